"""The paths and the notes of the open plan as the page shows them."""

from __future__ import annotations

from typing import TypedDict

from app.kit.kept import Same
from app.messages.sections import Section
from app.plans.instruments import shipped_tools
from app.plans.paths import Midplane, side_caution
from app.plans.service import Plan


class PathView(TypedDict):
    """A path of the plan; tool: its title."""

    id: str
    name: str
    points: int
    tool: str
    entry_side: str


class PathsSection(TypedDict):
    """The paths of the open plan, which one is chosen, and the notes.

    side_caution: a sentence where the entry of the chosen path lies on the other side than it says; else ''.
    """

    items: list[PathView]
    chosen: str
    side_caution: str
    notes: str
    locked: bool


class PathSections(TypedDict):
    """What the Plan tab shows of paths."""

    paths: PathsSection | None


def paths_section(plan: Plan, midplane: Midplane) -> Section[PathsSection]:
    """The page's section."""
    return Section((Same(plan), midplane), lambda: _view(plan, midplane))


def _view(plan: Plan, midplane: Midplane) -> PathsSection:
    titles = {tool.name: tool.title for tool in shipped_tools()}
    return {
        "items": [
            {
                "id": path.id,
                "name": path.name,
                "points": len(path.points),
                "tool": titles.get(path.tool, path.tool),
                "entry_side": path.entry_side,
            }
            for path in plan.content.paths
        ],
        "chosen": plan.content.path_id,
        "side_caution": side_caution(plan.content.path, midplane),
        "notes": plan.content.notes,
        "locked": plan.locked,
    }
