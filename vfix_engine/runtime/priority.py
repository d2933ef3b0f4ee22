"""Real-time priority of the control thread: acquired while the operator drives, released at rest.

An ordinary thread waits for the processor behind every busy one, such as a browser's; a thread of the scheduling
class SCHED_FIFO does not. Linux requires a permission (RLIMIT_RTPRIO or CAP_SYS_NICE). The means of other systems are
not used: there the loop runs at the ordinary priority, and `words` gives the reason.

The control thread also waits for the interpreter lock (GIL). The other threads of its process, which carry messages,
therefore get a real-time priority with it, below its own: an ordinary one that waits for a core, behind the worker
process or a browser, may hold the lock meanwhile.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress

LEVEL = 1  # the lowest real-time priority is above everything that is not real-time, and needs the least permission
CONTROL_LEVEL = 2  # of the control process, which may interrupt threads of the lower level; if permitted

NOT_ALLOWED = "the system does not allow one to this user"
NOT_HERE = "vfix takes one on Linux only"
NOT_WANTED = "none was asked for"
GIVEN_UP = "given up: the steps take so long that the rest of the machine would starve"

Schedule = Callable[[bool], None]


class RealTimePriority:
    """Priority of the calling thread. words: '' while nothing prevents a real-time priority, otherwise the reason.

    Args:
        wanted: whether to take one at all. schedule: changes the priority.
        others: threads that get one with it since they share the interpreter lock; see above.
    """

    def __init__(self, wanted: bool = True, schedule: Schedule | None = None, others: Iterable[threading.Thread] = ()):
        self._wanted, self._schedule = wanted, schedule or (lambda real_time: schedule_control(real_time, self._others))
        self._others = tuple(others)
        self.held = False
        self.words = ""

    def take(self) -> bool:
        """Acquire the priority for the calling thread; if it is not permitted, set `words` and return False."""
        if not self._wanted:
            self.words = NOT_WANTED
            return False
        try:
            self._schedule(True)
        except NotImplementedError:
            self.words = NOT_HERE
        except OSError:  # EPERM, or a sandbox that does not support the call
            self.words = NOT_ALLOWED
        else:
            self.held, self.words = True, ""
        return self.held

    def give_back(self) -> None:
        """Return to the ordinary priority."""
        if self.held:
            self.held = False
            self._schedule(False)

    def give_up(self) -> None:
        """Release the priority permanently for the benefit of the rest of the machine, and set the reason."""
        if self.held:
            self.give_back()
            self.words = GIVEN_UP


def schedule_control(real_time: bool, others: Iterable[threading.Thread] = ()) -> None:
    """As ``schedule_thread`` for the calling thread, above other real-time threads of vfix if permitted.

    others: threads of this process that are moved with it, at the lowest level.
    """
    try:
        schedule_thread(real_time, level=CONTROL_LEVEL)
    except PermissionError:
        schedule_thread(real_time)
    for thread in others:
        if thread.native_id is not None:
            with suppress(ProcessLookupError):  # the thread has just ended
                schedule_thread(real_time, thread.native_id)


def schedule_thread(real_time: bool, thread: int = 0, level: int = LEVEL) -> None:
    """Move a thread to the real-time class, or back to the ordinary one.

    Args:
        real_time: whether to the real-time class.
        thread: its native id; 0 is the calling thread. level: of the real-time class.

    Raises:
        NotImplementedError: the system has no such call.
        OSError: it is not permitted.
    """
    if sys.platform != "linux":
        raise NotImplementedError
    # Child processes do not inherit the class. Only root may clear that flag again.
    if real_time:
        os.sched_setscheduler(thread, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(level))
    else:
        os.sched_setscheduler(thread, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, os.sched_param(0))


def why_not() -> str:
    """Return why a control process of this user would not get its priority, or ''; nothing is changed."""
    priority = RealTimePriority()
    priority.take()
    priority.give_back()
    return priority.words
