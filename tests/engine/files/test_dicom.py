"""DICOM series: what is one regular stack, what is not, and that nobody's name gets out."""

import io
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk  # noqa: N813
from imaging_phantoms import asymmetric_volume, dicom_slices, save_dicom
from pydicom.dataset import FileDataset
from pydicom.uid import DeflatedExplicitVRLittleEndian, generate_uid

from vfix_engine.errors import ImageError
from vfix_engine.files import dicom_files
from vfix_engine.files.readers import read_volume

Slices = list[FileDataset]


def zipped(entries: dict[str, bytes], file: Path) -> Path:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return file


def dicom_bytes(one: FileDataset) -> bytes:
    stream = io.BytesIO()
    pydicom.dcmwrite(stream, one, enforce_file_format=True)
    return stream.getvalue()


def test_zip_equals_nrrd(trial_data: Path) -> None:
    """The same head as a DICOM series and as NRRD: the same voxels in the same places."""
    series, _ = read_volume(trial_data / "head_ct" / "cthead_derived_dicom.zip")
    nrrd, _ = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")
    assert np.array_equal(series.hu, nrrd.hu)
    assert np.allclose(series.bounds, nrrd.bounds, atol=1e-6)


def test_tilted_series_with_gaps_is_refused_with_its_figures(trial_data: Path) -> None:
    """HAZ-15: 18.5 degrees of gantry tilt and gaps of 4.00, 1.08 and 7.00 mm are not a regular grid."""
    (series,) = (trial_data / "formats" / "dicom_real").glob("*.zip")
    with pytest.raises(ImageError) as refused:
        read_volume(series)
    for figure in ("18.5", "4.00", "1.08", "7.00", "tilt"):
        assert figure in str(refused.value)


def drop_one(slices: Slices, k: int) -> None:
    del slices[k]


def shift_one(slices: Slices, k: int) -> None:
    slices[k].ImagePositionPatient[2] += 0.2


def double_one(slices: Slices, k: int) -> None:
    slices[k].ImagePositionPatient = slices[k + 1].ImagePositionPatient


def mix_series(slices: Slices, k: int) -> None:
    slices[k].SeriesInstanceUID = generate_uid()


def turn_one(slices: Slices, k: int) -> None:
    slices[k].ImageOrientationPatient = [0.0, 1.0, 0.0, 1.0, 0.0, 0.0]


def zoom_one(slices: Slices, k: int) -> None:
    slices[k].PixelSpacing = [0.6, 0.75]


def lose_slope(slices: Slices, k: int) -> None:
    del slices[k].RescaleSlope


def lose_position(slices: Slices, k: int) -> None:
    del slices[k].ImagePositionPatient


def other_modality(slices: Slices, k: int) -> None:
    slices[k].Modality = "MR"


def cut_pixels(slices: Slices, k: int) -> None:
    slices[k].PixelData = slices[k].PixelData[:100]


def claim_more(slices: Slices, k: int) -> None:
    slices[k].Rows = 60000


def infinite_position(slices: Slices, k: int) -> None:
    slices[k].add_new(0x00200032, "DS", b"inf\\0\\0 ")


def many_frames(slices: Slices, k: int) -> None:
    slices[k].NumberOfFrames = 3


def only_one(slices: Slices, k: int) -> None:
    del slices[k + 1 :], slices[:k]


@pytest.mark.parametrize(
    ("break_it", "words"),
    [
        (drop_one, "evenly spaced"),
        (shift_one, "evenly spaced"),
        (double_one, "same position"),
        (mix_series, "2 series"),
        (turn_one, "orientation"),
        (zoom_one, "pixel size"),
        (lose_slope, "Hounsfield"),
        (lose_position, "cannot be placed"),
        (other_modality, "not a CT"),
        (cut_pixels, "cut off"),
        (claim_more, "claims"),
        (infinite_position, "finite|cannot be read"),
        (many_frames, "single grey"),
        (only_one, "not a volume"),
    ],
)
@pytest.mark.parametrize("k", [1, 3, 5, 7])
def test_broken_series_is_never_loaded(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, break_it: Callable[[Slices, int], None], k: int, words: str
) -> None:
    """HAZ-15: 56 series, each broken at another slice. HAZ-33: no message, warning or log line holds the patient's name
    or series.
    """
    slices = dicom_slices(asymmetric_volume())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        break_it(slices, k)
        folder = save_dicom(slices, tmp_path / "series")
    caplog.clear()
    with warnings.catch_warnings(record=True) as heard, pytest.raises(ImageError, match=words) as refused:
        read_volume(folder)
    told = str(refused.value) + " ".join(str(warning.message) for warning in heard) + caplog.text
    assert "Canary" not in told
    assert str(slices[0].SeriesInstanceUID) not in told


def test_padding_is_air(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    slices = dicom_slices(volume)
    for one in slices:
        one.PixelPaddingValue = int(volume.hu[0, 0, 0]) + 1024
        one.PixelPaddingRangeLimit = int(volume.hu[0, 0, 3]) + 1024
    read, _ = read_volume(save_dicom(slices, tmp_path / "series"))
    padded = (volume.hu >= volume.hu[0, 0, 0]) & (volume.hu <= volume.hu[0, 0, 3])
    assert padded.any()
    assert (read.hu[padded] == -1000).all()
    assert np.array_equal(read.hu[~padded], volume.hu[~padded])


def test_slope_is_applied(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    slices = dicom_slices(volume)
    for one in slices:
        one.RescaleSlope, one.RescaleIntercept = 0.5, -512
    read, _ = read_volume(save_dicom(slices, tmp_path / "series"))
    assert np.abs(read.hu - volume.hu / 2).max() <= 0.5


@pytest.mark.parametrize("compressor", ["JPEG", "JPEG2000"])
def test_compressed_slices_are_decoded(tmp_path: Path, compressor: str) -> None:
    """Both lossless; written by GDCM, slice by slice."""
    volume = asymmetric_volume()
    folder = tmp_path / "series"
    folder.mkdir()
    for k, plain in enumerate(dicom_slices(volume, "1.2.3.4")):
        image = sitk.GetImageFromArray((volume.hu[k : k + 1].astype(np.int32) + 1024).astype(np.uint16))
        writer = sitk.ImageFileWriter()
        writer.SetImageIO("GDCMImageIO")
        writer.KeepOriginalImageUIDOn()
        writer.UseCompressionOn()
        writer.SetCompressor(compressor)
        writer.SetFileName(str(folder / f"{k}.dcm"))
        writer.Execute(image)
        packed = pydicom.dcmread(folder / f"{k}.dcm")
        for keyword in ("Modality", "SeriesInstanceUID", "ImagePositionPatient", "ImageOrientationPatient"):
            setattr(packed, keyword, getattr(plain, keyword))
        packed.PixelSpacing, packed.RescaleSlope, packed.RescaleIntercept = plain.PixelSpacing, 1, -1024
        packed.save_as(folder / f"{k}.dcm")
        assert packed.file_meta.TransferSyntaxUID.is_compressed
    read, _ = read_volume(folder)
    assert np.array_equal(read.hu, volume.hu)


def test_files_beside_the_slices_are_passed_over_but_no_lost_slice_is(tmp_path: Path) -> None:
    folder = save_dicom(dicom_slices(asymmetric_volume()), tmp_path / "series")
    (folder / "README.TXT").write_text("hello")
    (folder / ".DS_Store").write_bytes(b"\0")
    read_volume(folder)
    last = folder / "000.dcm"
    last.write_bytes(b"\0" * 128 + b"XXXX" + last.read_bytes()[132:])
    with pytest.raises(ImageError, match="not DICOM"):
        read_volume(folder)


@pytest.mark.parametrize("name", ["../evil.dcm", "/etc/evil.dcm", "a/../../evil.dcm", "..\\evil.dcm", "C:\\evil.dcm"])
def test_zip_that_leads_out_of_itself_is_refused(tmp_path: Path, name: str) -> None:
    """HAZ-21: and nothing is written anywhere."""
    inside = tmp_path / "inside"
    inside.mkdir()
    file = zipped({name: b"\0" * 132}, inside / "ct.zip")
    with pytest.raises(ImageError, match="leads out"):
        read_volume(file)
    assert sorted(tmp_path.rglob("*")) == [inside, file]


def test_link_in_a_zip_or_folder_is_refused(tmp_path: Path) -> None:
    """HAZ-21."""
    link = zipfile.ZipInfo("link.dcm")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(tmp_path / "ct.zip", "w") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(ImageError, match="link"):
        read_volume(tmp_path / "ct.zip")
    (tmp_path / "series").mkdir()
    (tmp_path / "series" / "a.dcm").symlink_to("/etc/passwd")
    with pytest.raises(ImageError, match="link"):
        read_volume(tmp_path / "series")


def test_bombs_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-17: by ratio, by the number of files, by size, and as a deflated dataset."""
    with pytest.raises(ImageError, match="beyond reason"):
        read_volume(zipped({"a.dcm": bytes(30 << 20)}, tmp_path / "ratio.zip"))
    plain = dicom_slices(asymmetric_volume())[0]
    plain.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    with pytest.raises(ImageError, match="deflated"):
        read_volume(zipped({"a.dcm": dicom_bytes(plain)}, tmp_path / "deflated.zip"))
    monkeypatch.setattr(dicom_files, "MAX_FILES", 3)
    with pytest.raises(ImageError, match="at most 3"):
        read_volume(zipped({f"{n}.dcm": b"x" for n in range(4)}, tmp_path / "many.zip"))


def test_damaged_zip_is_refused(tmp_path: Path) -> None:
    good = zipped(
        {f"{n}.dcm": dicom_bytes(one) for n, one in enumerate(dicom_slices(asymmetric_volume()))}, tmp_path / "a.zip"
    )
    data = good.read_bytes()
    for number, broken in enumerate((b"", b"PK\x03\x04", data[:-30], data[:200] + b"\xff" * 40 + data[240:])):
        file = tmp_path / f"broken{number}.zip"
        file.write_bytes(broken)
        with pytest.raises(ImageError):
            read_volume(file)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("depth", [30, 3000])
def test_deep_nesting_is_an_error_with_words(tmp_path: Path, depth: int, closed: bool) -> None:
    """HAZ-18: sequences in sequences, ended or cut off; it is the depth that is refused, and the file is named."""
    opening = b"\x08\x00\x40\x11SQ\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff"
    closing = b"\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0"
    slices = dicom_slices(asymmetric_volume())
    plain = dicom_bytes(slices[0])
    cut = plain.index(b"\x08\x00\x60\x00CS")
    nested = plain[:cut] + opening * depth + (closing * depth + plain[cut:] if closed else b"")
    entries = {"a.dcm": nested} | {f"{n}.dcm": dicom_bytes(one) for n, one in enumerate(slices[1:])}
    file = zipped(entries, tmp_path / "deep.zip")
    if depth == 30 and closed:
        assert read_volume(file)[0].hu.shape == asymmetric_volume().hu.shape
        return
    with pytest.raises(ImageError, match="a.dcm" if depth == 30 else "a.dcm' is nested too deeply"):
        read_volume(file)


DIRECTORY, REPORT = "1.2.840.10008.1.3.10", "1.2.840.10008.5.1.4.1.1.88.67"


def beside(sop_class: str) -> bytes:
    """What a hospital's archive lays beside the slices, under a name like theirs."""
    one = dicom_slices(asymmetric_volume())[0]
    one.SOPClassUID = one.file_meta.MediaStorageSOPClassUID = sop_class
    for keyword in ("Rows", "Columns", "PixelData", "SeriesInstanceUID", "ImagePositionPatient"):
        delattr(one, keyword)
    if sop_class == DIRECTORY:
        del one.SOPClassUID
    return dicom_bytes(one)


def test_what_is_no_image_is_passed_over_whatever_it_is_called(tmp_path: Path) -> None:
    """A directory record that is not called DICOMDIR, and a dose report."""
    folder = save_dicom(dicom_slices(asymmetric_volume()), tmp_path / "series")
    (folder / "000A").write_bytes(beside(DIRECTORY))
    (folder / "zz").mkdir()
    (folder / "zz" / "IM1").write_bytes(beside(REPORT))
    assert np.array_equal(read_volume(folder)[0].hu, asymmetric_volume().hu)
    only = zipped({"a": beside(DIRECTORY)}, tmp_path / "a.zip")
    with pytest.raises(ImageError, match="no DICOM image"):
        read_volume(only)


def test_of_several_series_one_is_chosen(tmp_path: Path) -> None:
    """HAZ-15: they are told by their number, images and pixels; another one's faults are no reason to refuse it."""
    volume = asymmetric_volume()
    head, scout = dicom_slices(volume), dicom_slices(volume)[:2]
    screen = dicom_slices(volume)[:1]
    screen[0].Modality = "OT"
    del screen[0].ImagePositionPatient
    entries = {
        f"{letter}{n}": dicom_bytes(one)
        for letter, series in (("a", screen), ("b", head), ("c", scout))
        for n, one in enumerate(series)
    }
    file = zipped(entries, tmp_path / "a.zip")
    with pytest.raises(ImageError) as refused:
        read_volume(file)
    told = str(refused.value)
    for part in ("3 series", "1: 1 image of 15 x 12, not CT", "2: 9 images of 15 x 12;", "3: 2 images", "--series"):
        assert part in told
    assert str(head[0].SeriesInstanceUID) not in told
    assert np.array_equal(read_volume(file, series=2)[0].hu, volume.hu)
    for number, words in ((1, "the file 'a0' is not a CT image"), (4, "no series 4"), (0, "no series 0")):
        with pytest.raises(ImageError, match=words):
            read_volume(file, series=number)
    with pytest.raises(ImageError, match="which this file is not"):
        read_volume(save_nrrd(tmp_path / "ct.nrrd"), series=1)


def save_nrrd(file: Path) -> Path:
    sitk.WriteImage(sitk.GetImageFromArray(asymmetric_volume().hu), str(file))
    return file


@pytest.mark.parametrize(
    ("width", "centre", "window"),
    [
        ("3000", "500", (3000.0, 500.0)),
        (["400", "2000"], ["40", "500"], (400.0, 40.0)),  # the first of several
        ("0", "40", None),
        ("400", "1e9", None),
        (None, "40", None),
    ],
)
def test_the_window_that_the_scanner_suggests(
    tmp_path: Path, width: object, centre: object, window: tuple[float, float] | None
) -> None:
    slices = dicom_slices(asymmetric_volume())
    for one in slices:
        if width is not None:
            one.WindowWidth = width
        one.WindowCenter = centre
    assert read_volume(save_dicom(slices, tmp_path / "windowed"))[0].window == window


def test_thickness_of_the_slices_is_kept(tmp_path: Path) -> None:
    """The scanner's figure, which may be more than the distance between slices; nonsense is no figure."""
    slices = dicom_slices(asymmetric_volume())
    for one in slices:
        one.SliceThickness = 5
    assert read_volume(save_dicom(slices, tmp_path / "thick"))[0].slice_thickness_mm == 5.0
    for one in slices:
        one.SliceThickness = -1
    assert read_volume(save_dicom(slices, tmp_path / "thick"))[0].slice_thickness_mm is None


def test_one_slice_alone_is_refused(tmp_path: Path) -> None:
    folder = save_dicom(dicom_slices(asymmetric_volume()), tmp_path / "series")
    with pytest.raises(ImageError, match="folder"):
        read_volume(folder / "000.dcm")
