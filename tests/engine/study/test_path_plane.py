"""The plane of a path, and errors across it, against displacements that are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.study.path_plane import PathPlane

TURN = Rotation.from_euler("xyz", [20.0, -35.0, 70.0], degrees=True).as_matrix()


def arc() -> tuple[SplinePath, np.ndarray]:
    """A quarter of a circle of 30 mm about the z axis, turned in space; and its plane's normal."""
    angle = np.linspace(0.0, np.pi / 2.0, 7)
    flat = np.column_stack([30.0 * np.cos(angle), 30.0 * np.sin(angle), np.zeros(7)])
    return SplinePath(flat @ TURN.T + [5.0, -40.0, 12.0]), TURN[:, 2]


def test_a_flat_path_lies_in_its_plane_and_errors_are_what_was_added() -> None:
    path, normal = arc()
    plane = PathPlane.of(path)
    assert abs(plane.normal @ normal) == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(np.stack([plane.along, plane.aside, plane.normal]) @ plane.normal, [0, 0, 1], atol=1e-12)
    assert plane.aside[2] >= 0.0
    places = path.position(plane.s)
    assert plane.along @ (places[-1] - places[0]) > 0.0
    back = plane.origin + plane.curve[:, :1] * plane.along + plane.curve[:, 1:] * plane.aside
    np.testing.assert_allclose(back, places, atol=1e-6)
    np.testing.assert_allclose(plane.flat(places), plane.curve, atol=1e-9)
    s = np.linspace(0.0, path.length, 23)
    tangent = path.tangent(s)
    outwards = np.cross(plane.normal, tangent)
    tips = path.position(s) + 0.3 * outwards - 0.7 * plane.normal + 0.2 * tangent
    np.testing.assert_allclose(plane.across(path, s, tips), np.tile([0.3, -0.7], (23, 1)), atol=1e-6)


def test_errors_of_a_path_in_space_keep_their_size() -> None:
    turn = np.linspace(0.0, 5.0, 12)
    path = SplinePath(np.column_stack([12.0 * np.cos(turn), 12.0 * np.sin(turn), 6.0 * turn]))
    plane, s = PathPlane.of(path), np.linspace(0.0, path.length, 60)
    tangent = path.tangent(s)
    aside = np.cross(tangent, np.random.default_rng(3).normal(size=(60, 3)))
    found = plane.across(path, s, path.position(s) + aside)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), np.linalg.norm(aside, axis=1), atol=1e-9)


def test_a_straight_path_has_an_upright_plane() -> None:
    path = SplinePath([(0.0, 0.0, 0.0), (0.0, 20.0, 0.0), (0.0, 50.0, 0.0)])
    plane = PathPlane.of(path)
    np.testing.assert_allclose(plane.along, [0, 1, 0], atol=1e-9)
    np.testing.assert_allclose(plane.aside, [0, 0, 1], atol=1e-9)
    found = plane.across(path, np.array([10.0]), np.array([[0.5, 10.0, 0.25]]))
    np.testing.assert_allclose(found, [[0.25, 0.5]], atol=1e-9)
    upright = PathPlane.of(SplinePath([(0.0, 0.0, 0.0), (0.0, 0.0, 5.0)]))
    assert upright.aside[2] == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(InputError, match="not on the path"):
        plane.across(path, np.array([51.0]), np.zeros((1, 3)))
    assert plane.across(path, np.zeros(0), np.zeros((0, 3))).shape == (0, 2)
