"""Directions from which a target can be inspected: over a plane, and in a tube that is open at both ends."""

import numpy as np
import pytest
import trimesh

from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import Tool
from vfix_engine.worlds.rigid.inspection_cone import inspection_cone

STRAIGHT = Tool.load("straight_pointer")
DOWN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # columns: the shaft, +y, runs along -z


def test_over_a_plane_every_direction_from_above_is_free() -> None:
    plane = TriangleMesh([[-500, -500, 0], [500, -500, 0], [500, 500, 0], [-500, 500, 0]], [[0, 1, 2], [0, 2, 3]])
    cone = inspection_cone(ProximityTree(plane), STRAIGHT, [0.0, 0.0, 3.0], 0.3, DOWN)
    assert cone.cone_deg == pytest.approx(180.0, abs=4.0)
    assert cone.directions[:, 2].max() < 0.05
    assert (cone.rolls == 1).all()


def test_in_a_tube_the_other_end_is_none_that_the_tool_can_take() -> None:
    tube = trimesh.creation.annulus(r_min=8.0, r_max=12.0, height=60.0, sections=48)
    tree = ProximityTree(TriangleMesh(tube.vertices, tube.faces))
    for rotation in (DOWN, np.diag([1.0, -1.0, -1.0]) @ DOWN):
        cone = inspection_cone(tree, STRAIGHT, [0.0, 0.0, 0.0], 0.3, rotation)
        assert len(cone.directions)
        assert (np.sign(cone.directions[:, 2]) == np.sign(rotation[2, 1])).all()
        # The shaft passes the rim, 30 mm away, within 8 mm less radius and margin.
        most = np.arctan2(8.0 - STRAIGHT.radius.max() - 0.3, 30.0)
        assert cone.cone_deg == pytest.approx(2.0 * np.degrees(most), abs=6.0)


def test_a_target_behind_bone_has_no_direction() -> None:
    shell = trimesh.creation.icosphere(subdivisions=3, radius=5.0)
    tree = ProximityTree(TriangleMesh(shell.vertices, shell.faces))
    cone = inspection_cone(tree, Tool.load("bent_30"), [0.0, 0.0, 0.0], 0.3, DOWN)
    assert len(cone.directions) == 0
    assert cone.cone_deg == 0.0
