"""Compile the kernels of a step one by one for the argument types of the full step, without building a tree.

A kernel that is compiled and cached is only linked into its callers. So one process can call these kernels while
another one builds a tree; the full step is linked afterwards (simulation/preparation.py).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..certificate.bind_kernel import binding, largest_moves
from ..certificate.certify_kernel import certify_motion, measure_state
from ..certificate.constants import StepConstants, unpack_candidates, unpack_constants
from ..certificate.measure_kernel import candidates_suffice, measure, place
from ..certificate.sweep_kernel import acceleration_bound, chords
from ..geometry.capsules import Segments
from ..geometry.mesh import TriangleMesh
from ..proximity.candidate_kernels import pack
from ..proximity.candidates import CandidateList
from ..proximity.pairs import MAX_ROWS
from ..robots import PlacedRobot, Tool
from ..virtual_fixtures.joint_limits import step_box
from ..virtual_fixtures.state_kernel import PAIR, StateViews, state_size, state_views
from . import qp
from .dual_kernel import solve_dual
from .problem_kernel import DUAL_TOLERANCE, PRIMAL_TOLERANCE, check_kkt, prepare
from .request_kernel import load_requests, task_numbers
from .settings import ControlSettings
from .shaft_kernel import load_shaft_rows
from .step_kernel import answer_size, answer_views, program_size, program_views
from .surroundings import Surroundings


def call_parts(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Compile distances to triangles and shapes, kinematics, and the certificate (with ``call_motion``)."""
    around = _surroundings(robot, tool, settings)
    around.gather(around.constants.start, around.constants.end)
    constants = unpack_constants(*around.packed)
    numbers, state = _state(constants)
    # Distances first: the process with the tree needs their kernels next.
    candidates = unpack_candidates(len(constants.radius), *around.arrays[2:])
    rows, labels, body = _one_pair()
    measure(constants, candidates, state.start, state.end, constants.threshold, state.distance, rows, labels, body)
    candidates_suffice(constants, candidates, state.start, state.end)
    place(constants, state.q, state.position, state.rotation, state.jacobian, state.start, state.end)
    measure_state(*around.arrays, numbers, rows, labels, body)
    certify_motion(*around.arrays, numbers, np.zeros(len(state.q)), numbers.copy(), rows, labels, body)


def call_motion(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Compile the motion bounds between two poses and within a step, and the selection of pairs that can bind."""
    constants = unpack_constants(*_surroundings(robot, tool, settings).packed)
    _, s = _state(constants)
    rows, labels, body = _one_pair()
    move, pairs = np.empty(len(constants.radius)), np.empty((MAX_ROWS, PAIR))
    chords(s.start, s.end, s.start, s.end, move)
    acceleration_bound(constants.chain, constants.links, constants.reach, s.q, s.velocity)
    limits = (constants.lower, constants.upper, constants.speed, constants.acceleration, constants.dt)
    step_box(s.q, s.velocity, *limits, s.box[0], s.box[1])
    largest_moves(s.box, s.position, s.jacobian, s.start, s.end, move)
    binding(constants, move, rows, labels, body, 1, pairs)


def call_solver(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Compile the program of a step that moves one joint, and its solver."""
    packed = _surroundings(robot, tool, settings).packed
    joints, segments, bodies = packed.counts[:3].tolist()
    numbers = np.zeros(state_size(joints, segments, bodies))
    workspace = np.zeros(program_size(joints + 1, MAX_ROWS))
    hessian, gradient, upper, lower, rows = program_views(workspace, joints + 1, 0)
    answer = np.zeros(answer_size(joints, joints + 1, MAX_ROWS))
    _, x, multiplier = answer_views(answer, joints, joints + 1, 0)
    given = qp.join_constraints((), joints + 1)
    prepare(
        *packed, numbers, np.eye(1, joints + 1), np.ones(1), np.ones(1), given.matrix, given.bound,
        1.0, hessian, gradient, rows, upper, lower,
    )  # fmt: skip
    solve_dual(hessian, gradient, rows, upper, lower, x, multiplier)
    check_kkt(hessian, gradient, rows, upper, lower, x, multiplier, PRIMAL_TOLERANCE, DUAL_TOLERANCE)


def call_requests(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Compile the requests of the tasks."""
    constants = unpack_constants(*_surroundings(robot, tool, settings).packed)
    sizes = len(constants.lower), len(constants.radius), len(constants.margin)
    kernel_sizes, before = (task_numbers(settings, tool), *sizes), _state(constants)[0]
    load_requests(kernel_sizes, before)
    load_shaft_rows(kernel_sizes, before)


def _state(constants: StepConstants) -> tuple[Array, StateViews]:
    """Return an empty packed state and its views."""
    sizes = len(constants.lower), len(constants.radius), len(constants.margin)
    numbers = np.zeros(state_size(*sizes))
    return numbers, state_views(numbers, *sizes)


def _one_pair() -> tuple[Array, NDArray[np.int32], NDArray[np.int32]]:
    """Return a workspace for one pair."""
    return np.ones((1, 10)), np.zeros((1, 2), np.int32), np.zeros(1, np.int32)


def _surroundings(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> Surroundings:
    tree: Any = _OneTriangle()  # surroundings only ask a tree for candidates
    return Surroundings(robot, tool, tree, settings)


class _OneTriangle:
    """Stand-in for a surface whose tree has not been built."""

    def candidates(self, segments: Segments, reach: float) -> CandidateList:
        """Return the triangle as a candidate of every segment."""
        labels = np.zeros((len(segments), 2), np.int32)
        labels[:, 0] = np.arange(len(segments))
        mesh = TriangleMesh(np.eye(3), np.arange(3)[None])
        labels.setflags(write=False)
        store = pack(mesh.vertices, mesh.faces, labels, len(segments), np.ones(4))
        return CandidateList(segments, reach, store, len(segments))
