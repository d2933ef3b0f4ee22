"""Bounds, springs and thresholds of single links, control bends in snapshots, and which runs count as certified."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from lumen_shapes import straight

from vfix_engine.errors import InputError
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import no_command
from vfix_engine.snake.haptics.haptics import step_forces
from vfix_engine.worlds.registry import is_certified
from vfix_engine.worlds.snake.plans.planner import Planner
from vfix_engine.worlds.snake.settings import ARMS, DriveSettings
from vfix_engine.worlds.snake.spec import LumenContours, SnakeSystemSpec
from vfix_engine.worlds.snake.stepping.state import SnakeState
from vfix_engine.worlds.snake.system import SnakeSystem

TUBE = straight(300.0, 15.0)
BOUNDS = (None, None, 3.0, 2.0, 1.0)


def test_a_link_has_its_own_bound_where_one_is_set() -> None:
    usual, own = (DriveSettings(bound_mm=6.0, link_bounds_mm=bounds).bounds(7) for bounds in (None, BOUNDS))
    np.testing.assert_array_equal(own.most, [6.0, 6.0, 6.0, 6.0, 3.0, 2.0, 1.0])
    np.testing.assert_array_equal(usual.most[:4], own.most[:4])
    by_place = DriveSettings(link_bounds_mm=BOUNDS).bounds(3)  # of a robot that has fewer links the last ones count
    np.testing.assert_array_equal(by_place.most, [3.0, 2.0, 1.0])
    assert np.isinf(by_place.share).all()


def test_springs_and_thresholds_are_those_of_table_ii_unless_they_are_set() -> None:
    usual, own = DriveSettings().haptics(), DriveSettings(springs_n_per_mm=(0.1, 0.2, 0.3, 0.4, 0.5)).haptics()
    assert usual.spring == (0.07, 0.07, 0.07, 0.07, 0.45)
    assert own.spring == (0.1, 0.2, 0.3, 0.4, 0.5)
    assert own.threshold == (0.0,) * 5
    assert own.for_links(5) is own
    assert own.for_links(3).spring == (0.3, 0.4, 0.5)  # of a robot that has fewer links the last ones count


@pytest.mark.parametrize(
    ("wrong", "word"),
    [({"link_bounds_mm": (1.0, 2.0)}, "5 values"), ({"springs_n_per_mm": (0.1,) * 4 + (-1.0,)}, "springs_n_per_mm"),
     ({"thresholds_mm": (0.0,) * 4 + (float("nan"),)}, "thresholds_mm"),
      ({"link_bounds_mm": (0.0,) * 5}, "link_bounds"), ({"springs_n_per_mm": 0.07}, "are a list"),
      ({"link_bounds_mm": 3.0}, "are a list"), ({"thresholds_mm": "12345"}, "are a list")],
)  # fmt: skip
def test_values_that_no_link_can_have_are_refused(wrong: dict, word: str) -> None:
    with pytest.raises(InputError, match=word):
        DriveSettings(**wrong)


def test_values_of_links_are_recorded_and_read_again() -> None:
    drive = DriveSettings(link_bounds_mm=BOUNDS, thresholds_mm=(0.5,) * 5, springs_n_per_mm=(0.1,) * 5)
    spec = SnakeSystemSpec(LumenContours(TUBE.centre, TUBE.radius), SnakeModel(6), drive=drive)
    values, arrays = spec.to_parts()
    again = SnakeSystemSpec.from_parts(json.loads(json.dumps(values)), arrays)
    assert again.drive == drive
    constants = again.build().constants
    assert constants.hand.settings.threshold == (0.5,) * 5


def test_a_threshold_silences_the_guidance_of_a_link_that_deviates_less() -> None:
    drive = DriveSettings(thresholds_mm=(2.0,) * 5).haptics()
    rest, outwards = (np.zeros(10), np.zeros(10), np.zeros(2), np.zeros(2)), np.array([1.0, 0.0])
    assert (step_forces(*rest, np.full(5, 1.9), outwards, drive)[1] == 0.0).all()
    assert np.abs(step_forces(*rest, np.full(5, 2.1), outwards, drive)[1]).max() > 0.0


def test_snapshots_have_the_control_bends_of_the_place() -> None:
    """Joints and tip in each: they begin where the links hang, and are as long as the links."""
    fixed = DriveSettings(bends=4, vertices_per_link=30, control="parameterised")
    spec = SnakeSystemSpec(LumenContours(TUBE.centre, TUBE.radius), SnakeModel(6), drive=fixed, tip_s=170.0)
    system = spec.build()
    assert isinstance(system.planner, Planner)
    before = system.snapshot(system.start())
    assert before.control_bends.shape == (0, 6, 3)
    state = planned(system)
    found = system.snapshot(state).control_bends
    assert found.shape == (4, 6, 3)
    frames = system.constants.snake.frames(state.q, state.base)
    np.testing.assert_allclose(found[:, 0], np.tile(frames[1, :3, 3], (4, 1)), atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=1), axis=2), 28.0, atol=1e-9)
    tips = found[:, -1] - found[:, -1].mean(axis=0)
    assert np.linalg.norm(tips, axis=1).min() > 5.0  # to four sides
    view = replace(spec, drive=replace(fixed, control="view")).build()
    assert view.snapshot(planned(view)).control_bends.shape[0] == 0


def planned(system: SnakeSystem) -> SnakeState:
    """The state after some steps at rest, whose plans are adopted."""
    state = system.start()
    for _ in range(5):
        state = system.step(state, no_command())
        wanted = system.background(state)
        if wanted is not None:
            state = system.adopt(state, system.planner(wanted.inputs), 0.0)
    return state


def test_a_run_is_certified_in_the_certified_arm_alone() -> None:
    names = [[name, ""] for name in ("q0", "tip_s", "beyond_bound")]
    for arm in ARMS:
        manifest = {"world": "snake", "columns": names, "spec": {"drive": {"arm": arm}}}
        assert is_certified(manifest) == (arm == "certified")
    assert is_certified({"world": "snake", "columns": names, "spec": {"drive": {}}})  # of before there were arms
