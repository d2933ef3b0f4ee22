"""A bent tip is inserted and drawn back with its bend, which stays relative to the pathway."""

import math
from dataclasses import asdict

import numpy as np
import pytest
from lumen_shapes import arc, straight

from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime import Command, Driver, InlineWorker
from vfix_engine.runtime.requests import Straighten
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.settings import Control, DriveSettings, SnakeSettings
from vfix_engine.worlds.snake.spec import LumenContours, SnakeSystemSpec
from vfix_engine.worlds.snake.stepping.command import SnakeCommand

CONTROLS: tuple[Control, ...] = ("parameterised", "view")


def bent(pathway: Pathway, control: Control, tip_s: float, angle: float) -> SnakeDrive:
    """A drive whose tip has been pushed to a side until the view is turned."""
    settings = DriveSettings(control=control, vertices_per_link=30, bends=4)
    drive = SnakeDrive(SnakeModel(6), pathway, settings, tip_s=tip_s)
    for _ in range(40):
        drive.step(SnakeCommand(camera_mm_per_s=(20.0 * math.cos(angle), 20.0 * math.sin(angle))), 0.02)
    assert np.abs(drive.bend).max() > math.radians(5.0)
    return drive


def go(drive: SnakeDrive, mm: float) -> float:
    """Insert, or draw back, by so much; how far links were beyond their bounds at most."""
    beyond, target = -np.inf, drive.tip_s + mm
    for _ in range(300):
        if (target - drive.tip_s) * mm <= 0.25 * abs(mm) / 40.0:
            break
        state = drive.step(SnakeCommand(insert_mm_per_s=math.copysign(20.0, mm)), 0.02)
        beyond = max(beyond, float((state.deviation.depth - state.bound)[state.measured].max()))
    return beyond


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("quarter", range(4))
def test_a_bend_goes_along_in_both_directions_and_is_straightened_afterwards(control: Control, quarter: int) -> None:
    drive = bent(straight(300.0, 20.0), control, 170.0, 0.5 * math.pi * quarter)
    bend = drive.bend
    for mm in (40.0, -40.0):
        began = drive.tip_s
        assert go(drive, mm) <= 0.0
        assert drive.tip_s - began == pytest.approx(mm, abs=0.6)
        np.testing.assert_allclose(drive.bend, bend, atol=1e-9)
    for _ in range(200):
        drive.step(SnakeCommand(straighten=True), 0.02)
    assert drive.straight
    state = drive.step(SnakeCommand(camera_mm_per_s=(20.0, 0.0)), 0.02)
    assert state.outcome in ("moved", "shrunk")


@pytest.mark.parametrize("control", CONTROLS)
def test_in_a_bend_of_the_lumen_it_goes_along_within_the_bounds(control: Control) -> None:
    """Where a joint's range ends, or a link would leave its bound, the bend gives way and not the certificate."""
    drive = bent(arc(130.0, 2.2, contours=41, radius=16.0), control, 180.0, 0.0)
    bend = drive.bend
    assert go(drive, 30.0) <= 0.0
    assert drive.tip_s > 200.0
    assert np.abs(drive.bend - bend).max() < math.radians(10.0)
    assert not drive.straight


def test_the_camera_is_steered_on_after_an_insertion_without_a_jump() -> None:
    drive = bent(straight(300.0, 20.0), "parameterised", 170.0, 0.0)
    go(drive, 30.0)
    for _ in range(20):
        before = drive.q.copy()
        drive.step(SnakeCommand(camera_mm_per_s=(0.0, 10.0)), 0.02)
        assert np.abs(drive.q - before).max() <= drive.settings.speed_max * 0.02 * (1.0 + 1e-6)
    assert drive.state.steering[1] != 0.0


def test_a_run_of_before_did_not_lock_bends() -> None:
    pathway = straight(300.0, 20.0)
    spec = SnakeSystemSpec(LumenContours(pathway.centre, pathway.radius), SnakeModel(6))
    values, arrays = spec.to_parts()
    assert SnakeSystemSpec.from_parts(values, arrays).drive.lock_bend
    values["drive"] = {name: value for name, value in asdict(spec.drive).items() if name != "lock_bend"}
    assert not SnakeSystemSpec.from_parts(values, arrays).drive.lock_bend


def test_a_tip_that_was_drawn_back_to_its_bound_and_its_range_is_straightened() -> None:
    """The bends that led there are beyond the range of the joints where the tip is now: they count as reached."""
    case, settings = colon_case(), DriveSettings(control="view")
    lumen = lumen_between(case.mesh, case.start, case.end, SnakeModel(1), settings)
    snake = lumen.snake(SnakeModel(1), None)
    spec = SnakeSystemSpec(LumenContours.of(lumen), snake, SnakeSettings(0.002), settings, tip_s=145.0)
    driver = Driver(spec.build(), InlineWorker(spec.worker(), age_steps=20))

    def push(steps: int, *axes: float) -> None:
        for _ in range(steps):
            driver.step(Command(np.zeros(3), axes=axes))

    push(800, 1.0, 0.0, 0.0)
    push(600, 0.0, 0.0, -1.0)
    state = driver.state
    drawn_to = state.tip_s
    assert state.outcome == "held"
    assert not state.straight
    driver.apply(Straighten())
    push(1500, 0.0, 0.0, 0.0)
    assert driver.state.straight
    push(300, 0.0, 0.0, -1.0)
    assert driver.state.tip_s < drawn_to - 5.0
