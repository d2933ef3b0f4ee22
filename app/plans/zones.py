"""Regions of a plan: protected structures, and bone that is to be removed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from app.kit.names import check_stored_name
from app.kit.values import check_id, number
from app.plans.shapes import check_shape, check_solid
from vfix_engine.errors import PlanError
from vfix_engine.virtual_fixtures.soft_zone import STIFFEST_N_PER_MM
from vfix_engine.virtual_fixtures.zones import LARGEST_MARGIN_MM
from vfix_engine.virtual_fixtures.zones import check_name as check_zone_name

Firmness = Literal["hard", "soft"]

MAX_ZONES = 64
MAX_ZONE_NAME = 56  # [characters]; the engine's zones of a chain have a longer one
MAX_REMOVED = 64
DEFAULT_COLOUR = "#9b51f5"
DEFAULT_STIFFNESS_N_PER_MM = 0.5
LARGEST_DEPTH_MM = 20.0
# In the order in which new zones take them: violets, since no outline of bone, path, tool, margin or target is near
# them, to colour-blind eyes either.
COLOURS = (DEFAULT_COLOUR, "#7650e8", "#b15cff", "#6a3de8", "#8a3ffc", "#9d4edd")
# What new zones took before, in the same order; plans that were stored then have them.
_FORMER_COLOURS = ("#e0b04c", "#c97bd1", "#7fb069", "#e07a5f", "#6fa8dc", "#b8a1e3")
_DRAWN = dict(zip(_FORMER_COLOURS, COLOURS, strict=True))


@dataclass(frozen=True)
class PlanZone:
    """A protected structure.

    shape: as in a file of zones, or {'kind': 'capsules', 'points': …, 'radius': …} or {'kind': 'structure',
    'structure': id}. margin_mm: how far the tool stays away from a hard one; of a soft one the thickness of the layer
    around it. A hard one is not entered; a soft one pushes back with stiffness_n_per_mm, and max_depth_mm is how deep
    it may be entered, None where the plan does not say. visible: whether the views draw it, which no drive asks.
    """

    id: str
    name: str
    shape: Mapping[str, Any]
    margin_mm: float = 1.0
    kind: Firmness = "hard"
    stiffness_n_per_mm: float | None = None
    max_depth_mm: float | None = None
    colour: str = DEFAULT_COLOUR
    visible: bool = True

    @property
    def drawn_colour(self) -> str:
        """The colour in which it is drawn: of a former default the present one, else its own."""
        return _DRAWN.get(self.colour.lower(), self.colour)


@dataclass(frozen=True)
class RemovedBone:
    """A region in which bone will be removed before the tool goes in: a sphere, a capsule or a box."""

    id: str
    name: str
    shape: Mapping[str, Any] = field(default_factory=dict)


def check_zones(zones: Sequence[PlanZone]) -> tuple[PlanZone, ...]:
    """The zones, whose values are checked. Raises InputError or one of its kinds."""
    _unique(zones, "protected structures", MAX_ZONES)
    return tuple(check_zone(zone) for zone in zones)


def check_zone(zone: PlanZone) -> PlanZone:
    """Raises InputError or one of its kinds, which name the zone."""
    named = f"the protected structure {check_stored_name(zone.name, 'protected structure')!r}"
    if len(check_zone_name(zone.name, "protected structure")) > MAX_ZONE_NAME:
        raise PlanError(f"{named} has a name of {len(zone.name)} characters; {MAX_ZONE_NAME} are allowed.")
    if zone.kind not in ("hard", "soft"):
        raise PlanError(f"{named} is {str(zone.kind)!r:.20}; it must be hard or soft.")
    if zone.kind == "hard" and (zone.stiffness_n_per_mm is not None or zone.max_depth_mm is not None):
        raise PlanError(f"{named} is hard; a stiffness and a greatest depth belong to a soft one.")
    if not isinstance(zone.visible, bool):
        raise PlanError(f"{named}: 'visible' must be true or false.")
    stiffness = zone.stiffness_n_per_mm
    if zone.kind == "soft" and stiffness is None:
        stiffness = DEFAULT_STIFFNESS_N_PER_MM
    return PlanZone(
        check_id(zone.id, "a protected structure"),
        zone.name,
        check_shape(zone.shape),
        _within(zone.margin_mm, f"{named}: the margin", 0.0, LARGEST_MARGIN_MM, "mm"),
        zone.kind,
        None if stiffness is None else _positive(stiffness, f"{named}: the stiffness", STIFFEST_N_PER_MM, "N/mm"),
        None if zone.max_depth_mm is None
        else _within(zone.max_depth_mm, f"{named}: the greatest depth", 0.0, LARGEST_DEPTH_MM, "mm"),
        _colour(zone.colour, named),
        zone.visible,
    )  # fmt: skip


def check_removed(regions: Sequence[RemovedBone]) -> tuple[RemovedBone, ...]:
    """The regions, whose values are checked. Raises InputError or one of its kinds."""
    _unique(regions, "regions of bone to remove", MAX_REMOVED)
    return tuple(
        RemovedBone(
            check_id(one.id, "a region of bone to remove"),
            check_stored_name(one.name, "name of the bone to remove"),
            check_solid(one.shape),
        )
        for one in regions
    )


def _unique(items: Sequence[PlanZone] | Sequence[RemovedBone], what: str, most: int) -> None:
    if len(items) > most:
        raise PlanError(f"{len(items)} {what} are too many; a plan has {most} at most.")
    for values in ([item.id for item in items], [item.name for item in items]):
        if len(set(values)) != len(values):
            twice = next(value for value in values if values.count(value) > 1)
            raise PlanError(f"two {what} are called {twice!r:.80}.")


def _within(value: Any, what: str, low: float, high: float, unit: str) -> float:
    given = number(value, what)
    if not low <= given <= high:
        raise PlanError(f"{what} is {given:g} {unit}; allowed is {low:g} to {high:g} {unit}.")
    return given


def _positive(value: Any, what: str, most: float, unit: str) -> float:
    given = number(value, what)
    if not 0.0 < given <= most:
        raise PlanError(f"{what} is {given:g} {unit}; it must be more than 0 and at most {most:g} {unit}.")
    return given


def _colour(value: Any, named: str) -> str:
    if (
        not isinstance(value, str)
        or len(value) != 7
        or value[0] != "#"
        or set(value[1:].lower()) - set("0123456789abcdef")
    ):
        raise PlanError(f"{named}: its colour is {str(value)!r:.20}; write it as #rrggbb.")
    return value.lower()
