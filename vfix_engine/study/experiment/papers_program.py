"""The papers' program of each step, solved the papers' way: rows, pairs, iterations and times on recorded trials.

Li 2004 and Li 2007 state a step as least squares with linear inequalities (LSI, eq. 20-21), which is reduced to least
squares with non-negative unknowns (NNLS: Lawson & Hanson, *Solving Least Squares Problems*, chapter 23). Its boundary
rows (16) come from the covariance tree, where a flat node gives one pair for all of its triangles. Nothing here drives
a robot: the product's own program and tree do.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...control.step_request import HandCommand
from ...control.tasks import FollowPath, PathPoint
from ...control.tasks.printed_path import PrintedPath
from ...errors import InputError
from ...proximity.covariance.tree import CovarianceTree
from ...virtual_fixtures import boundary, joint_regularisation
from ...virtual_fixtures.motion import point_jacobian
from ...virtual_fixtures.state import StepState
from ...worlds.rigid.covariance_watch import FLAT_MM
from ...worlds.rigid.rehearsal import Rehearsal
from .apparatus import Apparatus, apparatus
from .fit import Fitted
from .trials import Trial, TrialKey, run_trial, subject_of

EVERY = 5  # samples of a trial from one program to the next
THRESHOLD_MM = 0.5  # ε_thresh of the tree's search: not printed, chosen by the papers' largest number of rows
_POSITIVE = 1e-12  # a smaller gradient of NNLS is zero


class Lsi(NamedTuple):
    """Minimise ‖E x − f‖ subject to G x ≤ h; E (m, n), f (m,), G (k, n), h (k,)."""

    E: Array
    f: Array
    G: Array
    h: Array


class NnlsResult(NamedTuple):
    """u (k,) ≥ 0 with the least ‖A u − b‖, that norm, and the least-squares problems that were solved for it."""

    u: Array
    residual: float
    iterations: int


def nnls(A: Array, b: Array, most: int = 1000) -> NnlsResult:
    """Lawson & Hanson's NNLS (algorithm 23.10), with its iterations counted as their program counts them.

    Raises:
        InputError: no minimum after ``most`` iterations.
    """
    u, passive = np.zeros(A.shape[1]), np.zeros(A.shape[1], bool)
    gradient, iterations = A.T @ b, 0
    while (gradient[~passive] > _POSITIVE).any():
        passive[np.argmax(np.where(passive, -np.inf, gradient))] = True
        while True:
            iterations += 1
            if iterations > most:
                raise InputError(f"NNLS has found no minimum after {most} iterations")
            trial = np.zeros_like(u)
            trial[passive] = np.linalg.lstsq(A[:, passive], b, rcond=None)[0]
            wrong = passive & (trial <= 0.0)
            if not wrong.any():
                break
            u += np.min(u[wrong] / (u[wrong] - trial[wrong])) * (trial - u)
            passive &= u > _POSITIVE
            u[~passive] = 0.0
        u = trial
        gradient = A.T @ (b - A @ u)
    return NnlsResult(u, float(np.linalg.norm(A @ u - b)), iterations)


def solve_lsi(problem: Lsi) -> tuple[Array | None, int]:
    """The minimiser (n,), None where no x meets the rows, and the iterations of NNLS."""
    Q, R = np.linalg.qr(problem.E)
    free = np.linalg.solve(R, Q.T @ problem.f)
    C, d = -np.linalg.solve(R.T, problem.G.T).T, problem.G @ free - problem.h  # z = R (x − free): least ‖z‖, C z ≥ d
    size = np.linalg.norm(C, axis=1)
    system = np.vstack([(C / size[:, None]).T, d / size])
    wanted = np.append(np.zeros(len(free)), 1.0)
    found = nnls(system, wanted)
    if found.residual < 1e-9:
        return None, found.iterations
    r = system @ found.u - wanted
    return free + np.linalg.solve(R, -r[:-1] / r[-1]), found.iterations


@dataclass
class ProgramCounts:
    """Of each program: pairs of the boundary, iterations of NNLS, and seconds of tree and solution together.

    joints: n. unsolvable: programs without a solution, as (14) has where the anatomy stops the tool.
    """

    joints: int
    pairs: list[int] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    unsolvable: int = 0

    @property
    def constraint_rows(self) -> list[int]:
        """Rows of A·J in (21): the progress (14), both limits of every joint (18), one of each pair (16)."""
        return [1 + 2 * self.joints + count for count in self.pairs]

    @property
    def objective_rows(self) -> list[int]:
        """Rows of W·J in (20): the tip (15), the joints (19), one of each pair (17), as the papers' numbers suggest."""
        return [6 + self.joints + count for count in self.pairs]


def counted(trials: Iterable[Trial], threshold_mm: float = THRESHOLD_MM, preset: str = "li2007") -> ProgramCounts:
    """Build and solve the programs of hands-on trials; a pair of the boundary is nearer than ``threshold_mm``."""
    around = apparatus(preset)
    rehearsal = Rehearsal(around.scene, around.settings)
    tree, counts = CovarianceTree(around.scene.tree.mesh), ProgramCounts(len(around.scene.robot.joints))
    for trial in trials:
        for state, command in _states(rehearsal, trial):
            begin = time.perf_counter()
            made, pairs = _program(around, tree, state, command, threshold_mm)
            if made is None:
                continue
            x, iterations = solve_lsi(made)
            counts.seconds.append(time.perf_counter() - begin)
            counts.pairs.append(pairs)
            counts.iterations.append(iterations)
            counts.unsolvable += x is None
    return counts


def _states(rehearsal: Rehearsal, trial: Trial) -> Iterator[tuple[StepState, HandCommand]]:
    """Every few samples of a trial, with the speed that the tool had and the force of the hand."""
    for i in range(1, len(trial.q), EVERY):
        velocity = (trial.q[i] - trial.q[i - 1]) / trial.dt_s
        yield (
            rehearsal.controller.measure(trial.q[i], velocity),
            HandCommand(trial.force[i].astype(float).copy()),
        )


def _program(
    around: Apparatus, tree: CovarianceTree, state: StepState, command: HandCommand, threshold_mm: float
) -> tuple[Lsi | None, int]:
    """(20)-(21) in one state, and its pairs; None where no motion is desired."""
    weights, robot = around.scene.printed, around.scene.robot
    assert weights is not None
    near = PathPoint(*around.path.closest(state.position))
    request = PrintedPath(around.path, near, weights).request(state, command)
    if not request.constraints or request.scale is None:
        return None, 0
    n = len(robot.joints)
    pairs = tree.pairs_within(state.segments, threshold_mm, group_flat=FLAT_MM)
    wall = boundary(pairs, state.tip, around.settings.kept_mm)
    low, high = state.box
    aim, demand, scale = request.objectives[0], request.constraints[0], request.scale
    near_rows = [weights.near * point_jacobian(state.tip, point) for point in pairs.on_tool]
    E = np.vstack([aim.matrix[:, :n], *near_rows, joint_regularisation(robot).matrix[:, :n]])
    f = np.append(aim.target, np.zeros(len(E) - 6))
    G = np.vstack([demand.matrix[:, :n], wall.matrix[:, :n], np.eye(n), -np.eye(n)])
    h = np.concatenate([demand.bound, wall.bound, high, -low])
    return Lsi(E, f / scale, G, h / scale), len(pairs)


def measured_times(seed: int) -> dict[str, float]:
    """Times on this machine, in the first hands-on trial of a study: the covariance tree's building in s, one program's
    pairs and solution, and a whole certified step of the product, medians in ms. NNLS is here to be counted, not fast.
    """
    key, around = TrialKey(seed, 0, 0, "hands-on"), apparatus()
    trial = run_trial(key, subject_of(key, Fitted.stored().person))
    counted([trial])  # compiles
    rehearsal, steps = Rehearsal(around.scene, around.settings), []
    begin = time.perf_counter()
    CovarianceTree(around.scene.tree.mesh)
    build = time.perf_counter() - begin
    for state, command in _states(rehearsal, trial):
        task = FollowPath(around.path, PathPoint(*around.path.closest(state.position)))
        begin = time.perf_counter()
        rehearsal.controller.step(state, task, command)
        steps.append(time.perf_counter() - begin)
    return {
        "tree_build_s": build,
        "papers_program_ms": 1e3 * float(np.median(counted([trial]).seconds)),
        "product_step_ms": 1e3 * float(np.median(steps)),
    }
