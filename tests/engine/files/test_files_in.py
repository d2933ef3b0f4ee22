"""Images as scanners and other programs write them: detached voxels, zips, enhanced CT, packed slices."""

import io
import zipfile
from pathlib import Path

import nibabel
import numpy as np
import pydicom
import pytest
import SimpleITK as sitk  # noqa: N813
from imaging_phantoms import asymmetric_volume, dicom_slices, rotation, save_dicom
from PIL import Image
from pydicom.dataset import Dataset, FileDataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import (
    UID,
    EnhancedCTImageStorage,
    ExplicitVRBigEndian,
    ImplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
    generate_uid,
)

from vfix_engine.anatomy.head_import import HeadRequest, read_head
from vfix_engine.errors import ImageError, SeriesUnclear
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume

VOLUME = asymmetric_volume(rotation((5.0, -10.0, 15.0)))


def same(found: Volume, wanted: Volume = VOLUME) -> None:
    """The same voxels in the same places, in whatever order of the axes."""
    points = wanted.index_to_lps(np.argwhere(np.ones(wanted.hu.shape))[:, ::-1])
    assert np.prod(found.hu.shape) == np.prod(wanted.hu.shape)
    index = np.rint(found.lps_to_index(points)).astype(int)
    assert np.abs(found.index_to_lps(index) - points).max() < 1e-3
    assert np.array_equal(found.hu[index[:, 2], index[:, 1], index[:, 0]], wanted.hu.ravel())


def image_of(volume: Volume) -> sitk.Image:
    image = sitk.GetImageFromArray(volume.hu)
    image.SetOrigin(volume.origin.tolist())
    image.SetSpacing(volume.spacing.tolist())
    image.SetDirection(volume.direction.ravel().tolist())
    return image


def written(folder: Path, name: str, packed: bool = False) -> Path:
    """A header with detached voxels by SimpleITK, or a NIfTI pair by nibabel."""
    folder.mkdir()
    if name.endswith(".hdr"):
        affine = np.diag([-1.0, -1.0, 1.0, 1.0]) @ VOLUME.transform_index_to_lps
        pair = nibabel.Nifti1Pair(VOLUME.hu.T, affine)
        pair.header.set_xyzt_units("mm")
        nibabel.save(pair, folder / name)
    else:
        sitk.WriteImage(image_of(VOLUME), str(folder / name), packed)
    assert len(list(folder.iterdir())) == 2
    return folder


def zipped(folder: Path) -> Path:
    file = folder.with_suffix(".zip")
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for one in folder.rglob("*"):
            if one.is_file():
                archive.write(one, one.relative_to(folder))
    return file


@pytest.mark.parametrize(
    ("name", "packed"), [("v.nhdr", False), ("v.nhdr", True), ("v.mhd", False), ("v.mhd", True), ("v.hdr", False)]
)
def test_detached_voxels(tmp_path: Path, name: str, packed: bool) -> None:
    """As a folder, as a zip, and as the header alone with the file beside it."""
    folder = written(tmp_path / "v", name, packed)
    (folder / "readme.txt").write_text("of the same disc")
    for path in (folder, zipped(folder), folder / name):
        same(read_volume(path)[0])


def test_a_header_is_read_with_its_voxels_in_the_worker_too(tmp_path: Path) -> None:
    """The confined worker may read the file beside the header."""
    hu = np.full((40, 40, 40), -1000, dtype=np.int16)
    hu[5:35, 5:35, 5:35] = 900
    image = image_of(Volume(hu, np.zeros(3), np.full(3, 3.0), np.eye(3)))
    sitk.WriteImage(image, str(tmp_path / "v.mhd"))
    head = read_head(HeadRequest(tmp_path / "v.mhd"))
    assert head.volume is not None
    assert np.array_equal(head.volume.hu, hu)


def test_a_header_without_its_voxels_says_what_to_do(tmp_path: Path) -> None:
    folder = written(tmp_path / "v", "v.nhdr")
    (folder / "v.raw").unlink()
    with pytest.raises(ImageError, match="choose both files together"):
        read_volume(folder)


def test_a_header_that_leads_elsewhere_reads_nothing_there(tmp_path: Path) -> None:
    """HAZ-16: only what came along is opened, by its last name."""
    folder = written(tmp_path / "v", "v.nhdr")
    (tmp_path / "secret.raw").write_bytes((folder / "v.raw").read_bytes())
    header = (folder / "v.nhdr").read_text()
    (folder / "v.nhdr").write_text(header.replace("v.raw", "../secret.raw"))
    with pytest.raises(ImageError, match="choose both files together"):
        read_volume(folder)


def test_analyze_does_not_say_left_and_right(tmp_path: Path) -> None:
    folder = tmp_path / "v"
    folder.mkdir()
    nibabel.save(nibabel.AnalyzeImage(VOLUME.hu.T, np.eye(4)), folder / "v.hdr")
    with pytest.raises(ImageError, match="which side is left"):
        read_volume(folder)


def test_two_images_in_one_upload(tmp_path: Path) -> None:
    folder = written(tmp_path / "v", "v.nhdr")
    sitk.WriteImage(image_of(VOLUME), str(folder / "w.mhd"))
    with pytest.raises(ImageError, match="2 images"):
        read_volume(folder)


@pytest.mark.parametrize("name", ["v.nrrd", "v.nii.gz", "v.mha"])
def test_an_image_in_a_zip(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "v"
    folder.mkdir()
    sitk.WriteImage(image_of(VOLUME), str(folder / name))
    same(read_volume(zipped(folder))[0])


# -- DICOM


def with_syntax(slices: list[FileDataset], syntax: UID, folder: Path) -> Path:
    folder.mkdir()
    for number, one in enumerate(slices):
        one.file_meta.TransferSyntaxUID = syntax
        little = syntax != ExplicitVRBigEndian
        if not little:
            one.PixelData = np.frombuffer(one.PixelData, "<u2").astype(">u2").tobytes()
        implicit = syntax == ImplicitVRLittleEndian
        pydicom.dcmwrite(
            folder / f"{number}.dcm", one, enforce_file_format=True, little_endian=little, implicit_vr=implicit
        )
    return folder


@pytest.mark.parametrize("syntax", [ExplicitVRBigEndian, ImplicitVRLittleEndian])
def test_other_orders_of_bytes(tmp_path: Path, syntax: UID) -> None:
    same(read_volume(with_syntax(dicom_slices(VOLUME), syntax, tmp_path / "ct"))[0])


def packed_by_pillow(pixels: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG2000", irreversible=False, no_jp2=True)
    return stream.getvalue()


@pytest.mark.parametrize("syntax", [JPEG2000Lossless, JPEGLSLossless, RLELossless])
def test_packed_slices(tmp_path: Path, syntax: UID) -> None:
    """Each packed without loss, by a library other than the one that unpacks it here."""
    slices = dicom_slices(VOLUME)
    for one in slices:
        if syntax == JPEG2000Lossless:
            one.PixelData = encapsulate([packed_by_pillow(one.pixel_array)])
            one["PixelData"].VR = "OB"
            one.file_meta.TransferSyntaxUID = syntax
        else:
            one.compress(syntax, generate_instance_uid=False)
    same(read_volume(save_dicom(slices, tmp_path / "ct"))[0])


def test_jpeg_lossless_slices(tmp_path: Path) -> None:
    """Process 14, selection value 1, which most archives use; packed by the plain coder below."""
    slices = dicom_slices(VOLUME)
    for one in slices:
        one.PixelData = encapsulate([jpeg_lossless(one.pixel_array)])
        one["PixelData"].VR = "OB"
        one.file_meta.TransferSyntaxUID = JPEGLosslessSV1
    same(read_volume(save_dicom(slices, tmp_path / "ct"))[0])


def jpeg_lossless(pixels: np.ndarray) -> bytes:
    """ITU-T T.81 annex H for 16 bits: differences to the left neighbour, one Huffman code of five bits a class."""
    values = pixels.astype(np.int64)
    before = np.empty_like(values)
    before[:, 1:] = values[:, :-1]
    before[1:, 0] = values[:-1, 0]
    before[0, 0] = 1 << 15
    bits = []
    for difference in (values - before).ravel():
        wrapped = (int(difference) + (1 << 15)) % (1 << 16) - (1 << 15)
        size = abs(wrapped).bit_length()
        bits.append(f"{size:05b}")
        if 0 < size < 16:
            bits.append(f"{wrapped if wrapped > 0 else wrapped + (1 << size) - 1:0{size}b}")
    stream = "".join(bits)
    stream += "1" * (-len(stream) % 8)
    scan = int(stream, 2).to_bytes(len(stream) // 8, "big").replace(b"\xff", b"\xff\0")
    rows, columns = pixels.shape
    frame = b"\xff\xc3\0\x0b\x10" + rows.to_bytes(2, "big") + columns.to_bytes(2, "big") + b"\x01\x01\x11\0"
    table = b"\xff\xc4" + (19 + 17).to_bytes(2, "big") + b"\0" + bytes([0, 0, 0, 0, 17] + [0] * 11) + bytes(range(17))
    return b"\xff\xd8" + frame + table + b"\xff\xda\0\x08\x01\x01\0\x01\0\0" + scan + b"\xff\xd9"


def enhanced(volume: Volume, order: list[int] | None = None) -> FileDataset:
    """One file with every slice as a frame, its place and rescale in the functional groups."""
    slices = dicom_slices(volume)
    one = slices[0]
    one.SOPClassUID = one.file_meta.MediaStorageSOPClassUID = EnhancedCTImageStorage
    frames = [slices[k] for k in order or range(len(slices))]
    measures, value, plane = Dataset(), Dataset(), Dataset()
    measures.PixelSpacing, measures.SliceThickness = one.PixelSpacing, volume.spacing[2]
    value.RescaleSlope, value.RescaleIntercept = 1, -1024
    plane.ImageOrientationPatient = one.ImageOrientationPatient
    shared = Dataset()
    shared.PixelMeasuresSequence = Sequence([measures])
    shared.PixelValueTransformationSequence = Sequence([value])
    shared.PlaneOrientationSequence = Sequence([plane])
    groups = []
    for frame in frames:
        place, group = Dataset(), Dataset()
        place.ImagePositionPatient = frame.ImagePositionPatient
        group.PlanePositionSequence = Sequence([place])
        groups.append(group)
    one.NumberOfFrames = len(frames)
    one.PixelData = b"".join(frame.PixelData for frame in frames)
    one.SharedFunctionalGroupsSequence = Sequence([shared])
    one.PerFrameFunctionalGroupsSequence = Sequence(groups)
    for keyword in (
        "PixelSpacing",
        "ImageOrientationPatient",
        "ImagePositionPatient",
        "RescaleSlope",
        "RescaleIntercept",
    ):
        delattr(one, keyword)
    return one


@pytest.mark.parametrize("syntax", [None, RLELossless, JPEGLSLossless])
def test_enhanced_ct(tmp_path: Path, syntax: UID | None) -> None:
    """One file, in a folder or alone, with and without an ending of its name; frames in any order."""
    one = enhanced(VOLUME, [3, 1, 2, 0, 8, 7, 6, 5, 4])
    if syntax is not None:
        one.compress(syntax, generate_instance_uid=False)
    (tmp_path / "ct").mkdir()
    for file in (tmp_path / "ct" / "a.dcm", tmp_path / "IM0001"):
        pydicom.dcmwrite(file, one, enforce_file_format=True)
        same(read_volume(file)[0])
    same(read_volume(tmp_path / "ct")[0])


def test_frames_of_enhanced_ct_are_held_against_their_line(tmp_path: Path) -> None:
    """HAZ-37: shifted ones are resampled, an uneven or doubled one is refused by its number, a localizer is told."""
    volume = asymmetric_volume()
    for change, words in ((tilt, ""), (uneven, "evenly spaced"), (double, "frame 3 of the file and frame 4")):
        one = enhanced(volume)
        change([group.PlanePositionSequence[0] for group in one.PerFrameFunctionalGroupsSequence])
        file = tmp_path / f"{change.__name__}.dcm"
        one.save_as(file, enforce_file_format=True)
        if words:
            with pytest.raises(ImageError, match=words):
                read_volume(file)
        else:
            assert "gantry tilt of 18.0°" in read_volume(file)[1].notes[0]
    one = enhanced(volume)
    kind = Dataset()
    kind.FrameType = ["ORIGINAL", "PRIMARY", "LOCALIZER", "NONE"]
    one.PerFrameFunctionalGroupsSequence[0].CTImageFrameTypeSequence = [kind]
    one.save_as(tmp_path / "scout.dcm", enforce_file_format=True)
    read, report = read_volume(tmp_path / "scout.dcm")
    assert np.array_equal(read.hu, volume.hu[1:])
    assert "frame 1 of the file" in report.notes[0]


def tilt(places: list[Dataset]) -> None:
    for place in places:
        x, y, z = place.ImagePositionPatient
        place.ImagePositionPatient = [x, float(y) + np.tan(np.radians(18.0)) * (float(z) - 40.0), z]


def uneven(places: list[Dataset]) -> None:
    places[4].ImagePositionPatient[2] = float(places[4].ImagePositionPatient[2]) + 0.3


def double(places: list[Dataset]) -> None:
    places[3].ImagePositionPatient = places[2].ImagePositionPatient


def test_enhanced_ct_that_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "a.dcm"
    one = enhanced(VOLUME)
    del one.PerFrameFunctionalGroupsSequence[2]
    pydicom.dcmwrite(file, one, enforce_file_format=True)
    with pytest.raises(ImageError, match="claims 9 frames and describes 8"):
        read_volume(file)
    two_phases = enhanced(VOLUME, [*range(9), *range(9)])
    pydicom.dcmwrite(file, two_phases, enforce_file_format=True)
    with pytest.raises(ImageError, match="same position"):
        read_volume(file)
    one = enhanced(VOLUME)
    one.PixelData = encapsulate([packed_by_pillow(frame) for frame in one.pixel_array])
    one["PixelData"].VR = "OB"
    one.file_meta.TransferSyntaxUID = JPEG2000Lossless
    pydicom.dcmwrite(file, one, enforce_file_format=True)
    with pytest.raises(ImageError, match="not read for enhanced CT"):
        read_volume(file)
    bare = enhanced(VOLUME)
    del bare.SharedFunctionalGroupsSequence
    pydicom.dcmwrite(file, bare, enforce_file_format=True)
    with pytest.raises(ImageError, match="ImageOrientationPatient"):
        read_volume(file)


def test_several_series_are_told_with_what_one_chooses_by(tmp_path: Path) -> None:
    """Through the worker, and with their descriptions, which the message itself does not quote."""
    fine, scout = dicom_slices(VOLUME), dicom_slices(VOLUME)[:2]
    uid = generate_uid()
    for one in fine:
        one.SeriesDescription = "Sinus 0.6 <b>\x07"
    for one in scout:
        one.SeriesInstanceUID, one.Modality = uid, "MR"
    (tmp_path / "ct").mkdir()
    save_dicom(fine, tmp_path / "ct" / "a")
    save_dicom(scout, tmp_path / "ct" / "b")
    with pytest.raises(SeriesUnclear) as asked:
        read_head(HeadRequest(tmp_path / "ct"))
    assert asked.value.missing == ("series",)
    assert asked.value.series == (
        {
            "number": 1,
            "modality": "CT",
            "description": "Sinus 0.6 <b>",
            "slices": 9,
            "columns": 15,
            "rows": 12,
            "spacing_mm": [0.75, 0.5, 1.25],
        },
        {
            "number": 2,
            "modality": "MR",
            "description": "",
            "slices": 2,
            "columns": 15,
            "rows": 12,
            "spacing_mm": [0.75, 0.5, 1.25],
        },
    )
    assert "Sinus" not in str(asked.value)
