"""The progress of a task beside the control process of its drive: every step counts, as in the run that is recorded."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any

from vfix_engine.error_places import error_places
from vfix_engine.errors import ControlError

if TYPE_CHECKING:  # slow to load, as in `paths`
    from vfix_engine.pathway.pathway import TissueMotion
    from vfix_engine.robots.snake import SnakeModel
    from vfix_engine.runtime.process import ControlProcess
    from vfix_engine.runtime.ring import RowReader
    from vfix_engine.study.polyps.live import LiveProgress
    from vfix_engine.study.polyps.progress import PolypProgress, Sight
    from vfix_engine.study.polyps.task import PolypTask

_LOG = logging.getLogger(__name__)
LOOK_S = 0.02  # between two looks at the rows


class TaskWatch:
    """Study I of one drive, from its first step on. Its properties may be read from any thread.

    progress: None before the drive is ready. trouble: why what is shown may differ from the run, '' where it does not.
    """

    def __init__(self, task: PolypTask, snake: SnakeModel, motion: TissueMotion | None, sight: Sight) -> None:
        self.task, self.motion = task, motion
        self._snake, self._sight = snake, sight
        self.progress: PolypProgress | None = None
        self.trouble = ""

    def begin(self, process: ControlProcess[Any]) -> None:
        """Record the beginning of the task and follow the drive, which has made no step yet, until it ends.

        Raises ControlError where the process has ended.
        """
        from vfix_engine.study.polyps.live import LiveProgress
        from vfix_engine.study.polyps.series import task_note

        reader = process.rows()
        process.apply(task_note(self.task))
        live = LiveProgress(self.task, self._snake, self.motion, reader.columns, self._sight)
        self.progress = live.progress
        threading.Thread(target=self._follow, args=(reader, live), name="vfix-task", daemon=True).start()

    def _follow(self, reader: RowReader, live: LiveProgress) -> None:
        pause = threading.Event()
        try:
            while not reader.ended and not live.progress.completed:
                self.progress = live.read(reader.read())
                if reader.lost:
                    self.trouble = "Steps were missed here; the score has them."
                pause.wait(LOOK_S)
        except (ControlError, ValueError) as error:  # the memory was taken away with the process
            if not reader.ended:
                self.trouble = "The task is not followed any more; the score has it."
                _LOG.error("a task is not followed any more: %s", error_places(error))
        finally:
            reader.close()
