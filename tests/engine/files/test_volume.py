"""The mapping between voxels and patient, and the slice pictures."""

import tracemalloc

import numpy as np
import pytest
from imaging_phantoms import asymmetric_volume, rotation
from scipy.ndimage import map_coordinates

from vfix_engine.errors import ImageError
from vfix_engine.files.volume import Volume

OBLIQUE = rotation((20.0, 10.0, -35.0))
FLIPPED = np.diag([-1.0, 1.0, -1.0])
MIRRORED = np.diag([1.0, 1.0, -1.0])
PERMUTED = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
DIRECTIONS = pytest.mark.parametrize("direction", [np.eye(3), FLIPPED, MIRRORED, PERMUTED, OBLIQUE])


def expected_hu(volume: Volume, points: np.ndarray, outside: float) -> np.ndarray:
    """Independent trilinear sampling by scipy; voxel indices from the inverse of the whole affine."""
    inverse = np.linalg.inv(volume.transform_index_to_lps)
    indices = points @ inverse[:3, :3].T + inverse[:3, 3]
    last = np.array(volume.hu.shape[::-1]) - 1.0
    inside = ((indices > -1e-7) & (indices < last + 1e-7)).all(axis=1)
    values = map_coordinates(volume.hu.astype(float), np.clip(indices, 0, last)[:, ::-1].T, order=1)
    return np.where(inside, values, outside)


@DIRECTIONS
def test_indices_and_positions_are_inverse(direction: np.ndarray) -> None:
    volume = asymmetric_volume(direction)
    ijk = np.random.default_rng(0).uniform(-5, 20, (50, 3))
    assert np.allclose(volume.lps_to_index(volume.index_to_lps(ijk)), ijk, atol=1e-12)
    assert np.allclose(volume.index_to_lps([0, 0, 0]), volume.origin)
    step = volume.index_to_lps([1, 0, 0]) - volume.origin
    assert np.allclose(step, direction[:, 0] * volume.spacing[0])


@DIRECTIONS
@pytest.mark.parametrize("axis", ["axial", "coronal", "sagittal"])
def test_slice_shows_what_lies_at_each_pixel(direction: np.ndarray, axis: str) -> None:
    """Every pixel against scipy's sampling at the LPS position that the returned affine gives it."""
    volume = asymmetric_volume(direction)
    through = {"sagittal": 0, "coronal": 1, "axial": 2}[axis]
    position = volume.bounds[:, through] @ [0.4, 0.6]
    image, transform = volume.slice_image(axis, position, window=3000.0, level=200.0)
    rows, columns = np.indices(image.shape)
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1)
    points = pixels @ transform[:3, :2].T + transform[:3, 3]
    assert np.allclose(points[:, through], position)
    grey = np.clip((expected_hu(volume, points, -np.inf) + 1300.0) / 3000.0 * 255.0, 0, 255)
    assert np.abs(image.ravel() - grey).max() <= 0.51  # rounding to whole greys
    assert (image > 0).mean() > 0.1


def test_slice_is_the_voxels_themselves_where_pixels_meet_them() -> None:
    hu = np.arange(-200, -200 + 4 * 5 * 6).reshape(4, 5, 6).astype(np.int16)
    volume = Volume(hu, [10.0, 20.0, 30.0], [1.0, 1.0, 1.0], FLIPPED)
    image, transform = volume.slice_image("axial", 28.0, window=255.0, level=-72.5)
    assert np.array_equal(image, hu[2, :, ::-1] + 200)
    assert np.allclose(transform[:3, 3], [5.0, 20.0, 28.0])
    image, transform = volume.slice_image("sagittal", 7.0, window=255.0, level=-72.5)
    assert np.array_equal(image, hu[:, :, 3] + 200)
    assert np.allclose(transform[:3, 3], [7.0, 20.0, 30.0])
    assert np.allclose(transform[:3, :2], [[0, 0], [1, 0], [0, -1]])


def test_views_are_the_radiologists() -> None:
    """Columns and rows run left/posterior, left/inferior, posterior/inferior."""
    volume = asymmetric_volume()
    for axis, column, row in [
        ("axial", [1, 0, 0], [0, 1, 0]),
        ("coronal", [1, 0, 0], [0, 0, -1]),
        ("sagittal", [0, 1, 0], [0, 0, -1]),
    ]:
        through = {"sagittal": 0, "coronal": 1, "axial": 2}[axis]
        _, transform = volume.slice_image(axis, volume.bounds[0, through])
        assert np.allclose(transform[:3, :2], 0.5 * np.array([column, row]).T)


@pytest.mark.parametrize("axis", ["axial", "coronal", "sagittal"])
def test_slice_of_a_clinical_volume_works_on_its_plane_alone(axis: str) -> None:
    """512 x 512 pixels: what is made on the way is a few planes, not the volume of 157 MB."""
    hu = np.zeros((300, 512, 512), dtype=np.int16)
    volume = Volume(hu, np.zeros(3), [0.4, 0.4, 0.4], np.eye(3))
    volume.slice_image(axis, 50.0)
    tracemalloc.start()
    try:
        volume.slice_image(axis, 60.0)
        assert tracemalloc.get_traced_memory()[1] < 16e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("axis", "position", "window"),
    [("axial", 1e4, 100.0), ("axial", np.nan, 100.0), ("oblique", 45.0, 100.0), ("axial", 45.0, 0.0)],
)
def test_slice_that_cannot_be_is_refused(axis: str, position: float, window: float) -> None:
    with pytest.raises(ImageError):
        asymmetric_volume().slice_image(axis, position, window)  # type: ignore[arg-type]


@DIRECTIONS
def test_sample_agrees_with_scipy(direction: np.ndarray) -> None:
    volume = asymmetric_volume(direction)
    points = np.random.default_rng(1).uniform(volume.bounds[0] - 2.0, volume.bounds[1] + 2.0, (500, 3))
    assert np.allclose(volume.sample(points), expected_hu(volume, points, -1000.0), atol=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        {"hu": np.zeros((1, 4, 4), dtype=np.int16)},
        {"hu": np.zeros((4, 4, 4))},
        {"origin": [0.0, np.nan, 0.0]},
        {"spacing": [1.0, 0.0, 1.0]},
        {"direction": np.array([[1.0, 0.3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])},
    ],
)
def test_grid_that_is_no_grid_is_refused(change: dict[str, np.ndarray]) -> None:
    good = {"hu": np.zeros((4, 4, 4), dtype=np.int16), "origin": np.zeros(3), "spacing": np.ones(3)}
    with pytest.raises(ImageError):
        Volume(**({**good, "direction": np.eye(3)} | change))


def test_arrays_are_read_only() -> None:
    volume = asymmetric_volume()
    for array in (volume.hu, volume.origin, volume.spacing, volume.direction):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
