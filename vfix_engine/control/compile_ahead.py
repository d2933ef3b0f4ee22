"""The kernels of a step called one by one, each for the types that the whole step has for it, without a tree.

A kernel that is compiled and kept already is only put into those that call it. So one process calls these while another
one builds a tree, and the whole step is put together afterwards (simulation/preparation.py).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..fixtures.moment_kernel import PAIR, moment_parts, moment_places
from ..geometry.candidate_kernels import pack
from ..geometry.candidates import CandidateList
from ..geometry.capsules import Segments
from ..geometry.mesh import TriangleMesh
from ..geometry.pairs import MAX_ROWS
from ..robots import PlacedRobot, Tool
from . import qp
from .bind_kernel import binding, largest_moves
from .dual_kernel import solve_dual
from .judge_kernel import judge, look
from .measure_kernel import covered, measure, place
from .problem_kernel import prepare, settle
from .settings import ControlSettings
from .step_kernel import room_parts, room_size
from .surroundings import Surroundings
from .sweep_kernel import bend, chords
from .world import World, unpack_cover, unpack_world

Array = NDArray[np.float64]


def call_parts(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Distances to triangles and shapes, kinematics, and the certificate over them and over ``call_motion``."""
    around = _surroundings(robot, tool, settings)
    around.gather(around.world.start, around.world.end)
    world = unpack_world(*around.packed)
    moment, parts = _moment(world)
    q, _, position, rotation, jacobian, start, end, distance = parts
    # Distances first: the process with the tree will be asking for their kernels.
    cover = unpack_cover(len(world.radius), *around.arrays[2:])
    rows, labels, body = _room()
    measure(world, cover, start, end, world.threshold, distance, rows, labels, body)
    covered(world, cover, start, end)
    place(world, q, position, rotation, jacobian, start, end)
    look(*around.arrays, moment, rows, labels, body)
    judge(*around.arrays, moment, np.zeros(len(q)), moment.copy(), rows, labels, body)


def call_motion(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """How far the tool can move, between two poses and in a step, and which pairs can bind."""
    world = unpack_world(*_surroundings(robot, tool, settings).packed)
    _, (q, velocity, position, _, jacobian, start, end, _) = _moment(world)
    rows, labels, body = _room()
    move, pairs = np.empty(len(world.radius)), np.empty((MAX_ROWS, PAIR))
    chords(start, end, start, end, move)
    bend(world.chain, world.links, world.reach, q, velocity)
    largest_moves(world, q, velocity, position, jacobian, start, end, move)
    binding(world, move, rows, labels, body, 1, pairs)


def call_solver(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """The program of a step that wants one joint to move, and its solver."""
    packed = _surroundings(robot, tool, settings).packed
    joints, segments, bodies = packed.counts[:3].tolist()
    moment = np.zeros(moment_places(joints, segments, bodies)[-1])
    room = np.zeros(room_size(joints, MAX_ROWS))
    hessian, gradient, rows, upper, lower, x, multiplier, box, _ = room_parts(room, joints, 0)
    given = qp.join_constraints((), joints + 1)
    prepare(
        *packed, moment, np.eye(1, joints + 1), np.ones(1), np.ones(1), np.eye(joints + 1), given.matrix, given.bound,
        1.0, hessian, gradient, rows, upper, lower, box,
    )  # fmt: skip
    solve_dual(hessian, gradient, rows, upper, lower, x, multiplier)
    settle(hessian, gradient, rows, upper, lower, x, multiplier, qp.PRIMAL_TOLERANCE, qp.DUAL_TOLERANCE)


def _moment(world: World) -> tuple[Array, tuple[Array, ...]]:
    """An empty moment and its parts."""
    n, count, bodies = len(world.lower), len(world.radius), len(world.margin)
    moment = np.zeros(moment_places(n, count, bodies)[-1])
    return moment, moment_parts(moment, n, count, bodies)


def _room() -> tuple[Array, NDArray[np.int32], NDArray[np.int32]]:
    """For one pair."""
    return np.ones((1, 10)), np.zeros((1, 2), np.int32), np.zeros(1, np.int32)


def _surroundings(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> Surroundings:
    tree: Any = _OneTriangle()  # of a tree, surroundings ask for candidates only
    return Surroundings(robot, tool, tree, settings)


class _OneTriangle:
    """Stands for a surface where no tree has been built."""

    def candidates(self, segments: Segments, reach: float) -> CandidateList:
        """The triangle, near every segment."""
        labels = np.zeros((len(segments), 2), np.int32)
        labels[:, 0] = np.arange(len(segments))
        mesh = TriangleMesh(np.eye(3), np.arange(3)[None])
        labels.setflags(write=False)
        store = pack(mesh.vertices, mesh.faces, labels, len(segments), np.ones(4))
        return CandidateList(segments, reach, store, len(segments))
