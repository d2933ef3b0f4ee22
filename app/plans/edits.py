"""Edits of a plan's structures to spare and of the bone that is to be removed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from app.kit.errors import NotFound
from app.kit.values import new_id
from app.plans.model import Plan, PlanContent, drive_parts, without_placement
from app.plans.paths import PlanPath
from app.plans.points import PlanPoint
from app.plans.zones import COLOURS, PlanZone, RemovedBone, check_removed, check_zones
from vfix_engine.errors import PlanError

Edit = Callable[[Callable[[PlanContent], PlanContent], int | None], Plan]
Region = TypeVar("Region", PlanZone, RemovedBone)

ZONE_FIELDS = ("name", "shape", "margin_mm", "kind", "stiffness_n_per_mm", "max_depth_mm", "colour", "visible")


class ZoneEdits:
    """Structures to spare of one plan."""

    def __init__(self, edit: Edit) -> None:
        self._edit = edit

    def add(
        self,
        shape: Mapping[str, Any],
        name: str | None = None,
        *,
        expected_revision: int | None = None,
        **fields: Any,
    ) -> tuple[str, Plan]:
        """Add one of a shape; fields as in `PlanZone`. Returns its id too."""
        zone_id = new_id("zone")

        def change(content: PlanContent) -> PlanContent:
            called = _next_name("Structure", content.zones) if name is None else name
            colour = COLOURS[len(content.zones) % len(COLOURS)]
            zone = PlanZone(zone_id, called, shape, **{"colour": colour, **_zone_fields(fields)})
            return _with_zones(content, (*content.zones, zone))

        return zone_id, self._edit(change, expected_revision)

    def change(self, zone_id: str, *, expected_revision: int | None = None, **fields: Any) -> Plan:
        """Change fields of one; the others stay. One that is made hard loses its stiffness and its depth."""
        changes = _zone_changes(fields)

        def change(content: PlanContent) -> PlanContent:
            return _with_zones(content, _with(content.zones, zone_id, "structure to spare", changes))

        return self._edit(change, expected_revision)

    def delete(self, zone_id: str, *, expected_revision: int | None = None) -> Plan:
        """Take one away."""
        return self._edit(lambda c: _with_zones(c, _without(c.zones, zone_id, "structure to spare")), expected_revision)


class BoneEdits:
    """Bone of one plan that is to be removed."""

    def __init__(self, edit: Edit) -> None:
        self._edit = edit

    def add(
        self, shape: Mapping[str, Any], name: str | None = None, *, expected_revision: int | None = None
    ) -> tuple[str, Plan]:
        """Add a region: a sphere, a capsule or a box. Returns its id too."""
        region_id = new_id("bone")

        def change(content: PlanContent) -> PlanContent:
            called = _next_name("Opening", content.removed_bone) if name is None else name
            return _with_removed(content, (*content.removed_bone, RemovedBone(region_id, called, shape)))

        return region_id, self._edit(change, expected_revision)

    def change(self, region_id: str, *, expected_revision: int | None = None, **fields: Any) -> Plan:
        """Change the name or the shape of one."""
        if unknown := sorted(set(fields) - {"name", "shape"}):
            raise PlanError(f"a region of bone to remove has no {unknown[0]!r:.40}.")
        return self._edit(
            lambda c: _with_removed(c, _with(c.removed_bone, region_id, "region", fields)), expected_revision
        )

    def delete(self, region_id: str, *, expected_revision: int | None = None) -> Plan:
        """Take one away."""
        return self._edit(lambda c: _with_removed(c, _without(c.removed_bone, region_id, "region")), expected_revision)


def _with_zones(content: PlanContent, zones: Sequence[PlanZone]) -> PlanContent:
    """The content with other zones; a placement that was made among the old ones is dropped."""
    changed = replace(content, zones=check_zones(zones))
    if drive_parts(changed) == drive_parts(content):
        return changed
    return replace(changed, robot=without_placement(content.robot))


def _with_removed(content: PlanContent, regions: Sequence[RemovedBone]) -> PlanContent:
    """The content with other bone to remove; a placement that was made among the old bone is dropped."""
    changed = replace(content, removed_bone=check_removed(regions))
    if drive_parts(changed) == drive_parts(content):
        return changed
    return replace(changed, robot=without_placement(content.robot))


def changed_zone(zone: PlanZone, fields: Mapping[str, Any]) -> PlanZone:
    """A structure to spare with other fields, as `change` makes it, unchecked. Raises PlanError for unknown ones."""
    return replace(zone, **_zone_changes(fields))


def _zone_changes(fields: Mapping[str, Any]) -> dict[str, Any]:
    changes = _zone_fields(fields)
    return changes | ({"stiffness_n_per_mm": None, "max_depth_mm": None} if changes.get("kind") == "hard" else {})


def _zone_fields(fields: Mapping[str, Any]) -> dict[str, Any]:
    if unknown := sorted(set(fields) - set(ZONE_FIELDS)):
        raise PlanError(f"a structure to spare has no {unknown[0]!r:.40}.")
    return dict(fields)


def _next_name(word: str, items: Sequence[PlanZone] | Sequence[RemovedBone]) -> str:
    taken = {item.name for item in items}
    return next(name for n in range(1, len(items) + 2) if (name := f"{word} {n}") not in taken)


_Item = TypeVar("_Item", PlanPath, PlanPoint, PlanZone, RemovedBone)


def _found(items: Sequence[_Item], item_id: str, what: str) -> _Item:
    for item in items:
        if item.id == item_id:
            return item
    raise NotFound(f"there is no {what} {item_id!r:.80} in this plan.")


def _with(items: Sequence[Region], item_id: str, what: str, changes: Mapping[str, Any]) -> tuple[Region, ...]:
    _found(items, item_id, what)
    return tuple(replace(item, **changes) if item.id == item_id else item for item in items)


def _without(items: Sequence[Region], item_id: str, what: str) -> tuple[Region, ...]:
    gone = _found(items, item_id, what)
    return tuple(item for item in items if item is not gone)
