"""Where the robot of a plan stands in the image: as stored, or behind a registration."""

import numpy as np

from app.services.placing import stored_placing
from app.services.plan_model import unplaced_robot
from app.services.registration import RegistrationContent

BASE = [1.0, 0.0, 0.0, 1 / 3, 0.0, 0.0, -1.0, 0.1, 0.0, 1.0, 0.0, -7.0, 0.0, 0.0, 0.0, 1.0]
ROBOT = {"name": "steady_hand", "base": BASE, "q_start": [0.5] * 7}


def test_a_stored_placing_comes_back_to_the_last_bit() -> None:
    stored = stored_placing(ROBOT)
    assert stored is not None
    assert (stored.base.ravel().tolist(), stored.q_start.tolist()) == (BASE, [0.5] * 7)
    assert stored_placing(unplaced_robot()) is None


def test_a_registration_moves_the_robot_and_not_the_plan() -> None:
    """The patient lies 10 mm further along x than the image says: in the image the robot stands 10 mm back."""
    shift = tuple(np.array([[1, 0, 0, 10], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float).ravel().tolist())
    stored = stored_placing(ROBOT, RegistrationContent(transform=shift).registration)
    assert stored is not None
    np.testing.assert_allclose(stored.base[:3, 3], [1 / 3 - 10.0, 0.1, -7.0], atol=1e-15)
