"""How a DICOM file stores its pixels, and what lies beside the slices: read, left out with a note, or refused."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from imaging_phantoms import asymmetric_volume, dicom_slices, save_dicom
from pydicom.dataset import FileDataset

from vfix_engine.errors import ImageError
from vfix_engine.files.readers import read_volume

Slices = list[FileDataset]


def words_of(one: FileDataset) -> np.ndarray:
    return np.frombuffer(one.PixelData, "<u2").astype(np.int64)


def twelve_bits(slices: Slices, lift: int, above: int = 0, signed: bool = False) -> None:
    """12 bits of each word, `lift` bits up, with other bits below and above them."""
    for one in slices:
        values = words_of(one) - (1024 if signed else 0)
        below = (1 << lift) - 1
        words = ((values & 0xFFF) << lift) | below | (above << 12)
        one.PixelData = (words & 0xFFFF).astype("<u2").tobytes()
        one.BitsStored, one.HighBit, one.PixelRepresentation = 12, 11 + lift, int(signed)
        one.RescaleIntercept = 0 if signed else -1024


@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize(("lift", "above"), [(0, 0), (0, 0xA), (4, 0), (2, 0), (1, 0)])
def test_stored_bits_are_found_wherever_they_are_in_the_word(
    tmp_path: Path, lift: int, above: int, signed: bool
) -> None:
    """HAZ-15: HighBit is not BitsStored - 1; an overlay in the bits above; both signs."""
    volume, slices = asymmetric_volume(), dicom_slices(asymmetric_volume())
    twelve_bits(slices, lift, above, signed)
    assert np.array_equal(read_volume(save_dicom(slices, tmp_path / "series"))[0].hu, volume.hu)


@pytest.mark.parametrize(
    ("tag", "value", "words"),
    [
        ("HighBit", 3, "HighBit"),
        ("HighBit", 16, "HighBit"),
        ("BitsStored", 17, "BitsStored"),
        ("BitsAllocated", 12, "BitsAllocated"),
        ("PixelRepresentation", 2, "HighBit"),
        ("PhotometricInterpretation", "PALETTE COLOR", "single grey"),
        ("SamplesPerPixel", 3, "single grey"),
    ],
)
def test_pixels_of_another_kind_are_refused_by_name(tmp_path: Path, tag: str, value: object, words: str) -> None:
    """HAZ-15: each tag that is loaded is checked."""
    slices = dicom_slices(asymmetric_volume())
    setattr(slices[3], tag, value)
    with pytest.raises(ImageError, match=words) as refused:
        read_volume(save_dicom(slices, tmp_path / "series"))
    assert "'005.dcm'" in str(refused.value)


@pytest.mark.parametrize(
    ("stored", "padding", "limit", "signed"),
    [
        (63536, ("SS", -2000), None, False),
        (63536, ("US", 63536), None, True),
        (63540, ("SS", -2000), ("SS", -1990), False),
        (63540, ("SS", -1990), ("US", 63536), False),
        (65535, ("SS", -10), ("SS", -1), False),
        (63536, ("SS", -2000), None, True),
    ],
)
def test_padding_counts_in_the_type_of_the_pixels(
    tmp_path: Path, stored: int, padding: tuple[str, int], limit: tuple[str, int] | None, signed: bool
) -> None:
    """HAZ-15: the sign of the tag may not be that of the pixels; padding is never bone, and bone is never padding."""
    volume, slices = asymmetric_volume(), dicom_slices(asymmetric_volume())
    for one in slices:
        words = words_of(one)
        words[:4] = stored
        one.PixelData, one.PixelRepresentation = words.astype("<u2").tobytes(), int(signed)
        one.add_new("PixelPaddingValue", *padding)
        if limit is not None:
            one.add_new("PixelPaddingRangeLimit", *limit)
    read, _ = read_volume(save_dicom(slices, tmp_path / "series"))
    assert (read.hu[:, 0, :4] == -1000).all()
    assert np.array_equal(read.hu[:, 1:], volume.hu[:, 1:])


def test_padding_of_more_bits_than_are_stored_is_no_bone(tmp_path: Path) -> None:
    """A word of padding beyond 12 stored bits is air; a pixel of the same lower bits is bone."""
    volume, slices = asymmetric_volume(), dicom_slices(asymmetric_volume())
    for one in slices:
        words = words_of(one)
        words[:2], words[2:4] = 63536, 63536 & 0xFFF
        one.PixelData, one.BitsStored, one.HighBit = words.astype("<u2").tobytes(), 12, 11
        one.add_new("PixelPaddingValue", "SS", -2000)
    read, _ = read_volume(save_dicom(slices, tmp_path / "series"))
    assert (read.hu[:, 0, :2] == -1000).all()
    assert (read.hu[:, 0, 2:4] == (63536 & 0xFFF) - 1024).all()
    assert np.array_equal(read.hu[:, 1:], volume.hu[:, 1:])


@pytest.mark.parametrize("bits", [32, 64])
def test_wide_pixels_are_read(tmp_path: Path, bits: int) -> None:
    volume, slices = asymmetric_volume(), dicom_slices(asymmetric_volume())
    for one in slices:
        one.PixelData = words_of(one).astype(f"<u{bits // 8}").tobytes()
        one.BitsAllocated, one.BitsStored, one.HighBit = bits, bits, bits - 1
    assert np.array_equal(read_volume(save_dicom(slices, tmp_path / "series"))[0].hu, volume.hu)


def scout_of(slices: Slices, **tags: object) -> FileDataset:
    one = dicom_slices(asymmetric_volume())[0]
    one.SeriesInstanceUID = slices[0].SeriesInstanceUID
    for keyword, value in tags.items():
        if value is None:
            delattr(one, keyword)
        else:
            setattr(one, keyword, value)
    return one


CROSSWISE = [0.0, 1.0, 0.0, 0.0, 0.0, -1.0]
LOCALIZER = ["ORIGINAL", "PRIMARY", "LOCALIZER"]


@pytest.mark.parametrize(
    "tags",
    [
        {"ImageType": LOCALIZER, "ImageOrientationPatient": CROSSWISE},
        {"ImageType": [*LOCALIZER, "CT_SOM5 TOP"]},  # the same plane
        {"ImageType": LOCALIZER, "ImagePositionPatient": None, "PixelSpacing": None},
        {"ImageType": LOCALIZER, "RescaleSlope": None},
        {"ImageOrientationPatient": CROSSWISE},  # which says nothing of itself
    ],
)
def test_a_localizer_among_the_slices_is_named_and_left_out(tmp_path: Path, tags: dict[str, object]) -> None:
    slices = dicom_slices(asymmetric_volume())
    folder = save_dicom(slices, tmp_path / "series")
    scout_of(slices, **tags).save_as(folder / "IM0099")
    read, report = read_volume(folder)
    assert np.array_equal(read.hu, asymmetric_volume().hu)
    assert report.notes == ("1 localizer (scout view) in the series was left out: 'IM0099'.",)


def test_a_file_that_may_be_called_after_a_patient_is_not_named_in_a_note(tmp_path: Path) -> None:
    """HAZ-33: notes are stored."""
    slices = dicom_slices(asymmetric_volume())
    folder = save_dicom(slices, tmp_path / "series")
    scout_of(slices, ImageType=LOCALIZER).save_as(folder / "Canary_Jane.dcm")
    assert "Canary" not in str(read_volume(folder)[1].notes)
    assert "file 10 by name" in read_volume(folder)[1].notes[0]


def test_localizers_alone_are_no_head(tmp_path: Path) -> None:
    slices = dicom_slices(asymmetric_volume())
    for one in slices:
        one.ImageType = LOCALIZER
    with pytest.raises(ImageError, match="localizers"):
        read_volume(save_dicom(slices, tmp_path / "series"))


def disc(path: Path, more: dict[str, bytes], change: Callable[[bytes], bytes] = bytes) -> Path:
    """A disc as a zip: slices in one folder, a viewer in another. change: what happens to one slice."""
    folder = save_dicom(dicom_slices(asymmetric_volume()), path / "slices")
    with zipfile.ZipFile(path / "disc.zip", "w") as archive:
        for number, file in enumerate(sorted(folder.iterdir())):
            data = file.read_bytes()
            archive.writestr(f"DICOM/{file.stem}", change(data) if number == 4 else data)
        for name, data in more.items():
            archive.writestr(name, data)
    return path / "disc.zip"


VIEWER = {
    "AUTORUN.INF": b"[autorun]",
    "VIEWER/start.exe": b"MZ\x90",
    "VIEWER/core.dll": b"MZ\x90",
    "VIEWER/app.ico": b"\0\0\1\0",
    "VIEWER/viewer.ini": b"[a]",
    "VIEWER/lang/de.dat": b"\1\2\3",  # below a folder of programs
    "VIEWER/PACKAGE": b"x",
    "linux/viewer": b"\x7fELF\2",  # by how it begins
    "Viewer.app/Contents/Info.plist": b"<plist>",
    "Viewer.app/Contents/PkgInfo": b"APPL????",
}


def test_files_of_a_viewer_are_passed_over_with_a_note(tmp_path: Path) -> None:
    read, report = read_volume(disc(tmp_path, VIEWER))
    assert np.array_equal(read.hu, asymmetric_volume().hu)
    assert report.notes == (
        "10 files of other programs beside the images (.dll, .exe, .ico, .inf, .ini, .plist) were passed over.",
    )


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data[:50],
        lambda data: b"",
        lambda data: b"\0" * 400,
        lambda data: data[132:],
        lambda data: b"<html>",
    ],
)
def test_a_damaged_slice_among_the_files_of_a_viewer_is_refused(
    tmp_path: Path, change: Callable[[bytes], bytes]
) -> None:
    """HAZ-15."""
    with pytest.raises(ImageError, match=r"'004'.* is not DICOM"):
        read_volume(disc(tmp_path, VIEWER, change))


def test_an_image_with_the_name_of_a_program_is_an_image(tmp_path: Path) -> None:
    folder = save_dicom(dicom_slices(asymmetric_volume()), tmp_path / "series")
    (folder / "004.dcm").rename(folder / "004.ini")
    assert np.array_equal(read_volume(folder)[0].hu, asymmetric_volume().hu)
