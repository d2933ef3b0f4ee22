"""How deep the tool of a dry run goes into each soft structure to spare of a plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from app.planning.zone_sets import whole_name
from vfix_engine.arrays import Array, IndexArray
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.proximity.fields.tool_depth import axis_samples
from vfix_engine.robots import Tool
from vfix_engine.virtual_fixtures import SoftRegion, SoftZone
from vfix_engine.virtual_fixtures.zones import SHAPES
from vfix_engine.worlds.rigid.dry_run import STATION_MM, DryRun


@dataclass(frozen=True)
class SoftDepth:
    """A soft structure to spare that the tool touches.

    depth_mm: the greatest depth of the tool below the border of the structure's layer, which its margin sets, as its
    greatest depth is counted. s_mm: arc length of the tip there.
    """

    name: str
    depth_mm: float
    s_mm: float


def soft_depths(
    run: DryRun, rows: IndexArray, tool: Tool, soft: Sequence[SoftZone | SoftRegion]
) -> tuple[SoftDepth, ...]:
    """The soft structures that the tool touches, the deepest touched first; a chain is one structure.

    rows (n,): of the run that are looked at, about a station apart; around the deepest every pose is.
    """
    deepest: dict[str, SoftDepth] = {}
    rows = np.union1d(rows, [len(run.s) - 1])
    for zone in soft:
        coarse = int(rows[_depths(zone, run, rows, tool.radius).argmax()])
        around = np.flatnonzero(np.abs(run.s - run.s[coarse]) <= STATION_MM)
        depths = _depths(zone, run, around, tool.radius)
        best, name = int(depths.argmax()), whole_name(zone.name)
        depth = float(depths[best])
        if depth > (deepest[name].depth_mm if name in deepest else 0.0):
            deepest[name] = SoftDepth(name, depth, float(run.s[around[best]]))
    return tuple(sorted(deepest.values(), key=lambda one: -one.depth_mm))


def _depths(zone: SoftZone | SoftRegion, run: DryRun, rows: IndexArray, radius: Array) -> Array:
    """Depth (n,) of the tool in a zone in poses of the run, mm; not above 0 where it does not touch it.

    A surface is measured exactly, a shape at samples of the tool's axis, at most 0.03 mm too shallow, and a solid by
    its field of distances.
    """
    start, end = run.segments_start[rows], run.segments_end[rows]
    if isinstance(zone, SoftRegion):
        return zone.layer_mm + _deepest(start, end, radius, zone.field.at)
    solid = zone.over
    if isinstance(solid, SHAPES):
        return zone.thickness_mm + _deepest(start, end, radius, partial(signed_distance, solid))
    if solid is None:  # all of the anatomy, whose clearance the run has
        return zone.thickness_mm - run.clearance[rows]
    away = [solid.closest(Segments(a, b, radius)).distance for a, b in zip(start, end, strict=True)]
    return zone.thickness_mm - np.array(away)


def _deepest(start: Array, end: Array, radius: Array, distance: Callable[[Array], Array]) -> Array:
    """How deep (n,) the tool's surface is in a solid; -inf where nothing is known of it."""
    points, _, segment = axis_samples(start, end)
    away = distance(points.reshape(-1, 3)).reshape(points.shape[:2])
    depth: Array = np.where(np.isnan(away), -np.inf, radius[segment] - away).max(axis=1)
    return depth
