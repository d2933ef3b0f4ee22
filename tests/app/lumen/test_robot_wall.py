"""A robot against the wall: the distance of its lens, and how deep its links are behind it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh

from app.lumen import robot_wall
from app.lumen.robot_wall import RobotWall
from vfix_engine.geometry.mesh import TriangleMesh


def a_wall() -> RobotWall:
    """A cube of 20 mm about the origin, in which a robot stands on a base in the middle of the floor, z up."""
    box = trimesh.creation.box((20.0, 20.0, 20.0))
    base = np.eye(4)
    base[2, 3] = -10.0
    path: Any = SimpleNamespace(base=base)
    return RobotWall(TriangleMesh(np.asarray(box.vertices), np.asarray(box.faces)), path)


def snapshot(end: tuple[float, float, float], bounds: tuple[float, ...] = (8.0, 8.0)) -> Any:
    """Two links of 1 mm radius, the first up to the middle."""
    capsules = np.array([[0.0, 0.0, -10.0, 0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, *end, 1.0]])
    return SimpleNamespace(capsules=capsules, bounds=np.array(bounds))


@pytest.mark.parametrize(("height", "expected"), [(0.0, 10.0), (8.0, 2.0), (12.5, -2.5)])
def test_the_distance_of_the_lens_is_signed(height: float, expected: float) -> None:
    camera = np.eye(4)
    camera[2, 3] = height
    assert a_wall().lens_mm(camera) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("end", "found"), [((5.0, 0.0, 0.0), (0.0, 0)), ((9.5, 0.0, 0.0), (0.5, 2)), ((13.0, 0.0, 0.0), (4.0, 2))]
)
def test_the_deepest_link_is_measured_by_its_surface(end: tuple[float, float, float], found: tuple[float, int]) -> None:
    """A tip 0.5 mm before a wall with a radius of 1 mm is 0.5 mm behind it; what stands on the floor is not."""
    deepest = a_wall().deepest(snapshot(end))
    assert (deepest.mm, deepest.link) == (pytest.approx(found[0]), found[1])


def test_links_that_are_not_in_the_pathway_are_not_behind_the_wall() -> None:
    assert a_wall().deepest(snapshot((13.0, 0.0, 0.0), (np.inf, np.inf))).link == 0


def test_many_pages_measure_once(monkeypatch: pytest.MonkeyPatch) -> None:
    wall, clock = a_wall(), [100.0]
    monkeypatch.setattr(robot_wall.time, "monotonic", lambda: clock[0])
    assert wall.deepest(snapshot((13.0, 0.0, 0.0))).mm == pytest.approx(4.0)
    assert wall.deepest(snapshot((5.0, 0.0, 0.0))).mm == pytest.approx(4.0)
    clock[0] += robot_wall.EVERY_S
    assert wall.deepest(snapshot((5.0, 0.0, 0.0))).mm == 0.0
