"""Image files as people have them: wide whole numbers, single further axes, scaled labels, two placements, any name."""

import os
import shutil
from pathlib import Path

import nibabel
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from imaging_phantoms import asymmetric_volume

from vfix_engine.anatomy.head_import import HeadRequest, read_head
from vfix_engine.anatomy.labels.mask_folder import read_mask_folder
from vfix_engine.anatomy.labels.reading import read_label_map
from vfix_engine.errors import FrameError, ImageError
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume

LABELS = (np.arange(5 * 6 * 7).reshape(5, 6, 7) % 8).astype(np.int16)


def save(file: Path, values: np.ndarray, volume: Volume | None = None) -> Path:
    image = sitk.GetImageFromArray(values)
    if volume is not None:
        image.SetSpacing(volume.spacing.tolist())
        image.SetOrigin(volume.origin.tolist())
    sitk.WriteImage(image, str(file))
    return file


@pytest.mark.parametrize("suffix", ["nrrd", "nii", "nii.gz", "mha", "nhdr", "mhd"])
@pytest.mark.parametrize("kind", [np.int64, np.uint64])
def test_whole_numbers_of_64_bits(tmp_path: Path, suffix: str, kind: type) -> None:
    volume = asymmetric_volume()
    lift = 1100 if kind is np.uint64 else 0
    file = save(tmp_path / f"ct.{suffix}", (volume.hu.astype(np.int64) + lift).astype(kind), volume)
    read, _ = read_volume(file)
    assert np.array_equal(read.hu, volume.hu + lift)
    labels = read_label_map(save(tmp_path / "labels.nrrd", LABELS.astype(kind)), {}).labels
    assert [label.value for label in labels] == list(range(1, 8))


def test_wide_numbers_beyond_a_voxel_are_cut_and_not_wrapped(tmp_path: Path) -> None:
    values = asymmetric_volume().hu.astype(np.int64)
    values[0, 0, :2] = 2**40, -(2**40)
    assert read_volume(save(tmp_path / "ct.nrrd", values))[0].hu[0, 0, :2].tolist() == [32767, -32768]


@pytest.mark.parametrize("further", [1, 2, 3, 4])
def test_single_further_axes_of_nifti(tmp_path: Path, further: int) -> None:
    volume = asymmetric_volume()
    image = nibabel.Nifti1Image(volume.hu.T.reshape(*volume.hu.shape[::-1], *[1] * further), np.diag([2.0, 2, 2, 1]))
    image.header["dim"][0] = 3 + further
    nibabel.save(image, str(tmp_path / "ct.nii.gz"))
    assert np.array_equal(read_volume(tmp_path / "ct.nii.gz")[0].hu, volume.hu)


def test_further_axes_of_more_voxels_are_refused(tmp_path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 5, 6, 1, 2), np.int16), np.eye(4)), str(tmp_path / "ct.nii"))
    with pytest.raises(ImageError, match="4 x 5 x 6 x 1 x 2"):
        read_volume(tmp_path / "ct.nii")
    for file in (nrrd_of(tmp_path / "ct.nrrd", "15 12 3 3", "{} none"), meta_of(tmp_path / "ct.mha", "15 12 3 3")):
        with pytest.raises(ImageError, match="more than three dimensions"):
            read_volume(file)


def nrrd_of(file: Path, sizes: str, directions: str) -> Path:
    space = directions.format("(1,0,0) (0,1,0) (0,0,1)")
    head = (
        f"NRRD0004\ntype: short\ndimension: {len(sizes.split())}\nspace: left-posterior-superior\nsizes: {sizes}\n"
        f"space directions: {space}\nendian: little\nencoding: raw\nspace origin: (1,2,3)\n\n"
    )
    file.write_bytes(head.encode() + asymmetric_volume().hu.tobytes())
    return file


def meta_of(file: Path, sizes: str) -> Path:
    axes = len(sizes.split())
    numbers = [" ".join(map(str, row)) for row in (np.eye(axes, dtype=int).ravel(), [3] * axes, [1] * axes)]
    head = (
        f"ObjectType = Image\nNDims = {axes}\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
        f"TransformMatrix = {numbers[0]}\nOffset = {numbers[1]}\nElementSpacing = {numbers[2]}\nDimSize = {sizes}\n"
        "ElementType = MET_SHORT\nElementDataFile = LOCAL\n"
    )
    file.write_bytes(head.encode() + asymmetric_volume().hu.tobytes())
    return file


def test_a_metaimage_whose_spacing_is_not_above_zero_is_refused(tmp_path: Path) -> None:
    """HAZ-14: a negative one would mirror the head."""
    file = meta_of(tmp_path / "a.mha", "15 12 9")
    for spacing in (b"-1 1 1", b"1 0 1"):
        file.write_bytes(meta_of(tmp_path / "b.mha", "15 12 9").read_bytes().replace(b"= 1 1 1", b"= " + spacing))
        with pytest.raises(ImageError, match=r"ElementSpacing .* must be above 0"):
            read_volume(file)


@pytest.mark.parametrize("ones", ["1", "1 1"])
def test_single_further_axes_of_nrrd_and_metaimage(tmp_path: Path, ones: str) -> None:
    volume = asymmetric_volume()
    none = " none" * len(ones.split())
    for file in (
        nrrd_of(tmp_path / "a.nrrd", f"15 12 9 {ones}", "{}" + none),
        meta_of(tmp_path / "a.mha", f"15 12 9 {ones}"),
    ):
        assert np.array_equal(read_volume(file)[0].hu, volume.hu)


@pytest.mark.parametrize(("slope", "shift"), [(0.9999, 0.0), (1.0, 4e-4), (0.99999, -4e-4), (1.0001, 0.0)])
def test_labels_through_a_slope_are_rounded(tmp_path: Path, slope: float, shift: float) -> None:
    image = nibabel.Nifti1Image(LABELS.T, np.eye(4))
    image.header.set_slope_inter(slope, shift)
    nibabel.save(image, str(tmp_path / "labels.nii"))
    found = {label.value: int(label.mask.sum()) for label in read_label_map(tmp_path / "labels.nii", {}).labels}
    assert found == {value: int(np.count_nonzero(value == LABELS)) for value in range(1, 8)}
    (tmp_path / "masks").mkdir()
    mask = nibabel.Nifti1Image((LABELS.T == 1).astype(np.int16), np.eye(4))
    mask.header.set_slope_inter(slope, shift)
    nibabel.save(mask, str(tmp_path / "masks" / "eye.nii"))
    assert read_mask_folder(tmp_path / "masks").labels[0].mask.sum() == (LABELS == 1).sum()


def test_labels_farther_from_whole_numbers_are_refused(tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(LABELS.T, np.eye(4))
    image.header.set_slope_inter(0.999, 0.0)
    nibabel.save(image, str(tmp_path / "labels.nii"))
    with pytest.raises(ImageError, match="not whole numbers"):
        read_label_map(tmp_path / "labels.nii", {})


@pytest.mark.parametrize("codes", [(1, 1), (2, 1), (1, 2), (4, 2)])
@pytest.mark.parametrize(("apart", "told"), [(0.0, False), (0.09, False), (0.2, True), (0.9, True)])
def test_two_placements_of_a_nifti_file(tmp_path: Path, apart: float, told: bool, codes: tuple[int, int]) -> None:
    """HAZ-37: a tenth of a voxel apart they are one; beyond it is told which is used."""
    image = nibabel.Nifti1Image(asymmetric_volume().hu.T, np.eye(4))
    away = np.diag([2.0, 2.0, 2.0, 1.0])
    image.set_sform(away, codes[0])
    away[0, 3] = 2.0 * apart
    image.set_qform(away, codes[1])
    image.header.set_xyzt_units("mm")
    nibabel.save(image, str(tmp_path / "ct.nii"))
    read, report = read_volume(tmp_path / "ct.nii")
    assert bool(report.notes) is told
    used = 0.0 if codes[0] == 1 else -2.0 * apart
    assert read.origin[0] == pytest.approx(used, abs=1e-5)
    if told:
        assert f"{apart:.2g} voxels" in report.notes[0]
        assert f"the {'sform' if codes[0] == 1 else 'qform'} is used" in report.notes[0]


def test_two_placements_a_voxel_apart_contradict_each_other(tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(asymmetric_volume().hu.T, np.eye(4))
    image.set_sform(np.diag([2.0, 2.0, 2.0, 1.0]), 1)
    image.set_qform(np.diag([-2.0, 2.0, 2.0, 1.0]), 1)  # left and right
    nibabel.save(image, str(tmp_path / "ct.nii"))
    with pytest.raises(ImageError, match="twice"):
        read_volume(tmp_path / "ct.nii")


@pytest.mark.skipif(os.name != "posix", reason="names are bytes there alone")
@pytest.mark.parametrize("suffix", ["nrrd", "nii", "nii.gz", "mha"])
def test_a_name_that_is_not_utf8_reads_like_any_other(tmp_path: Path, suffix: str) -> None:
    """A Latin-1 byte in a name ended the reading process in SimpleITK; here and in a folder of that name."""
    volume = asymmetric_volume()
    plain = save(tmp_path / f"ct.{suffix}", volume.hu, volume)
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/M\xfcller"))
    folder.mkdir()
    for name in (b"Sch\xe4del", b"a\xff\xfe b", "Schädel 頭".encode()):
        named = folder / os.fsdecode(name + b"." + suffix.encode())
        shutil.copyfile(plain, named)
        assert np.array_equal(read_volume(named)[0].hu, volume.hu)


@pytest.mark.skipif(os.name != "posix", reason="names are bytes there alone")
def test_a_worker_reads_a_file_whose_name_is_not_utf8(tmp_path: Path) -> None:
    """Through the confined process, which may make a link in its own folder."""
    values = np.full((30, 30, 30), -1000, dtype=np.int16)
    values[5:20, 5:20, 5:20] = 900
    image = sitk.GetImageFromArray(values)
    image.SetSpacing([4.0, 4.0, 4.0])
    sitk.WriteImage(image, str(tmp_path / "ct.nrrd"))
    named = tmp_path / os.fsdecode(b"Sch\xe4del.nrrd")
    (tmp_path / "ct.nrrd").rename(named)
    head = read_head(HeadRequest(named, assume=True))
    assert head.volume is not None
    assert np.array_equal(head.volume.hu, values)


@pytest.mark.parametrize("suffix", ["nii", "nii.gz"])
def test_a_nifti_header_without_a_unit_is_told(tmp_path: Path, suffix: str) -> None:
    """HAZ-14: mm is assumed with a note; what the user says counts, and contradicts a header that names one."""
    volume = asymmetric_volume()
    affine = np.diag([-1.0, -1.0, 1.0, 1.0]) @ volume.transform_index_to_lps
    for code, scale, unit in ((0, 1.0, None), (0, 1e-3, "m"), (2, 1.0, None), (1, 1e-3, None), (2, 1.0, "mm")):
        image = nibabel.Nifti1Image(volume.hu.T, np.diag([scale, scale, scale, 1.0]) @ affine)
        image.header.set_xyzt_units(code)
        file = tmp_path / f"ct.{suffix}"
        nibabel.save(image, str(file))
        read, report = read_volume(file, None, unit)
        assert np.allclose(read.transform_index_to_lps, volume.transform_index_to_lps, atol=1e-4)
        told = "The NIfTI header does not name its unit; mm was assumed." in report.notes
        assert (told, report.unit_named) == (code == 0 and unit is None, code != 0)
    with pytest.raises(FrameError, match="names the unit mm, not m"):
        read_volume(file, None, "m")
