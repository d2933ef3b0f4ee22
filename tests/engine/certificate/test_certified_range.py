"""The certificate keeps the joints' ranges, whoever proposes the step: HAZ-06."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.control.test_three_functions import FREE, PUSH, same_report
from tests.engine.control.test_whole_step import controller_of, random_task
from tests.engine.scenes import straight_scene, wall
from vfix_engine.certificate.certify_kernel import AT_LIMIT
from vfix_engine.control import Certified, Controller, Refused, StepState, build_step, certify_step
from vfix_engine.control.step import CERTIFICATE
from vfix_engine.errors import ControlError


@pytest.fixture(scope="module")
def control() -> Controller:
    return controller_of(straight_scene(wall(400.0)))


def certified(control: Controller, q: np.ndarray, dq: np.ndarray) -> StepState | None:
    """The state after a proposed step from rest at q; None where it is refused."""
    verdict = certify_step(build_step(control.context.measure(q), FREE, command=PUSH), dq)
    if isinstance(verdict, Refused):
        assert verdict.by == CERTIFICATE
        return None
    assert isinstance(verdict, Certified)
    return verdict.next_state


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("upper", [False, True])
def test_no_proposal_leads_out_of_a_range(control: Controller, joint: int, upper: bool) -> None:
    robot = control.context.robot.robot
    limit, out = (robot.upper[joint], 1.0) if upper else (robot.lower[joint], -1.0)
    q, step = np.zeros(7), np.zeros(7)
    q[joint] = limit - 5e-3 * out
    for size, kept in ((5e-3, True), (5e-3 + 0.5 * AT_LIMIT, True), (5e-3 + 2.0 * AT_LIMIT, False), (8e-3, False)):
        step[joint] = size * out
        after = certified(control, q, step)
        assert (after is not None) == kept
        if after is not None:
            assert robot.lower[joint] <= after.q[joint] <= robot.upper[joint]
            assert after.q[joint] == pytest.approx(limit, abs=1e-12)
            assert after.velocity[joint] == pytest.approx((after.q[joint] - q[joint]) / control.context.settings.dt_s)


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("upper", [False, True])
def test_from_outside_a_range_only_motions_back_in_are_kept(control: Controller, joint: int, upper: bool) -> None:
    robot = control.context.robot.robot
    limit, out = (robot.upper[joint], 1.0) if upper else (robot.lower[joint], -1.0)
    q, step = np.zeros(7), np.zeros(7)
    q[joint] = limit + 0.02 * out
    for size, kept in ((0.0, True), (-1e-3, True), (-0.03, True), (2.0 * AT_LIMIT, False), (1e-3, False)):
        step[joint] = size * out
        assert (certified(control, q, step) is not None) == kept, size


def test_steps_at_random_are_kept_within_the_ranges_alone(control: Controller) -> None:
    """Far from anything, so that nothing else refuses them; the fused step and the single calls agree."""
    robot, random = control.context.robot.robot, np.random.default_rng(1)
    refused = 0
    for _ in range(200):
        q = np.zeros(7)
        one = random.integers(7)
        q[one] = random.choice([robot.lower[one], robot.upper[one]]) + random.uniform(-0.01, 0.01)
        step = random.uniform(-0.012, 0.012, 7)
        low, high = np.minimum(robot.lower, q), np.maximum(robot.upper, q)
        inside = bool(((q + step >= low) & (q + step <= high)).all())
        assert (certified(control, q, step) is not None) == inside
        refused += not inside
    assert 30 < refused < 170


def test_the_fused_step_from_outside_comes_back_in_as_the_single_calls_do(control: Controller) -> None:
    robot, random = control.context.robot.robot, np.random.default_rng(2)
    for joint in range(7):
        q = np.zeros(7)
        q[joint] = robot.upper[joint] + 0.02
        for _ in range(5):
            state = control.context.measure(q, 0.01 * random.normal(size=7))
            task = random_task(state, random)
            same_report(control, state, task)
            after = control.step(state, task).state
            assert after.q[joint] <= q[joint]


def test_a_step_that_is_no_number_is_refused(control: Controller) -> None:
    for bad in (np.nan, np.inf, -np.inf):
        assert certified(control, np.zeros(7), np.full(7, bad)) is None
    other, state = controller_of(straight_scene(wall(400.0))), control.context.measure(np.zeros(7))
    with pytest.raises(ControlError, match="the same surroundings"):
        other.context.certify(state, np.zeros(7))
