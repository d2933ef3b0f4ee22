"""A tool in a solid: along which length, how deep, and where; against a half-space."""

import numpy as np
import pytest
from numpy.typing import NDArray

from vfix_engine.proximity.fields.distance_field import DistanceField, field_of_level
from vfix_engine.proximity.fields.tool_depth import tool_depth

Array = NDArray[np.float64]


def below(points: Array) -> Array:
    """Level of the half-space z < 0; not known beyond z = 15."""
    level: Array = np.where(points[:, 2] > 15.0, np.nan, -points[:, 2])
    return level


def test_length_depth_and_place_in_a_half_space() -> None:
    field = field_of_level(below, [[-20.0] * 3, [20.0] * 3], 1.0)
    # A tip of 4 mm and a shaft of 16 mm, upright: from z = -5 to 15, then the same 3 mm higher, then free.
    start = np.array([[[0.0, 0.0, z + 4.0], [0.0, 0.0, z + 18.0]] for z in (-5.0, -2.0, 3.0)])
    end = np.array([[[0.0, 0.0, z], [0.0, 0.0, z + 4.0]] for z in (-5.0, -2.0, 3.0)])
    found = tool_depth(field, start, end, np.array([1.0, 0.5]), near=[0.0, 0.0, -5.0], near_mm=2.0)
    # The tip's axis below z = 1, the shaft's below 0.5: their surface is in the solid there.
    assert found.length == pytest.approx([5.5, 3.0, 0.0], abs=0.51)
    assert found.near_length == pytest.approx([2.0, 0.0, 0.0], abs=0.51)
    assert found.depth == pytest.approx([6.0, 3.0, 0.0], abs=0.3)
    assert found.place[0] == pytest.approx([0.0, 0.0, -5.0], abs=0.3)
    assert list(found.segment[:2]) == [0, 0]
    assert found.not_known == pytest.approx([0.0, 1.0, 6.0], abs=1.1)


def side_in(field: DistanceField, start: Array, end: Array, radius: Array) -> float:
    """Length of a tool whose side is in a solid, by brute force: 48 places around each 0.1 mm of its axis."""
    total = 0.0
    turns = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    for a, b, r in zip(start, end, radius, strict=True):
        along = (b - a) / np.linalg.norm(b - a)
        u = np.cross(along, np.eye(3)[np.abs(along).argmin()])
        u /= np.linalg.norm(u)
        ring = r * (np.cos(turns)[:, None] * u + np.sin(turns)[:, None] * np.cross(along, u))
        places = a + np.arange(0.05, float(np.linalg.norm(b - a)), 0.1)[:, None] * along
        found = field.at((places[:, None] + ring).reshape(-1, 3)).reshape(len(places), len(turns))
        total += 0.1 * float((found < 0.0).any(axis=1).sum())
    return total


@pytest.mark.parametrize("tilt_deg", [0.0, 35.0, 70.0, 88.0])
def test_each_contact_is_told_longer_by_two_radii_at_most(tilt_deg: float) -> None:
    """The ball of the tool around a place of its axis reaches into the solid before the tool's side does."""
    slab = field_of_level(lambda points: 4.0 - np.abs(points[:, 2]), [[-30.0] * 3, [30.0] * 3], 0.5)
    tilt = np.radians(tilt_deg)
    along = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    start, end = -25.0 * along, 25.0 * along
    radius = np.array([1.5])
    found = tool_depth(slab, start[None, None], end[None, None], radius, near=[0.0, 0.0, 0.0], near_mm=1.0)
    told, side = float(found.length[0]), side_in(slab, start[None], end[None], radius)
    assert side - 0.6 <= told <= side + 3.0 + 0.6  # 0.5 mm of sampling, and the field's own error
    if tilt_deg == 0.0:
        assert (told, side) == (pytest.approx(11.0, abs=0.6), pytest.approx(8.0, abs=0.2))
