"""What runs in the control process and in its worker process, from their start to their end."""

from __future__ import annotations

import gc
import signal
import sys
import threading
from multiprocessing.connection import Connection

from ..error_places import error_places
from ..errors import VfixError
from ..kernels.compile_progress import compilation_told
from .background import NoWorker, WorkerLink, Workers, work
from .control_mode import Control, first_control
from .driver import Driver
from .events import Event
from .hand import Hand
from .loop import ControlLoop
from .mailbox import Mailbox
from .outbox import Outbox
from .priority import RealTimePriority
from .run_recorder import FarEnd
from .system import SystemSpec

LAST_WORD_S = 0.5  # time for an ending process to send its reason


def control_main(
    out: str,
    into: str,
    pipe: Connection,
    real_time: bool,
    to_worker: Connection | None,
    log: FarEnd,
    control: Control | None,
) -> None:
    """Main function of the process: build the system, send 'ready', and loop until told to end or the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the planner, which closes this pipe
    events = Outbox(pipe)
    try:
        spec: SystemSpec = pipe.recv()
        with compilation_told(lambda count: events.put(Event("compiled", str(count)))):
            system = spec.build()
            system.prepare()
        workers: Workers = NoWorker()
        if to_worker is not None:
            link = workers = WorkerLink(to_worker)
            link.made.wait()  # else the first motion waits for it, seconds after 'ready'
        record = log.attach(system.row_layout)
        driver = Driver(system, workers, record)
        hand = Hand(control or first_control(spec.world))
        mailboxes = Mailbox.attach(out), Mailbox.attach(into)
        carriers = [thread for thread in threading.enumerate() if thread is not threading.current_thread()]
        loop = ControlLoop(driver, *mailboxes, pipe, events, RealTimePriority(real_time, others=carriers), hand)
        gc.collect()
        gc.freeze()  # excludes the objects that exist now from later collections
        events.put(Event("ready"))
        loop.run()
        record.flush(LAST_WORD_S)
    except VfixError as error:
        events.put(Event("refused", str(error)))
    except EOFError:
        pass  # closed before it started
    except Exception as error:
        print(error_places(error), file=sys.stderr)  # goes to the planner's log
        words = f"the control process failed ({type(error).__name__}: {error}); start the rehearsal again"
        events.put(Event("failed", words))
    events.flush(LAST_WORD_S)


def worker_main(spec: SystemSpec, pipe: Connection) -> None:
    """Main function of the worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work(spec, pipe)
