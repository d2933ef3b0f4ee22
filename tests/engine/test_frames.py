"""Image, patient and base: every way from one to another gives the same point."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vfix_engine import frames
from vfix_engine.errors import InputError
from vfix_engine.frames import (
    ImageRegistration,
    direction_in_base,
    inverse,
    transform_base_to_image,
    transform_image_to_base,
)


def pose(turn: list[float], shift: list[float]) -> frames.Array:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    matrix[:3, 3] = shift
    return matrix


vectors = st.lists(st.floats(-3, 3), min_size=3, max_size=3)
places = st.lists(st.floats(-500, 500), min_size=3, max_size=3)
poses = st.builds(pose, vectors, places)


@given(poses)
def test_the_inverse_undoes(transform: frames.Array) -> None:
    np.testing.assert_allclose(inverse(transform) @ transform, np.eye(4), atol=1e-10)
    np.testing.assert_allclose(inverse(transform), np.linalg.inv(transform), atol=1e-9)


@given(poses, poses, places)
def test_a_point_of_the_image_is_the_same_point_in_the_base(
    placement: frames.Array, registration: frames.Array, point: list[float]
) -> None:
    """Step by step: image to patient by the registration, patient to base by the placement's inverse."""
    in_image = np.array([*point, 1.0])
    in_base = np.linalg.inv(placement) @ (registration @ in_image)
    known = ImageRegistration(registration)
    np.testing.assert_allclose(transform_image_to_base(placement, known) @ in_image, in_base, atol=1e-8)
    np.testing.assert_allclose(transform_base_to_image(placement, known) @ in_base, in_image, atol=1e-8)


@given(poses, poses)
def test_a_registration_to_the_base_needs_no_placement(placement: frames.Array, to_base: frames.Array) -> None:
    known = ImageRegistration(to_base, to="base")
    np.testing.assert_array_equal(transform_image_to_base(placement, known), to_base)
    np.testing.assert_allclose(transform_base_to_image(placement, known) @ to_base, np.eye(4), atol=1e-10)


def test_without_a_registration_image_and_patient_are_one_frame() -> None:
    """To the last bit: a drive in the simulation is the one of before."""
    placement = pose([0.1, 0.2, 0.3], [1 / 3, -40.0, 12.5])
    np.testing.assert_array_equal(transform_base_to_image(placement), placement)
    np.testing.assert_allclose(transform_image_to_base(placement) @ placement, np.eye(4), atol=1e-14)


def test_a_force_of_the_hand_in_the_base() -> None:
    """A base turned by a quarter about z: what pushes along the patient's +y pushes along the base's +x."""
    base = pose([0.0, 0.0, np.pi / 2], [100.0, 0.0, 0.0])
    np.testing.assert_allclose(direction_in_base([0.0, 2.0, 0.0], base), [2.0, 0.0, 0.0], atol=1e-15)


def test_the_change_between_ras_and_lps_is_its_own_inverse() -> None:
    np.testing.assert_array_equal(frames.RAS_TO_LPS * frames.RAS_TO_LPS, np.ones(3))
    with pytest.raises(ValueError, match="read-only"):
        frames.RAS_TO_LPS[0] = 1.0


@pytest.mark.parametrize(
    "matrix",
    [np.diag([2.0, 2.0, 2.0, 1.0]), np.diag([-1.0, 1.0, 1.0, 1.0]), np.eye(3), np.full((4, 4), np.nan)],
    ids=["scaled", "mirrored", "3 x 3", "NaN"],
)
def test_what_is_not_rigid_is_refused(matrix: frames.Array) -> None:
    """HAZ-14: a scaled or mirrored image would put every point of a plan elsewhere."""
    for make in (ImageRegistration, inverse, transform_base_to_image, transform_image_to_base):
        with pytest.raises(InputError, match="is not rigid"):
            make(matrix)


def test_an_image_is_registered_to_the_patient_or_to_the_base() -> None:
    with pytest.raises(InputError, match="'patient' or to 'base', not to 'tracker'"):
        ImageRegistration(np.eye(4), to="tracker")  # type: ignore[arg-type]
