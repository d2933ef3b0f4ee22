"""Review on the server: the scene it is looked at in; runs are read over REST, and replayed by the page itself."""

from __future__ import annotations

from app.kit.kept import Same
from app.messages.sections import Section, Sections
from app.tabs.base import Tab
from app.tabs.review import SPEC
from app.workspace.plan_items import plan_items


class ReviewTab(Tab):
    """Owned by the session's thread."""

    spec = SPEC
    first_view = "nose"

    def enter(self) -> None:
        """Open the anatomy along the path, as Rehearse shows it."""
        plan = self.workspace.plan.current
        self.workspace.case.open_up([] if plan is None else [item.position for item in plan_items(plan)])

    def sections(self) -> Sections:
        """The :class:`ReviewSections`."""
        case = self.workspace.case
        return {"scope": Section((self.active, Same(case.case)), lambda: case.scope() if self.active else None)}

    def hint(self) -> str:
        return "Space plays the chosen run; drag a plot to go through it."
