"""Islands as voxels: what is kept is what the surface is made of; half the resolution against scipy on every second."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from vfix_engine.anatomy.islands import islands
from vfix_engine.anatomy.segmentation import PRESETS, Band, SegmentRequest, segment
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import Volume

SPACING = np.array([0.5, 0.6, 0.8])


def specks() -> Volume:
    """Noise that was blurred: islands of many sizes."""
    noise = ndimage.gaussian_filter(np.random.default_rng(4).normal(size=(40, 44, 50)), 1.5)
    return Volume((noise / noise.std() * 300).astype(np.int16), np.array([3.0, 4.0, 5.0]), SPACING, np.eye(3))


def by_scipy(mask: np.ndarray, least_voxels: float) -> np.ndarray:
    labels, count = ndimage.label(mask)
    sizes = ndimage.sum(mask, labels, range(1, count + 1))
    return np.isin(labels, 1 + np.flatnonzero(sizes >= least_voxels))


@pytest.mark.parametrize("step", [1, 2])
def test_what_is_kept_is_what_scipy_keeps(step: int) -> None:
    volume, voxel = specks(), float(np.prod(SPACING)) * step**3
    found = islands(volume, SegmentRequest(Band(200.0, 5000.0), least_mm3=30.0), step)
    chosen = volume.hu[::step, ::step, ::step] >= 200
    np.testing.assert_array_equal(found.mask, by_scipy(chosen, 30.0 / voxel))
    assert (found.step, found.islands) == (step, ndimage.label(chosen)[1])
    assert found.left_out == found.islands - ndimage.label(found.mask)[1]
    assert found.volume_mm3 == pytest.approx(found.mask.sum() * voxel)


def test_the_crop_box_and_the_largest_are_those_of_the_surface() -> None:
    volume, box = specks(), ((8.0, 10.0, 12.0), (20.0, 22.0, 30.0))
    request = SegmentRequest(Band(100.0, 5000.0), box, largest=True)
    found, surface = islands(volume, request), segment(volume, request)
    assert (found.volume_mm3, found.islands, found.left_out) == pytest.approx(
        (surface.volume_mm3, surface.islands, surface.left_out)
    )
    k, j, i = np.nonzero(found.mask)
    places = volume.index_to_lps(np.stack([i, j, k], axis=1).astype(float))
    assert (places >= np.array(box[0]) - 1e-9).all()
    assert (places <= np.array(box[1]) + 1e-9).all()


def test_air_is_kept_within_the_body() -> None:
    hu = np.full((30, 60, 60), -1000, dtype=np.int16)
    hu[:, 10:50, 10:50] = 40
    hu[10:20, 25:32, 25:32] = -1000
    found = islands(Volume(hu, np.zeros(3), np.ones(3), np.eye(3)), SegmentRequest(PRESETS["air"]), 2)
    np.testing.assert_array_equal(np.argwhere(found.mask).min(axis=0), [5, 13, 13])
    np.testing.assert_array_equal(np.argwhere(found.mask).max(axis=0), [9, 15, 15])


def test_what_holds_nothing_is_refused() -> None:
    with pytest.raises(ImageError, match="no voxel"):
        islands(specks(), SegmentRequest(Band(9000.0, 9900.0)))
    with pytest.raises(ImageError, match="steps"):
        islands(specks(), SegmentRequest(Band(0.0, 900.0)), 30)
