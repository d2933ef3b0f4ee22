"""What the tool of a dry run keeps from, each by a margin of its own, and how far it stays from it along the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.planning.zone_sets import whole_name
from vfix_engine.arrays import Array, IndexArray
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.proximity.fields.tool_depth import axis_samples
from vfix_engine.robots import Tool
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.virtual_fixtures.zones import SHAPES
from vfix_engine.worlds.rigid.dry_run import STATION_MM, DryRun


@dataclass(frozen=True, eq=False)
class Obstacle:
    """The anatomy, or a hard structure to spare; lengths in mm.

    clearance (n,): of the whole tool to it, one for each pose of a profile. row: of the dry run, where that is least.
    zones: of the engine, which a chain has several of; none for the anatomy.
    """

    name: str
    margin_mm: float
    clearance: Array
    row: int
    zones: tuple[Zone, ...] = ()

    @property
    def least_mm(self) -> float:
        """The least clearance."""
        return float(self.clearance.min())

    @property
    def left_mm(self) -> float:
        """Of the least clearance, above the margin."""
        return self.least_mm - self.margin_mm


def structures_of(
    run: DryRun, rows: IndexArray, group: IndexArray, tool: Tool, zones: Sequence[Zone]
) -> tuple[Obstacle, ...]:
    """The hard structures to spare, in the order of their zones; a chain of capsules is one.

    rows (n,): of the run, a station apart. group (m,): of each of its poses, the station that it belongs to.
    The clearance is measured at every station, and in every pose around the least one and at the end.
    """
    chains: dict[tuple[str, float], list[Zone]] = {}
    for zone in zones:
        chains.setdefault((whole_name(zone.name), zone.margin_mm), []).append(zone)
    found = list[Obstacle]()
    for (name, margin_mm), chain in chains.items():
        clearance = _clearance(chain, run, rows, tool.radius)
        around = np.flatnonzero(np.abs(run.s - run.s[rows[clearance.argmin()]]) <= STATION_MM)
        around = np.union1d(around, [len(run.s) - 1])
        near = _clearance(chain, run, around, tool.radius)
        np.minimum.at(clearance, group[around], near)
        found.append(Obstacle(name, margin_mm, clearance, int(around[near.argmin()]), tuple(chain)))
    return tuple(found)


def nearest_part(obstacle: Obstacle, run: DryRun, tool: Tool) -> int:
    """The part of the tool that is nearest to a structure to spare, in the pose of the least clearance."""
    start, end = run.segments_start[[obstacle.row]], run.segments_end[[obstacle.row]]
    each = [
        min(_zone_clearance(zone, start[:, [part]], end[:, [part]], tool.radius[[part]])[0] for zone in obstacle.zones)
        for part in range(len(tool.radius))
    ]
    return int(np.argmin(each))


def _clearance(zones: Sequence[Zone], run: DryRun, rows: IndexArray, radius: Array) -> Array:
    start, end = run.segments_start[rows], run.segments_end[rows]
    least: Array = np.min([_zone_clearance(zone, start, end, radius) for zone in zones], axis=0)
    return least


def _zone_clearance(zone: Zone, start: Array, end: Array, radius: Array) -> Array:
    """Clearance (n,) of the tool to a zone; to a shape from samples of its axis, at most 0.03 mm too large."""
    solid = zone.solid
    if isinstance(solid, SHAPES):
        points, _, segment = axis_samples(start, end)
        away = signed_distance(solid, points.reshape(-1, 3)).reshape(points.shape[:2]) - radius[segment]
        least: Array = away.min(axis=1)
        return least
    return np.array([solid.closest(Segments(a, b, radius)).distance for a, b in zip(start, end, strict=True)])
