"""Speeds, accelerations and being able to stop, in closed loop and judged by an oracle of its own (HAZ-06, HAZ-11)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.attack.rigid.limits import MotionJudge, braking_way
from tests.engine.scenes import curved_tube, placed_scene, straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.control.admittance import slew_limited
from vfix_engine.worlds.rigid.rehearsal import Command, Rehearsal, RehearsalState
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.teleoperation import Master

SLOW, FAST = ControlSettings(), ControlSettings(dt_s=5e-3)
# Five times the force, five times its effect, and no patience of its own: all that is left are the limits.
WILD = ControlSettings(
    dt_s=5e-3,
    force_cap_n=20.0,
    gain_mm_per_s_per_n=10.0,
    rotation_gain_rad_per_s_per_nmm=5e-3,
    acceleration_mm_per_s2=5000.0,
    turn_acceleration_rad_per_s2=100.0,
)


@pytest.fixture(scope="module")
def tube() -> Scene:
    return placed_scene(*curved_tube())


@dataclass
class ViolentHand:
    """Random episodes, far above the cap: a push, nothing, jumps at every step, reversals, into the nearest bone."""

    scene: Scene
    random: np.random.Generator
    master: bool

    def commands(self, state: Callable[[], RehearsalState]) -> Iterator[Command]:
        while True:
            kind, length = int(self.random.integers(6)), int(self.random.integers(3, 120))
            push, drive, twist = self.random.normal(size=3), 0, int(self.random.integers(-1, 2))
            for i in range(length):
                force = push
                if kind == 0:
                    force = np.zeros(3)
                elif kind == 1:
                    force, drive = push, 1 if i % 40 < 30 else -1
                elif kind == 2:
                    force = self.random.normal(size=3)
                elif kind == 3:
                    force = push * (1 if (i // 7) % 2 else -1)
                elif kind == 4:
                    force = -self.scene.tree.closest(state().tool.segments).normal
                master = Master(force, clutch=kind > 0) if self.master else None
                yield Command(100.0 * force, drive, twist, master)


def violence(
    scene: Scene,
    settings: ControlSettings,
    mode: str,
    steps: int,
    seed: int,
    master: bool = False,
) -> tuple[MotionJudge, float, float]:
    """The judge after ``steps`` steps, the least clearance and the fastest joint as a share of its limit."""
    rehearsal = Rehearsal(scene, settings)
    state = rehearsal.start("free" if scene.path is None else "path")
    if mode != "path":
        state = rehearsal.with_mode(state, mode)
    judge = judge_of(rehearsal)
    hand = ViolentHand(scene, np.random.default_rng(seed), master).commands(lambda: state)
    least, fastest = np.inf, 0.0
    for _ in range(steps):
        before = state
        state, snapshot = rehearsal.step(state, next(hand))
        clearance = (before.tool.clearance, state.tool.clearance)
        judge.judge(before.tool.q, state.tool.q, state.emergencies > before.emergencies, clearance)
        least = min(least, snapshot.clearance_mm)
        fastest = max(fastest, float((np.abs(state.tool.velocity) / scene.robot.speed).max()))
    return judge, least, fastest


def judge_of(rehearsal: Rehearsal) -> MotionJudge:
    """Being able to stop before the margin is judged within the robot's limits.

    Its stages can brake with 1200 mm/s² in every direction. The rows ask for 300, and what they leave out, near copies
    of nearer pairs and the bend of a turn, takes part of the rest: one step in 10⁵ at the defaults.
    """
    robot, settings = rehearsal.scene.robot, rehearsal.settings
    return MotionJudge(
        robot.lower,
        robot.upper,
        robot.speed,
        robot.acceleration,
        settings.dt_s,
        settings.margin_mm,
        float(robot.acceleration[~robot.revolute].min()),
        settings.reach_mm,
    )


@pytest.mark.parametrize("master", [False, True])
@pytest.mark.parametrize("mode", ["path", "free"])
@pytest.mark.parametrize("settings", [SLOW, FAST], ids=["1kHz", "200Hz"])
def test_no_hand_makes_the_robot_exceed_its_limits(
    tube: Scene, settings: ControlSettings, mode: str, master: bool
) -> None:
    """HAZ-06: jumps, reversals and releases; an emergency is exempt, counted and rare: one step in a thousand."""
    judge, least, _ = violence(tube, settings, mode, 1200, seed=7, master=master)
    assert judge.violations == 0, judge.report()
    assert judge.report()["emergency_share"] <= 1e-3
    assert least >= settings.margin_mm


@pytest.mark.parametrize("mode", ["path", "free"])
def test_nor_does_a_hand_without_any_easing(tube: Scene, mode: str) -> None:
    """HAZ-06: twenty times the wanted speed, at accelerations that the joints do not have."""
    judge, least, fastest = violence(tube, WILD, mode, 1500, seed=3)
    assert judge.violations == 0, judge.report()
    assert judge.report()["emergency_share"] <= 0.01
    assert least >= WILD.margin_mm
    assert fastest > 0.2  # the robot was really driven hard


def test_inspection_under_violence_keeps_limits_and_target() -> None:
    """HAZ-06, and ε_t as well: the swing brakes along its own way."""
    scene = straight_scene(wall(25.0))
    start = Rehearsal(scene, FAST).start("free").tool
    ahead = start.tip.position + FAST.view_distance_mm * scene.tool.direction(start.tip.rotation)
    scene = replace(scene, targets=ahead[None], target_names=("ahead",))
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.with_mode(rehearsal.start("free"), "inspect")
    judge = judge_of(rehearsal)
    hand = ViolentHand(scene, np.random.default_rng(1), master=False).commands(lambda: state)
    turned = 0.0
    for _ in range(1200):
        before = state
        state, snapshot = rehearsal.step(state, next(hand))
        judge.judge(before.tool.q, state.tool.q, state.emergencies > before.emergencies)
        assert snapshot.target_error_mm <= FAST.target_tolerance_mm
        turned += float(np.linalg.norm(state.tool.tip.rotation - before.tool.tip.rotation))
    assert judge.violations == 0, judge.report()
    assert judge.report()["emergency_share"] <= 0.005
    assert turned > 0.3


@pytest.mark.parametrize("mode", ["path", "free"])
def test_a_hand_that_lets_go_lets_the_tool_stand_soon(mode: str) -> None:
    """HAZ-11: from full speed within 0.1 s and half a millimetre, and then really still, on the path all the way."""
    scene = straight_scene(wall(90.0), np.array([[0.0, 0, 0], [2, 12, 0], [0, 24, 1], [0, 36, 0]]))
    rehearsal = Rehearsal(scene, SLOW)
    state = rehearsal.start(mode)
    push = Command(np.array([0.0, 5.0, 0.0]))
    for _ in range(400):
        state, snapshot = rehearsal.step(state, push)
    speed = float(np.linalg.norm(state.tool.tip.jacobian[:3] @ state.tool.velocity))
    assert speed == pytest.approx(10.0, rel=0.05)
    left = state.tool.tip.position
    for _ in range(100):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3)))
        if mode == "path":
            assert snapshot.tip_error_mm < 2e-3
    assert not state.tool.velocity.any()
    assert np.linalg.norm(state.tool.tip.position - left) < 0.5
    q = state.tool.q
    for _ in range(5):
        state, _ = rehearsal.step(state, Command(np.zeros(3)))
    assert state.tool.q.tobytes() == q.tobytes()
    assert state.emergencies == 0


def test_the_tool_slows_down_before_a_wall_and_the_end_of_a_path() -> None:
    """Speed over room: √(2 · deceleration · room) at most, and the whole way is used."""
    scene = straight_scene(wall(20.0), np.array([[0.0, 0, 0], [0, 10, 0], [0, 30, 0]]))
    rehearsal = Rehearsal(scene, SLOW)
    state = rehearsal.start()
    rooms, speeds = [], []
    for _ in range(2400):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
        rooms.append(snapshot.clearance_mm - SLOW.margin_mm)
        speeds.append(float(state.tool.tip.jacobian[1] @ state.tool.velocity))
    room, speed = np.array(rooms), np.array(speeds)
    near = room < 2.0
    assert (speed[near] <= np.sqrt(2 * SLOW.approach_deceleration_mm_per_s2 * np.maximum(room[near], 0))).all()
    assert speed.max() == pytest.approx(10.0, rel=0.01)
    assert 0.0 <= room[-1] < 0.02
    assert state.emergencies == 0

    free = replace(scene, tree=straight_scene(wall(90.0)).tree)
    rehearsal = Rehearsal(free, SLOW)
    state = rehearsal.start()
    while state.phase != "done":
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
    for _ in range(50):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
        assert snapshot.tip_error_mm < 1e-3
    assert np.abs(state.tool.velocity).max() < 1e-3  # the hand still pushes, the law still corrects micrometres
    assert state.emergencies == 0


# The judge itself can say no


def recording(judge: MotionJudge, q: np.ndarray, **more: object) -> int:
    judge.again()
    for before, after in pairwise(q):
        judge.judge(before, after, **more)  # type: ignore[arg-type]
    return judge.violations


def test_the_judge_sees_what_is_wrong() -> None:
    def judge() -> MotionJudge:
        one = np.ones(1)
        return MotionJudge(-one, one, 5.0 * one, 100.0 * one, 1e-2, 0.3, 100.0)

    fine = np.cumsum([0.0, 0.01, 0.02, 0.03, 0.03, 0.02, 0.01, 0.0])[:, None]
    assert recording(judge(), fine) == 0
    cases = {
        "acceleration": np.cumsum([0.0, 0.01, 0.0201, 0.0401, 0.03])[:, None],
        "speed": np.cumsum([0.0, 0.01, 0.02, 0.03, 0.04, 0.0501])[:, None],
        "range": np.array([[0.985], [0.995], [1.0001]]),
        "stop in range": np.array([[0.94], [0.95], [0.97], [0.995]]),
    }
    for kind, q in cases.items():
        one = judge()
        assert recording(one, q) > 0, kind
        assert one.counts[kind] > 0, one.counts
    late = judge()
    assert late.judge(np.zeros(1), np.full(1, 0.01), clearance=(0.36, 0.35))
    assert not late.judge(np.full(1, 0.01), np.full(1, 0.03), clearance=(0.35, 0.31))
    assert late.counts == {"stop before the margin": 1}
    exempt = judge()
    assert recording(exempt, np.array([[0.0], [0.03]]), emergency=True) == 0
    assert exempt.report()["emergency_share"] == 1.0


@pytest.mark.parametrize("step", [0.0, 0.004, 0.01, 0.011, 0.0999, 0.1, 0.7])
def test_the_judges_braking_way_is_the_sum(step: float) -> None:
    way, left = 0.0, step - 0.01
    while left > 1e-15:
        way, left = way + left, left - 0.01
    assert braking_way(np.array([step]), np.array([0.01]))[0] == pytest.approx(way, abs=1e-12)


def test_easing_goes_straight_to_the_wish_and_arrives() -> None:
    now, wish = (3.0, 0.0, 0.0), (0.0, 4.0, 0.0)
    after, share = slew_limited(now, wish, 0.5)
    np.testing.assert_allclose(after, [2.7, 0.4, 0.0])
    assert share == pytest.approx(0.1)
    arrived, all_of_it = slew_limited(after, wish, 10.0)
    assert arrived is wish
    assert all_of_it == 1.0
