"""The distance of a lens to the wall, negative behind it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from app.lumen.lens_wall import LensWall
from vfix_engine.geometry.mesh import TriangleMesh


@pytest.mark.parametrize(("height", "expected"), [(0.0, 10.0), (8.0, 2.0), (12.5, -2.5)])
def test_the_distance_is_signed(height: float, expected: float) -> None:
    box = trimesh.creation.box((20.0, 20.0, 20.0))
    camera = np.eye(4)
    camera[2, 3] = height
    wall = LensWall(TriangleMesh(np.asarray(box.vertices), np.asarray(box.faces)))
    assert wall.distance_mm(camera) == pytest.approx(expected)
