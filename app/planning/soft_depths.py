"""Depth of the tool of a dry run in each soft protected structure of a plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from app.planning.protected_structures import structure_name
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
    """A soft protected structure that the tool touches.

    depth_mm: greatest depth of the tool below the border of the structure's layer, whose thickness is its margin; its
    maximum depth counts from the same border. s_mm: arc length of the tip there.
    """

    name: str
    depth_mm: float
    s_mm: float


def soft_depths(
    run: DryRun, rows: IndexArray, tool: Tool, soft: Sequence[SoftZone | SoftRegion]
) -> tuple[SoftDepth, ...]:
    """Return the soft structures that the tool touches, the deepest first; a chain is one structure.

    rows (n,): rows of the run to examine, about a station apart; around the deepest one every pose is examined.
    """
    deepest: dict[str, SoftDepth] = {}
    rows = np.union1d(rows, [len(run.s) - 1])
    for zone in soft:
        coarse = int(rows[_depths(zone, run, rows, tool.radius).argmax()])
        around = np.flatnonzero(np.abs(run.s - run.s[coarse]) <= STATION_MM)
        depths = _depths(zone, run, around, tool.radius)
        best, name = int(depths.argmax()), structure_name(zone.name)
        depth = float(depths[best])
        if depth > (deepest[name].depth_mm if name in deepest else 0.0):
            deepest[name] = SoftDepth(name, depth, float(run.s[around[best]]))
    return tuple(sorted(deepest.values(), key=lambda one: -one.depth_mm))


def _depths(zone: SoftZone | SoftRegion, run: DryRun, rows: IndexArray, radius: Array) -> Array:
    """Return the depth (n,) in mm of the tool in a zone in poses of the run; at most 0 where it does not touch it."""
    away = soft_clearance(zone, run.segments_start[rows], run.segments_end[rows], radius)
    layer = zone.layer_mm if isinstance(zone, SoftRegion) else zone.thickness_mm
    return layer - (run.clearance[rows] if away is None else away)


def soft_clearance(
    zone: SoftZone | SoftRegion, start: Array, end: Array, radius: Array, reach_mm: float = np.inf
) -> Array | None:
    """Return the clearance (n,) in mm of the tool to what a zone lies over; beyond reach_mm it may be that.

    None: that is all of the anatomy. start, end (n, S, 3): axis segments of the tool in n poses; radius (S,).
    A surface is measured exactly, a shape at samples of the tool's axis, at most 0.03 mm too far, and a solid by
    its distance field, inf where that ends.
    """
    if isinstance(zone, SoftRegion):
        return -_deepest(start, end, radius, zone.field.at)
    solid = zone.over
    if isinstance(solid, SHAPES):
        return -_deepest(start, end, radius, partial(signed_distance, solid))
    if solid is None:
        return None
    return np.array([solid.clearance(Segments(a, b, radius), reach_mm) for a, b in zip(start, end, strict=True)])


def _deepest(start: Array, end: Array, radius: Array, distance: Callable[[Array], Array]) -> Array:
    """Return the depth (n,) of the tool's surface in a solid; -inf where its distance is not known."""
    points, _, segment = axis_samples(start, end)
    away = distance(points.reshape(-1, 3)).reshape(points.shape[:2])
    depth: Array = np.where(np.isnan(away), -np.inf, radius[segment] - away).max(axis=1)
    return depth
