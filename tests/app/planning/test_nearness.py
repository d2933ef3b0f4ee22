"""How near a tool is to protected structures of every kind, compared with points of its axis."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import trimesh

from app.planning.nearness import REACH_MM, nearness
from app.planning.protected_structures import engine_zones
from app.plans.zones import PlanZone
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import Tool

TOOL = Tool.load("bent_30")
START = np.array([[0.0, 0.0, 0.0], [0.0, -15.0, 0.0]])
END = np.array([[0.0, -15.0, 0.0], [0.0, -110.0, 60.0]])
CENTRE, BALL_MM = np.array([2.0, 9.0, 1.0]), 5.0
CHAIN = np.array([[7.0, -30.0, 3.0], [8.0, -5.0, 2.0], [8.0, 9.0, 2.0]])
BALL = {"kind": "sphere", "centre": CENTRE.tolist(), "radius": BALL_MM}


def gland(structure_id: str) -> TriangleMesh:
    made = trimesh.creation.icosphere(subdivisions=4, radius=BALL_MM)
    return TriangleMesh(np.asarray(made.vertices) + CENTRE, np.asarray(made.faces))


def protected(name: str, shape: dict[str, Any], margin: float, kind: Any = "hard", **fields: Any) -> PlanZone:
    return PlanZone(f"z-{name}", name, shape, margin, kind, 0.5 if kind == "soft" else None, **fields)


def to_chain(points: np.ndarray) -> np.ndarray:
    away = []
    for a, b in pairwise(CHAIN):
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        away.append(np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
    return np.asarray(np.min(away, axis=0))


def to_ball(points: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(points - CENTRE, axis=1) - BALL_MM)


def brute(distance: Any, moved: np.ndarray) -> float:
    share = np.linspace(0.0, 1.0, 20_000)[:, None]
    each = [distance(a + share * (b - a) + moved).min() - r for a, b, r in zip(START, END, TOOL.radius, strict=True)]
    return float(min(each))


@pytest.mark.parametrize("moved", [(0.0, 0.0, 0.0), (0.5, 3.0, 0.0), (1.0, 8.0, 1.0)])
def test_each_structure_has_its_clearance_and_margin(moved: tuple[float, float, float]) -> None:
    plan = [
        protected("nerve", {"kind": "capsules", "points": CHAIN.tolist(), "radius": 1.5}, 1.0),
        protected("ball", BALL, 0.5),
        protected("gland", {"kind": "structure", "structure": "gland"}, 2.0),
        protected("soft ball", BALL, 0.7, "soft"),
        protected("soft gland", {"kind": "structure", "structure": "gland"}, 0.3, "soft"),
        protected("far", {"kind": "sphere", "centre": [300.0, 0.0, 0.0], "radius": 4.0}, 1.0),
    ]
    zones = engine_zones(plan, gland)
    at = np.array(moved)
    found = {one.name: one for one in nearness((*zones.zones, *zones.soft_zones), START + at, END + at, TOOL.radius)}
    assert set(found) == {"nerve", "ball", "gland", "soft ball", "soft gland", "far"}, "a chain is one structure"
    to_nerve = brute(to_chain, at) - 1.5
    assert found["nerve"].clearance_mm == pytest.approx(min(to_nerve, REACH_MM), abs=0.04)
    away = brute(to_ball, at)
    for name, within in (("ball", 0.04), ("soft ball", 0.04), ("soft gland", 0.2)):
        assert found[name].clearance_mm == pytest.approx(away, abs=within), name
    if away > 0.0:  # a surface has no inside
        assert found["gland"].clearance_mm == pytest.approx(away, abs=0.05)
    else:
        assert found["gland"].clearance_mm < 0.0
    assert found["far"].clearance_mm == REACH_MM
    assert [found[one.name].margin_mm for one in plan] == pytest.approx([1.0, 0.5, 2.0, 0.7, 0.3, 1.0])
    assert [found[one.name].soft for one in plan] == [False, False, False, True, True, False]


def test_a_soft_layer_over_all_of_the_bone_is_left_out() -> None:
    zones = engine_zones([protected("bone", {"kind": "structure", "structure": "bone"}, 0.5, "soft")], gland)
    assert nearness(zones.soft_zones, START, END, TOOL.radius) == ()
