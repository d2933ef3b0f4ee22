"""The same control step built from existing libraries: Pinocchio, coal and qpsolvers, combined by numpy.

It is optimised for a fair comparison: shapes and requests are created once, coal uses its faster tree for each query,
array operations are vectorised, the QP is solved by daqp through qpsolvers (its fastest solver for a dense problem of
this size), and nothing is formatted or copied unnecessarily.
It calls none of the engine's compiled code, so that equal steps of both are also a check.
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
_MANY = 1_000_000  # limit of contacts, which all of them stay below
_REGULARISATION = 1e-9


@dataclass(frozen=True, eq=False)
class StackStep:
    """The stack's step for one state and task. seconds: by part, in the order of ``PARTS``."""

    step: Array | None
    clearance: float | None
    pairs: int
    rows: int
    seconds: tuple[float, ...]


class Stack:
    """One robot with one tool and one surface.

    Args:
        coal: the module, see ``report.need("coal")``.
        exact_check: measure the clearance of the predicted pose, as the engine's step reports it, instead of only
            comparing it with the margin.
    """

    def __init__(
        self, coal: ModuleType, mesh: TriangleMesh, robot: PlacedRobot, tool: Tool, settings: ControlSettings,
        exact_check: bool = True,
    ):  # fmt: skip
        self._coal, self._robot, self._radius, self._exact = coal, robot, tool.radius, exact_check
        # coal's fastest tree for each query.
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
        """Take one step from the state's joints and velocity."""
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
        """Return the placements of the capsules for a pose of the tip."""
        centres = self._centres @ rotation.T + position
        return [
            self._coal.Transform3s(rotation @ turn, centre) for turn, centre in zip(self._turns, centres, strict=True)
        ]

    def _box(self, state: StepState) -> tuple[Array, Array]:
        """Return the least and largest joint step (n,), (n,): by speed, acceleration, and stopping within the range."""
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
        """Return the reduced pairs within the threshold, and the number of all pairs."""
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
                # The direction from the surface to the capsule, and the nearest points on both.
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
        """Return the problem of Li 2007, eq. 14-20, scaled by the length of the wanted step."""
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
        """Return the clearance of the predicted pose.

        Without an exact check it is the margin, or None if the margin is not kept.
        """
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
    """Return the longest steps after which a stop within ``room`` is possible if steps differ by at most ``change``."""
    n = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * room / change) - 1.0))
    steps: Array = (room + 0.5 * change * n * (n + 1.0)) / (n + 1.0)
    return steps


def _reduced(pairs: Pairs) -> NDArray[np.int64]:
    """Return the pairs that are not implied by others, nearest first, as ``geometry.pairs``."""
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
