"""CT volumes through every file format, and the files that must not be read."""

import gzip
import struct
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from imaging_phantoms import asymmetric_volume, dicom_slices, rotation, save_dicom

from vfix_engine.errors import FrameError, ImageError
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume

DIRECTIONS = pytest.mark.parametrize(
    "direction",
    [np.eye(3), np.diag([-1.0, -1.0, 1.0]), np.diag([1.0, -1.0, 1.0]), rotation((11.0, -7.0, 23.0))],
    ids=["upright", "turned", "left-handed", "oblique"],
)


def sitk_image(volume: Volume) -> sitk.Image:
    image = sitk.GetImageFromArray(volume.hu)
    image.SetOrigin(volume.origin.tolist())
    image.SetSpacing(volume.spacing.tolist())
    image.SetDirection(volume.direction.ravel().tolist())
    return image


def nrrd_bytes(volume: Volume, space: str | None, signs: np.ndarray, extra: str = "") -> bytes:
    """A header written by hand, so that the frame does not go through the library that reads it."""
    vectors = (volume.direction * volume.spacing).T * signs
    head = "NRRD0004\ntype: short\ndimension: 3\n" + (f"space: {space}\n" if space else "")
    head += f"sizes: {' '.join(str(size) for size in volume.hu.shape[::-1])}\n"
    head += "space directions: " + " ".join("(" + ",".join(f"{x:.17g}" for x in vector) + ")" for vector in vectors)
    head += "\nendian: little\nencoding: raw\n" + extra
    head += "space origin: (" + ",".join(f"{x:.17g}" for x in volume.origin * signs) + ")\n\n"
    return head.encode() + volume.hu.astype("<i2").tobytes()


def assert_same_patient(read: Volume, volume: Volume) -> None:
    """Every voxel of the original is found at its own LPS position, within 1e-3 mm (HAZ-14)."""
    k, j, i = np.indices(volume.hu.shape).reshape(3, -1)
    points = volume.index_to_lps(np.stack([i, j, k], axis=1))
    indices = read.lps_to_index(points)
    nearest = np.rint(indices).astype(int)
    assert np.abs(read.index_to_lps(nearest) - points).max() < 1e-3
    assert np.array_equal(read.hu[nearest[:, 2], nearest[:, 1], nearest[:, 0]], volume.hu[k, j, i])


@DIRECTIONS
@pytest.mark.parametrize("name", ["ct.nrrd", "ct.nii", "ct.nii.gz", "ct.mha", "packed.nrrd", "packed.mha"])
def test_formats_bring_the_same_patient(tmp_path: Path, name: str, direction: np.ndarray) -> None:
    """HAZ-14: the asymmetric head through NRRD, NIfTI and MetaImage, plain and compressed."""
    volume = asymmetric_volume(direction)
    sitk.WriteImage(sitk_image(volume), str(tmp_path / name), useCompression=name.startswith("packed"))
    read, report = read_volume(tmp_path / name)
    assert report.name == ("RAS" if ".nii" in name else "LPS")
    assert not report.assumed
    assert_same_patient(read, volume)


@DIRECTIONS
def test_dicom_brings_the_same_patient(tmp_path: Path, direction: np.ndarray) -> None:
    """HAZ-14: a left-handed stack comes back right-handed, each voxel in its place."""
    volume = asymmetric_volume(direction)
    read, report = read_volume(save_dicom(dicom_slices(volume), tmp_path / "series"))
    assert (report.name, report.assumed) == ("LPS", False)
    assert_same_patient(read, volume)


@pytest.mark.parametrize(
    ("space", "signs"),
    [("left-posterior-superior", [1, 1, 1]), ("LPS", [1, 1, 1]), ("right-anterior-superior", [-1, -1, 1])],
)
def test_nrrd_is_read_in_the_space_it_names(tmp_path: Path, space: str, signs: list[int]) -> None:
    volume = asymmetric_volume(rotation((5.0, 6.0, 7.0)))
    file = tmp_path / "ct.nrrd"
    file.write_bytes(nrrd_bytes(volume, space, np.array(signs)))
    read, report = read_volume(file)
    assert report.name == ("RAS" if signs[0] < 0 else "LPS")
    assert_same_patient(read, volume)


def test_nrrd_in_metres_is_converted(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    metres = Volume(volume.hu, volume.origin / 1000, volume.spacing / 1000, volume.direction)
    file = tmp_path / "ct.nrrd"
    file.write_bytes(nrrd_bytes(metres, "LPS", np.ones(3), 'space units: "m" "m" "m"\n'))
    assert_same_patient(read_volume(file)[0], volume)
    file.write_bytes(nrrd_bytes(metres, "LPS", np.ones(3)))
    with pytest.raises(ImageError, match="check the unit"):
        read_volume(file)


def test_frame_that_is_not_named_is_asked_for(tmp_path: Path) -> None:
    """HAZ-14: no guess, unless the caller says that it may be assumed; then the report says so."""
    volume = asymmetric_volume()
    file = tmp_path / "ct.nrrd"
    file.write_bytes(nrrd_bytes(volume, None, np.array([-1, -1, 1])))
    with pytest.raises(FrameError) as refused:
        read_volume(file)
    assert refused.value.missing == ("frame",)
    read, report = read_volume(file, frame="RAS")
    assert_same_patient(read, volume)
    assert (report.name, report.assumed) == ("RAS", False)
    assert read_volume(file, assume=True)[1].assumed


def test_nifti_without_a_placement_is_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "ct.nii"
    sitk.WriteImage(sitk_image(asymmetric_volume()), str(file))
    data = bytearray(file.read_bytes())
    struct.pack_into("<2h", data, 252, 0, 0)
    file.write_bytes(data)
    with pytest.raises(FrameError, match="frame"):
        read_volume(file)


def test_nifti_with_voxels_that_are_not_above_zero_is_refused(tmp_path: Path) -> None:
    """HAZ-14: a negative pixdim would mirror the head."""
    file = tmp_path / "ct.nii"
    sitk.WriteImage(sitk_image(asymmetric_volume()), str(file))
    data = bytearray(file.read_bytes())
    struct.pack_into("<f", data, 80, -1.0)
    file.write_bytes(data)
    with pytest.raises(ImageError, match="pixdim"):
        read_volume(file)


def test_user_who_contradicts_the_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "ct.nrrd"
    file.write_bytes(nrrd_bytes(asymmetric_volume(), "LPS", np.ones(3)))
    with pytest.raises(FrameError, match="names the frame LPS"):
        read_volume(file, frame="RAS")
    with pytest.raises(FrameError, match="not known"):
        read_volume(file, frame="MNI")


def test_nifti_that_is_placed_twice_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "ct.nii"
    sitk.WriteImage(sitk_image(asymmetric_volume()), str(file))
    data = bytearray(file.read_bytes())
    struct.pack_into("<f", data, 268, struct.unpack_from("<f", data, 268)[0] + 1.0)
    file.write_bytes(data)
    with pytest.raises(ImageError, match="twice"):
        read_volume(file)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bad_magic.nii", "magic"),
        ("truncated.nii", "cut off"),
        ("empty.nrrd", "not NRRD"),
        ("size_too_big.nrrd", "claims"),
        ("truncated_gzip.nrrd", "cut off"),
    ],
)
def test_malformed_volumes_are_refused(trial_data: Path, name: str, words: str) -> None:
    """HAZ-16: SimpleITK alone would take two of these in silence."""
    with pytest.raises(ImageError, match=words):
        read_volume(trial_data / "formats" / "malformed" / name)


def test_odd_but_valid_volumes_are_read(trial_data: Path) -> None:
    folder = trial_data / "formats" / "malformed"
    mirrored, _ = read_volume(folder / "left_handed.nrrd")
    assert np.allclose(mirrored.bounds, [[0, 0, -10], [7, 6, 0]])
    ras, report = read_volume(folder / "ras_space.nrrd")
    assert report.name == "RAS"
    assert np.allclose(ras.bounds, [[-7, -6, 0], [0, 0, 10]])
    told, _ = read_volume(folder / "no_space.nrrd", frame="RAS")
    assert np.allclose(told.bounds, ras.bounds)


def test_real_nifti_agrees_with_simpleitk(trial_data: Path) -> None:
    """Its slope is NaN and it has no sform."""
    file = trial_data / "formats" / "nifti" / "dicom2stl_ct_head_26slices.nii.gz"
    volume, report = read_volume(file)
    image = sitk.ReadImage(str(file))
    assert report.name == "RAS"
    assert np.array_equal(volume.hu, sitk.GetArrayFromImage(image))
    assert np.allclose(volume.index_to_lps([9, 5, 3]), image.TransformIndexToPhysicalPoint([9, 5, 3]), atol=1e-4)


def test_bomb_is_not_inflated(tmp_path: Path) -> None:
    """HAZ-17: a gzip stream of far more than the header claims stops being read there."""
    volume = asymmetric_volume()
    head, _ = nrrd_bytes(volume, "LPS", np.ones(3)).split(b"\n\n", 1)
    file = tmp_path / "bomb.nrrd"
    file.write_bytes(head.replace(b"raw", b"gzip") + b"\n\n" + gzip.compress(bytes(64 << 20)))
    with pytest.raises(ImageError, match="more than"):
        read_volume(file)


@pytest.mark.parametrize("name", ["ct.nrrd", "ct.nii", "ct.nii.gz", "ct.mha", "packed.nrrd", "packed.mha"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_voxel_that_is_not_finite_is_refused_in_every_format(tmp_path: Path, name: str, value: float) -> None:
    """HAZ-05: the library that decodes NIfTI would make a zero of it, which is neither air nor bone."""
    values = asymmetric_volume().hu.astype(np.float32)
    image = sitk.GetImageFromArray(values)
    sitk.WriteImage(image, str(tmp_path / name), useCompression=name.startswith("packed"))
    assert np.array_equal(read_volume(str(tmp_path / name), assume=True)[0].hu, values)
    values[3, 3, 3] = value
    sitk.WriteImage(sitk.GetImageFromArray(values), str(tmp_path / name), useCompression=name.startswith("packed"))
    with pytest.raises(ImageError, match="1 voxels are not finite"):
        read_volume(tmp_path / name)


def spoiled(data: bytes, name: str) -> dict[str, bytes]:
    """A volume whose header claims half of its slices, or that something follows, or that is cut off."""
    in_text, in_nifti = data.replace(b"15 12 9", b"15 12 4", 1), data[:46] + struct.pack("<h", 4) + data[48:]
    halved = in_nifti if ".nii" in name else in_text
    return {"halved": halved, "followed": data + bytes(16), "cut": data[:-16]}


@pytest.mark.parametrize("name", ["ct.nrrd", "ct.nii", "ct.nii.gz", "ct.mha", "packed.nrrd", "packed.mha"])
@pytest.mark.parametrize("how", ["halved", "followed", "cut"])
def test_header_and_voxels_must_be_of_one_volume(tmp_path: Path, name: str, how: str) -> None:
    """HAZ-16: fewer or more voxels than the header claims are another volume's, whatever packs them."""
    file = tmp_path / name
    sitk.WriteImage(sitk_image(asymmetric_volume()), str(file), useCompression=name.startswith("packed"))
    data = file.read_bytes()
    if name.endswith(".gz"):
        file.write_bytes(gzip.compress(spoiled(gzip.decompress(data), name)[how]))
    else:
        file.write_bytes(spoiled(data, name)[how])
    with pytest.raises(ImageError, match=r"cut off|longer than|more than the|follows|damaged"):
        read_volume(file)


def test_a_refused_volume_says_what_is_wrong_with_it(tmp_path: Path) -> None:
    """Labels, flat and sheared axes, a missing order of bytes, a name that hides the packing."""
    volume = asymmetric_volume()
    plain = nrrd_bytes(volume, "LPS", np.ones(3))
    nifti = tmp_path / "ct.nii"
    sitk.WriteImage(sitk_image(volume), str(nifti))
    faults = [
        ("a.seg.nrrd", plain.replace(b"\n\n", b"\nSegment0_ID:=Segment_1\n\n", 1), "segmentation"),
        ("a.nrrd", plain.replace(b"\n\n", b"\nSegmentation_ConversionParameters:=x\n\n", 1), "segmentation"),
        ("a.nrrd", plain.replace(b"(0.75,0,0)", b"(0,0.5,0)", 1), "not at right angles"),
        ("a.nrrd", plain.replace(b"(0.75,0,0)", b"(0.75,0.2,0)", 1), "not at right angles"),
        ("a.nrrd", plain.replace(b"endian: little\n", b"", 1), "endian"),
        ("a.nrrd", gzip.compress(plain), "gzip as a whole"),
        ("a.mha", gzip.compress(plain), "gzip as a whole"),
        ("a.nii", gzip.compress(nifti.read_bytes()), "gzip as a whole"),
        ("a.nii.gz", nifti.read_bytes(), "not packed with gzip"),
    ]
    for name, data, words in faults:
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ImageError, match=words):
            read_volume(tmp_path / name)
