"""Rescale and unit of DICOM slices, and DICOM files that are cut off or lie there under other names."""

from pathlib import Path

import numpy as np
import pytest
from pydicom.dataset import FileDataset
from pydicom.uid import RLELossless

from tests.engine.imaging_phantoms import asymmetric_volume, dicom_slices, save_dicom
from vfix_engine.errors import ImageError
from vfix_engine.files.dicom import read_series

FOREIGN = "not known to be in Hounsfield units"


def rescaled(steps: float, packed: bool = False) -> list[FileDataset]:
    """The slices, each stored with a slope and an intercept of its own that give the same values."""
    volume = asymmetric_volume()
    slices = dicom_slices(volume)
    for k, one in enumerate(slices):
        slope, intercept = 1.0 + steps * (k % 3), -1024 - 100 * steps * k
        one.RescaleSlope, one.RescaleIntercept = f"{slope:g}", f"{intercept:g}"
        stored = np.rint((volume.hu[k] - intercept) / slope).astype("<u2")
        one.PixelData = stored.tobytes()
        if packed:
            one.compress(RLELossless)
    return slices


@pytest.mark.parametrize("packed", [False, True])
def test_each_slice_is_rescaled_by_its_own_values(tmp_path: Path, packed: bool) -> None:
    """HAZ-15: and that they differ is told."""
    read = read_series(save_dicom(rescaled(0.5, packed), tmp_path / "series"))
    assert np.abs(read.volume.hu - asymmetric_volume().hu).max() <= 1  # the largest slope is 2
    (note,) = read.notes
    assert note.startswith("The slices are rescaled differently: slopes from 1 to 2, intercepts from -1424 to -1024.")
    assert read_series(save_dicom(rescaled(1e-5), tmp_path / "rounded")).notes == ()


def test_units_that_differ_are_refused_and_foreign_ones_told(tmp_path: Path) -> None:
    """HAZ-15: by the standard a CT that says none is in Hounsfield units; text of the file is not quoted."""
    slices = dicom_slices(asymmetric_volume())
    for one in slices[::2]:
        one.RescaleType = "HU"
    assert read_series(save_dicom(slices, tmp_path / "hu")).notes == ()
    slices[3].RescaleType = "US"
    with pytest.raises(ImageError, match=r"different units: .*Hounsfield.* an unspecified unit in .*'005\.dcm'"):
        read_series(save_dicom(slices, tmp_path / "mixed"))
    for unit, words in (("US", "an unspecified unit"), ("ED", "ED"), ("CANARY", "another unit")):
        for one in slices:
            one.RescaleType = unit
        (note,) = read_series(save_dicom(slices, tmp_path / unit)).notes
        assert FOREIGN in note
        assert f"are in {words}." in note
    for one in slices:
        one.Modality = "MR"
    assert read_series(save_dicom(slices, tmp_path / "mr"), modalities=("CT", "MR")).notes == ()


@pytest.mark.parametrize("name", ["viewer.exe", "readme.txt", ".IM0004", "VIEWER/app.dll", "VIEWER/IM4"])
def test_a_file_that_begins_as_dicom_is_read_or_named(tmp_path: Path, name: str) -> None:
    """HAZ-15: under whatever name, cut off wherever; also where another series is asked for."""
    folder = save_dicom(dicom_slices(asymmetric_volume()), tmp_path / "disc")
    (folder / "VIEWER").mkdir()
    (folder / "VIEWER" / "run.exe").write_bytes(b"MZ" + bytes(500))
    data = (folder / "004.dcm").read_bytes()
    (folder / "004.dcm").rename(folder / name)
    assert np.array_equal(read_series(folder).volume.hu, asymmetric_volume().hu)
    for length in (132, 150, 300, 400, 500, 560, 700, 850, 1000, len(data) - 2):
        (folder / name).write_bytes(data[:length])
        with pytest.raises(ImageError, match=f"the file '{Path(name).name}'"):
            read_series(folder, 1)


@pytest.mark.parametrize("spacing", [[-1.0, 1.0], [1.0, -1.0], [0.0, 1.0]])
def test_a_spacing_that_is_not_above_zero_is_refused(tmp_path: Path, spacing: list[float]) -> None:
    """HAZ-14: a negative one would mirror the head."""
    slices = dicom_slices(asymmetric_volume())
    for one in slices:
        one.PixelSpacing = spacing
    with pytest.raises(ImageError, match=r"the PixelSpacing of .* must be above 0"):
        read_series(save_dicom(slices, tmp_path / "series"))


def test_slices_of_several_frames_of_reference_are_refused(tmp_path: Path) -> None:
    """HAZ-37: their positions cannot be compared; files that name none are read."""
    slices = dicom_slices(asymmetric_volume())
    for one in slices:
        one.FrameOfReferenceUID = "1.2.3"
    assert read_series(save_dicom(slices, tmp_path / "one")).volume.hu.shape == asymmetric_volume().hu.shape
    del slices[1].FrameOfReferenceUID
    assert read_series(save_dicom(slices, tmp_path / "unnamed")).volume.hu.shape == asymmetric_volume().hu.shape
    slices[-1].FrameOfReferenceUID = "1.2.4"
    with pytest.raises(ImageError, match="different frames of reference"):
        read_series(save_dicom(slices, tmp_path / "two"))
