"""Segmentations: each format lands on the voxels that it was drawn on, with names; a second library reads the same."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from imaging_phantoms import asymmetric_volume, dicom_slices, rotation, save_dicom
from label_files import ellipsoid, place_of, save_dicom_seg, save_nifti, save_seg_nrrd

from vfix_engine.anatomy.labels import label_map
from vfix_engine.anatomy.labels.label_map import CroppedLabel
from vfix_engine.anatomy.labels.names import read_names
from vfix_engine.anatomy.labels.reading import (
    AnatomyPlace,
    SegmentationRequest,
    _read,
    read_label_map,
    read_segmentation,
)
from vfix_engine.anatomy.labels.surfaces import surface_of
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.errors import FrameError, ImageError, InputError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume
from vfix_engine.proximity.proximity import ProximityTree

MIRRORED = np.diag([1.0, 1.0, -1.0])


@pytest.fixture(params=["straight", "turned", "mirrored"])
def volume(request: pytest.FixtureRequest) -> Volume:
    turned = rotation((10.0, 20.0, 30.0))
    return asymmetric_volume({"straight": None, "turned": turned, "mirrored": turned @ MIRRORED}[request.param])


def masks_of(volume: Volume) -> list[np.ndarray]:
    """Two masks that overlap."""
    shape = volume.hu.shape
    return [ellipsoid(shape, (7, 6, 4), (4, 3, 2)), ellipsoid(shape, (9, 6, 4), (3, 3, 2))]


def centres(mask: np.ndarray, volume: Volume) -> np.ndarray:
    """LPS mm of the mask's voxels, in the order of their coordinates."""
    return sorted_rows(volume.index_to_lps(np.argwhere(mask)[:, ::-1]))


def label_centres(label: CroppedLabel) -> np.ndarray:
    index = np.argwhere(label.mask)[:, ::-1] + label.first
    return sorted_rows(index @ label.transform[:3, :3].T + label.transform[:3, 3])


def sorted_rows(points: np.ndarray) -> np.ndarray:
    return points[np.lexsort(np.round(points, 4).T)]


def silent(stage: str, fraction: float) -> None:
    """Progress of no interest."""


def read_here(file: Path, volume: Volume | None, **told: Any) -> Any:
    """Without a worker, so that a fault is seen where it is."""
    place = place_of(volume) if volume is not None else AnatomyPlace(np.array([[-50.0] * 3, [50.0] * 3]))
    names = told.pop("names", None)
    return _read(file, names, told.get("frame"), told.get("unit"), False, place, progress=silent)


SEGMENTS = [
    {"Name": "Left eye", "LabelValue": 1, "Layer": 0, "Color": "1 0 0", "ID": "Segment_1"},
    {"Name": "Optic nerve", "LabelValue": 1, "Layer": 1, "Color": "0 1 0.5", "ID": "Segment_2"},
]


def write_layers(tmp_path: Path, volume: Volume) -> Path:
    """Cropped, as Slicer does: two layers, since the segments overlap."""
    first, second = masks_of(volume)
    crop = (slice(1, 8), slice(2, 11), slice(2, 14))
    transform = volume.transform_index_to_lps
    transform[:3, 3] = volume.index_to_lps([2, 2, 1])
    layers = [first[crop].astype(int), second[crop].astype(int)]
    return save_seg_nrrd(tmp_path / "canary.seg.nrrd", layers, SEGMENTS, transform)


def write_binary(tmp_path: Path, volume: Volume) -> Path:
    return save_dicom_seg(tmp_path / "seg.dcm", masks_of(volume), ["Left eye", "Optic nerve"], volume)


def write_binary_whole(tmp_path: Path, volume: Volume) -> Path:
    names = ["Left eye", "Optic nerve"]
    return save_dicom_seg(tmp_path / "seg.dcm", masks_of(volume), names, volume, omit_empty_frames=False)


@pytest.mark.parametrize("write", [write_layers, write_binary, write_binary_whole])
def test_overlapping_segments_land_on_their_voxels(
    tmp_path: Path, volume: Volume, write: Callable[[Path, Volume], Path]
) -> None:
    found = read_label_map(write(tmp_path, volume), {})
    assert [label.name for label in found.labels] == ["Left eye", "Optic nerve"]
    assert found.labels[0].colour == "#ff0000"
    for label, mask in zip(found.labels, masks_of(volume), strict=True):
        assert np.abs(label_centres(label) - centres(mask, volume)).max() < 1e-3
    assert (found.frame.name, found.frame.assumed) == ("LPS", False)


def write_nifti(tmp_path: Path, labels: np.ndarray, volume: Volume) -> Path:
    return save_nifti(tmp_path / "x.nii.gz", labels, volume.transform_index_to_lps, {1: "eye_left", 5: "nerve"})


def write_label_map_seg(tmp_path: Path, labels: np.ndarray, volume: Volume) -> Path:
    names = ["eye_left", "two", "three", "four", "nerve"]
    masks = [labels == value for value in range(1, 6)]
    return save_dicom_seg(tmp_path / "x.dcm", masks, names, volume, "LABELMAP")


def write_one_layer(tmp_path: Path, labels: np.ndarray, volume: Volume) -> Path:
    segments = [{"Name": "eye_left", "LabelValue": 1, "Layer": 0}, {"Name": "nerve", "LabelValue": 5, "Layer": 0}]
    return save_seg_nrrd(tmp_path / "x.seg.nrrd", [labels], segments, volume.transform_index_to_lps)


@pytest.mark.parametrize("write", [write_nifti, write_label_map_seg, write_one_layer])
def test_label_maps_land_on_their_voxels(
    tmp_path: Path, volume: Volume, write: Callable[[Path, np.ndarray, Volume], Path]
) -> None:
    first, second = masks_of(volume)
    labels = np.where(first, 1, np.where(second, 5, 0))
    found = read_label_map(write(tmp_path, labels, volume), {})
    assert [(label.value, label.name) for label in found.labels] == [(1, "eye_left"), (5, "nerve")]
    for label in found.labels:
        assert np.abs(label_centres(label) - centres(labels == label.value, volume)).max() < 1e-3


def test_a_second_library_reads_the_files_of_these_tests_so(tmp_path: Path, volume: Volume) -> None:
    """SimpleITK places NRRD and NIfTI as our readers do; it takes a binary SEG for one stack of all segments."""
    first, second = masks_of(volume)
    labels = np.where(first, 1, np.where(second, 5, 0))
    image = sitk.ReadImage(str(write_nifti(tmp_path, labels, volume)))
    at = np.array([image.TransformIndexToPhysicalPoint([int(v) for v in i]) for i in np.argwhere(labels == 5)[:, ::-1]])
    assert np.abs(sorted_rows(at) - centres(labels == 5, volume)).max() < 1e-3
    layers = sitk.ReadImage(str(write_layers(tmp_path, volume)))
    assert layers.GetNumberOfComponentsPerPixel() == 2
    assert np.allclose(layers.GetOrigin(), volume.index_to_lps([2, 2, 1]), atol=1e-6)
    assert layers.GetMetaData("Segment1_Name") == "Optic nerve"
    stacked = sitk.ReadImage(str(write_binary(tmp_path, volume)))
    assert stacked.GetSize()[2] == sum(int(mask.any(axis=(1, 2)).sum()) for mask in (first, second))


def test_surfaces_are_closed_and_turn_outwards(tmp_path: Path, volume: Volume) -> None:
    found = read_here(write_layers(tmp_path, volume), volume)
    assert found.notes == ()
    for surface, mask in zip(found.surfaces, masks_of(volume), strict=True):
        mesh, cell = surface.mesh, float(np.prod(volume.spacing)) / 1000.0
        a, b, c = np.moveaxis(mesh.triangles - mesh.bounds.mean(axis=0), 1, 0)
        enclosed = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0 / 1000.0
        assert surface.volume_ml == pytest.approx(cell * mask.sum())
        assert 0.75 * surface.volume_ml < enclosed < surface.volume_ml  # marching cubes cuts the corners off
        edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        off = ProximityTree(mesh).point_distance(centres(mask, volume))[0]
        assert off.min() > 0.2 * volume.spacing.min()
        assert surface.voxel_mm == pytest.approx(volume.spacing)


def test_a_label_at_the_border_of_its_grid_is_closed_too() -> None:
    surface = surface_of(
        CroppedLabel(1, "", None, np.ones((2, 3, 4), dtype=bool), np.zeros(3, dtype=np.int64), np.eye(4))
    )
    assert surface.mesh.bounds == pytest.approx(np.array([[-0.5] * 3, [3.5, 2.5, 1.5]]))


def test_the_worker_gives_the_same(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    for file in (write_layers(tmp_path, volume), write_binary(tmp_path, volume)):
        here = read_here(file, volume)
        found = read_segmentation(SegmentationRequest(file), place_of(volume), silent)
        for a, b in zip(found.surfaces, here.surfaces, strict=True):
            assert np.array_equal(a.mesh.vertices, b.mesh.vertices)
            assert (a.name, a.colour, a.notes) == (b.name, b.colour, b.notes)


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("t.json", '{"1": "eye", "5": "nerve"}'),
        ("t.json", '{"eye": 1, "nerve": 5}'),
        ("t.json", '{"labels": {"background": 0, "eye": 1, "nerve": 5}}'),
        ("t.json", '[{"label": 1, "name": "eye"}, {"label": "5", "name": "nerve"}]'),
        ("t.csv", "label,name\n1,eye\n5,nerve\n"),
        ("t.csv", "name;value;color\neye;1;red\nnerve;5;blue\n"),
        ("t.csv", "1,eye\n5,nerve"),
        ("t.tsv", "index\tname\n1\teye\n5\tnerve\n"),
        ("t.tsv", "# of a colour table\n1\teye\n5\tnerve\n"),
        ("t.csv", "\ufefflabel,structure\r\n1,eye\r\n5,nerve\r\n"),
    ],
)
def test_tables_of_names(tmp_path: Path, file: str, text: str) -> None:
    path = tmp_path / file
    path.write_text(text, encoding="utf-8")
    assert {value: look.name for value, look in read_names(path).items()} == {1: "eye", 5: "nerve"}


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("t.json", "{", "not valid JSON"),
        ("t.json", "[" * 100_000, "not valid JSON"),
        ("t.json", "{}", "holds none"),
        ("t.csv", "", "holds none"),
        ("t.csv", "a,b\nc,d\n", "holds none"),
        ("t.csv", "label,name\n1,eye\n1,nerve\n", "label 1 two names"),
        ("t.csv", "label,name\n1,eye, left\n", "name with a comma in quotes"),
        ("t.csv", "1,eye\n2,eye, left\n", "name with a comma in quotes"),
    ],
)
def test_tables_without_names_are_refused(tmp_path: Path, file: str, text: str, words: str) -> None:
    path = tmp_path / file
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ImageError, match=words):
        read_names(path)


def test_the_table_names_what_the_file_does_not(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    first, second = masks_of(volume)
    labels = np.where(first, 1, np.where(second, 5, 0))
    table = tmp_path / "names.json"
    table.write_text(json.dumps({"1": "from the table", "5": "nerve", "9": "not there"}))
    named = save_nifti(tmp_path / "a.nii", labels, volume.transform_index_to_lps, {1: "from the file"})
    assert [s.name for s in read_here(named, volume, names=table).surfaces] == ["from the file", "nerve"]
    bare = save_nifti(tmp_path / "b.nii", labels, volume.transform_index_to_lps)
    assert [s.name for s in read_here(bare, volume).surfaces] == ["", ""]
    assert nibabel.load(bare).header.extensions == []


def test_a_damaged_table_in_the_header_is_refused(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    file = save_nifti(tmp_path / "a.nii", masks_of(volume)[0].astype(int), volume.transform_index_to_lps, {1: "eye"})
    data = file.read_bytes()
    for before, after, words in (
        (b"</LabelTable>", b"<LabelTable//", "damaged"),
        (b"<CaretExtension>", b"<!DOCTYPE x[]>  ", "entities"),
    ):
        assert len(before) == len(after)
        file.write_bytes(data.replace(before, after))
        with pytest.raises(ImageError, match=words):
            read_here(file, volume)


def test_old_segmentations_have_a_layer_for_each_segment(tmp_path: Path) -> None:
    """Slicer before 4.11 wrote neither layer nor label."""
    volume = asymmetric_volume()
    first, second = masks_of(volume)
    segments: list[dict[str, object]] = [{"Name": "a"}, {"Name": "b"}]
    layers = [first.astype(int), second.astype(int)]
    file = save_seg_nrrd(tmp_path / "x.seg.nrrd", layers, segments, volume.transform_index_to_lps)
    assert [label.name for label in read_label_map(file, {}).labels] == ["a", "b"]


@pytest.mark.parametrize("kind", ["BINARY", "LABELMAP"])
@pytest.mark.parametrize("share", [0.0, 0.5, 0.99])
def test_a_dicom_segmentation_that_ends_early_is_said_to_be_cut_off(tmp_path: Path, kind: str, share: float) -> None:
    """Not that its frames are irregular: resampling it, as that error advises, would not help."""
    scan = asymmetric_volume(None)
    first, second = masks_of(scan)
    file = save_dicom_seg(tmp_path / "seg.dcm", [first, second & ~first], ["Left eye", "Optic nerve"], scan, kind)
    data = file.read_bytes()
    voxels = data.rindex(struct.pack("<HH", 0x7FE0, 0x0010))
    file.write_bytes(data[: voxels + int(share * (len(data) - voxels))])
    with pytest.raises(ImageError, match="is cut off"):
        read_label_map(file, {})


def test_empty_segments_are_told_and_left_out(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    first = masks_of(volume)[0]
    segments = [{"Name": name, "LabelValue": value, "Layer": 0} for value, name in ((1, "eye"), (2, "lens"))]
    file = save_seg_nrrd(tmp_path / "x.seg.nrrd", [first.astype(int)], segments, volume.transform_index_to_lps)
    assert read_here(file, volume).notes == ("'lens' has no voxel and was left out.",)
    with pytest.raises(ImageError, match="empty"):
        read_here(save_nifti(tmp_path / "e.nii", 0 * first, volume.transform_index_to_lps), volume)


def test_a_segmentation_off_the_scan_is_refused_or_noted(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    mask = masks_of(volume)[0]
    transform = volume.transform_index_to_lps
    far = transform.copy()
    far[:3, 3] += [500.0, 0.0, 0.0]
    with pytest.raises(ImageError, match=r"outside the CT.*another scan"):
        read_here(save_nifti(tmp_path / "far.nii", mask.astype(int), far), volume)
    half = transform.copy()
    half[:3, 3] += [4.125, 0.0, 0.0]  # five and a half voxels: off the grid, and partly out of the box
    found = read_here(save_nifti(tmp_path / "half.nii", mask.astype(int), half), volume)
    assert "a grid of its own" in found.notes[0]
    assert "lie outside the CT" in found.surfaces[0].notes[0]
    two = np.zeros((9, 12, 30), dtype=int)
    two[:, :, :15][mask], two[:, :, 18:28] = 1, 2
    found = read_here(save_nifti(tmp_path / "two.nii", two, transform), volume)
    assert [surface.value for surface in found.surfaces] == [1]
    assert found.notes == ("'2' lies outside the CT and was left out.",)


def test_a_case_without_a_ct_has_only_its_box(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    file = save_nifti(tmp_path / "x.nii", masks_of(volume)[0].astype(int), volume.transform_index_to_lps)
    assert read_here(file, None).notes == ()


def test_a_map_without_a_place_is_asked_about(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    image = nibabel.Nifti1Image(masks_of(volume)[0].T.astype(np.uint8), np.diag([-0.75, -0.5, 1.25, 1.0]))
    image.set_sform(None, code=0)
    image.set_qform(None, code=0)
    nibabel.save(image, tmp_path / "x.nii")
    with pytest.raises(FrameError) as asked:
        read_here(tmp_path / "x.nii", None)
    assert asked.value.missing == ("frame",)


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


@pytest.mark.parametrize("write", [write_layers, write_binary])
def test_truncated_files_are_refused(tmp_path: Path, write: Callable[[Path, Volume], Path]) -> None:
    volume = asymmetric_volume()
    file = write(tmp_path, volume)
    file.write_bytes(cut(file.read_bytes()))
    with pytest.raises(ImageError):
        read_here(file, volume)


def test_pictures_and_other_dicom_are_no_segmentations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    volume = asymmetric_volume()
    ct = save_dicom(dicom_slices(volume), tmp_path / "ct") / "000.dcm"
    with pytest.raises(ImageError, match="not a segmentation"):
        read_here(ct, volume)
    nrrd.write(str(tmp_path / "ct.nrrd"), volume.hu.T, {"space": "LPS", "space directions": np.eye(3)})
    with pytest.raises(ImageError):
        read_here(tmp_path / "ct.nrrd", volume)
    many = np.arange(volume.hu.size).reshape(volume.hu.shape) % 200
    file = save_nifti(tmp_path / "many.nii", many, volume.transform_index_to_lps)
    monkeypatch.setattr(label_map, "MAX_LABELS", 100)
    with pytest.raises(ImageError, match="199 different values"):
        read_here(file, volume)
    halves = nibabel.Nifti1Image(np.full((3, 3, 3), 0.5), np.eye(4))
    nibabel.save(halves, tmp_path / "halves.nii")
    with pytest.raises(ImageError, match="whole numbers"):
        read_here(tmp_path / "halves.nii", volume)


def test_shares_are_no_labels(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    file = write_binary(tmp_path, volume)
    file.write_bytes(file.read_bytes().replace(b"BINARY", b"FRACTI"))
    with pytest.raises(ImageError, match="no binary or label map"):
        read_here(file, volume)


def test_a_segmentation_is_no_ct(tmp_path: Path) -> None:
    """It is recognised, and the words say what to do with it."""
    volume = asymmetric_volume()
    layer = save_seg_nrrd(tmp_path / "x.seg.nrrd", [masks_of(volume)[0].astype(int)], [{"Name": "a"}], np.eye(4))
    for file in (layer, write_binary(tmp_path, volume)):
        with pytest.raises(ImageError, match="--into"):
            read_volume(file)


def test_what_nifti_says_of_its_extensions_is_not_trusted(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    file = save_nifti(tmp_path / "a.nii", masks_of(volume)[0].astype(int), volume.transform_index_to_lps, {1: "eye"})
    data = bytearray(file.read_bytes())
    struct.pack_into("<i", data, 352, 1 << 30)
    file.write_bytes(data)
    assert [surface.name for surface in read_here(file, volume).surfaces] == [""]


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    request = SegmentationRequest(tmp_path / "gone.seg.nrrd")
    with pytest.raises(InputError, match="no such file"):
        read_segmentation(request, place_of(asymmetric_volume()), silent)


def test_names_that_are_not_ascii(tmp_path: Path) -> None:
    volume = asymmetric_volume()
    segments: list[dict[str, object]] = [{"Name": "optic nerve", "LabelValue": 1, "Layer": 0}]
    layers = [masks_of(volume)[0].astype(int)]
    file = save_seg_nrrd(tmp_path / "x.seg.nrrd", layers, segments, volume.transform_index_to_lps)
    file.write_bytes(file.read_bytes().replace(b"optic nerve", "Sehnerv µ".encode()))
    assert [label.name for label in read_label_map(file, {}).labels] == ["Sehnerv µ"]


def test_the_real_head_lands_on_itself(tmp_path: Path, trial_data: Path) -> None:
    """NRRD, DICOM, and segmentations in each format within 1e-3 mm; the mesh within a millimetre of the surface."""
    folder = trial_data / "head_ct"
    ct, _ = read_volume(folder / "cthead_hu_lps.nrrd")
    series, _ = read_volume(folder / "cthead_derived_dicom.zip")
    assert np.array_equal(ct.hu, series.hu)
    assert np.abs(ct.transform_index_to_lps - series.transform_index_to_lps).max() < 1e-3
    mesh, _ = read_mesh(folder / "nose_sinus_bone_lps_mm.ply", "LPS", "mm")
    surface = extract_surface(ct, 250.0, mesh.bounds + np.array([[-3.0], [3.0]]))
    # The mesh was thinned when it was made, which closed some sheets: not every one of its corners counts.
    assert np.quantile(ProximityTree(surface).point_distance(mesh.vertices)[0], 0.99) < 1.0
    bone = ct.hu > 250
    transform = ct.transform_index_to_lps
    files = (
        save_nifti(tmp_path / "x.nii.gz", bone.astype(int), transform),
        save_seg_nrrd(tmp_path / "x.seg.nrrd", [bone.astype(int)], [{"Name": "bone"}], transform),
        save_dicom_seg(tmp_path / "x.dcm", [bone], ["bone"], ct),
    )
    for file in files:
        (label,) = read_label_map(file, {}).labels
        first, last = label.first, label.first + np.array(label.mask.shape[::-1]) - 1
        ours = np.array([label.transform[:3, :3] @ index + label.transform[:3, 3] for index in (first, last)])
        wanted = ct.index_to_lps(np.argwhere(bone)[:, ::-1])
        assert np.abs(np.sort(ours, axis=0) - [wanted.min(axis=0), wanted.max(axis=0)]).max() < 1e-3
        assert np.count_nonzero(label.mask) == np.count_nonzero(bone)
