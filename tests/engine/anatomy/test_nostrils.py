"""Nostrils of the shipped head: where they are, on which side, and none where the scan does not show them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest

from vfix_engine.anatomy.nostrils import Nostril, nostrils_of_volume
from vfix_engine.anatomy.phantom import load_head_ct, load_nose_ct
from vfix_engine.arrays import Array
from vfix_engine.files.volume import Volume

CENTRELINE = np.array([(7.5, -14.6, -6.5), (7.4, -13.2, -3.5), (6.7, -11.0, 1.0), (6.0, -7.5, 5.6), (5.6, -1.0, 8.0)])
RADII = 4.0, 5.0  # mm, of the left and right tubes that the head is generated with
TISSUE, AIR = 40, -1000
ASIDE = np.array([60.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def nose() -> Volume:
    return load_nose_ct()


def same_grid(volume: Volume, hu: npt.NDArray[np.integer]) -> Volume:
    return Volume(hu.astype(np.int16), volume.origin, volume.spacing, volume.direction)


def part(volume: Volume, low: Array) -> Volume:
    """The volume from this LPS place on along each axis."""
    i, j, k = np.maximum(np.rint(volume.lps_to_index(low)), 0).astype(int)
    return Volume(volume.hu[k:, j:, i:], volume.index_to_lps([i, j, k]), volume.spacing, volume.direction)


def plugged(volume: Volume, *centres: Array) -> Volume:
    """With tissue within 10 mm of these places."""
    hu = volume.hu.copy()
    for centre in centres:
        at = volume.lps_to_index(centre)[::-1]
        squares = sum(
            ((np.arange(size).reshape([-1 if n == axis else 1 for n in range(3)]) - at[axis]) * step) ** 2
            for axis, (size, step) in enumerate(zip(hu.shape, volume.spacing[::-1], strict=True))
        )
        hu[squares < 100.0] = TISSUE
    return same_grid(volume, hu)


def from_centreline(nostril: Nostril, side: float) -> tuple[float, Array]:
    """Distance [mm] of a nostril from the middle of its tube, and the tube's direction there; side: -1 on the right."""
    line = CENTRELINE * [side, 1.0, 1.0]
    found = []
    for start, end in pairwise(line):
        along = np.clip((nostril.position - start) @ (end - start) / ((end - start) @ (end - start)), 0.0, 1.0)
        away = float(np.linalg.norm(nostril.position - start - along * (end - start)))
        found.append((away, (end - start) / np.linalg.norm(end - start)))
    return min(found, key=lambda one: one[0])


def test_both_nostrils_of_the_shipped_head_are_where_it_was_generated(nose: Volume) -> None:
    for volume in (nose, load_head_ct()):
        found = nostrils_of_volume(volume)
        assert [one.side for one in found] == ["right", "left"]
        for nostril, side in zip(found, (-1.0, 1.0), strict=True):
            away, along = from_centreline(nostril, side)
            assert away < 1.5, "in the middle"
            assert nostril.inward @ along > 0.9
            assert np.linalg.norm(nostril.inward) == pytest.approx(1.0)
            # up to a voxel, of at most 1 mm, is lost on all sides of a place that is itself a voxel
            assert RADII[0] - 1.0 < nostril.radius_mm < RADII[1]
        again = nostrils_of_volume(volume)
        assert all(np.array_equal(one.position, other.position) for one, other in zip(found, again, strict=True))


def test_the_sides_are_those_of_the_patient_however_voxels_are_stored(nose: Volume) -> None:
    k, _, i = nose.hu.shape
    turned = np.ascontiguousarray(nose.hu[::-1, :, ::-1].transpose(1, 2, 0))  # its axes are k, i, j from the far end
    direction = nose.direction[:, [2, 0, 1]] * [-1.0, -1.0, 1.0]
    stored = Volume(turned, nose.index_to_lps([i - 1, 0, k - 1]), nose.spacing[[2, 0, 1]], direction)
    assert np.allclose(stored.bounds, nose.bounds)
    for one, other in zip(nostrils_of_volume(stored), nostrils_of_volume(nose), strict=True):
        assert one.side == other.side
        assert np.linalg.norm(one.position - other.position) < 2.5, "other voxels are skipped"


@pytest.mark.parametrize("every", [2, 4], ids=["1 mm", "2 mm"])
def test_coarse_voxels_show_them_as_well(nose: Volume, every: int) -> None:
    hu = np.ascontiguousarray(nose.hu[::every, ::every, ::every])
    found = nostrils_of_volume(Volume(hu, nose.origin, nose.spacing * every, nose.direction))
    assert [one.side for one in found] == ["right", "left"]
    assert max(from_centreline(one, side)[0] for one, side in zip(found, (-1.0, 1.0), strict=True)) < 2.5


def test_a_single_nostril_is_on_its_side_of_the_tip(nose: Volume) -> None:
    for side, name in ((1.0, "right"), (-1.0, "left")):
        plug = CENTRELINE[2] * [side, 1.0, 1.0]
        (one,) = nostrils_of_volume(plugged(nose, plug))
        assert one.side == name
        assert from_centreline(one, -side)[0] < 1.5
    assert nostrils_of_volume(plugged(nose, CENTRELINE[2], CENTRELINE[2] * [-1.0, 1.0, 1.0])) == ()


def test_a_head_that_lies_aside_in_its_scan_has_the_same_nostrils(nose: Volume) -> None:
    moved = Volume(nose.hu, nose.origin + ASIDE, nose.spacing, nose.direction)
    assert [one.side for one in nostrils_of_volume(moved)] == ["right", "left"]
    (one,) = nostrils_of_volume(plugged(moved, CENTRELINE[2] + ASIDE))
    assert one.side == "right"


def test_a_scan_that_ends_in_the_nose_or_above_it_has_none(nose: Volume) -> None:
    whole = nose.bounds[0]
    assert nostrils_of_volume(part(nose, np.array([whole[0], -4.0, whole[2]]))) == (), "its end opens the airway"
    assert nostrils_of_volume(part(nose, np.array([whole[0], whole[1], 12.0]))) == ()
    unmeasured = np.where(np.indices(nose.hu.shape)[1] < 60, -2000, nose.hu)  # up to y = -6
    assert nostrils_of_volume(same_grid(nose, unmeasured)) == ()


def test_nothing_but_air_or_tissue_has_none() -> None:
    for hu in (AIR, TISSUE):
        assert nostrils_of_volume(Volume(np.full((30, 30, 30), hu, np.int16), np.zeros(3), np.ones(3), np.eye(3))) == ()
