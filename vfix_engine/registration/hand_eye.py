"""Pose of a tracker relative to a robot, from poses of a marker mounted on the robot (hand-eye calibration)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from .expected_error import motion_rows
from .pointer import checked_poses
from .points import checked_points

FEWEST_POSES = 5
LEVER_MM = 50.0  # a rotation by 1 rad counts as much as this displacement

_MOST_LEVERAGE = 0.99  # of a pose that alone determines a direction, so that its residual does not show its error
_CLOSEST = 2e-3  # smallest relative difference between the first two singular values of the rotations


@dataclass(frozen=True, eq=False)
class HandEye:
    """Poses of the tracker relative to the robot, and of the marker on the robot's flange; rigid, mm.

    transform_tracker_to_base, transform_marker_to_flange: (4, 4).
    rotation_residuals_deg, translation_residuals_mm: (n,) difference of the marker's pose by robot and by tracker.
    covariance: (6, 6) of the error (t, ω) of ``transform_tracker_to_base``, in mm and rad: a point p of the base's
        frame is displaced by t + ω × p.
    """

    transform_tracker_to_base: Array
    transform_marker_to_flange: Array
    rotation_residuals_deg: Array
    translation_residuals_mm: Array
    covariance: Array

    @property
    def rotation_residual_deg(self) -> float:
        """Rms of the angles between the marker's orientations by robot and by tracker."""
        return float(np.sqrt((self.rotation_residuals_deg**2).mean()))

    @property
    def translation_residual_mm(self) -> float:
        """Rms of the distances between the marker's positions by robot and by tracker."""
        return float(np.sqrt((self.translation_residuals_mm**2).mean()))

    def error_mm(self, points: ArrayLike) -> Array:
        """Expected rms error (m,) in the base's frame of points (m, 3) of the tracker's frame; from the residuals."""
        given = checked_points("the points", points)
        matrix = self.transform_tracker_to_base
        rows = motion_rows(given @ matrix[:3, :3].T + matrix[:3, 3])
        squared: Array = np.einsum("nij,jk,nik->n", rows, self.covariance, rows)
        return np.sqrt(squared)


def register_robot_to_tracker(robot_poses: ArrayLike, tracker_poses: ArrayLike) -> HandEye:
    """Estimate the transform from a tracker to a robot's base, and that of the marker on the robot's flange.

    Solves A X = Y B for the robot's poses A (``transform_flange_to_base``), the tracker's B
    (``transform_marker_to_tracker``), X = ``transform_marker_to_flange`` and Y = ``transform_tracker_to_base``.
    First in closed form (Shah 2013): the rotations are the singular vectors of Σ R_B ⊗ R_A, the translations follow
    linearly. Then by least squares over both: the distances between points around the marker by robot and by tracker,
    where a radian counts as 50 mm.

    Args:
        robot_poses, tracker_poses: (n, 4, 4) each, rigid, mm, measured simultaneously; at least 5.

    Raises:
        InputError: too few poses, poses that are not rigid, unequal numbers, or rotations about only one axis or too
            small.
    """
    a = checked_poses("the robot's poses", robot_poses, FEWEST_POSES)
    b = checked_poses("the tracker's poses", tracker_poses, FEWEST_POSES)
    if len(a) != len(b):
        raise InputError(
            f"{len(a)} poses of the robot and {len(b)} of the tracker are no pairs; give one for each moment"
        )
    x, y = _closed_form(a, b)
    for _ in range(30):
        rows, residuals, back = _equations(a, b, x, y)
        step = -back @ np.einsum("nri,nr->i", rows, residuals)
        x, y = x @ _motion(step[:6]), _motion(step[6:]) @ y
        if np.abs(step).max() < 1e-12:
            break
    covariance = _covariance(rows, residuals, back)
    ways, others = a @ x, y @ b
    turned = np.swapaxes(ways[:, :3, :3], 1, 2) @ others[:, :3, :3]
    sines = np.linalg.norm(_axial(turned), axis=1)
    angles = np.degrees(np.arctan2(sines, 0.5 * (np.trace(turned, axis1=1, axis2=2) - 1.0)))
    distances = np.linalg.norm(ways[:, :3, 3] - others[:, :3, 3], axis=1)
    result = HandEye(y, x, angles, distances, covariance)
    for array in (y, x, angles, distances, covariance):
        array.setflags(write=False)
    return result


def _closed_form(a: Array, b: Array) -> tuple[Array, Array]:
    """Solve for X and Y in closed form; raises if the rotations do not determine them."""
    products = np.einsum("nij,nkl->ikjl", b[:, :3, :3], a[:, :3, :3]).reshape(9, 9)
    u, s, vt = np.linalg.svd(products)
    if s[0] - s[1] < _CLOSEST * s[0]:
        raise InputError(
            "the robot turned its flange about one axis only, or by a few degrees; turn it about two axes at least, by "
            "20 degrees or more"
        )
    rotation_x, rotation_y = _rotation(vt[0]), _rotation(u[:, 0])
    rows = np.concatenate([a[:, :3, :3], np.broadcast_to(-np.eye(3), (len(a), 3, 3))], axis=2).reshape(-1, 6)
    places = np.linalg.lstsq(rows, (b[:, :3, 3] @ rotation_y.T - a[:, :3, 3]).reshape(-1), rcond=None)[0]
    x, y = np.eye(4), np.eye(4)
    x[:3, :3], x[:3, 3], y[:3, :3], y[:3, 3] = rotation_x, places[:3], rotation_y, places[3:]
    return x, y


def _rotation(columns: Array) -> Array:
    """Rotation nearest to a matrix with columns stacked in (9,), up to its sign and size."""
    matrix = columns.reshape(3, 3).T
    u, _, vt = np.linalg.svd(matrix * np.sign(np.linalg.det(matrix)))
    rotation: Array = u @ vt
    return rotation


def _equations(a: Array, b: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Rows (n, 18, 12) and residuals (n, 18) of a Gauss-Newton step of X and Y, (t, ω) each, and (Σ rowsᵀ rows)⁻¹.

    X moves in its own frame, X exp(δ), and Y in the base's, exp(δ) Y. The residuals are differences at six points
    around the marker, two on each axis.
    """
    points = np.vstack([np.eye(3), -np.eye(3)]) * (LEVER_MM * np.sqrt(1.5))  # mean square radius per axis: LEVER_MM
    ways = np.einsum("nij,pj->npi", (a @ x)[:, :3, :3], points) + (a @ x)[:, None, :3, 3]
    others = np.einsum("nij,pj->npi", (y @ b)[:, :3, :3], points) + (y @ b)[:, None, :3, 3]
    by_x = np.einsum("nij,pjk->npik", (a @ x)[:, :3, :3], motion_rows(points))
    by_y = -motion_rows(others.reshape(-1, 3)).reshape(len(a), len(points), 3, 6)
    rows = np.concatenate([by_x, by_y], axis=3).reshape(len(a), -1, 12)
    residuals = (ways - others).reshape(len(a), -1)
    scale = np.repeat([1.0, 1.0 / LEVER_MM], 3)
    scale = np.concatenate([scale, scale])
    stacked = (rows * scale).reshape(-1, 12)
    back = np.linalg.pinv(stacked.T @ stacked, hermitian=True, rcond=1e-14)
    return rows, residuals, scale[:, None] * back * scale


def _covariance(rows: Array, residuals: Array, back: Array) -> Array:
    """Covariance (6, 6) of Y, from the residuals of the poses, which may have different variances.

    The residuals of a pose are smaller than its errors, since the fit follows them, especially with few poses: they are
    corrected to (I − H)^−½ r, with H the pose's block of the hat matrix (Bell & McCaffrey 2002).
    """
    hat = rows @ back @ np.swapaxes(rows, 1, 2)
    shares, directions = np.linalg.eigh(hat)
    along = np.einsum("nij,ni->nj", directions, residuals) / np.sqrt(1.0 - np.minimum(shares, _MOST_LEVERAGE))
    gradients = np.einsum("nri,nrj,nj->ni", rows, directions, along)
    covariance: Array = back @ (gradients.T @ gradients) @ back
    return covariance[6:, 6:]


def _motion(step: Array) -> Array:
    """Rigid transform of a small motion (t, ω)."""
    x, y, z = step[3:]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = float(np.linalg.norm(step[3:]))
    near = angle < 1e-6
    sine, cosine = (1.0, 0.5) if near else (np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2)
    motion = np.eye(4)
    motion[:3, :3] += sine * cross + cosine * (cross @ cross)
    motion[:3, 3] = step[:3]
    return motion


def _axial(rotations: Array) -> Array:
    """Axes (n, 3) of rotations, multiplied by the sines of their angles."""
    skew = rotations - np.swapaxes(rotations, 1, 2)
    axes: Array = 0.5 * np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    return axes
