"""The pathway in the layout of the kernels: one row of numbers per segment, and the radii of every contour."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .checks import LARGEST_COORDINATE_MM
from .inner_line import inner_lines

# Columns of PackedPathway.rows; vectors take three.
START, END = 0, 3  # P_j, P_{j+1} mm
START_TANGENT, END_TANGENT = 6, 9  # M_j, M_{j+1}
START_RADIUS, END_RADIUS = 12, 13  # the contours' largest radius, mm
BALL, BALL_RADIUS = 14, 17  # contains both contours' discs, and so the whole segment
INSCRIBED_RADIUS = 18  # mm; every point between the contours' planes that is closer to the axis line is inside
AXIS, LENGTH = 19, 22  # unit vector from P_j to P_{j+1} and their distance in mm
START_FIRST, START_SECOND, END_FIRST, END_SECOND = 23, 26, 29, 32  # directions of the polar angles 0 and π/2
SECTION = 35  # number of columns that section.py reads
LIPSCHITZ = 35  # Λ_j: Lipschitz constant of the deviation where h is at least half the inscribed radius
INNER_LINE = 36  # height mm, slope, factor and √(1 + slope²) of the line below the wall (inner_line.py)
START_FACING, END_FACING = 40, 41  # M_j·e, M_{j+1}·e
START_LEAN, END_LEAN = 42, 43  # M_j·w, M_{j+1}·w; w: projection of first_j perpendicular to e, for points on the axis
START_COSINE, START_SINE, END_COSINE, END_SINE = 44, 47, 50, 53  # ⊥ e; times the offset w from the axis: parts of ρ
BEHIND, BEYOND = 56, 57  # mm; largest distance of the wall behind the first contour's plane, and beyond the last one's
ROW = 58

_ROUNDING = 1e-12  # relative allowance of ball and inscribed radius for rounding


class PackedPathway(NamedTuple):
    """A pathway at one moment.

    rows: (S, ROW), one row a segment, read-only and C-contiguous; the columns are named above.
    polar: (S + 1, A) mm, radii of every contour at the polar angles 2πa/A, linear in the angle between them; A is 1
        for circular contours and at least 3 for others. The direction at the angle ψ is cos ψ · first + sin ψ ·
        second, with second = tangent × first.
    """

    rows: Array
    polar: Array


def check_packed(packed: PackedPathway) -> None:
    """Check that rows and polar are as ``pack`` makes them: the kernels do not check, and to them NaN is inside.

    Raises:
        InputError: arrays of other shapes or kinds, or a non-finite value.
    """
    if not isinstance(packed, PackedPathway):
        raise InputError(f"{packed!r:.60} is no packed pathway: take one from Pathway.packed")
    rows, polar = packed
    for array in (rows, polar):
        if not (isinstance(array, np.ndarray) and array.dtype == np.float64 and array.flags.c_contiguous):
            raise InputError("a packed pathway is of contiguous arrays of float64: take it from Pathway.packed")
    if rows.ndim != 2 or rows.shape[1] != ROW or not len(rows) or polar.ndim != 2 or len(polar) != len(rows) + 1:
        raise InputError(
            f"a packed pathway is (S, {ROW}) and (S + 1, A), not {rows.shape} and {polar.shape}: "
            "take it from Pathway.packed"
        )
    if polar.shape[1] < 1 or polar.shape[1] == 2:
        raise InputError(f"contours of {polar.shape[1]} radii: give one for circles, else at least three")
    # The Lipschitz constant is infinite where the inscribed radius is 0.
    places = np.abs(rows[:, :LIPSCHITZ]).max() <= LARGEST_COORDINATE_MM and polar.max() <= LARGEST_COORDINATE_MM
    if not (places and np.isfinite(rows[:, LIPSCHITZ + 1 :]).all() and (polar > 0.0).all()) or np.isnan(rows).any():
        raise InputError("a packed pathway holds a value that is not finite: take it from Pathway.packed")


def pack(centre: Array, tangent: Array, first: Array, radius: Array) -> PackedPathway:
    """Compute the rows for validated contours (``checks.py``).

    Args:
        centre: (C, 3) mm.
        tangent: (C, 3) unit, the contours' normals along the pathway.
        first: (C, 3) unit, perpendicular to the tangents: the polar angle 0.
        radius: (C, A) mm.
    """
    rows = np.zeros((len(centre) - 1, ROW))
    polar = np.array(radius, dtype=np.float64, order="C")
    second = _cross(tangent, first)
    along = centre[1:] - centre[:-1]
    length = np.linalg.norm(along, axis=1)
    axis = along / length[:, None]
    largest, smallest = polar.max(axis=1), polar.min(axis=1)
    facing = np.einsum("ij,ij->i", tangent[:-1], axis), np.einsum("ij,ij->i", tangent[1:], axis)
    rows[:, START : START + 3], rows[:, END : END + 3] = centre[:-1], centre[1:]
    rows[:, START_TANGENT : START_TANGENT + 3], rows[:, END_TANGENT : END_TANGENT + 3] = tangent[:-1], tangent[1:]
    rows[:, START_RADIUS], rows[:, END_RADIUS] = largest[:-1], largest[1:]
    rows[:, BALL : BALL + 3] = 0.5 * (centre[:-1] + centre[1:])
    rows[:, BALL_RADIUS] = np.maximum(
        _farthest(0.5 * length, largest[:-1], facing[0]), _farthest(0.5 * length, largest[1:], facing[1])
    )
    # In the plane of the axis and a point the contour's rim is at the height R a / √(a² + b²) above the axis, with
    # a = M·e and b the component of M along the other direction of that plane; a² + b² ≤ 1. The wall between the rims
    # is straight.
    inscribed = np.maximum(np.minimum(smallest[:-1] * facing[0], smallest[1:] * facing[1]) * (1.0 - _ROUNDING), 0.0)
    rows[:, INSCRIBED_RADIUS] = inscribed
    rows[:, AXIS : AXIS + 3], rows[:, LENGTH] = axis, length
    rows[:, START_FIRST : START_FIRST + 3], rows[:, START_SECOND : START_SECOND + 3] = first[:-1], second[:-1]
    rows[:, END_FIRST : END_FIRST + 3], rows[:, END_SECOND : END_SECOND + 3] = first[1:], second[1:]
    rows[:, LIPSCHITZ] = _lipschitz(polar, inscribed, facing)
    rows[:, INNER_LINE : INNER_LINE + 4] = inner_lines(smallest, length, facing)
    rows[:, START_FACING], rows[:, END_FACING] = facing
    across = first[:-1] - np.einsum("ij,ij->i", first[:-1], axis)[:, None] * axis
    across /= np.linalg.norm(across, axis=1)[:, None]
    rows[:, START_LEAN] = np.einsum("ij,ij->i", tangent[:-1], across)
    rows[:, END_LEAN] = np.einsum("ij,ij->i", tangent[1:], across)
    _put_parts(rows, tangent, first, second, axis, facing)
    across = np.linalg.norm(_cross(tangent[:-1], tangent[1:]), axis=1)
    rows[:, BEHIND] = np.maximum(across * largest[1:] - length * facing[0], 0.0)
    rows[:, BEYOND] = np.maximum(across * largest[:-1] - length * facing[1], 0.0)
    rows.setflags(write=False)
    polar.setflags(write=False)
    return PackedPathway(rows, polar)


def _cross(one: Array, two: Array) -> Array:
    """Cross products (n, 3): ``np.cross`` without what it does for other shapes, as a control step packs."""
    (x, y, z), (u, v, w) = one.T, two.T
    found = np.empty_like(one)
    found[:, 0], found[:, 1], found[:, 2] = y * w - z * v, z * u - x * w, x * v - y * u
    return found


def _put_parts(
    rows: Array, tangent: Array, first: Array, second: Array, axis: Array, facing: tuple[Array, Array]
) -> None:
    """Write the components of ρ along both contours' polar directions, as vectors to be multiplied by w.

    In the plane of e and w, eq. 2 is ρ ~ (M·e) w - (M·w) e, so ρ·first = ((M·e) first - (first·e) M)·w.
    """
    for end, at in ((0, START_COSINE), (1, END_COSINE)):
        own = slice(end, len(tangent) - 1 + end)
        for k, polar_direction in enumerate((first[own], second[own])):
            along = np.einsum("ij,ij->i", polar_direction, axis)
            part = facing[end][:, None] * polar_direction - along[:, None] * tangent[own]
            rows[:, at + 3 * k : at + 3 * k + 3] = part


def _farthest(half: Array, radius: Array, facing: Array) -> Array:
    """Distance (S,) from the midpoint of each axis to the farthest point of a disc about its end."""
    sine = np.sqrt(np.maximum(1.0 - facing**2, 0.0))  # component of the axis in the disc's plane
    far: Array = np.sqrt(half**2 + radius**2 + 2.0 * half * radius * sine) * (1.0 + _ROUNDING)
    return far


def _lipschitz(polar: Array, inscribed: Array, facing: tuple[Array, Array]) -> Array:
    """Λ_j (S,) = √(1 + (2 K_j / c_j)²), c_j the inscribed radius; infinite if that is 0.

    ``clearance.lipschitz_constant`` states what it bounds, and the proof.
    K_j is the displacement of an end of the wall in its section per angle of rotation of the section about the axis: by
    R tan β across, since the contour is inclined, and by |R'| / cos β along, cos β = M·e.
    """
    angles = polar.shape[1]
    rate = np.abs(np.roll(polar, -1, axis=1) - polar).max(axis=1) * angles / (2.0 * np.pi)
    largest = polar.max(axis=1)
    with np.errstate(divide="ignore"):
        turned = [
            np.hypot(radius * np.sqrt(np.maximum(1.0 - cosine**2, 0.0)), change) / (0.5 * cosine * inscribed)
            for radius, change, cosine in ((largest[:-1], rate[:-1], facing[0]), (largest[1:], rate[1:], facing[1]))
        ]
        return np.asarray(np.hypot(1.0, np.maximum(*turned)))
