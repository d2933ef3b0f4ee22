"""Which task of Kwok 2013 a run is of, in few words, so that a run can be told from one of another trial."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Self

from ...runtime.requests import Note
from ...runtime.run import RunEvent
from ..diathermy import table as label_table
from ..diathermy.placing import LABELS
from ..polyps import series as polyp_series
from ..polyps.printed import HOLD_S, POLYPS
from ..polyps.task import PolypTask
from .file import RouteOfStudy, TaskName


class ToldTask(NamedTuple):
    """A task. seed, number: of what was drawn, None of polyps that were put on the route; hold_s: None of labels."""

    task: TaskName
    seed: int | None
    number: int | None
    hold_s: float | None

    @classmethod
    def of_route(cls, route: RouteOfStudy) -> Self:
        """As the file of a study has it."""
        if route.task == "kwok2":
            return cls("kwok2", route.seed, route.count or LABELS, None)
        hold_s = HOLD_S if route.hold_s is None else route.hold_s
        drawn = route.places == "seed"
        return cls("kwok1", route.seed if drawn else None, (route.count or POLYPS) if drawn else None, hold_s)

    @classmethod
    def in_events(cls, events: Iterable[RunEvent]) -> Self | None:
        """The last one of a run; None of a run without. Raises InputError for one that is damaged."""
        notes = [event.content for event in events if isinstance(event.content, Note)]
        found = [note for note in notes if note.kind in (polyp_series.NOTE, label_table.NOTE)]
        if not found:
            return None
        content = found[-1].content
        if found[-1].kind == label_table.NOTE:
            return cls("kwok2", content.get("seed"), len(content.get("labels", ())), None)
        task = PolypTask.from_dict(content)
        drawn = task.viewable_share is not None
        return cls("kwok1", task.seed if drawn else None, len(task.polyps) if drawn else None, task.hold_s)
