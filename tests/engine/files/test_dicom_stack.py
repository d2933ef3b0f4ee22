"""Where the slices of a series are placed: on a line at right angles, resampled onto one, or refused (HAZ-37)."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pydicom
import pytest
from imaging_phantoms import asymmetric_volume, dicom_slices, rotation, save_dicom
from label_files import ellipsoid, save_dicom_seg
from scipy.ndimage import binary_erosion
from scipy.special import erf

from vfix_engine.anatomy.labels.reading import read_label_map
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.errors import ImageError
from vfix_engine.files.dicom_stack import Slice, stack
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume

Floats = np.ndarray
PIXEL_MM = np.array([0.5, 0.6])


def ramp(points: Floats) -> Floats:
    """Hounsfield units that rise along all three axes, the same in any frame."""
    return 40.0 * points[..., 0] - 60.0 * points[..., 1] + 30.0 * points[..., 2]


def ball(points: Floats, radius: float = 9.0, blur: float = 0.45) -> Floats:
    """A ball of 1,000 HU in tissue of 0 HU around the origin, blurred as by a scanner [mm]."""
    return 500.0 * (1.0 - erf((np.linalg.norm(points, axis=-1) - radius) / (np.sqrt(2.0) * blur)))


def sliced(
    of: Callable[[Floats], Floats], offsets: Floats, size: tuple[int, int] = (48, 44), axes: Floats | None = None
) -> list[Slice]:
    """Slices of an analytic body; offsets: (n, 3) of each first pixel along rows, columns and normal [mm]."""
    turned = np.eye(3) if axes is None else axes
    rows, columns = size
    j, i = np.indices(size)
    middle = 0.5 * np.array([(columns - 1) * PIXEL_MM[0], (rows - 1) * PIXEL_MM[1], 0.0])
    made = []
    for number, offset in enumerate(offsets - [*offsets[:, :2].mean(axis=0), offsets[:, 2].mean()]):
        local = np.stack([i * PIXEL_MM[0], j * PIXEL_MM[1], np.zeros(size)], axis=-1) + offset - middle
        hu = np.rint(of(local @ turned.T)).astype(np.int16)
        position = turned @ (offset - middle)
        made.append(Slice(hu, position, turned[:, :2], PIXEL_MM, None, None, f"slice {number}", f"slice {number}"))
    return made


def tilted(count: int, spacing: float, degrees: float, along: int = 1) -> Floats:
    offsets = np.zeros((count, 3))
    offsets[:, 2] = spacing * np.arange(count)
    offsets[:, along] = np.tan(np.radians(degrees)) * offsets[:, 2]
    return offsets


def inner(volume: Volume, margin: int = 4) -> tuple[Floats, Floats]:
    """LPS places and Hounsfield units of the voxels that some slice covers, without those at its edges."""
    covered = binary_erosion(volume.hu != -1000, np.ones((1, 2 * margin + 1, 2 * margin + 1)))
    index = np.argwhere(covered)
    return volume.index_to_lps(index[:, ::-1]), volume.hu[tuple(index.T)]


@pytest.mark.parametrize("degrees", [-25.0, 1.0, 12.0, 18.5])
@pytest.mark.parametrize("along", [0, 1])
def test_a_tilted_ramp_is_placed_where_it_is(degrees: float, along: int) -> None:
    """HAZ-37: the ramp has 60 HU a mm, so that 3 HU are 0.05 mm."""
    turned = rotation((10.0, 20.0, 30.0))
    volume, notes = stack(sliced(ramp, tilted(30, 1.25, degrees, along), axes=turned))
    places, hu = inner(volume)
    assert len(hu) > 10_000
    assert np.abs(hu - ramp(places)).max() < 3.0
    assert f"{abs(degrees):.1f}°" in notes[0]
    assert volume.resampled_mm is not None


@pytest.mark.parametrize("degrees", [1.0, 12.0, 25.0])
def test_a_tilted_ball_has_its_surface_and_the_error_told_covers_it(degrees: float) -> None:
    """HAZ-37: against the ball itself, and against the same ball scanned upright, whose border has its own error."""
    upright, _ = stack(sliced(ball, tilted(44, 0.5, 0.0)))
    aslant, _ = stack(sliced(ball, tilted(44, 0.5, degrees), (80, 60)))
    own, found = (np.linalg.norm(extract_surface(one, 500.0).vertices, axis=1) - 9.0 for one in (upright, aslant))
    assert aslant.resampled_mm is not None
    assert np.abs(found).max() < 0.05
    assert np.percentile(np.abs(found), 95) <= np.percentile(np.abs(own), 95) + aslant.resampled_mm
    assert upright.resampled_mm is None


def test_one_degree_of_shear_is_not_dropped(tmp_path: Path) -> None:
    """HAZ-37: 400 slices of 0.5 mm with one degree: each gap is within any tolerance, and the last is 3.5 mm off."""
    volume, notes = stack(sliced(ball, tilted(400, 0.5, 1.0), (40, 40)))
    places, hu = inner(volume)
    assert np.abs(hu - ball(places)).max() < 25.0
    assert "3.5 mm" in notes[0]


def test_slices_that_jitter_sideways_are_placed_one_by_one() -> None:
    """HAZ-37."""
    offsets = tilted(30, 1.0, 0.0)
    offsets[:, :2] += np.random.default_rng(5).uniform(-0.4, 0.4, (30, 2))
    volume, _ = stack(sliced(ramp, offsets))
    places, hu = inner(volume)
    assert np.abs(hu - ramp(places)).max() < 3.0


@pytest.mark.parametrize("which", [slice(17, 18), slice(15, 30)])
def test_slices_that_lie_aside_of_the_line_are_refused(which: slice) -> None:
    """HAZ-37: one slice, or the upper half; no tilt explains it, and where they belong nobody can tell."""
    offsets = tilted(30, 1.0, 0.0)
    offsets[which, 0] += 20.0
    with pytest.raises(ImageError, match=r"mm to the side of the line through the slices"):
        stack(sliced(ramp, offsets))


@pytest.mark.parametrize(
    ("heights", "figures"),
    [
        (np.cumsum([0.0] + [0.49] * 200 + [0.51] * 199), ("0.49 mm (200x)", "0.51 mm (199x)", "1.00 mm off")),
        (np.arange(400) * 0.5 + 1e-5 * np.arange(400) ** 2, ("off its even place",)),
        (np.delete(np.arange(60) * 0.4, 59 - 1), ("0.80 mm (1x)",)),
        (np.arange(40) * 3.0 + 0.15 * (np.arange(40) == 20), ("3.15 mm", "2.85 mm")),
        (np.arange(40) * 0.15 + 0.03 * (np.arange(40) == 7), ("0.03 mm off",)),
    ],
)
def test_uneven_slices_are_refused_with_the_figure(heights: Floats, figures: tuple[str, ...]) -> None:
    """HAZ-37: two gaps, a drift, a slice missing next to the end, one slice off."""
    offsets = np.zeros((len(heights), 3))
    offsets[:, 2] = heights
    with pytest.raises(ImageError, match="not evenly spaced") as refused:
        stack(sliced(ramp, offsets, (4, 4)))
    for figure in figures:
        assert figure in str(refused.value)


def test_rounded_positions_are_placed_within_the_tolerance() -> None:
    """Written with two decimals: read as they are, on the line that fits them."""
    offsets = np.round(tilted(300, 0.6249, 0.0) + np.array([0.003, 0.004, 0.0]), 2)
    offsets[:, :2] += np.round(np.random.default_rng(3).uniform(-0.01, 0.01, (300, 2)), 2)
    volume, notes = stack(sliced(ramp, offsets, (4, 4)))
    assert notes == ()
    assert volume.spacing[2] == pytest.approx(0.6249, abs=1e-5)


def test_a_doubled_slice_is_named_with_its_file(tmp_path: Path) -> None:
    """HAZ-15: and whether it is a copy."""
    for other, words in ((False, "copies of the same image"), (True, "different images")):
        slices = dicom_slices(asymmetric_volume())
        twice = dicom_slices(asymmetric_volume())[4]
        twice.SeriesInstanceUID = slices[0].SeriesInstanceUID
        if other:
            twice.PixelData = bytes(len(twice.PixelData))
        folder = save_dicom(slices, tmp_path / words.replace(" ", ""))
        pydicom.dcmwrite(folder / "004 (1).dcm", twice, enforce_file_format=True)
        with pytest.raises(ImageError, match="same position") as refused:
            read_volume(folder)
        assert "'004.dcm'" in str(refused.value)
        assert "'004 (1).dcm'" in str(refused.value)
        assert words in str(refused.value)


def test_frames_of_a_segmentation_off_their_grid_are_refused(tmp_path: Path) -> None:
    """HAZ-37: each gap is within what the library takes, and the last frame is not where its grid says."""
    volume = asymmetric_volume()
    mask = ellipsoid(volume.hu.shape, (7, 6, 4), (4, 3, 3.9))
    file = save_dicom_seg(tmp_path / "seg.dcm", [mask], ["Eye"], volume)
    assert read_label_map(file, {}).labels
    seg = pydicom.dcmread(file)
    for group in seg.PerFrameFunctionalGroupsSequence:
        place = group.PlanePositionSequence[0].ImagePositionPatient
        place[1] = float(place[1]) + 0.05 * (float(place[2]) - 40.0)
    seg.save_as(file)
    with pytest.raises(ImageError, match=r"mm off the even places|regular grid"):
        read_label_map(file, {})
