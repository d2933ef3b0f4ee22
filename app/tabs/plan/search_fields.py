"""What a search for a path needs of the head, measured in the background while its ends are being chosen."""

from __future__ import annotations

import numpy as np

from app.cases.service import Case
from app.kit.values import Position
from app.planning.suggestion_ends import check_ends
from app.tabs.plan.edited_plan import EditedPlan
from app.workspace.latest import BackgroundTask, Latest
from app.workspace.workspace import Workspace
from vfix_engine.worlds.rigid import preparation


class SearchFields:
    """Measures once a head, and once each pair of ends. Owned by the session's thread."""

    def __init__(self, workspace: Workspace) -> None:
        self._distance_fields = workspace.services.distance_fields
        self._latest = Latest(workspace.executor, workspace.post)
        self._asked: tuple[str, tuple[Position, ...]] | None = None  # id of the case, and the ends

    def refresh(self, edited: EditedPlan | None) -> None:
        """Begin to measure where a path has still to be found; a failure is reported by the search itself."""
        if edited is None or edited.locked or not edited.case.has_volume or len(edited.plan.content.points) > 1:
            return
        content, case = edited.plan.content, edited.case
        both = content.points and content.targets
        ends = (content.points[0].position, content.targets[-1].position) if both else ()
        if self._asked == (case.id, ends):
            return
        self._asked = case.id, ends

        def measure(run: BackgroundTask) -> None:
            preparation.wait(run.check)
            self._measure(case, ends)

        self._latest.ask("The distances for a search", measure, _ignored, _ignored, lane=case.id)

    def _measure(self, case: Case, ends: tuple[Position, ...]) -> None:
        if ends:
            check_ends(case, *ends)
            self._distance_fields.around(case, np.array(ends)).both()
        else:
            self._distance_fields.whole(case)


def _ignored(_: object) -> None:
    """Nothing is shown: the fields are cached, and the search says what fails."""
