"""Teleoperation in closed loop: a master in path following, free motion and inspection (Li 2007, section V.F)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.geometry.rotations import rotation_vector
from vfix_engine.runtime.command import COMMAND_SIZE, command_from_row
from vfix_engine.runtime.control_mode import Control, Device
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.rehearsal import Command, Rehearsal, RehearsalState
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.teleoperation import Master, advance_leader, consume_motion, spring

SETTINGS = ControlSettings(dt_s=2e-3)
CURVE = np.array([[0.0, 0, 0], [2, 12, 0], [0, 24, 1], [0, 36, 0]])
NO_FORCE = np.zeros(3)


def lead(
    rehearsal: Rehearsal, state: RehearsalState, increment: np.ndarray, steps: int, clutch: bool = True
) -> tuple[RehearsalState, list[RigidSnapshot]]:
    kept = []
    for _ in range(steps):
        state, snapshot = rehearsal.step(state, Command(NO_FORCE, master=Master(increment, clutch)))
        kept.append(snapshot)
    return state, kept


def rest(rehearsal: Rehearsal, state: RehearsalState, steps: int = 1500) -> tuple[RehearsalState, list[RigidSnapshot]]:
    """The master is held where it is."""
    return lead(rehearsal, state, np.zeros(3), steps)


def free_scene(distance: float = 90.0) -> Scene:
    return straight_scene(wall(distance))


@pytest.mark.parametrize("scale", [0.2, 1.0])
def test_in_free_motion_the_tip_goes_where_the_master_goes(scale: float) -> None:
    """Scaled, in every direction, without turning, and it stops where the master has stopped."""
    rehearsal = Rehearsal(free_scene(), replace(SETTINGS, master_scale=scale))
    state = rehearsal.start("free")
    start, rotation = state.tool.tip.position, state.tool.tip.rotation
    way = np.array([3.0, 2.0, -1.0])
    state, _ = lead(rehearsal, state, way / 1000, 1000)
    state, kept = rest(rehearsal, state)
    np.testing.assert_allclose(state.tool.tip.position - start, scale * way, atol=1e-3)
    np.testing.assert_allclose(state.tool.tip.rotation, rotation, atol=1e-4)
    assert not state.tool.velocity.any()
    assert np.linalg.norm(kept[-1].reflection) < 0.01
    assert all(s.teleoperated for s in kept)
    assert state.emergencies == 0


def test_on_a_path_the_master_only_chooses_how_far() -> None:
    """τ in f's place in (10)-(11): the tip stays on the path, and across it the master feels the spring."""
    scene = straight_scene(wall(90.0), CURVE)
    rehearsal = Rehearsal(scene, SETTINGS)
    state = rehearsal.start("path")
    along = np.array([0.0, 0.02, 0.0])
    state, kept = lead(rehearsal, state, along, 1000)
    assert max(s.tip_error_mm for s in kept) < 0.003
    assert kept[-1].progress_mm == pytest.approx(SETTINGS.master_scale * 20.0, abs=1.5)
    state, kept = rest(rehearsal, state)
    # Where the path bends away from the master's straight way, the lag across it takes a share of what is bounded.
    assert kept[-1].progress_mm == pytest.approx(SETTINGS.master_scale * 20.0, abs=1.0)
    assert not state.tool.velocity.any()

    stood = state.tool.tip.position
    state, kept = lead(rehearsal, state, np.array([0.05, 0.0, 0.0]), 400)
    assert kept[-1].tip_error_mm < 0.003
    assert np.linalg.norm(state.tool.tip.position - stood) < 0.5  # only what of x is along the path
    assert kept[-1].reflection[0] == pytest.approx(-SETTINGS.force_cap_n, rel=0.1)
    assert max(np.linalg.norm(s.reflection) for s in kept) <= SETTINGS.force_cap_n * (1 + 1e-12)
    state, kept = lead(rehearsal, state, -along, 600)
    assert kept[-1].progress_mm < SETTINGS.master_scale * 20.0 - 3.0  # and back again
    assert max(s.tip_error_mm for s in kept) < 0.003


def test_a_tip_off_its_path_is_guided_by_as_much_as_the_master_moves() -> None:
    """The approach: whatever the master's direction, the length of its motion counts, and a still master ends it."""
    scene = straight_scene(wall(90.0), np.array([[6.0, 5, 0], [6, 20, 0], [6, 40, 0]]))
    rehearsal = Rehearsal(scene, SETTINGS)
    state = rehearsal.start("path")
    assert state.phase == "approach"
    before = rehearsal.snapshot(state).tip_error_mm
    state, _ = lead(rehearsal, state, np.array([0.0, 0.0, 0.01]), 400)
    state, kept = rest(rehearsal, state)
    assert before - kept[-1].tip_error_mm == pytest.approx(SETTINGS.master_scale * 4.0, abs=0.02)
    assert not state.tool.velocity.any()
    assert state.phase == "approach"
    state, kept = lead(rehearsal, state, np.array([0.0, 0.02, 0.0]), 1500)
    assert kept[-1].phase == "follow"


def test_inspection_by_a_master() -> None:
    """It brings the view onto the target, then its motion swings the grip about it (24)."""
    scene = free_scene()
    start = Rehearsal(scene, SETTINGS).start("free").tool
    ahead = start.tip.position + SETTINGS.view_distance_mm * scene.tool.direction(start.tip.rotation)
    scene = replace(scene, targets=ahead[None] + [1.5, 1.0, 0.0], target_names=("there",))
    rehearsal = Rehearsal(scene, SETTINGS)
    state = rehearsal.with_mode(rehearsal.start("free"), "inspect")
    state, kept = lead(rehearsal, state, np.array([0.01, 0.0, 0.0]), 1200)
    assert kept[-1].phase == "inspect_hold"
    grip = kept[-1].grip
    state, kept = lead(rehearsal, state, np.array([0.0, 0.0, 0.02]), 1000)
    assert all(s.phase == "inspect_hold" for s in kept)
    assert max(s.target_error_mm for s in kept) <= SETTINGS.target_tolerance_mm
    state, kept = rest(rehearsal, state)
    assert (kept[-1].grip - grip)[2] == pytest.approx(SETTINGS.master_scale * 20.0, rel=0.1)
    assert not state.tool.velocity.any()
    assert state.emergencies == 0


def test_an_open_clutch_leaves_the_tool_where_it_is() -> None:
    rehearsal = Rehearsal(free_scene(), SETTINGS)
    state, _ = lead(rehearsal, rehearsal.start("free"), np.array([0.02, 0, 0]), 200)
    state, _ = lead(rehearsal, state, np.array([0.02, 0, 0]), 50, clutch=False)
    stood = state.tool.tip.position
    assert not state.tool.velocity.any()
    state, kept = lead(rehearsal, state, np.array([-0.5, 0.3, 0.1]), 100, clutch=False)
    np.testing.assert_array_equal(state.tool.tip.position, stood)
    assert not kept[-1].reflection.any()
    state, _ = lead(rehearsal, state, np.array([0.0, 0.01, 0.0]), 200)  # taken up again from there
    state, _ = rest(rehearsal, state)
    np.testing.assert_allclose(state.tool.tip.position - stood, [0, SETTINGS.master_scale * 2.0, 0], atol=1e-3)


def test_bone_stops_the_tool_and_the_master_feels_it() -> None:
    """HAZ-01: bounded force, nothing wound up: a master that turns round takes the tool along after its own lag."""
    rehearsal = Rehearsal(free_scene(8.0), SETTINGS)
    state, kept = lead(rehearsal, rehearsal.start("free"), np.array([0.0, 0.02, 0.0]), 2500)
    assert kept[-1].clearance_mm == pytest.approx(SETTINGS.margin_mm, abs=0.05)
    assert min(s.clearance_mm for s in kept) >= SETTINGS.margin_mm
    assert kept[-1].reflection[1] == pytest.approx(-SETTINGS.force_cap_n, rel=0.02)
    most = SETTINGS.force_cap_n / SETTINGS.master_stiffness_n_per_mm
    back = int(most / (SETTINGS.master_scale * 0.02)) + 100
    at_the_wall = kept[-1].clearance_mm
    state, kept = lead(rehearsal, state, np.array([0.0, -0.02, 0.0]), back)
    assert kept[-1].clearance_mm > at_the_wall + 0.3


@pytest.mark.parametrize("wrong", [[np.nan, 0, 0], [np.inf, 0, 0], [0, -1e9, 0], [0, 0]])
def test_nonsense_from_the_master_moves_nothing(wrong: list[float]) -> None:
    """HAZ-05."""
    rehearsal = Rehearsal(free_scene(), SETTINGS)
    start = rehearsal.start("free")
    state, kept = lead(rehearsal, start, np.array(wrong), 3)
    np.testing.assert_array_equal(state.tool.q, start.tool.q)
    assert np.isfinite(kept[-1].reflection).all()


def test_a_hand_on_the_grip_is_no_master() -> None:
    rehearsal = Rehearsal(free_scene(), SETTINGS)
    state, _ = lead(rehearsal, rehearsal.start("free"), np.array([0.1, 0, 0]), 20)
    assert state.lag.any()
    state, snapshot = rehearsal.step(state, Command(np.array([0.0, 1.0, 0.0])))
    assert not state.lag.any()
    assert not snapshot.teleoperated
    assert not snapshot.reflection.any()


def test_the_lag_is_bounded_and_used_up() -> None:
    lag = np.zeros(3)
    for _ in range(1000):
        lag = advance_leader(lag, Master(np.array([1.0, 2.0, 0.0])), SETTINGS)
        assert np.linalg.norm(spring(lag, SETTINGS)) <= SETTINGS.force_cap_n * (1 + 1e-12)
    tool = np.array([0.4, 0.1, 0])
    np.testing.assert_allclose(consume_motion(np.array([1.0, 0, 0]), tool, guided=False), [0.6, -0.1, 0])
    np.testing.assert_allclose(consume_motion(np.array([0.0, 0, 2]), np.array([0.5, 0, 0]), guided=True), [0, 0, 1.5])
    np.testing.assert_allclose(consume_motion(np.array([0.0, 0, 2]), np.array([3.0, 0, 0]), guided=True), 0.0)


def rate(force: list[float], turns: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Command:
    return Command(np.array(force), axes=turns, rate=True)


def drive(rehearsal: Rehearsal, state: RehearsalState, command: Command, steps: int) -> list[RehearsalState]:
    kept = [state]
    for _ in range(steps):
        kept.append(rehearsal.step(kept[-1], command)[0])
    return kept[1:]


def test_a_rate_device_held_still_moves_on_and_a_master_held_still_stands() -> None:
    """τ in f's place: a constant deflection is a constant speed, of a master a place."""
    rehearsal = Rehearsal(straight_scene(wall(90.0), np.array([[0.0, 0, 0], [0, 20, 0], [0, 40, 0]])), SETTINGS)
    kept = drive(rehearsal, rehearsal.start("path"), rate([0.0, 2.0, 0.0]), 1000)
    progress = np.array([state.tool.tip.position[1] for state in kept])
    speed = np.diff(progress[500:]) / SETTINGS.dt_s
    assert np.ptp(speed) < 1e-3 * speed.mean()
    assert speed.mean() == pytest.approx(SETTINGS.gain_mm_per_s_per_n * 2.0, rel=0.01)
    snapshot = rehearsal.step(kept[-1], rate([0.0, 2.0, 0.0]))[1]
    assert snapshot.teleoperated
    assert not snapshot.forces.any(), "a rate device has springs of its own"

    state, _ = lead(rehearsal, rehearsal.start("path"), np.array([0.0, 0.02, 0.0]), 400)
    state, _ = rest(rehearsal, state)
    stood = state.tool.tip.position
    state, _ = rest(rehearsal, state)
    np.testing.assert_array_equal(state.tool.tip.position, stood)


def test_a_rate_device_moves_the_tip_and_turns_about_it() -> None:
    """In free motion its translations do not turn the tool, unlike a force on the grip, and its rotations do."""
    rehearsal = Rehearsal(free_scene(), SETTINGS)
    start = rehearsal.start("free")
    pushed = drive(rehearsal, start, rate([2.0, 0.0, 0.0]), 200)[-1]
    assert pushed.tool.tip.position[0] > start.tool.tip.position[0] + 0.5
    np.testing.assert_allclose(pushed.tool.tip.rotation, start.tool.tip.rotation, atol=1e-4)
    by_hand = drive(rehearsal, start, Command(np.array([2.0, 0.0, 0.0])), 200)[-1]
    assert np.abs(by_hand.tool.tip.rotation - start.tool.tip.rotation).max() > 1e-2
    for axis in range(3):
        turns = [0.0, 0.0, 0.0]
        turns[axis] = 0.5
        turned = drive(rehearsal, start, rate([0.0, 0.0, 0.0], (turns[0], turns[1], turns[2])), 200)[-1]
        angle = rotation_vector(turned.tool.tip.rotation @ start.tool.tip.rotation.T)
        assert angle[axis] > 0.02
        np.testing.assert_allclose(np.delete(angle, axis), 0.0, atol=1e-4)
        np.testing.assert_allclose(turned.tool.tip.position, start.tool.tip.position, atol=1e-3)


def test_in_inspection_a_rate_device_swings_the_tool_about_its_target() -> None:
    """k·τ of (24) without a lever of the hand: by translations of the grip, and by its rotations."""
    scene = free_scene()
    start = Rehearsal(scene, SETTINGS).start("free").tool
    ahead = start.tip.position + SETTINGS.view_distance_mm * scene.tool.direction(start.tip.rotation)
    scene = replace(scene, targets=ahead[None], target_names=("there",))
    rehearsal = Rehearsal(scene, SETTINGS)
    state = rehearsal.with_mode(rehearsal.start("free"), "inspect")
    for command in (rate([0.0, 0.0, 1.0]), rate([0.0, 0.0, 0.0], (0.5, 0.0, 0.0))):
        kept = drive(rehearsal, state, command, 300)
        assert all(one.phase == "inspect_hold" for one in kept)
        assert rehearsal.snapshot(kept[-1]).target_error_mm <= SETTINGS.target_tolerance_mm
        assert np.abs(kept[-1].tool.tip.rotation - state.tool.tip.rotation).max() > 1e-2


@pytest.mark.parametrize("device", ["position", "rate"])
def test_the_scripted_operator_follows_a_path_and_inspects_at_either_device(device: Device) -> None:
    """HAZ-13: its run is replayed to the last bit."""
    path = np.array([[0.0, 0, 0], [1, 6, 0], [0, 12, 0]])
    scene = straight_scene(wall(90.0), path)
    start = Rehearsal(scene, SETTINGS).start("path").tool
    ahead = start.tip.position + SETTINGS.view_distance_mm * scene.tool.direction(start.tip.rotation)
    scene = replace(scene, targets=ahead[None] + [1.0, 4.0, 0.5], target_names=("there",))
    log = Rows()
    run = HeadlessRun(Rehearsal(scene, SETTINGS), lambda _: None, log, control=Control("teleoperated", device))
    last = run.follow()
    assert (last.phase, last.teleoperated) == ("done", True)
    assert float(np.mean(run.tally.errors)) < 0.003
    reached = run.inspect(0, 300)
    assert reached["reached"]
    assert reached["error_mm"]["max"] <= SETTINGS.target_tolerance_mm
    assert reached["swing_deg"] > 0.5
    commands = [command_from_row(line) for line in log.lines]
    assert {command.rate for command in commands} == {device == "rate"}
    assert {command.master is None for command in commands} == {device == "rate"}
    state = Rehearsal(scene, SETTINGS).start("path")
    again = Rehearsal(scene, SETTINGS)
    for command, line in zip(commands[:500], log.lines[:500], strict=True):
        state = again.system.step(state, command)
        row = np.zeros(len(again.system.row_layout))
        again.system.row(state, row)
        np.testing.assert_array_equal(row, line[COMMAND_SIZE:])


class Rows:
    """A log that keeps the rows."""

    def __init__(self) -> None:
        self.lines: list[np.ndarray] = []

    def tick(self, line: np.ndarray) -> None:
        self.lines.append(line.copy())

    def event(self, kind: str, content: object) -> None:
        pass
