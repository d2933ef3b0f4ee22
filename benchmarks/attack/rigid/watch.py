"""Step-by-step checks of the attack by its judges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.attack.campaign import Tally
from vfix_engine.arrays import Array
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.state import RehearsalState
from vfix_engine.worlds.rigid.system import RigidSystem

from .bodies import Judges
from .exact import furthest
from .oracle import ends

VIOLATION_MM = 1e-3  # a clearance below the margin by more than this is a violation
AGREES = 1e-9  # tolerance of the engine's distance and pose against the judge's, relative to the scale
COAL_AGREES = 1e-6  # the same for coal
FINER = 50  # poses between two steps
NEAR_SHARE = 2.0  # a step is replayed if the remaining room is less than this times its length
ROOM_MM = 0.05  # beyond the margin: the least range in which the judges measure
LAST_BITS = 1e-9  # tolerance of a limit for rounding, relative
REPLAYS_PASSED = 7  # coal measures one of this many replays, until there are enough


@dataclass
class RigidTally(Tally):
    """The findings in one scene of the rigid tool.

    deepest_mm: the largest violation of the required clearance by a pose or the motion to it.
    least_room_mm: the least clearance of a pose above the required one.
    limits_judged: steps that had to keep the joint limits. beyond_limits: of the other steps, those that did not.
    """

    replay_remeasured: int = 0
    emergencies: int = 0
    limits_judged: int = 0
    beyond_limits: int = 0
    episodes: int = 0
    inside_starts: int = 0


class Watch:
    """Judges every step of one episode.

    share: fraction of the steps whose pose coal measures again. replays: number of finer replays measured by coal.
    doing: names of what is used.
    limits: whether the joints' speeds and accelerations have to be kept. Steps that bypass the program and are checked
    only by the certificate need not keep them, and are counted separately. Ranges always have to be kept.
    """

    def __init__(
        self,
        tally: RigidTally,
        judges: Judges,
        system: RigidSystem,
        state: RehearsalState,
        share: float,
        replays: int,
        doing: str,
        limits: bool,
    ):
        self._tally, self._judges, self._system = tally, judges, system
        self._share, self._replays, self._doing, self._limits = share, replays, doing, limits
        self._settings, self._robot = state.settings, system.scene.robot
        self._margins = judges.margins(state.settings.margin_mm)
        self._places = judges.screws.places(state.tool.q)
        self._clear = judges.clearance(self._places, self._margins + ROOM_MM)

    def judge(self, before: RehearsalState, after: RehearsalState) -> None:
        """Judge one step of the engine."""
        tally, q, snapshot = self._tally, after.tool.q, self._system.snapshot(after)
        tally.held += snapshot.held
        if not _all_finite(after, snapshot):
            tally.nan += 1
            tally.fail("not finite", q=q.tolist())
            return
        self._judge_limits(before, after)
        if np.array_equal(before.tool.q, q):
            return
        tally.moved += 1
        places = self._judges.screws.places(q)
        way = furthest(self._places, places)
        caps = self._margins + min(NEAR_SHARE * way, 5.0) + ROOM_MM
        clear = self._judges.clearance(places, caps)
        self._judge_report(after, places, clear, caps)
        floor = np.minimum(self._clear, self._margins[:, None])
        self._found(floor - clear, "pose", before, after)
        tally.least_room_mm = min(tally.least_room_mm, float((clear - floor).min()))
        room = np.minimum(self._clear, clear) - self._margins[:, None]
        if room.min() < NEAR_SHARE * way:
            self._replay(before, after, floor)
        if tally.remeasured < self._share * tally.steps:
            self._ask_coal(places, clear, caps, floor)
            tally.remeasured += 1
        self._places, self._clear = places, clear

    def _found(self, depth: Array, kind: str, before: RehearsalState, after: RehearsalState) -> bool:
        """Return whether a capsule is deeper in a body (B, S) than allowed, and count it."""
        deepest = float(depth.max())
        self._tally.deepest_mm = max(self._tally.deepest_mm, deepest)
        if deepest <= VIOLATION_MM:
            return False
        self._tally.violations += 1
        self._tally.fail(kind, depth_mm=deepest, q=before.tool.q.tolist(), to=after.tool.q.tolist(), mode=after.mode)
        return True

    def _judge_limits(self, before: RehearsalState, after: RehearsalState) -> None:
        """Judge range, speed and acceleration of every joint (HAZ-06); an emergency may exceed the last one."""
        tally, emergency, q = self._tally, after.emergencies > before.emergencies, after.tool.q
        step = q - before.tool.q
        over: Array = np.maximum(self._robot.lower - q, q - self._robot.upper)
        too_fast = self._too_fast(before, after, emergency)
        if self._limits:
            over = np.maximum(over, too_fast)
            tally.limits_judged += 1
            if emergency:
                tally.emergencies += 1
                tally.used[f"emergency: {self._doing}"] += 1
        else:
            tally.beyond_limits += bool((too_fast > 0.0).any())
        if (over > 0.0).any():
            tally.limit_violations += 1
            joint, doing = int(over.argmax()), self._doing
            tally.fail("joint limit", assault=doing, joint=joint, over=float(over.max()), step_of=step.tolist())

    def _too_fast(self, before: RehearsalState, after: RehearsalState, emergency: bool) -> Array:
        """Return by how much (n,) a step exceeds speed and, unless in an emergency, acceleration, in mm or rad."""
        robot, q, dt = self._robot, after.tool.q, self._settings.dt_s
        step = q - before.tool.q
        last = before.tool.velocity * dt
        rounding = 1e-15 * (1.0 + np.abs(q))
        over: Array = np.abs(step) - robot.speed * dt * (1.0 + LAST_BITS) - rounding
        if not emergency:
            change = robot.acceleration * dt * dt
            over = np.maximum(over, np.abs(step - last) - change - LAST_BITS * (change + np.abs(last)) - rounding)
        return over

    def _judge_report(self, after: RehearsalState, places: Array, clear: Array, caps: Array) -> None:
        """Check that the pose and distances reported by the engine are those of the judges."""
        told_up_to = np.minimum(caps, np.maximum(self._settings.reach_mm, self._margins))[:, None]
        told = np.minimum(after.tool.distance, told_up_to)
        # The engine reports the depth in a shape that an axis has entered; the judge only knows that it has entered.
        expected = np.minimum(clear, told_up_to)
        apart = np.abs(told - expected)
        apart[1:][expected[1:] <= -self._judges.screws.radius] = 0.0
        scale = AGREES * self._judges.scale
        moved = furthest(ends(after.tool.segments), places)
        if apart.max() > scale or moved > scale:
            self._tally.disagreements += 1
            self._tally.fail("disagreement", distance_mm=float(apart.max()), pose_mm=moved, q=after.tool.q.tolist())

    def _replay(self, before: RehearsalState, after: RehearsalState, floor: Array) -> None:
        """Check the straight motion between the joints fifty times finer (HAZ-02)."""
        tally, judges = self._tally, self._judges
        tally.replayed += 1
        caps = self._margins + ROOM_MM
        worst = judges.between(before.tool.q, after.tool.q, FINER, caps)
        tally.replay_hits += self._found(floor - worst, "replay", before, after)
        if tally.replay_remeasured < self._replays and tally.replayed % REPLAYS_PASSED == 1:
            q, to = before.tool.q, after.tool.q
            poses = [judges.screws.places(q + k / FINER * (to - q)) for k in range(1, FINER)]
            found = [judges.clearance(p, caps) for p in poses]
            least = int(np.argmin([(c - self._margins[:, None]).min() for c in found]))
            self._ask_coal(poses[least], found[least], caps, floor)
            tally.replay_remeasured += 1

    def _ask_coal(self, places: Array, clear: Array, caps: Array, floor: Array) -> None:
        """Check a pose by coal: not below the floor, and the same distance where it is clear."""
        by_coal = self._judges.by_coal(places)
        if by_coal is None:
            return
        tally = self._tally
        least, keep = clear.min(axis=1), floor.min(axis=1)
        deep = np.where(keep > 0.0, keep - by_coal, 0.0)
        if deep.max() > VIOLATION_MM:
            tally.violations += 1
            tally.deepest_mm = max(tally.deepest_mm, float(deep.max()))
            tally.fail("coal", coal_mm=by_coal.tolist(), ours_mm=least.tolist())
        # In contact coal's distance is not the depth, so only clear poses can be compared.
        apart = np.where(least > 0.0, np.abs(np.minimum(by_coal, caps) - least), 0.0)
        if apart.max() > COAL_AGREES * self._judges.scale:
            tally.disagreements += 1
            tally.fail("coal disagrees", coal_mm=by_coal.tolist(), ours_mm=least.tolist(), places=places.tolist())


def _all_finite(after: RehearsalState, snapshot: RigidSnapshot) -> bool:
    """Return whether all outputs are finite, except for the error to a missing target, which may be NaN."""
    tool = after.tool
    arrays: list[Any] = [tool.q, tool.distance, tool.tip.position, tool.tip.rotation, tool.tip.jacobian]
    arrays += [tool.velocity, snapshot.force, snapshot.torque, snapshot.virtual_point, snapshot.grip]
    numbers = (snapshot.clearance_mm, snapshot.tip_error_mm, snapshot.progress_mm, snapshot.t)
    return all(np.isfinite(a).all() for a in arrays) and bool(np.isfinite(numbers).all())
