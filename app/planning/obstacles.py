"""Obstacles of a dry run, each with its margin and the clearance of the tool to it along the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.planning.protected_structures import structure_name
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
    """The anatomy, or a hard protected structure; lengths in mm.

    clearance (n,): from the whole tool to it, for each pose of a profile. row: of the dry run with the least clearance.
    zones: the engine's zones of the structure, several for a chain of capsules; empty for the anatomy.
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
        """The least clearance minus the margin."""
        return self.least_mm - self.margin_mm


def structures_of(
    run: DryRun, rows: IndexArray, group: IndexArray, tool: Tool, zones: Sequence[Zone]
) -> tuple[Obstacle, ...]:
    """Return the hard protected structures as obstacles, in the order of their zones; a chain of capsules is one.

    rows (n,): rows of the run, one per station. group (m,): station index of each pose of the run.
    The clearance is measured at every station, and in every pose around the least one and at the end.
    """
    chains: dict[tuple[str, float], list[Zone]] = {}
    for zone in zones:
        chains.setdefault((structure_name(zone.name), zone.margin_mm), []).append(zone)
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
    """Return the index of the tool part nearest to a protected structure in the pose of the least clearance."""
    start, end = run.segments_start[[obstacle.row]], run.segments_end[[obstacle.row]]
    each = [
        min(zone_clearance(zone, start[:, [part]], end[:, [part]], tool.radius[[part]])[0] for zone in obstacle.zones)
        for part in range(len(tool.radius))
    ]
    return int(np.argmin(each))


def _clearance(zones: Sequence[Zone], run: DryRun, rows: IndexArray, radius: Array) -> Array:
    start, end = run.segments_start[rows], run.segments_end[rows]
    least: Array = np.min([zone_clearance(zone, start, end, radius) for zone in zones], axis=0)
    return least


def zone_clearance(zone: Zone, start: Array, end: Array, radius: Array, reach_mm: float = np.inf) -> Array:
    """Return the clearance (n,) in mm of the tool to a zone; beyond reach_mm it may be that.

    start, end (n, S, 3): axis segments of the tool in n poses; radius (S,): of its capsules.
    For a shape it is measured at samples of the tool's axis, and is at most 0.03 mm too large.
    """
    solid = zone.solid
    if isinstance(solid, SHAPES):
        points, _, segment = axis_samples(start, end)
        away = signed_distance(solid, points.reshape(-1, 3)).reshape(points.shape[:2]) - radius[segment]
        least: Array = away.min(axis=1)
        return least
    return np.array([solid.clearance(Segments(a, b, radius), reach_mm) for a, b in zip(start, end, strict=True)])
