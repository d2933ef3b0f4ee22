"""The progress of a task beside the control process of its drive: every step counts, as in the run that is recorded."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from vfix_engine.arrays import Array
from vfix_engine.error_places import error_places
from vfix_engine.errors import ControlError

if TYPE_CHECKING:  # slow to load, as in `paths`
    from collections.abc import Sequence

    from vfix_engine.pathway.pathway import TissueMotion
    from vfix_engine.robots.snake import SnakeModel
    from vfix_engine.runtime.process import ControlProcess
    from vfix_engine.runtime.requests import Note
    from vfix_engine.runtime.ring import RowReader
    from vfix_engine.runtime.system import Column
    from vfix_engine.study.diathermy.labels import Label
    from vfix_engine.study.diathermy.live import LabelMoment, LiveLabels
    from vfix_engine.study.diathermy.task import DiathermyState
    from vfix_engine.study.diathermy.task import Sight as LabelSight
    from vfix_engine.study.polyps.live import LiveProgress, PolypMoment
    from vfix_engine.study.polyps.progress import PolypProgress, Sight
    from vfix_engine.study.polyps.task import PolypTask

_LOG = logging.getLogger(__name__)
LOOK_S = 0.02  # between two looks at the rows


class Live(Protocol):
    """A task that is stepped with the rows of its drive."""

    @property
    def completed(self) -> bool: ...

    @property
    def moment(self) -> PolypMoment | LabelMoment: ...

    def read(self, lines: Array) -> object: ...


L = TypeVar("L", bound=Live)


class TaskWatch(Generic[L]):
    """The task of one drive, from its first step on. Its properties may be read from any thread.

    live: None before the drive is ready. trouble: why what is shown may differ from the run, '' where it does not.
    """

    def __init__(self) -> None:
        self.live: L | None = None
        self.trouble = ""

    @property
    def moment(self) -> PolypMoment | LabelMoment | None:
        """After the newest row; None before the drive is ready."""
        return None if self.live is None else self.live.moment

    def note(self) -> Note:
        """What records the beginning of the task in the run."""
        raise NotImplementedError

    def follow(self, columns: Sequence[Column]) -> L:
        """The task before the first row; rows have these columns."""
        raise NotImplementedError

    def begin(self, process: ControlProcess[Any]) -> None:
        """Record the beginning of the task and follow the drive, which has made no step yet, until it ends.

        Raises ControlError where the process has ended.
        """
        reader = process.rows()
        process.apply(self.note())
        live = self.follow(reader.columns)
        self.live = live
        threading.Thread(target=self._follow, args=(reader, live), name="vfix-task", daemon=True).start()

    def _follow(self, reader: RowReader, live: L) -> None:
        pause = threading.Event()
        try:
            while not reader.ended and not live.completed:
                live.read(reader.read())
                if reader.lost:
                    self.trouble = "Steps were missed here; the score has them."
                pause.wait(LOOK_S)
        except (ControlError, ValueError) as error:  # the memory was taken away with the process
            if not reader.ended:
                self.trouble = "The task is not followed any more; the score has it."
                _LOG.error("a task is not followed any more: %s", error_places(error))
        finally:
            reader.close()


class PolypWatch(TaskWatch["LiveProgress"]):
    """Study I of one drive."""

    def __init__(self, task: PolypTask, snake: SnakeModel, motion: TissueMotion | None, sight: Sight) -> None:
        super().__init__()
        self.task, self.motion = task, motion
        self._snake, self._sight = snake, sight

    @property
    def progress(self) -> PolypProgress | None:
        """After the newest row; None before the drive is ready."""
        return None if self.live is None else self.live.progress

    def note(self) -> Note:
        from vfix_engine.study.polyps.series import task_note

        return task_note(self.task)

    def follow(self, columns: Sequence[Column]) -> LiveProgress:
        from vfix_engine.study.polyps.live import LiveProgress

        return LiveProgress(self.task, self._snake, self.motion, columns, self._sight)


class LabelWatch(TaskWatch["LiveLabels"]):
    """Study II of one drive. seed: by which the labels were drawn; surface: ``surface_hash`` of the cavity."""

    def __init__(
        self, labels: tuple[Label, ...], seed: int, surface: str, snake: SnakeModel, sight: LabelSight
    ) -> None:
        super().__init__()
        self.labels, self.seed, self.surface = labels, seed, surface
        self._snake, self._sight = snake, sight

    @property
    def state(self) -> DiathermyState | None:
        """After the newest row; None before the drive is ready."""
        return None if self.live is None else self.live.state

    def note(self) -> Note:
        from vfix_engine.study.diathermy.table import task_note

        return task_note(self.labels, self.seed, self.surface)

    def follow(self, columns: Sequence[Column]) -> LiveLabels:
        from vfix_engine.study.diathermy.live import LiveLabels

        return LiveLabels(self.labels, self._snake, columns, self._sight)
