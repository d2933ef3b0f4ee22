"""Which pairs can bind in the next step, against a plain loop over all of them and against steps at random."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.engine.control.test_whole_step import controller_of
from tests.engine.scenes import straight_scene, wall
from vfix_engine.certificate.bind_kernel import binding, largest_moves
from vfix_engine.certificate.constants import StepConstants, unpack_constants
from vfix_engine.certificate.inputs import PairSpace
from vfix_engine.proximity.pairs import COSINE, MAX_ROWS, RADIUS_MM
from vfix_engine.virtual_fixtures.state_kernel import BODY, SEGMENT, TRIANGLE
from vfix_engine.virtual_fixtures.stopping import stopping_distance

PAIR = 13  # numbers of a pair


@pytest.fixture(scope="module")
def constants() -> StepConstants:
    made: StepConstants = unpack_constants(*controller_of(straight_scene(wall(90.0))).context.packed)
    return made


def some_pairs(random: np.random.Generator, count: int, segments: int) -> PairSpace:
    """Pairs at random, some of them alike."""
    space = PairSpace.of(count)
    rows, labels = space.rows[:, :10], space.labels
    rows[:] = random.normal(size=(count, 10))
    rows[:, 0] = random.uniform(0.2, 4.0, count)
    alike = random.random(count) < 0.4
    rows[alike, 1:4], rows[alike, 4:7] = rows[0, 1:4], rows[0, 4:7]
    rows[:, 1:4] /= np.linalg.norm(rows[:, 1:4], axis=1, keepdims=True)
    labels[:, 0], labels[:, 1], labels[:, 2] = random.integers(0, segments, count), np.arange(count), 0
    return space


def chosen_by_hand(constants: StepConstants, move: np.ndarray, rows: np.ndarray, labels: np.ndarray) -> list[int]:
    """Triangles of the pairs to be kept, nearest first, read off the definition."""
    free = rows[:, 0] - constants.buffered_margin[0]
    order = sorted(range(len(rows)), key=lambda i: (free[i], i))
    can = [i for i in order if i == order[0] or free[i] < stopping_distance(move[labels[i, 0]], constants.change)]
    kept: list[int] = []
    for i in can:
        copies = (
            labels[k, 0] == labels[i, 0]
            and rows[k, 1:4] @ rows[i, 1:4] >= COSINE
            and math.dist(rows[k, 4:7], rows[i, 4:7]) <= RADIUS_MM
            for k in kept
        )
        if len(kept) < MAX_ROWS and not any(copies):
            kept.append(i)
    return kept


@pytest.mark.parametrize("seed", range(40))
def test_pairs_that_can_bind_are_those_of_a_plain_loop(constants: StepConstants, seed: int) -> None:
    random = np.random.default_rng(seed)
    segments = len(constants.radius)
    space = some_pairs(random, int(random.integers(1, 60)), segments)
    rows, labels = space.rows[:, :10], space.labels
    move = random.choice([1e-4, 0.3, 2.0], segments)
    pairs, slack = np.empty((MAX_ROWS, PAIR)), np.array([stopping_distance(m, constants.change) for m in move])
    found = binding(constants, slack, *space, len(rows), pairs)
    kept = chosen_by_hand(constants, move, rows, labels)
    assert pairs[:found, TRIANGLE].astype(int).tolist() == kept
    np.testing.assert_array_equal(pairs[:found, :10], rows[kept])
    np.testing.assert_array_equal(pairs[:found, SEGMENT], labels[kept, 0])
    np.testing.assert_array_equal(pairs[:found, BODY], 0)


def test_a_pair_that_binds_is_kept_beside_a_nearer_one_that_cannot(constants: StepConstants) -> None:
    """The nearest pair is on a segment that stands still, another one on a segment that moves fast."""
    space = some_pairs(np.random.default_rng(0), 2, 1)
    space.rows[:, 0] = constants.buffered_margin[0] + np.array([0.5, 1.0])
    space.labels[:, 0] = 0, 1
    slack = np.zeros(len(constants.radius))
    slack[1] = stopping_distance(2.0, constants.change)
    pairs = np.empty((MAX_ROWS, PAIR))
    assert binding(constants, slack, *space, 2, pairs) == 2
    assert pairs[:2, TRIANGLE].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("seed", range(10))
def test_no_step_within_the_box_moves_a_point_further_than_the_bound(seed: int) -> None:
    """By the pose after the step, of another function than the kernel's."""
    random = np.random.default_rng(seed)
    context = controller_of(straight_scene(wall(90.0))).context
    robot = context.robot.robot
    state = context.measure(random.uniform(0.4 * robot.lower, 0.4 * robot.upper))
    box = np.stack([-random.uniform(0, 1e-4, 7), random.uniform(0, 1e-4, 7)])
    at, move = state.segments, np.empty(len(context.tool.radius))
    largest_moves(box, state.tip.position, state.tip.jacobian, at.start, at.end, move)
    furthest = np.zeros(len(move))
    for _ in range(50):
        after = context.measure(state.q + np.where(random.random(7) < 0.5, box[0], box[1])).segments
        for one, two in ((at.start, after.start), (at.end, after.end)):
            furthest = np.maximum(furthest, np.linalg.norm(two - one, axis=1))
    assert (furthest <= move * (1.0 + 1e-3) + 1e-9).all()  # the bound is linear in the step, which is small here
    assert (furthest >= 0.2 * move).all()
