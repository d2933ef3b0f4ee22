"""Depth of the tool in soft protected structures, compared with brute force over every pose."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import trimesh

from app.planning.protected_structures import engine_zones
from app.planning.soft_depths import soft_depths
from app.planning.verdict import profile_of
from app.plans.zones import PlanZone
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.robots import Tool
from vfix_engine.worlds.rigid.dry_run import DryRun

TOOL = Tool.load("bent_30")
# Tip and shaft from the tip backwards, which is −y.
AXES = np.array([[[0.0, 0.0, 0.0], [0.0, -15.0, 0.0]], [[0.0, -15.0, 0.0], [0.0, -110.0, 60.0]]])
CENTRE, RADIUS = np.array([1.5, 20.0, 4.0]), 5.0
CHAIN = np.array([[-8.0, 31.0, 3.0], [0.5, 30.0, 2.5], [8.0, 31.0, 3.0]])


def drive(length: float = 40.0, step: float = 0.05) -> DryRun:
    """The tool goes along +y and turns a little about its tip."""
    s = np.arange(0.0, length, step)
    starts, ends = [], []
    for at in s:
        turn = 0.3 * at / length
        rotation = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])
        tip = np.array([0.2 * np.sin(at), at, 0.05 * at])
        starts.append(AXES[:, 0] @ rotation.T + tip)
        ends.append(AXES[:, 1] @ rotation.T + tip)
    tips = np.stack([start[0] for start in starts])
    return DryRun(
        s, tips, np.full(len(s), 9.0), np.zeros((len(s), 7)), np.stack(starts), np.stack(ends), True, "", length, 9.0
    )  # fmt: skip


def soft(name: str, shape: dict[str, Any], margin: float, **fields: Any) -> PlanZone:
    return PlanZone(f"z-{name}", name, shape, margin, "soft", 0.5, **fields)


def ball_mesh(structure_id: str) -> TriangleMesh:
    made = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    return TriangleMesh(np.asarray(made.vertices) + CENTRE, np.asarray(made.faces))


def to_chain(points: np.ndarray) -> np.ndarray:
    """Distance of points (n, 3) to the chain's axis."""
    away = []
    for a, b in pairwise(CHAIN):
        along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        away.append(np.linalg.norm(points - a - along[:, None] * (b - a), axis=1))
    return np.min(away, axis=0)


def brute(run: DryRun, distance: Any, layer: float) -> tuple[float, float]:
    """Greatest depth over every pose at points of the axis 0.05 mm apart, and arc length there."""
    best = (-np.inf, 0.0)
    for s, start, end in zip(run.s, run.segments_start, run.segments_end, strict=True):
        for a, b, radius in zip(start, end, TOOL.radius, strict=True):
            if np.linalg.norm((a + b) / 2 - CENTRE) > 40.0 + np.linalg.norm(b - a) / 2:
                continue
            count = int(np.linalg.norm(b - a) / 0.05) + 2
            points = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
            depth = layer + radius - float(distance(points).min())
            if depth > best[0]:
                best = depth, float(s)
    return best


def test_depths_are_those_of_brute_force() -> None:
    run = drive()
    structures = [
        soft("gland", {"kind": "structure", "structure": "gland"}, 0.5),
        soft("ball", {"kind": "sphere", "centre": CENTRE.tolist(), "radius": 4.0}, 0.0),
        soft("nerve", {"kind": "capsules", "points": CHAIN.tolist(), "radius": 1.5}, 1.0, max_depth_mm=9.0),
        soft("far", {"kind": "sphere", "centre": [300.0, 0.0, 0.0], "radius": 4.0}, 1.0),
    ]
    rows = np.arange(0, len(run.s), 10)
    found = {one.name: one for one in soft_depths(run, rows, TOOL, engine_zones(structures, ball_mesh).soft_zones)}
    assert set(found) == {"gland", "ball", "nerve"}
    every = drive(step=0.25)
    for name, distance, layer in (
        ("gland", lambda at: np.linalg.norm(at - CENTRE, axis=1) - RADIUS, 0.5),
        ("ball", lambda at: np.linalg.norm(at - CENTRE, axis=1) - 4.0, 0.0),
        ("nerve", lambda at: to_chain(at) - 1.5, 1.0),
    ):
        depth, s_mm = brute(every, distance, layer)
        assert depth > 1.0
        assert found[name].depth_mm == pytest.approx(depth, abs=0.1), name
        assert found[name].s_mm == pytest.approx(s_mm, abs=1.5), name
    deepest = [one.depth_mm for one in found.values()]
    assert deepest == sorted(deepest, reverse=True)


def test_a_surface_that_is_open_is_soft_on_both_of_its_sides() -> None:
    """A flat patch across the way: the tip presses the layer before it."""
    corners = np.array([[-20.0, 25.0, -20.0], [20.0, 25.0, -20.0], [20.0, 25.0, 20.0], [-20.0, 25.0, 20.0]])
    flat = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    zones = engine_zones([soft("flap", {"kind": "structure", "structure": "flap"}, 1.0)], lambda _: flat)
    run = drive(length=24.0)
    (one,) = profile_of(run, TOOL, SplinePath(run.tip[::80]), None, zones).soft
    assert (one.name, one.s_mm) == ("flap", pytest.approx(run.s[-1], abs=0.6))
    expected = 1.0 + TOOL.radius[0] - (25.0 - run.tip[-1, 1])
    assert one.depth_mm == pytest.approx(expected, abs=0.05)
