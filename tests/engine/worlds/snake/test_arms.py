"""The three arms of a snake's hand: manual and guided ones refuse nothing but joint range and speed, and say so."""

import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from lumen_shapes import arc, straight
from snake_runs import AGE, BREATH, hand, run

from vfix_engine.errors import ControlError, InputError
from vfix_engine.pathway.pathway import Pathway, TissueMotion
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import no_command
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.requests import ChooseJoint
from vfix_engine.worlds.snake.row import ARM_CODES
from vfix_engine.worlds.snake.settings import ARMS, Arm, Control, DriveSettings
from vfix_engine.worlds.snake.spec import LumenContours, SnakeSystemSpec
from vfix_engine.worlds.snake.stepping.command import SnakeCommand

DT = 0.02
TUBE = straight(300.0, 15.0)


def driven(arm: Arm, pathway: Pathway = TUBE, control: Control = "parameterised", **more: float) -> SnakeDrive:
    settings = DriveSettings(arm=arm, control=control, vertices_per_link=30, bends=4, bound_mm=4.0, **more)
    return SnakeDrive(SnakeModel(6), pathway, settings, tip_s=170.0)


def pushed(drive: SnakeDrive, right: float, down: float, steps: int) -> float:
    """Push the camera; how far links were beyond their bounds at most, in mm. No joint is faster than it may be."""
    beyond = -np.inf
    for _ in range(steps):
        before = drive.q.copy()
        state = drive.step(SnakeCommand(camera_mm_per_s=(right, down)), DT)
        assert np.abs(drive.q - before).max() <= drive.settings.speed_max * DT * (1.0 + 1e-6)
        assert np.abs(drive.q).max() <= drive.snake.q_max
        beyond = max(beyond, float((state.deviation.depth - state.bound)[state.measured].max()))
    return beyond


@pytest.mark.parametrize("control", ["parameterised", "qp", "view"])
def test_only_the_certified_arm_holds_links_to_their_bounds(control: Control) -> None:
    found = {arm: pushed(driven(arm, control=control, yield_mm_per_s_per_n=0.0), 60.0, 0.0, 60) for arm in ARMS}
    assert found["certified"] <= 0.0
    assert found["manual"] > 0.3
    assert found["guided"] > 0.3


def test_a_manual_hand_turns_one_universal_joint_as_it_moves() -> None:
    """To the right by the second angle, down by the first, and the camera moves as fast as the hand."""
    drive = driven("manual", straight(300.0, 30.0))
    drive.step(SnakeCommand(camera_mm_per_s=(10.0, 0.0)), DT)
    np.testing.assert_allclose(drive.bend, [0.0] * 9 + [10.0 * DT / 34.0], atol=1e-12)
    drive.step(SnakeCommand(camera_mm_per_s=(0.0, 10.0)), DT)
    np.testing.assert_allclose(drive.bend[8:], [-10.0 * DT / 34.0, 10.0 * DT / 34.0], atol=1e-12)
    rest, view = (
        drive.snake.camera(drive.state.q_nominal, drive.state.base),
        drive.snake.camera(drive.q, drive.state.base),
    )
    moved = rest[:3, :3].T @ (view[:3, 3] - rest[:3, 3])
    np.testing.assert_allclose(moved[:2], [10.0 * DT, 10.0 * DT], rtol=1e-3)
    drive.ask(ChooseJoint(2))
    drive.state = drive.driver.state
    drive.step(SnakeCommand(camera_mm_per_s=(10.0, 0.0)), DT)
    np.testing.assert_allclose(drive.bend[7], 10.0 * DT / 62.0, atol=1e-12)
    assert drive.bend[9] == pytest.approx(10.0 * DT / 34.0)  # the other one stays
    assert (drive.bend[:7] == 0.0).all()


def test_a_manual_hand_is_held_by_the_range_of_the_joint_only_and_told() -> None:
    drive = driven("manual")
    pushed(drive, 60.0, 0.0, 100)
    assert drive.state.outcome == "held"
    assert drive.state.held_by == "joint 6 is at the end of its range, ± 45°"
    assert drive.state.limit == "range"
    assert drive.q[-1] == pytest.approx(math.radians(45.0))
    pushed(drive, -60.0, 0.0, 5)
    assert drive.state.outcome in ("moved", "shrunk")


@pytest.mark.parametrize("arm", ["manual", "guided"])
def test_nothing_refuses_the_insertion_of_a_bent_tip(arm: Arm) -> None:
    drive = driven(arm, arc(130.0, 2.2, contours=41, radius=12.0), yield_mm_per_s_per_n=0.0)
    assert pushed(drive, 60.0, 0.0, 60) > 0.0
    began = drive.tip_s
    for _ in range(100):
        state = drive.step(SnakeCommand(insert_mm_per_s=20.0), DT)
        assert state.outcome in ("moved", "shrunk")
        assert state.limit in (None, "speed", "step")
    assert drive.tip_s - began > 10.0
    for _ in range(150):
        drive.step(SnakeCommand(straighten=True), DT)
    assert drive.straight


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("motion", [None, BREATH], ids=["still", "moving"])
def test_a_live_insertion_ends_where_no_link_is_left(arm: Arm, motion: TissueMotion | None) -> None:
    """Five links of 28 mm in a lumen of 300 mm: their base does not follow them into it."""
    fixed = DriveSettings(arm=arm, vertices_per_link=30, bends=4)
    contours = LumenContours(TUBE.centre, TUBE.radius)
    spec = SnakeSystemSpec(contours, SnakeModel(5), drive=fixed, tissue=motion, tip_s=138.0)
    system = spec.build()
    *_, state = run(system, system.start(), [hand(insert=1.0)] * 400)
    assert state.tip_s == 140.0
    assert (state.outcome, state.limit) == ("held", "end")
    assert state.held_by == "all 5 links are inside: the robot is at its full length"
    *_, back = run(system, state, [hand(insert=-1.0)] * 200)
    assert back.tip_s < 139.0


def test_shapes_of_an_insertion_are_planned_for_the_bend_only_where_a_bound_holds_it() -> None:
    """A guided hand's bend may be far beyond its bounds: shapes with it inside are then sought in vain, and slowly."""
    asked = {}
    for arm in ("guided", "certified"):
        fixed = DriveSettings(arm=arm, vertices_per_link=30, control="view", bound_mm=4.0)
        contours = LumenContours(TUBE.centre, TUBE.radius)
        system = SnakeSystemSpec(contours, SnakeModel(8), drive=fixed, tissue=BREATH, tip_s=170.0).build()
        *_, state = run(system, system.start(), [hand(1.0)] * 800)
        *_, last = run(system, state, [hand(insert=1.0)] * AGE)
        bend = last.pose.q - last.pose.shape.q
        assert np.abs(bend).max() > math.radians(3.0)
        wanted = next(w for w in map(system.background, run(system, last, [hand(insert=1.0)] * 40)) if w is not None)
        asked[arm] = wanted.inputs.bend
    assert (asked["guided"] == 0.0).all()
    assert np.abs(asked["certified"]).max() > math.radians(3.0)


def test_a_guided_hand_without_a_device_yields_to_the_force() -> None:
    """Pulled outside and then held with a hundredth of the pull: r falls until hardly a link deviates."""
    drive = driven("guided", yield_mm_per_s_per_n=0.0)
    pushed(drive, 60.0, 0.0, 60)
    before = math.hypot(*drive.state.steering)
    deep = float(drive.state.deviation.depth.max())
    assert deep > 2.0
    assert drive.state.forces.guidance[0] < -0.1  # against the pull
    stiff, yielding = drive.state, replace(drive.state.settings, yield_mm_per_s_per_n=10.0)
    pushed(drive, 0.6, 0.0, 100)
    assert math.hypot(*drive.state.steering) >= before
    drive.state = drive.driver.state = stiff._replace(settings=yielding)
    radii = []
    for _ in range(6):
        pushed(drive, 0.6, 0.0, 50)
        radii.append(math.hypot(*drive.state.steering))
    assert (np.diff([before, *radii]) <= 0.0).all()
    assert radii[-1] < 0.9 * before
    assert drive.state.deviation.depth.max() < 0.5 * deep


def test_snapshots_and_manifests_say_which_arm() -> None:
    contours = LumenContours(TUBE.centre, TUBE.radius)
    for arm in ARMS:
        spec = SnakeSystemSpec(contours, SnakeModel(6), drive=DriveSettings(arm=arm, vertices_per_link=30))
        values, arrays = spec.to_parts()
        again = SnakeSystemSpec.from_parts(values, arrays)
        assert again.drive == spec.drive
        system = again.build()
        state = system.step(system.start(), replace(no_command(), axes=(0.0, 0.0, 1.0)))
        shown = system.snapshot(state)
        assert (shown.arm, shown.certified) == (arm, arm == "certified")
        assert shown.bounds.shape == (6,)
    values["drive"] = {name: value for name, value in asdict(spec.drive).items() if name in ("bends", "control")}
    assert SnakeSystemSpec.from_parts(values, arrays).drive.arm == "certified"  # a run of before


def test_a_joint_is_chosen_in_the_manual_arm_only() -> None:
    manual, certified = driven("manual"), driven("certified")
    with pytest.raises(ControlError, match="manual arm"):
        certified.ask(ChooseJoint(1))
    with pytest.raises(InputError, match="joint"):
        manual.ask(ChooseJoint(3))
    manual.ask(ChooseJoint(2))
    assert manual.state.hand_joint == 2


@pytest.mark.parametrize(
    ("wrong", "word"),
    [({"arm": "free"}, "arm is one of"), ({"arm": "manual", "lock_bend": False}, "lock_bend"),
     ({"yield_mm_per_s_per_n": -1.0}, "yield")],
)  # fmt: skip
def test_settings_that_are_no_arm_are_refused(wrong: dict, word: str) -> None:
    with pytest.raises(InputError, match=word):
        DriveSettings(**wrong)


def test_within_the_bounds_guided_and_certified_arms_make_the_same_motion() -> None:
    """The certificate refuses nothing there and no force leads the hand; a manual hand turns one joint alone."""
    wide = straight(300.0, 30.0)
    ends = {}
    for arm in ARMS:
        drive = driven(arm, wide)
        assert pushed(drive, 40.0, 15.0, 20) < 0.0
        ends[arm] = drive.q
    np.testing.assert_array_equal(ends["guided"], ends["certified"])
    assert np.abs(ends["manual"] - ends["certified"]).max() > math.radians(1.0)


def test_codes_of_arms_in_recorded_rows_stay() -> None:
    assert ARM_CODES.keys() == set(ARMS)
    assert {name: ARM_CODES[name] for name in ("manual", "guided", "certified")} == {
        "manual": 0.0, "guided": 1.0, "certified": 2.0,
    }  # fmt: skip
    assert len(set(ARM_CODES.values())) == len(ARMS)
