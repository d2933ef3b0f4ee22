"""Edits of a plan's paths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from app.kit.errors import NotFound
from app.kit.names import check_name, check_text
from app.kit.values import check_position, new_id
from app.plans.model import MAX_NOTES, Plan, PlanContent
from app.plans.paths import PATH, PlanPath, check_paths, check_side, new_path_name
from app.plans.points import PlanPoint, check_direction, check_point, check_roll, new_point_id
from vfix_engine.errors import PlanError

Edit = Callable[[Callable[[PlanContent], PlanContent], int | None], Plan]


class PathEdits:
    """Paths of one plan, and what a path says of its shaft."""

    def __init__(self, edit: Edit) -> None:
        self._edit = edit

    def add(
        self,
        name: str | None = None,
        *,
        copy_of: str | None = None,
        places: Sequence[Sequence[float]] = (),
        named: str = PATH,
        expected_revision: int | None = None,
    ) -> tuple[str, Plan]:
        """Add a path and choose it: with the chosen path's tool and points at these places, or a copy.

        places: (n, 3) LPS mm, from outside to inside; none are an empty path. named: what is numbered where there is no
        name. Returns its id too.
        """
        path_id = new_id("path")

        def change(content: PlanContent) -> PlanContent:
            like = content.path if copy_of is None else _found(content.paths, copy_of, "path")
            points = tuple(
                check_point(PlanPoint(new_point_id(), f"P{number}", check_position(place)))
                for number, place in enumerate(places, 1)
            )
            if copy_of is not None:
                points = tuple(replace(point, id=new_point_id()) for point in like.points)
            called = new_path_name(content.paths, named) if name is None else name
            side = "" if copy_of is None else like.entry_side
            path = PlanPath(path_id, called, points, like.tool, like.tool_shape, side)
            return content.with_paths(check_paths((*content.paths, path)), path_id)

        return path_id, self._edit(change, expected_revision)

    def choose(self, path_id: str, *, expected_revision: int | None = None) -> Plan:
        """Make a path the one that is edited and driven."""
        return self._edit(lambda content: content.with_paths(content.paths, path_id), expected_revision)

    def rename(self, path_id: str, name: str, *, expected_revision: int | None = None) -> Plan:
        """Give a path another name."""
        return self._change(path_id, expected_revision, name=check_name(name, "path's name"))

    def set_entry_side(self, path_id: str, side: str, *, expected_revision: int | None = None) -> Plan:
        """Say on which side of the patient a path enters; '' says nothing."""
        return self._change(path_id, expected_revision, entry_side=check_side(side))

    def delete(self, path_id: str, *, expected_revision: int | None = None) -> Plan:
        """Take a path away; the one before it is chosen where it was. Raises PlanError for the only one."""

        def change(content: PlanContent) -> PlanContent:
            index = content.paths.index(_found(content.paths, path_id, "path"))
            rest = (*content.paths[:index], *content.paths[index + 1 :])
            if not rest:
                raise PlanError("a plan has one path at least; delete its points instead.")
            chosen = content.path_id if content.path_id != path_id else rest[max(index - 1, 0)].id
            return content.with_paths(rest, chosen)

        return self._edit(change, expected_revision)

    def set_shaft(
        self,
        point_id: str,
        direction: Sequence[float] | None,
        roll_deg: float | None = None,
        *,
        expected_revision: int | None = None,
    ) -> Plan:
        """The shaft's direction, LPS from the tip towards the tail, and its roll at a point; None leaves both open."""
        unit, roll = check_direction(direction), check_roll(roll_deg)

        def turned(point: PlanPoint) -> PlanPoint:
            return point if point.id != point_id else check_point(replace(point, direction=unit, roll_deg=roll))

        def change(content: PlanContent) -> PlanContent:
            _found(content.points, point_id, "point")
            return content.with_points([turned(point) for point in content.points])

        return self._edit(change, expected_revision)

    def set_notes(self, notes: str, *, expected_revision: int | None = None) -> Plan:
        """What the planner writes down, in lines."""
        text = check_text(notes, "notes", MAX_NOTES)
        return self._edit(lambda content: replace(content, notes=text), expected_revision)

    def _change(self, path_id: str, expected_revision: int | None, **changes: Any) -> Plan:
        def change(content: PlanContent) -> PlanContent:
            _found(content.paths, path_id, "path")
            paths = [replace(path, **changes) if path.id == path_id else path for path in content.paths]
            return content.with_paths(check_paths(paths), content.path_id)

        return self._edit(change, expected_revision)


_Item = TypeVar("_Item", PlanPath, PlanPoint)


def _found(items: Sequence[_Item], item_id: str, what: str) -> _Item:
    for item in items:
        if item.id == item_id:
            return item
    raise NotFound(f"there is no {what} {item_id!r:.80} in this plan.")
