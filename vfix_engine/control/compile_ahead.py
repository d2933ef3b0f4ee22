"""Compile the kernels of a step one by one for the argument types of the full step, without building a tree.

A kernel that is compiled and cached is only linked into its callers. So one process can call these kernels while
another one builds a tree; the full step is linked afterwards (worlds/rigid/preparation.py).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..certificate.bind_kernel import binding, binding_slack
from ..certificate.certify_kernel import certify_motion, measure_state
from ..certificate.constants import StepConstants, unpack_candidates, unpack_constants
from ..certificate.inputs import COLUMNS, MOTION_SPACE, Inputs, PairSpace
from ..certificate.measure_kernel import candidates_suffice, measure, measure_distances, place
from ..certificate.sweep_kernel import acceleration_bound, chords
from ..geometry.capsules import Segments
from ..geometry.mesh import TriangleMesh
from ..kernels.array_table import table_of
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
from .step_kernel import program_views, workspace_size
from .surroundings import Surroundings


def call_parts(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Compile distances to triangles and shapes, kinematics, and the certificate (with ``call_motion``)."""
    around = _surroundings(robot, tool, settings)
    around.gather(around.constants.start, around.constants.end)
    constants = unpack_constants(*around.packed)
    numbers, state = _state(constants)
    candidates = unpack_candidates(len(constants.radius), *around.arrays[2:])
    sizes = len(constants.lower), len(constants.radius), len(constants.margin)
    space, scratch, program = _one_pair(), np.zeros(MOTION_SPACE.size(*sizes)), np.zeros(1)
    inputs = Inputs(constants, candidates, *space, MOTION_SPACE.views(scratch, *sizes), program)
    # Distances first: the process with the tree needs their kernels next.
    measure(inputs, state.start, state.end, inputs.scratch.within, state.distance)
    measure_distances(constants, candidates, state.start, state.end, state.distance)
    candidates_suffice(constants, candidates, state.start, state.end)
    place(constants, state.q, state.position, state.rotation, state.jacobian, state.start, state.end)
    table = table_of((*around.arrays, *space, scratch, program))
    measure_state(table, numbers)
    certify_motion(table, numbers, np.zeros(len(state.q)), numbers.copy())


def call_motion(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Compile the motion bounds between two poses and within a step, and the selection of pairs that can bind."""
    constants = unpack_constants(*_surroundings(robot, tool, settings).packed)
    _, s = _state(constants)
    move, pairs = np.empty(len(constants.radius)), np.empty((MAX_ROWS, PAIR))
    chords(s.start, s.end, s.start, s.end, move)
    acceleration_bound(constants.chain, constants.links, constants.reach, s.q, s.velocity)
    limits = (constants.lower, constants.upper, constants.speed, constants.acceleration, constants.dt)
    step_box(s.q, s.velocity, *limits, s.box[0], s.box[1])
    binding_slack(constants, s, move)
    binding(constants, move, *_one_pair(), 1, pairs)


def call_solver(robot: PlacedRobot, tool: Tool, settings: ControlSettings) -> None:
    """Compile the program of a step that moves one joint, and its solver."""
    packed = _surroundings(robot, tool, settings).packed
    joints, segments, bodies = packed.counts[:3].tolist()
    numbers = np.zeros(state_size(joints, segments, bodies))
    workspace = np.zeros(workspace_size(joints + 1, 0))
    hessian, gradient, upper, lower, rows = program_views(workspace, joints + 1, 0)
    x, multiplier = np.zeros(joints + 1), np.zeros(joints + 1)
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


def _one_pair() -> PairSpace:
    """Return a workspace with one pair."""
    return PairSpace(np.ones((1, COLUMNS)), np.zeros((1, 3), np.int32), np.zeros(1 + MAX_ROWS, np.int32))


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
