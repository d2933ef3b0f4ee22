"""The task of a run over its time, as a drive of it showed the task: by the steps that a live drive makes."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...arrays import Array
from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from .samples import last_of_intervals
from .task_rows import TASKS

if TYPE_CHECKING:  # their modules know this package
    from ..diathermy.live import LabelMoment
    from ..polyps.live import PolypMoment


class LiveTask(Protocol):
    """A task that is stepped with the lines of a drive, each a command and a row."""

    @property
    def moment(self) -> PolypMoment | LabelMoment: ...

    def read(self, lines: Array) -> object: ...


@dataclass(frozen=True, eq=False)
class TaskReplay:
    """The task of a run. t: (n,) s, ascending; moments: n of them, the first before its first step. None of no task."""

    t: Array
    moments: tuple[PolypMoment | LabelMoment, ...]

    def at(self, t: float) -> PolypMoment | LabelMoment | None:
        """The task at a time in s; None before it began."""
        number = int(np.searchsorted(self.t, t, side="right"))
        return self.moments[number - 1] if number else None


def task_replay(run: Run, rate_hz: float, wall: TriangleMesh | None = None) -> TaskReplay:
    """The task of a run at no more than ``rate_hz``: after the last sample of every interval of that time.

    wall: of the lumen that was driven through, which a run does not have; lines of sight end at it.

    Raises:
        InputError: a task that is damaged, one without steps, or one whose wall is not at hand.
    """
    for module in TASKS:
        found: tuple[LiveTask, int] | None = import_module(module).task_live(run, wall)
        if found is not None:
            return _stepped(run, *found, rate_hz)
    return TaskReplay(np.empty(0), ())


def _stepped(run: Run, live: LiveTask, first: int, rate_hz: float) -> TaskReplay:
    """first: number of the first step of the task."""
    t = np.maximum.accumulate(run.column("t")[first:])
    again = first == 0 or t[0] <= run.column("t")[first - 1]  # its first step, or the first after a return to the start
    times, moments = [0.0 if again else float(run.column("t")[first - 1])], [live.moment]
    begin = first
    for last in last_of_intervals(t, rate_hz).tolist():
        live.read(run.ticks[begin : first + last + 1])
        begin = first + last + 1
        times.append(float(t[last]))
        moments.append(live.moment)
    return TaskReplay(np.array(times), tuple(moments))
