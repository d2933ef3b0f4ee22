"""The bound of a swept motion's second derivative, on every shipped robot and on any chain (HAZ-02)."""

import numpy as np
import pytest

from tests.engine.robots.test_robot import SHIPPED, random_base
from vfix_engine.certificate.sweep_kernel import acceleration_bound
from vfix_engine.robots import Joint, RobotModel, Tool

TOOL = Tool.load("shaver_40")


def worst_ratio(robot: RobotModel, random: np.random.Generator, count: int) -> float:
    """Largest second derivative of any end of the tool's segments over its bound, over random motions."""
    placed, worst, h = robot.placed(random_base(random), TOOL), 0.0, 1e-3
    links = np.linalg.norm(placed.chain.offset, axis=1)
    ends = TOOL.segments(np.eye(3), np.zeros(3))
    farthest = max(np.linalg.norm(ends.start, axis=1).max(), np.linalg.norm(ends.end, axis=1).max())
    reach = float(np.linalg.norm(placed.chain.tip_offset) + farthest)

    def points(q: np.ndarray) -> np.ndarray:
        segments = TOOL.segments(*placed.tip_pose(q))
        return np.concatenate([segments.start, segments.end])

    for _ in range(count):
        q = random.uniform(robot.lower, robot.upper)
        step = random.normal(size=len(q)) * np.where(robot.revolute, 0.3, 30.0) * (random.random(len(q)) < 0.7)
        at = q + random.random() * step
        second = (points(at + h * step) - 2.0 * points(at) + points(at - h * step)) / h**2
        # A second difference of numbers of this size is no better than that.
        rounding = 1e-14 * np.abs(points(at)).max() / h**2
        bound = acceleration_bound(placed.chain, links, reach, q, step)
        most = float(np.linalg.norm(second, axis=1).max()) - rounding
        assert most <= bound * (1.0 + 1e-5)
        worst = max(worst, most / bound) if bound > 0.0 else worst
    return worst


@pytest.mark.parametrize("name", SHIPPED)
def test_no_point_of_the_tool_bends_more_than_its_bound(name: str) -> None:
    """HAZ-02: and the bound is not so wide that it says nothing."""
    assert 0.4 < worst_ratio(RobotModel.load(name), np.random.default_rng(3), 500) <= 1.0 + 1e-5


def test_the_bound_holds_for_any_chain() -> None:
    """HAZ-02: 200 random chains of one to seven joints with link offsets, 30 motions each."""
    random = np.random.default_rng(5)
    worst = 0.0
    for _ in range(200):
        joints = []
        for i in range(random.integers(1, 8)):
            axis = random.normal(size=3)
            x, y, z = axis / np.linalg.norm(axis)
            kind = "revolute" if random.random() < 0.7 else "prismatic"
            low, high = np.sort(random.uniform(-3, 3, 2)) * (1.0 if kind == "revolute" else 30.0)
            joints.append(Joint(f"j{i}", kind, (x, y, z), low, high, 1.0, 1.0, "test", random_base(random)))
        worst = max(worst, worst_ratio(RobotModel("r", "r", "test", tuple(joints)), random, 30))
    assert worst > 0.8
