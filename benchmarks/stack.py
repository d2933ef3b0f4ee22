"""The same control step built from what is on the shelf: Pinocchio, coal and qpsolvers, glued in numpy.

It is written to be fast, not to look slow: shapes and requests are made once, coal has the faster of its trees for
either question, what is done to many numbers is done by numpy at once, the QP is daqp's through qpsolvers (the fastest
there for a dense problem of this size), and nothing is formatted or copied for show.
It calls nothing of the engine's compiled code: that both take the same step is a check as well.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import qpsolvers
from numpy.typing import NDArray

from benchmarks.coal_peer import build, turning_z_to
from vfix_engine.arrays import Array
from vfix_engine.control import ControlSettings, StepRequest, StepState
from vfix_engine.control.surroundings import BUFFER_MM
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.pairs import COSINE, MAX_ROWS, RADIUS_MM, Pairs
from vfix_engine.robots import PlacedRobot, TipState, Tool
from vfix_engine.virtual_fixtures.joint_limits import joint_regularisation

PARTS = ("kinematics", "proximity", "rows", "qp", "certificate")
_MANY = 1_000_000  # contacts: all of them
_REGULARISATION = 1e-9


@dataclass(frozen=True, eq=False)
class StackStep:
    """What the stack makes of one state and task; ``seconds``: by part, in the order of ``PARTS``."""

    step: Array | None
    clearance: float | None
    pairs: int
    rows: int
    seconds: tuple[float, ...]


class Stack:
    """One robot with one tool among one surface.

    Args:
        coal: the module, see ``report.need("coal")``.
        exact_check: the predicted pose's clearance is measured, as the engine's step tells it, instead of only being
            compared with the margin.
    """

    def __init__(
        self, coal: ModuleType, mesh: TriangleMesh, robot: PlacedRobot, tool: Tool, settings: ControlSettings,
        exact_check: bool = True,
    ):  # fmt: skip
        self._coal, self._robot, self._radius, self._exact = coal, robot, tool.radius, exact_check
        # coal's fastest trees for either question.
        self._surface, _ = build(coal, mesh, "BVHModelOBB")
        self._measured = build(coal, mesh)[0] if exact_check else None
        self._still = coal.Transform3s.Identity()
        ends = tool.segments(np.eye(3), np.zeros(3))
        self._capsules = [
            coal.Capsule(float(radius), float(np.linalg.norm(end - start)))
            for start, end, radius in zip(ends.start, ends.end, ends.radius, strict=True)
        ]
        # Placements of the capsules, whose axis is z, in the tip frame.
        self._turns = [turning_z_to((e - s) / np.linalg.norm(e - s)) for s, e in zip(ends.start, ends.end, strict=True)]
        self._centres = 0.5 * (ends.start + ends.end)
        self._near, self._close = coal.CollisionRequest(), coal.CollisionRequest()
        self._near.security_margin, self._near.num_max_contacts = settings.reach_mm, _MANY
        self._close.security_margin, self._close.num_max_contacts = settings.margin_mm, 1
        self._close.enable_contact = False
        self._distance = coal.DistanceRequest()
        self._little = joint_regularisation(robot.robot).matrix
        self._keep, self._dt = settings.margin_mm + BUFFER_MM, settings.dt_s
        self._change = settings.approach_deceleration_mm_per_s2 * settings.dt_s**2

    def step(self, state: StepState, task: StepRequest) -> StackStep:
        """One step from the state's joints and velocity."""
        marks = [time.perf_counter()]
        tip = self._robot.tip(state.q)
        places = self._placed(tip.rotation, tip.position)
        low, high = self._box(state)
        marks.append(time.perf_counter())
        pairs, count = self._pairs(places)
        marks.append(time.perf_counter())
        problem = self._problem(task, tip, pairs, low, high)
        marks.append(time.perf_counter())
        solution = qpsolvers.solve_problem(problem, solver="daqp")
        marks.append(time.perf_counter())
        step = solution.x[: len(state.q)] * (task.scale or 0.0) if solution.found and solution.x is not None else None
        clearance = None if step is None else self._check(state.q + step)
        marks.append(time.perf_counter())
        return StackStep(step, clearance, count, len(pairs), tuple(np.diff(marks).tolist()))

    def _placed(self, rotation: Array, position: Array) -> list[Any]:
        """The capsules' placements with the tip there."""
        centres = self._centres @ rotation.T + position
        return [
            self._coal.Transform3s(rotation @ turn, centre) for turn, centre in zip(self._turns, centres, strict=True)
        ]

    def _box(self, state: StepState) -> tuple[Array, Array]:
        """Least and largest joint step (n,), (n,): speed, acceleration, and being able to stop in the range."""
        robot, dt = self._robot.robot, self._dt
        last, change, fastest = state.velocity * dt, robot.acceleration * (dt * dt), robot.speed * dt
        least = -np.minimum(fastest, _stoppable(np.maximum(state.q - robot.lower, 0.0), change))
        most = np.minimum(fastest, _stoppable(np.maximum(robot.upper - state.q, 0.0), change))
        low, high = np.maximum(least, last - change), np.minimum(most, last + change)
        over = low > high
        if over.any():
            low[over] = high[over] = np.where(last - change > most, most, least)[over]
        return low, high

    def _pairs(self, places: list[Any]) -> tuple[Pairs, int]:
        """The reduced pairs within the threshold, and how many there are."""
        coal, count = self._coal, 0
        gaps: list[float] = []
        vectors: list[Array] = []
        segment: list[int] = []
        triangle: list[int] = []
        for s, (capsule, place) in enumerate(zip(self._capsules, places, strict=True)):
            result = coal.CollisionResult()
            coal.collide(self._surface, self._still, capsule, place, self._near, result)
            contacts = result.getContacts()
            count += len(contacts)
            for contact in contacts:
                gaps.append(contact.penetration_depth)
                # From the surface to the capsule; the point on the surface, and that on the capsule's.
                vectors += (contact.normal, contact.getNearestPoint1(), contact.getNearestPoint2())
                triangle.append(contact.b1)
            segment += [s] * len(contacts)
        parts, table = np.array(segment, dtype=np.int32), np.array(vectors, dtype=float).reshape(-1, 3, 3)
        normal = table[:, 0].copy()
        on_tool = table[:, 2] + self._radius[parts][:, None] * normal
        every = Pairs(
            np.array(gaps, dtype=float), normal, on_tool, table[:, 1].copy(), parts, np.array(triangle, dtype=np.int32)
        )
        return every.take(_reduced(every)), count

    def _problem(self, task: StepRequest, tip: TipState, pairs: Pairs, low: Array, high: Array) -> qpsolvers.Problem:
        """Li 2007, eq. 14-20 in numpy, scaled by the length of the wanted step."""
        n, scale = len(low), task.scale or 0.0
        column = np.append(np.ones(n), 1.0 / scale)
        matrix = np.concatenate([np.sqrt(o.weight) * o.matrix for o in task.objectives] + [self._little]) * column
        target = np.concatenate([np.sqrt(o.weight) * o.target for o in task.objectives] + [np.zeros(n)]) / scale
        lever = pairs.on_tool - tip.position
        linear = pairs.normal @ tip.jacobian[:3] + np.cross(lever, pairs.normal) @ tip.jacobian[3:]
        rows = np.concatenate(
            [c.matrix for c in task.constraints] + [np.column_stack([-linear, np.zeros(len(linear))])]
        )
        room = pairs.distance - self._keep
        approach = np.where(
            room >= 0.0, _stoppable(np.maximum(room, 0.0), self._change), np.maximum(room, -self._change)
        )
        bound = np.concatenate([c.bound for c in task.constraints] + [approach])
        return qpsolvers.Problem(
            matrix.T @ matrix + _REGULARISATION * np.eye(n + 1),
            -(matrix.T @ target),
            rows * column,
            bound / scale,
            lb=np.append(low / scale, 0.0),
            ub=np.append(high / scale, 1.0),
        )

    def _check(self, q: Array) -> float | None:
        """Clearance of the predicted pose; of a mere comparison the margin, or None where it is not kept."""
        places = self._placed(*self._robot.tip_pose(q))
        coal, least = self._coal, np.inf
        for capsule, place in zip(self._capsules, places, strict=True):
            if self._exact:
                result = coal.DistanceResult()
                least = min(least, coal.distance(self._measured, self._still, capsule, place, self._distance, result))
            elif coal.collide(self._surface, self._still, capsule, place, self._close, coal.CollisionResult()):
                return None
        return float(least) if self._exact else float(self._close.security_margin)


def _stoppable(room: Array, change: Array | float) -> Array:
    """The longest steps after which a stop within ``room`` is possible when a step differs by ``change`` at most."""
    n = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * room / change) - 1.0))
    steps: Array = (room + 0.5 * change * n * (n + 1.0)) / (n + 1.0)
    return steps


def _reduced(pairs: Pairs) -> NDArray[np.int64]:
    """The pairs that say something of their own, nearest first, in the sense of ``geometry.pairs``."""
    kept: list[int] = []
    waiting = np.argsort(pairs.distance, kind="stable")
    while len(waiting) and len(kept) < MAX_ROWS:
        best = waiting[0]
        kept.append(int(best))
        apart = pairs.on_tool[waiting] - pairs.on_tool[best]
        same = (
            (pairs.segment[waiting] == pairs.segment[best])
            & (pairs.normal[waiting] @ pairs.normal[best] >= COSINE)
            & (np.einsum("ij,ij->i", apart, apart) <= RADIUS_MM**2)
        )
        same[0] = True
        waiting = waiting[~same]
    return np.array(kept, dtype=np.int64)
