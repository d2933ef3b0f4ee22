"""Labels of study II: drawn by a rule and a seed, and bends that trace their lines."""

import itertools
import math

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.pathway.limits.limits import Configuration, HardLimits, LinksAt
from vfix_engine.study.diathermy.bend_map import BendMap
from vfix_engine.study.diathermy.labels import DIAMETER_MM, HALF_MM, marker_on
from vfix_engine.study.diathermy.placing import HALVES, PlacedLabels, placed_labels
from vfix_engine.study.diathermy.tracing import FARTHEST_MM, NEAREST_MM, STEEPEST_DEG, STEP_MM, Tracer
from vfix_engine.study.diathermy.trial import trial
from vfix_engine.worlds.snake.cavity import cavity_case
from vfix_engine.worlds.snake.settings import Arm

CASE = cavity_case()
COUNT = 2


@pytest.fixture(scope="module")
def bends() -> BendMap:
    return BendMap(CASE.script().build())


@pytest.fixture(scope="module")
def placed(bends: BendMap) -> PlacedLabels:
    return placed_labels(CASE, bends, 2, COUNT)


def test_labels_follow_the_rule_and_the_seed(bends: BendMap, placed: PlacedLabels) -> None:
    again = placed_labels(CASE, bends, 2, COUNT)
    assert [one.to_dict() for one in again.labels] == [one.to_dict() for one in placed.labels]
    assert placed.drawn == COUNT + placed.untraceable
    assert 0 <= placed.unselected <= COUNT
    for number, label in enumerate(placed.labels):
        height = label.centre[2] / CASE.pathway.length
        assert HALVES[number % 2][0] - 0.05 < height < HALVES[number % 2][1] + 0.05
        beneath = CASE.mesh.vertices - label.centre
        beneath = beneath[np.linalg.norm(beneath, axis=1) < 0.4 * DIAMETER_MM]
        assert len(beneath) > 10
        assert (beneath @ label.normal).max() < 0.0  # the wall is behind the label
        assert label.normal @ label.along == pytest.approx(0.0, abs=1e-12)
    one = placed_labels(CASE, bends, 2, 1)  # the first of the same six
    assert one.labels[0].to_dict() == placed.labels[0].to_dict()
    other = placed_labels(CASE, bends, 3, 1)
    assert np.linalg.norm(other.labels[0].centre - placed.labels[0].centre) > 1.0


def test_a_traced_line_is_aimed_at_within_the_bounds_all_along(bends: BendMap, placed: PlacedLabels) -> None:
    for label, line in zip(placed.labels, placed.tracings, strict=True):
        before = line[0]
        for number, steering in enumerate(line):
            pose = bends.pose(steering)
            marker = marker_on(label, pose.camera)
            assert marker is not None
            assert math.hypot(marker.along + HALF_MM - STEP_MM * number, marker.across) < 0.03
            assert NEAREST_MM <= marker.distance <= FARTHEST_MM
            assert -label.normal @ pose.camera[:3, 2] >= math.cos(math.radians(STEEPEST_DEG)) - 1e-12
            assert pose.inside_mm > 0.1
            assert math.dist(before, steering) < 0.13
            before = steering
        assert -HALF_MM + STEP_MM * (len(line) - 1) > HALF_MM  # behind the arrow's tip, where it is done


def test_what_cannot_be_seen_or_aimed_at_is_not_traced(bends: BendMap, placed: PlacedLabels) -> None:
    tracer, label = Tracer(bends, Wall(CASE.mesh)), placed.labels[0]
    assert tracer.trace(label) is not None
    assert tracer.trace(label._replace(normal=-label.normal)) is None
    assert tracer.trace(label._replace(centre=label.centre + 500.0)) is None
    behind = label._replace(centre=label.centre - 12.0 * label.normal)  # the wall is between it and the camera
    assert tracer.trace(behind) is None


def test_a_way_between_two_lines_is_of_bends_that_are_free(bends: BendMap, placed: PlacedLabels) -> None:
    one, two = placed.tracings[0][-1], placed.tracings[1][0]
    way = bends.way(one, two)
    assert way is not None
    assert (way[0], way[-1]) == (one, two)
    for place in way[1:-1]:
        assert bends.usable(place)
    steps = [math.dist(*pair) for pair in itertools.pairwise(way)]
    assert max(steps) < 0.12
    assert not bends.is_free((1.3, -0.5))  # where links are beyond their bounds


def test_a_small_motion_from_any_free_bend_can_be_certified(bends: BendMap) -> None:
    """Not so where the base stands lower: near the pathway's end motions are refused as too large even in parts."""
    context = bends.context
    limits = HardLimits(context.query, context.snake, context.bound)
    for i, j in np.argwhere(bends.free)[::5]:
        u, v = float(bends.at[i]), float(bends.at[j])
        before, after = (Configuration(context.base, bends.joints(at)) for at in ((u, v), (0.99 * u + 0.003, 0.99 * v)))
        verdict = limits.certify(LinksAt(context.packed, context.window, before), after)
        assert not verdict.exhausted, (u, v)


@pytest.mark.parametrize("arm", ["guided", "manual"])
def test_the_arms_without_a_certificate(bends: BendMap, placed: PlacedLabels, arm: Arm) -> None:
    """The first label alone; the manual hand chooses joints, and nothing keeps its links in the bounds."""
    first = placed._replace(labels=placed.labels[:1], tracings=placed.tracings[:1])
    found = trial(CASE, bends, first, arm)
    assert found.task.done, found.given_up
    row = found.to_dict()["labels"][0]
    assert row["line_error_mm"] < 0.5
    assert row["distance_mm"] is None
    assert 3.0 < row["time_s"] < 20.0
    assert (found.joint_choices > 0) == (arm == "manual")
