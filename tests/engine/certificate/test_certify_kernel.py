"""The certificate on motions at random, with coal and Pinocchio's placements as judges: HAZ-01, HAZ-02, HAZ-04."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.control.test_whole_step import controller_of, narrow_tube
from tests.engine.scenes import CoalJudge, straight_scene, wall
from vfix_engine.certificate.certify_kernel import SWEEP_TOLERANCE_MM
from vfix_engine.certificate.sweep_kernel import chords
from vfix_engine.control import ControlContext, StepState
from vfix_engine.worlds.rigid.scene import Scene

POSES = 8  # of a motion that are looked at again
COAL_MM = 1e-5  # what coal's iterations leave


@pytest.fixture(scope="module")
def tube() -> Scene:
    return narrow_tube()


def clearances(context: ControlContext, judge: CoalJudge, q: np.ndarray, step: np.ndarray) -> np.ndarray:
    """By coal at POSES + 1 poses of the motion, ends included."""
    robot, found = context.robot, []
    for share in np.linspace(0.0, 1.0, POSES + 1):
        segments = context.tool.segments(*robot.tip_pose(q + share * step))
        found.append(judge.clearance(segments))
    return np.array(found)


def motions(random: np.random.Generator, count: int) -> np.ndarray:
    """Steps (count, 7) of very different lengths."""
    sizes = 10.0 ** random.uniform(-1.5, 0.7, (count, 1))
    return random.normal(size=(count, 7)) * sizes * np.array([1.0, 1.0, 1.0, 0.01, 0.01, 1.0, 0.01])


def test_a_motion_that_is_kept_keeps_the_margin_and_one_that_is_refused_mostly_does_not(tube: Scene) -> None:
    context = controller_of(tube).context
    judge, random = CoalJudge(tube.tree.mesh), np.random.default_rng(7)
    margin = float(context.constants.margin[0])
    state, kept, refused, dipped = context.measure(np.zeros(7)), 0, 0, 0
    for step in motions(random, 40):
        after = context.certify(state, step)
        seen = clearances(context, judge, state.q, step)
        if after is None:
            refused += 1
            dipped += seen.min() < margin
            continue
        kept += 1
        assert seen.min() >= margin - SWEEP_TOLERANCE_MM - COAL_MM
        assert after.clearance == pytest.approx(seen[-1], abs=COAL_MM)
        state = after if random.random() < 0.3 else context.measure(np.zeros(7))
    assert kept > 5
    assert refused > 5
    assert dipped > 0.85 * refused  # a bound that refuses everything would pass the rest


def test_from_inside_the_margin_no_motion_that_is_kept_comes_nearer() -> None:
    scene = straight_scene(wall(1.15))
    context = controller_of(scene).context
    judge, random = CoalJudge(scene.tree.mesh), np.random.default_rng(8)
    state = context.measure(np.zeros(7))
    before, margin, kept = state.clearance, float(context.constants.margin[0]), 0
    assert 0.0 < before < margin
    for step in motions(random, 120):
        if context.certify(state, step) is not None:
            kept += 1
            seen = clearances(context, judge, state.q, step)
            assert seen[-1] >= min(before, margin) - COAL_MM
            assert seen.min() >= min(before, margin) - SWEEP_TOLERANCE_MM - COAL_MM
    assert 10 < kept < 100


def test_a_wall_between_two_free_poses_is_not_passed(tube: Scene) -> None:
    """HAZ-02: both ends are clear, the way is not, for steps of any length up to the whole stroke."""
    scene = straight_scene(wall(30.0))
    context = controller_of(scene).context
    state = context.measure(np.zeros(7))
    for stroke in (32.0, 45.0, 80.0, 300.0):
        beyond = np.zeros(7)
        beyond[1] = stroke
        assert context.certify(state, beyond) is None
    beyond[1] = 28.0
    assert isinstance(context.certify(state, beyond), StepState)


def test_a_chord_is_the_larger_way_of_a_segments_ends() -> None:
    random = np.random.default_rng(9)
    start, end, new_start, new_end = random.normal(size=(4, 5, 3))
    chord = np.empty(5)
    chords(start, end, new_start, new_end, chord)
    ways = np.linalg.norm(new_start - start, axis=1), np.linalg.norm(new_end - end, axis=1)
    np.testing.assert_allclose(chord, np.maximum(*ways), rtol=1e-14)
