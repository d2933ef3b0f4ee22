"""Compilation of every kernel that a page and a rehearsal need; see ``kernels/preparation.py``.

`python -m vfix_engine.worlds.rigid.preparation PART ...` is one of its processes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...anatomy.labels.painting import Stroke, draw_stroke
from ...anatomy.piercing import Ways
from ...anatomy.room_air import RoomAir
from ...anatomy.way_round_kernel import ROOM
from ...control import ControlSettings, compile_ahead
from ...files.sampling import sample_plane, sample_points
from ...geometry.mesh import TriangleMesh
from ...geometry.path import SplinePath
from ...kernels.preparation import Preparation, compile_parts
from ...proximity.fields.distance_field import field_of_level, refined_by_level
from ...proximity.fit import nearest_free_point
from ...proximity.proximity import ProximityTree
from ...robots import PlacedRobot, RobotModel, Tool
from .dry_run import dry_run
from .scene import Scene
from .system import RigidSystem

# For two processes; the second parts use kernels of both first ones.
RIGID = Preparation(
    "vfix_engine.worlds.rigid.preparation", (("surface", "distances"), ("parts", "control")), "prepared", 134
)
prepare, is_prepared, progress, wait = RIGID.prepare, RIGID.is_prepared, RIGID.progress, RIGID.wait


def _tube() -> TriangleMesh:
    """A small substitute for anatomy: a tube along y from the origin, which bounds the tip; the shaft is outside."""
    around = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    along = np.linspace(0.0, 60.0, 40)
    y, angle = np.meshgrid(along, around, indexing="ij")
    vertices = np.column_stack([4.0 * np.cos(angle).ravel(), y.ravel(), 4.0 * np.sin(angle).ravel()])
    i, j = np.meshgrid(np.arange(39), np.arange(24), indexing="ij")
    a, b = (i * 24 + j).ravel(), (i * 24 + (j + 1) % 24).ravel()
    return TriangleMesh(
        vertices, np.concatenate([np.column_stack([a, b, a + 24]), np.column_stack([b, b + 24, a + 24])])
    )


def _surface() -> None:
    tree, (robot, tool) = ProximityTree(_tube()), _robot()
    # When the tree is built, the other process has compiled what this needs.
    compile_ahead.call_motion(robot, tool, ControlSettings())
    tree.candidates(tool.segments(np.eye(3), np.zeros(3)), 3.0)
    compile_ahead.call_solver(robot, tool, ControlSettings())
    compile_ahead.call_requests(robot, tool, ControlSettings())


def _parts() -> None:
    compile_ahead.call_parts(*_robot(), ControlSettings())
    path = SplinePath(np.array([[0.0, 0, 0], [0, 10, 0.5], [0, 20, 0]]))
    path.position(np.linspace(0.0, path.length, 5))
    path.closest(np.array([0.1, 5.0, 0.2]))


def _robot() -> tuple[PlacedRobot, Tool]:
    """A robot with its tip at the origin."""
    robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
    return robot.placed(_base(tool), tool), tool


def _base(tool: Tool) -> NDArray[np.float64]:
    base = np.eye(4)
    base[:3, 3] = -tool.tip_in_flange
    return base


def _distances() -> None:
    """Queries of the page; others are compiled on their first use."""
    tree, segments = ProximityTree(_tube()), Tool.load("bent_30").segments(np.eye(3), np.zeros(3))
    tree.clearance(segments, 3.0)
    nearest_free_point(tree, np.array([2.5, 5.0, 0.0]), 1.8, inside_bone=None)
    _fields()
    _slices()


def _fields() -> None:
    """Queries of the verdict about bone and soft tissue."""
    ball = field_of_level(lambda points: 3.0 - np.linalg.norm(points, axis=1), [[-6.0] * 3, [6.0] * 3], 1.0)
    ball = refined_by_level(ball, lambda points: 3.0 - np.linalg.norm(points, axis=1), [[-4.0] * 3, [4.0] * 3], 0.5)
    ball.at(np.zeros((1, 3)))
    air = RoomAir(np.full((7, 7, 7), ROOM, np.uint8), ball.grids[0].origin, 2.0, 0.0)
    Ways(ball, air, np.zeros(3)).of_pose(np.array([[0.0, 0.0, 5.9]]), np.array([[0.0, 0.0, -5.9]]))


def _slices() -> None:
    """Queries of a CT, and painting on it."""
    grey = np.zeros((4, 5, 6), dtype=np.int16)
    grey.setflags(write=False)  # like a volume's voxels, which are another type to the compiler
    sample_points(grey, np.ones((2, 3)), np.zeros(3), np.eye(3), -1024.0)
    along_i, along_j, along_k = 0.5 * np.eye(3)
    for column, row in ((along_i, along_j), (along_j, along_k)):  # the second is sampled in a copy
        sample_plane(grey, np.ones(3), column, row, (4, 4), -1024.0)
    draw_stroke(np.zeros(grey.shape, dtype=bool), np.eye(4), Stroke("paint", "ball", 1.0, ((1.0, 1.0, 1.0),)))


def _control() -> None:
    robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
    scene = Scene(ProximityTree(_tube()), robot, tool, _base(tool), np.zeros(len(robot.joints)))
    settings = ControlSettings()
    RigidSystem(scene, settings).prepare()  # first the kernels that only this half compiles
    path = SplinePath(np.array([[0.0, 0, 0], [0, 10, 0], [0, 20, 0]]))
    scene = replace(scene, path=path, targets=np.array([[0.0, 18.0, 1.0]]), target_names=("ahead",))
    RigidSystem(scene, settings).prepare()
    dry_run(scene, settings)


_PARTS: dict[str, Callable[[], None]] = {
    "surface": _surface, "parts": _parts, "distances": _distances, "control": _control,
}  # fmt: skip

if __name__ == "__main__":
    compile_parts(sys.argv[1:], _PARTS)
