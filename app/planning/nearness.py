"""How near the tool of a drive is to each protected structure, for display: measured in one pose, beside the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.planning.obstacles import zone_clearance
from app.planning.protected_structures import structure_name
from app.planning.soft_depths import soft_clearance
from vfix_engine.arrays import Array
from vfix_engine.virtual_fixtures import SoftRegion, SoftZone, Zone

REACH_MM = 10.0  # farther away than this, how far does not matter


@dataclass(frozen=True)
class Nearness:
    """A structure; lengths in mm.

    clearance_mm: from the whole tool to it, negative inside; REACH_MM where it is farther away. margin_mm: that the
    tool keeps to it, of a soft one the thickness of its layer, which the tool may enter.
    """

    name: str
    clearance_mm: float
    margin_mm: float
    soft: bool = False


def nearness(
    zones: Sequence[Zone | SoftZone | SoftRegion], start: Array, end: Array, radius: Array
) -> tuple[Nearness, ...]:
    """Return each protected structure, a chain of capsules as one, in the order of their zones.

    zones: the hard ones, then the soft ones; a soft layer over all of the anatomy is left out. start, end (S, 3): axis
    segments of the tool, LPS mm; radius (S,): of its capsules.
    """
    found: dict[str, Nearness] = {}
    for zone in zones:
        away = _clearance(zone, start[None], end[None], radius)
        name = structure_name(zone.name)
        if away is not None and (name not in found or away < found[name].clearance_mm):
            found[name] = Nearness(name, min(away, REACH_MM), _margin(zone), not isinstance(zone, Zone))
    return tuple(found.values())


def _clearance(zone: Zone | SoftZone | SoftRegion, start: Array, end: Array, radius: Array) -> float | None:
    if isinstance(zone, Zone):
        return float(zone_clearance(zone, start, end, radius, REACH_MM)[0])
    found = soft_clearance(zone, start, end, radius, REACH_MM)
    return None if found is None else float(found[0])


def _margin(zone: Zone | SoftZone | SoftRegion) -> float:
    if isinstance(zone, Zone):
        return zone.margin_mm
    return zone.layer_mm if isinstance(zone, SoftRegion) else zone.thickness_mm
