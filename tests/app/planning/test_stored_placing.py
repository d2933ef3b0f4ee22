"""Where the robot of a plan stands in the image: as stored, or by a registration."""

import numpy as np
import pytest

from app.planning.placement import standing_base, stored_placing
from app.plans.model import unplaced_robot
from vfix_engine.errors import InputError
from vfix_engine.frames import ImageRegistration, placement_of

BASE = [1.0, 0.0, 0.0, 1 / 3, 0.0, 0.0, -1.0, 0.1, 0.0, 1.0, 0.0, -7.0, 0.0, 0.0, 0.0, 1.0]
ROBOT = {"name": "steady_hand", "base": BASE, "q_start": [0.5] * 7}


def test_a_stored_placing_comes_back_to_the_last_bit() -> None:
    stored = stored_placing(ROBOT)
    assert stored is not None
    assert (stored.base.ravel().tolist(), stored.q_start.tolist()) == (BASE, [0.5] * 7)
    assert stored_placing(unplaced_robot()) is None


def test_a_registration_moves_the_robot_and_not_the_plan() -> None:
    """The patient lies 10 mm further along x than the image says: in the image the robot stands 10 mm back."""
    shift = np.eye(4)
    shift[0, 3] = 10.0
    base = standing_base(ROBOT, ImageRegistration(shift))
    assert base is not None
    np.testing.assert_allclose(base[:3, 3], [1 / 3 - 10.0, 0.1, -7.0], atol=1e-15)
    np.testing.assert_allclose(placement_of(base, ImageRegistration(shift)).ravel(), BASE, atol=1e-12)
    assert standing_base(unplaced_robot(), ImageRegistration(shift)) is None


def test_a_registration_to_the_base_says_alone_where_the_robot_stands() -> None:
    """Whether the plan holds a placing or not."""
    to_base = np.array(BASE).reshape(4, 4)
    for robot in (ROBOT, unplaced_robot()):
        base = standing_base(robot, ImageRegistration(to_base, "base"))
        assert base is not None
        np.testing.assert_allclose(to_base @ base, np.eye(4), atol=1e-12)
    with pytest.raises(InputError, match="does not say where the patient"):
        placement_of(np.eye(4), ImageRegistration(to_base, "base"))
