"""A real-time priority for the thread that controls: taken while somebody drives, given back at rest.

An ordinary thread waits for the processor behind every busy one, a browser's among them; a thread of the scheduling
class SCHED_FIFO does not. Linux asks for a permission (RLIMIT_RTPRIO or CAP_SYS_NICE). Other systems have other
means, which are not used: there the loop runs at the ordinary priority, and `words` says so.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

LEVEL = 1  # the lowest real-time priority is above everything that is not real-time, and asks for the least permission
CONTROL_LEVEL = 2  # of the control process, which interrupts threads of the lower level; where allowed

NOT_ALLOWED = "the system does not allow one to this user"
NOT_HERE = "vfix takes one on Linux only"
NOT_WANTED = "none was asked for"
GIVEN_UP = "given up: the steps take so long that the rest of the machine would starve"

Schedule = Callable[[bool], None]


class RealTimePriority:
    """The calling thread's priority. words: '' while nothing prevents one, otherwise why it has none."""

    def __init__(self, wanted: bool = True, schedule: Schedule | None = None):
        self._wanted, self._schedule = wanted, schedule or schedule_control
        self.held = False
        self.words = ""

    def take(self) -> bool:
        """Ask for it; False, with `words`, where it is not to be had. Called by the thread that is meant."""
        if not self._wanted:
            self.words = NOT_WANTED
            return False
        try:
            self._schedule(True)
        except NotImplementedError:
            self.words = NOT_HERE
        except OSError:  # EPERM, or a sandbox that does not know the call
            self.words = NOT_ALLOWED
        else:
            self.held, self.words = True, ""
        return self.held

    def give_back(self) -> None:
        """Back to the ordinary priority."""
        if self.held:
            self.held = False
            self._schedule(False)

    def give_up(self) -> None:
        """Give it back for the sake of the rest of the machine, and say so."""
        if self.held:
            self.give_back()
            self.words = GIVEN_UP


def schedule_control(real_time: bool) -> None:
    """As ``schedule_thread`` of the calling thread, above other real-time threads of vfix where that is allowed."""
    try:
        schedule_thread(real_time, level=CONTROL_LEVEL)
    except PermissionError:
        schedule_thread(real_time)


def schedule_thread(real_time: bool, thread: int = 0, level: int = LEVEL) -> None:
    """Put a thread into the real-time class, or back into the ordinary one.

    Args:
        real_time: whether into the real-time class.
        thread: its native id; 0 is the calling thread. level: of the real-time class.

    Raises:
        NotImplementedError: this system has no such call.
        OSError: it is not allowed.
    """
    if sys.platform != "linux":
        raise NotImplementedError
    # What it starts does not inherit the class. Only root may take that flag off again.
    if real_time:
        os.sched_setscheduler(thread, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(level))
    else:
        os.sched_setscheduler(thread, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, os.sched_param(0))


def why_not() -> str:
    """'' when a control process of this user would get its priority, otherwise why not; nothing is changed."""
    priority = RealTimePriority()
    priority.take()
    priority.give_back()
    return priority.words
