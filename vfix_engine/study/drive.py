"""A drive of any world by a simulated person, recorded and counted as it goes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..runtime.command import Command
from ..runtime.driver import Driver, Log
from ..runtime.snapshot import Snapshot
from ..runtime.system import System

LONGEST_S = 240.0  # of simulated time, after which the person gives up


@dataclass
class DriveResult:
    """What a drive came to: its snapshots' last, whether the person finished, and the time of every step in µs."""

    last: Snapshot
    finished: bool = False
    step_us: list[float] = field(default_factory=list)


def drive(
    system: System[Any],
    operator: Callable[[Snapshot], Command | None],
    keep: Callable[[Snapshot], None] = lambda snapshot: None,
    log: Log | None = None,
    longest_s: float = LONGEST_S,
) -> DriveResult:
    """Let a person drive a system from its start, until the end seems reached or the time is over.

    operator: from a snapshot to the command of the next period, None to end.
    keep: called with the snapshot after every step; log: destination of the recorded run.

    Raises:
        StartRefused: the start pose violates a limit or margin.
    """
    driver: Driver[Any] = Driver(system, log=log)
    found = DriveResult(system.snapshot(driver.state))
    while found.last.t < longest_s:
        command = operator(found.last)
        if command is None:
            found.finished = True
            break
        begin = time.perf_counter()
        driver.step(command)
        found.step_us.append(1e6 * (time.perf_counter() - begin))
        found.last = system.snapshot(driver.state)
        keep(found.last)
    return found
