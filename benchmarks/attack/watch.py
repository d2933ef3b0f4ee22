"""What the judges find, step by step."""

from __future__ import annotations

import hashlib
from collections import Counter
from dataclasses import dataclass, field, fields
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vfix_engine.control import ControlSettings
from vfix_engine.robots import RobotModel
from vfix_engine.simulation.rehearsal import RehearsalState
from vfix_engine.simulation.scene import Scene
from vfix_engine.simulation.snapshot import Snapshot

from .exact import furthest
from .oracle import Anatomy, Local, Peer, Screws, ends

Array = NDArray[np.float64]

VIOLATION_MM = 1e-3  # deeper than this under the margin is a violation
AGREES = 1e-9  # of the scale: how far the engine's distance and pose may be from the judge's
COAL_AGREES = 1e-6  # of the scale
FINER = 50  # poses between two steps
NEAR_SHARE = 2.0  # a step is replayed where the room left is less than this times its length
FAILURES_KEPT = 5  # of a scene, with what it takes to see them again
REPLAYS_PASSED = 7  # one of so many replays is looked at by coal, until there are enough


@dataclass
class Tally:
    """What was found in one scene; ``failures`` keeps what the first few need to be seen again.

    deepest_mm: how far under what had to be kept a pose, or the way to it, was at worst.
    least_room_mm: how near to it a pose came.
    """

    steps: int = 0
    violations: int = 0
    deepest_mm: float = 0.0
    held: int = 0
    moved: int = 0
    nan: int = 0
    remeasured: int = 0
    replayed: int = 0
    replay_hits: int = 0
    replay_remeasured: int = 0
    emergencies: int = 0
    limit_violations: int = 0
    disagreements: int = 0
    exceptions: int = 0
    episodes: int = 0
    refused_starts: int = 0
    inside_starts: int = 0
    least_room_mm: float = np.inf
    used: Counter[str] = field(default_factory=Counter)
    failures: list[dict[str, Any]] = field(default_factory=list)

    def counts(self) -> dict[str, int]:
        """The integers by name."""
        return {f.name: getattr(self, f.name) for f in fields(self) if isinstance(getattr(self, f.name), int)}

    def fail(self, kind: str, **details: Any) -> None:
        """Keep what a person needs to see this again."""
        if len(self.failures) < FAILURES_KEPT:
            self.failures.append({"kind": kind, "step": self.steps, **details})


class Judges:
    """Everything that measures again in one scene: brute force always, coal where it is asked."""

    def __init__(self, scene: Scene, coal: ModuleType | None):
        self._coal = coal
        self._peer: Peer | None = None
        self.screws = Screws.of(scene.placed_robot(), scene.tool)
        self.anatomy = Anatomy(scene.tree.mesh)
        self.local = Local(self.anatomy, self.screws.radius)
        self.scale = 1.0 + float(np.abs(self.anatomy.corners).max())

    def peer(self) -> Peer | None:
        """coal over the whole mesh, built when first asked for."""
        if self._peer is None and self._coal is not None:
            self._peer = Peer(self._coal, self.anatomy.mesh)
        return self._peer


@dataclass
class Ledger:
    """What a scene's episodes share: the tally, the hash of all joints, and how much coal is asked.

    share: of the steps whose pose coal measures again; replays: finer replays that it looks at.
    """

    tally: Tally
    share: float
    replays: int
    digest: Any = field(default_factory=hashlib.sha256)


class Watch:
    """Judges every step of one episode; ``limits``: whether the joints' speeds have to be kept."""

    def __init__(
        self,
        ledger: Ledger,
        judges: Judges,
        settings: ControlSettings,
        robot: RobotModel,
        state: RehearsalState,
        limits: bool = True,
    ):
        self._ledger, self._tally, self._judges = ledger, ledger.tally, judges
        self._settings, self._robot, self._limits = settings, robot, limits
        self._places = judges.screws.places(state.tool.q)
        self._clear = judges.local.clearance(self._places, settings.margin_mm + 0.05)

    def judge(self, before: RehearsalState, after: RehearsalState, snapshot: Snapshot) -> None:
        """One step that the engine has taken."""
        tally, q = self._tally, after.tool.q
        tally.steps += 1
        tally.held += snapshot.held
        self._ledger.digest.update(q.tobytes())
        if not _all_finite(after, snapshot):
            tally.nan += 1
            tally.fail("not finite", q=q.tolist())
            return
        if self._limits:
            self._judge_limits(before, after)
        if np.array_equal(before.tool.q, q):
            return
        tally.moved += 1
        places = self._judges.screws.places(q)
        way = furthest(self._places, places)
        margin = self._settings.margin_mm
        cap = margin + min(NEAR_SHARE * way, 5.0) + 0.05
        clear = self._judges.local.clearance(places, cap)
        self._judge_report(after, places, clear, cap)
        floor = np.minimum(self._clear, margin)
        self._found(floor - clear, "pose", before, after)
        tally.least_room_mm = min(tally.least_room_mm, float((clear - floor).min()))
        if min(float(self._clear.min()), float(clear.min())) - margin < NEAR_SHARE * way:
            self._replay(before, after, floor)
        if tally.remeasured < self._ledger.share * tally.steps:
            self._ask_coal(places, clear, cap, floor)
            tally.remeasured += 1
        self._places, self._clear = places, clear

    def _found(self, depth: Array, kind: str, before: RehearsalState, after: RehearsalState) -> bool:
        """Whether some capsule is deeper (S,) than it may be; it is counted."""
        deepest = float(depth.max())
        self._tally.deepest_mm = max(self._tally.deepest_mm, deepest)
        if deepest <= VIOLATION_MM:
            return False
        self._tally.violations += 1
        self._tally.fail(kind, depth_mm=deepest, q=before.tool.q.tolist(), to=after.tool.q.tolist(), mode=after.mode)
        return True

    def _judge_limits(self, before: RehearsalState, after: RehearsalState) -> None:
        """HAZ-06: range and speed of every joint."""
        robot, q = self._robot, after.tool.q
        step = np.abs(q - before.tool.q)
        allowed = robot.speed * self._settings.dt_s * (1 + 1e-9) + 1e-12 * np.abs(q)
        if (q < robot.lower).any() or (q > robot.upper).any() or (step > allowed).any():
            self._tally.limit_violations += 1
            over = np.maximum(step - allowed, np.maximum(robot.lower - q, q - robot.upper))
            self._tally.fail("joint limit", joint=int(over.argmax()), over=float(over.max()))

    def _judge_report(self, after: RehearsalState, places: Array, clear: Array, cap: float) -> None:
        """The engine's own pose and distance are the judge's."""
        told = np.minimum(np.atleast_2d(after.tool.distance)[0], cap)
        scale = AGREES * self._judges.scale
        apart = float(np.abs(told - np.minimum(clear, self._settings.reach_mm)).max())
        moved = furthest(ends(after.tool.segments), places)
        if apart > scale or moved > scale:
            self._tally.disagreements += 1
            self._tally.fail("disagreement", distance_mm=apart, pose_mm=moved, q=after.tool.q.tolist())

    def _replay(self, before: RehearsalState, after: RehearsalState, floor: Array) -> None:
        """HAZ-02: fifty times finer on the straight way between the joints."""
        tally, judges = self._tally, self._judges
        tally.replayed += 1
        cap = self._settings.margin_mm + 0.05
        worst = judges.local.between(judges.screws, before.tool.q, after.tool.q, FINER, cap)
        tally.replay_hits += self._found(floor - worst, "replay", before, after)
        if tally.replay_remeasured < self._ledger.replays and tally.replayed % REPLAYS_PASSED == 1:
            q, to = before.tool.q, after.tool.q
            poses = [judges.screws.places(q + k / FINER * (to - q)) for k in range(1, FINER)]
            found = [judges.local.clearance(p, cap) for p in poses]
            least = int(np.argmin([c.min() for c in found]))
            self._ask_coal(poses[least], found[least], cap, floor)
            tally.replay_remeasured += 1

    def _ask_coal(self, places: Array, clear: Array, cap: float, floor: Array) -> None:
        """Another library's word on a pose: not under the floor, and where it is clear, the same distance."""
        peer = self._judges.peer()
        if peer is None:
            return
        tally = self._tally
        by_coal = peer.clearance(places, self._judges.screws.radius)
        least, keep = float(clear.min()), float(floor.min())
        if keep > 0.0 and by_coal < keep - VIOLATION_MM:
            tally.violations += 1
            tally.deepest_mm = max(tally.deepest_mm, keep - by_coal)
            tally.fail("coal", coal_mm=by_coal, ours_mm=least)
        # Where an axis touches, coal's distance is not the depth: only clear poses can be compared.
        if least > 0.0 and abs(min(by_coal, cap) - least) > COAL_AGREES * self._judges.scale:
            tally.disagreements += 1
            tally.fail("coal disagrees", coal_mm=by_coal, ours_mm=least, places=places.tolist())


def _all_finite(after: RehearsalState, snapshot: Snapshot) -> bool:
    """Nothing that goes out is not a number; the error to a target that there is not may be."""
    tool = after.tool
    arrays: list[Any] = [tool.q, tool.distance, tool.tip.position, tool.tip.rotation, tool.tip.jacobian]
    arrays += [tool.velocity, snapshot.force, snapshot.torque, snapshot.virtual_point, snapshot.grip]
    numbers = (snapshot.clearance_mm, snapshot.tip_error_mm, snapshot.progress_mm, snapshot.t)
    return all(np.isfinite(a).all() for a in arrays) and bool(np.isfinite(numbers).all())
