"""Step-by-step checks of the attack by its judge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from benchmarks.attack.campaign import Tally
from vfix_engine.arrays import Array, BoolArray, IntArray
from vfix_engine.pathway.limits.limits import MOTION_TOLERANCE_MM, Configuration, LinksAt, MotionVerdict
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.runtime.system import Certificate
from vfix_engine.worlds.snake.offline.script import ScriptSystem
from vfix_engine.worlds.snake.stepping.state import SnakeState

from .judge import Judge, bounds_by_place, turned

AGREES_MM = 1e-9  # tolerance of the engine's depths against the judge's, and of promised depths
SAME = 1e-12  # [rad] tolerance between the end of a motion and the start of the next one
FINER = 50  # poses of a replay
NEAR_MM = 0.5  # steps nearer than this to a bound are replayed five times as often
TISSUE_EVERY = 10  # steps in moving tissue between queries of its true position
LONG_S, RECOVERS_S = 0.03, 2.0  # [s] a step in which tissue moves unobserved, and how long a robot may take to follow


class Motion(NamedTuple):
    """What the certificate took: links from ``first`` on, against what, from where to where.

    windows, measured: of those links.
    """

    first: int
    packed: PackedPathway
    windows: IntArray
    measured: BoolArray
    before: Configuration
    after: Configuration


@dataclass
class SnakeTally(Tally):
    """The findings in one scene of the snake.

    violations: links beyond what is promised at a configuration that a step ended in, on the way to it, or moved there
    by no motion that the certificate took. deepest_mm: beyond that, at configurations; way_mm: beyond b_i on the way,
    where 0.05 is promised. outrun: configurations with a link deeper than b_i that the tissue's own motion brought
    there, outrun_mm: how much; outrun_in_time: without a step of more than 30 ms in the last two seconds.
    tissue_mm: beyond b_i against the tissue as it was at the very end of the step.
    """

    way_mm: float = 0.0
    shrunk: int = 0
    inserted: int = 0
    replayed_insertions: int = 0
    replayed_in_moving_tissue: int = 0
    refused_commands: int = 0
    outrun: int = 0
    outrun_in_time: int = 0
    outrun_mm: float = 0.0
    tissue_mm: float = 0.0


class _Witness:
    """Wraps a certificate and records the motions that it accepts."""

    def __init__(self, limits: Certificate[LinksAt, Configuration, MotionVerdict], first: int, taken: list[Motion]):
        self._limits, self._first, self._taken = limits, first, taken

    def certify(self, state: LinksAt, motion: Configuration) -> MotionVerdict:
        """Return the certificate's verdict."""
        verdict = self._limits.certify(state, motion)
        if verdict.taken:
            packed, windows, before, bound, _ = state
            assert bound is not None
            self._taken.append(Motion(self._first, packed, windows, np.isfinite(bound), before, motion))
        return verdict


class Watch:
    """Judges every step of one episode."""

    def __init__(self, tally: SnakeTally, system: ScriptSystem, doing: str, replays: float, seed: int):
        self._tally, self._doing, self._replays = tally, doing, replays
        given, state = system.constants, system.start()
        self._snake, self._pathway, self._settings = given.snake, given.pathway, state.settings
        self._random = np.random.default_rng(seed)
        self._judge = Judge(given.snake, given.query.vertices)
        self._taken: list[Motion] = []
        limits = _Witness(given.limits, 0, self._taken)
        distal = _Witness(given.distal_limits, given.first, self._taken)
        system.constants = replace(given, limits=limits, distal_limits=distal)
        self._windows, self._measured = state.windows, state.measured
        self._q, self._base, self._tip = state.q.copy(), state.base.copy(), state.tip_s
        self._rushed = -np.inf
        self._asked, self._found = b"", np.empty(0)  # windows that bounds were asked of last, and those bounds

    def judge(self, before: SnakeState, state: SnakeState) -> None:
        """Judge one step of the engine."""
        tally, dt, motions = self._tally, state.period_s, [self._of_all_links(one) for one in self._taken]
        self._taken.clear()
        self._windows, self._measured = state.windows, state.measured
        tally.held += state.outcome == "held"
        tally.shrunk += state.outcome == "shrunk"
        tally.refused_commands += state.refused_commands - before.refused_commands
        if not (
            np.isfinite(state.q).all() and np.isfinite(state.base).all() and np.isfinite(state.deviation.depth).all()
        ):
            tally.nan += 1
            tally.fail("not finite", doing=self._doing, q=state.q.tolist())
            return
        self._judge_joints(state, dt)
        self._rushed = state.t if dt > LONG_S else self._rushed
        poses = self._chain(state, motions)
        moved = not (np.array_equal(self._q, state.q) and np.array_equal(self._base, state.base))
        tally.moved += moved
        tally.inserted += state.tip_s != self._tip
        depth = self._judge_end(state, motions, poses)
        if motions and self._random.random() < self._replays * self._haste(depth, state):
            self._replay(motions, poses, state.tip_s != self._tip)
        if self._pathway.motion is not None and tally.steps % TISSUE_EVERY == 0:
            now = self._pathway.packed(state.t)
            over = self._depth(now, state.windows, state.measured, state.q, state.base) - self._bound(state.windows)
            tally.tissue_mm = max(tally.tissue_mm, float(over[state.measured].max(initial=0.0)))
        self._q, self._base, self._tip = state.q.copy(), state.base.copy(), state.tip_s

    def _of_all_links(self, motion: Motion) -> Motion:
        """With windows and links that count of the whole robot, of which the first ones may be those of before."""
        if motion.first:
            windows = np.concatenate([self._windows[: motion.first], motion.windows])
            return motion._replace(windows=windows, measured=self._measured)
        self._windows, self._measured = motion.windows, motion.measured
        return motion

    def _depth(self, packed: PackedPathway, windows: IntArray, asked: BoolArray, q: Array, base: Array) -> Array:
        return self._judge.depth(packed, windows, asked, q, base)

    def _bound(self, windows: IntArray) -> Array:
        """Return b_i (L,) of links with those windows, by the judge."""
        key = windows.tobytes()
        if key != self._asked:
            self._asked = key
            self._found = bounds_by_place(self._pathway, self._settings, windows)
        return self._found

    def _haste(self, depth: Array, state: SnakeState) -> float:
        near = depth[state.measured] > self._bound(state.windows)[state.measured] - NEAR_MM
        return 5.0 if near.any() else 1.0

    def _judge_joints(self, state: SnakeState, dt: float) -> None:
        """Judge range and speed of every joint (HAZ-06)."""
        q_max, most = self._snake.q_max, self._settings.speed_max * dt
        over = max(float(np.abs(state.q).max()) - q_max, float(np.abs(state.q - self._q).max()) - most * (1.0 + 1e-9))
        if over > 1e-15:
            self._tally.limit_violations += 1
            self._tally.fail("joint limit", doing=self._doing, over=over, dt=dt)

    def _chain(self, state: SnakeState, motions: list[Motion]) -> list[tuple[Array, Array, Array, Array]]:
        """Return each motion as joints and base of the whole robot before and after, without gaps between states."""
        q, base, apart = self._q, self._base, 0.0
        poses = []
        for one in motions:
            if one.first:
                hangs = self._judge.frames(q, base)[one.first - 1]
                off = [q[2 * one.first :] - one.before.q, hangs - one.before.base, hangs - one.after.base]
                q_end, base_end = np.concatenate([q[: 2 * one.first], one.after.q]), base
            else:
                off = [q - one.before.q, base - one.before.base]
                q_end, base_end = one.after.q, one.after.base
            apart = max([apart, *(float(np.abs(each).max()) for each in off)])
            poses.append((q, base, q_end, base_end))
            q, base = q_end, base_end
        apart = max(apart, float(np.abs(state.q - q).max()), float(np.abs(state.base - base).max()))
        if apart > AGREES_MM:
            self._tally.violations += 1
            self._tally.fail("moved without a verdict", doing=self._doing, apart=apart)
        return poses

    def _judge_end(
        self, state: SnakeState, motions: list[Motion], poses: list[tuple[Array, Array, Array, Array]]
    ) -> Array:
        """Judge the configuration at the end of the step."""
        tally, bound, asked = self._tally, self._bound(state.windows), state.measured
        depth = self._depth(state.packed, state.windows, asked, state.q, state.base)
        tally.remeasured += 1
        apart = float(np.abs(depth - state.deviation.depth)[asked].max(initial=0.0))
        apart = max(apart, float(np.abs(bound - state.bound).max()))  # the bounds that the engine went by, too
        if apart > AGREES_MM:
            tally.disagreements += 1
            tally.fail("disagreement", doing=self._doing, apart_mm=apart)
        over = np.where(asked, depth - bound, -np.inf)
        tally.least_room_mm = min(tally.least_room_mm, abs(float(over.max())))
        if over.max() <= AGREES_MM:
            return depth
        if self._pathway.motion is None:
            self._promise(over, "configuration")
            return depth
        tally.outrun += 1
        tally.outrun_in_time += state.t > self._rushed + RECOVERS_S
        tally.outrun_mm = max(tally.outrun_mm, float(over.max()))
        for one, (q, base, q_end, base_end) in zip(motions, poses, strict=True):
            before = self._depth(one.packed, one.windows, one.measured, q, base)
            after = self._depth(one.packed, one.windows, one.measured, q_end, base_end)
            self._promise(after - np.maximum(self._bound(one.windows), before), "configuration")
        return depth

    def _promise(self, over: Array, kind: str) -> bool:
        """Return whether a link is deeper than promised, and count it."""
        most = float(over.max())
        self._tally.deepest_mm = max(self._tally.deepest_mm, most if kind == "configuration" else 0.0)
        if most <= AGREES_MM:
            return False
        self._tally.violations += 1
        self._tally.fail(kind, doing=self._doing, link=int(over.argmax()) + 1, over_mm=most)
        return True

    def _replay(self, motions: list[Motion], poses: list[tuple[Array, Array, Array, Array]], inserted: bool) -> None:
        """Check the accepted motion fifty times finer: joints on a straight line, the base by one rotation."""
        tally = self._tally
        tally.replayed += 1
        tally.replayed_insertions += inserted
        tally.replayed_in_moving_tissue += self._pathway.motion is not None
        worst = -np.inf
        for one, (q, base, q_end, base_end) in zip(motions, poses, strict=True):
            asked, limit = one.measured, self._bound(one.windows)
            if self._pathway.motion is not None:
                limit = np.maximum(limit, self._depth(one.packed, one.windows, asked, q, base))
            for share in np.linspace(0.0, 1.0, FINER + 1)[1:]:
                here = turned(base, base_end, share)
                depth = self._depth(one.packed, one.windows, asked, q + share * (q_end - q), here)
                worst = max(worst, float((depth - limit)[asked].max(initial=-np.inf)))
        tally.way_mm = max(tally.way_mm, worst)
        tally.replay_hits += self._promise(np.array([worst - MOTION_TOLERANCE_MM]), "way")
