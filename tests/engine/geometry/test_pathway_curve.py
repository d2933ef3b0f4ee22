"""The pathway's curve and its frames, which do not spin."""

from __future__ import annotations

import lumen_shapes
import numpy as np
import pytest

from vfix_engine.errors import PathwayError
from vfix_engine.geometry.curve import Curve
from vfix_engine.geometry.transport import transported


def circle(radius: float = 50.0, turn: float = 2.0, points: int = 60) -> np.ndarray:
    angle = np.linspace(0.0, turn, points)
    return np.column_stack([radius * np.sin(angle), radius * (1.0 - np.cos(angle)), np.zeros(points)])


def test_a_curve_is_even_in_arc_length_and_goes_straight_on() -> None:
    curve = Curve.through(circle())
    assert curve.length == pytest.approx(100.0, abs=2e-3)
    assert curve.step_mm <= 0.5
    apart = np.linalg.norm(np.diff(curve.points, axis=0), axis=1)
    assert np.ptp(apart) < 1e-4
    s = np.linspace(0.0, curve.length, 40)
    turned = s / 50.0
    assert np.abs(curve.position(s) - 50.0 * np.column_stack([np.sin(turned), 1 - np.cos(turned), 0 * s])).max() < 2e-3
    assert np.abs(curve.tangent(s) - np.column_stack([np.cos(turned), np.sin(turned), 0 * s])).max() < 1e-3
    assert np.abs(curve.bending() - 0.02).max() < 2e-4
    assert np.allclose(curve.position(-7.0), curve.points[0] - 7.0 * curve.tangents[0], atol=1e-12)
    beyond = curve.position([curve.length + 3.0])
    assert np.allclose(beyond, curve.points[-1] + 3.0 * curve.tangents[-1], atol=1e-12)
    assert np.allclose(curve.tangent(curve.length + 3.0), curve.tangents[-1], atol=1e-15)


def test_the_closest_place_stays_within_its_window() -> None:
    curve = Curve.through(circle(turn=6.2))  # the ends nearly meet
    assert curve.closest([0.0, -1.0, 0.0]) == pytest.approx(0.0, abs=0.2)
    at = curve.position(180.0) + np.array([0.0, 0.0, 9.0])
    assert curve.closest(at) == pytest.approx(180.0, abs=1e-6)
    assert curve.closest([0.0, 0.0, 0.0], near_s=300.0, window=20.0) > 280.0
    with pytest.raises(PathwayError, match="no nearest point"):
        curve.closest([0.0, np.nan, 0.0])
    with pytest.raises(PathwayError, match="no nearest point"):
        curve.closest([0.0, 0.0, 0.0], near_s=900.0, window=20.0)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([[0, 0, 0]], "at least two points"),
        ([[0, 0, 0], [0, 0, np.nan]], "point 2 .* not finite"),
        ([[0, 0, 0], [0, 0, 1], [0, 0, 1]], "points 2 and 3 .* same place"),
        ([0, 1, 2], "at least two"),
    ],
)
def test_a_curve_refuses(points: list, says: str) -> None:
    with pytest.raises(PathwayError, match=says):
        Curve.through(points)


def test_a_curve_refuses_steps_windows_and_places() -> None:
    with pytest.raises(PathwayError, match="step"):
        Curve.through(circle(), step_mm=0.0)
    curve = Curve.through(circle())
    with pytest.raises(PathwayError, match="not finite"):
        curve.position([0.0, np.inf])
    with pytest.raises(PathwayError, match="window"):
        curve.bending(-1.0)


# Frames


@pytest.mark.parametrize("name", lumen_shapes.SHAPES)
def test_frames_are_orthonormal_and_do_not_spin(name: str) -> None:
    found = lumen_shapes.SHAPES[name].contours()
    second = np.cross(found.tangent, found.first)
    frames = np.stack([found.first, second, found.tangent], axis=2)
    assert np.abs(np.einsum("cij,cik->cjk", frames, frames) - np.eye(3)).max() < 1e-12
    # The first vector's change has no part along the second: it does not turn about the tangent.
    step = np.linalg.norm(np.diff(found.centre, axis=0), axis=1)
    middle = second[:-1] + second[1:]
    twist = np.einsum("ij,ij->i", np.diff(found.first, axis=0), middle) / (2.0 * step)
    assert np.abs(twist).max() < 2e-4  # rad/mm


def test_frames_come_back_on_a_plane_curve() -> None:
    """Without torsion a vector in the plane stays in it, and one across stays what it is."""
    angle = np.linspace(0.0, 2.0 * np.pi, 150)
    centre = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]) * (30.0 + 8.0 * np.cos(2.0 * angle))[:, None]
    curve = Curve.through(centre)
    across = transported(curve.points, curve.tangents, [0.0, 0.0, 1.0])
    assert np.abs(across - [0.0, 0.0, 1.0]).max() < 1e-12
    inside = transported(curve.points, curve.tangents, [1.0, 0.0, 0.0])
    assert np.abs(inside[:, 2]).max() < 1e-12


def test_frames_turn_by_the_solid_angle_of_a_helix() -> None:
    """Parallel transport round one turn of a helix turns by 2π(1 − sin pitch) against the helix's own frame."""
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    centre = np.column_stack([40.0 * np.cos(angle), 40.0 * np.sin(angle), 30.0 * angle])
    tangent = np.column_stack([-40.0 * np.sin(angle), 40.0 * np.cos(angle), np.full(400, 30.0)]) / 50.0
    first = transported(centre, tangent, [-1.0, 0.0, 0.0])
    normal, binormal = np.array([-1.0, 0.0, 0.0]), np.cross(tangent[-1], [-1.0, 0.0, 0.0])
    turned = np.arctan2(first[-1] @ binormal, first[-1] @ normal)
    # Torsion 30/2500 per mm over the length 2π · 50 mm is 0.6 turns.
    assert turned % (2.0 * np.pi) == pytest.approx((-2.0 * np.pi * 0.6) % (2.0 * np.pi), abs=1e-6)


def test_a_frame_along_the_tangent_still_starts() -> None:
    first = transported([[0, 0, 0], [0, 0, 1]], [[0, 0, 1], [0, 0, 1]], [0.0, 0.0, 2.0])
    assert np.allclose(np.linalg.norm(first, axis=1), 1.0)
    assert np.allclose(first[:, 2], 0.0)
