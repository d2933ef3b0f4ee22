"""What can be a head and what cannot, and what is said of one that is doubtful."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from imaging_phantoms import asymmetric_volume, dicom_slices, save_dicom

from vfix_engine.anatomy.head_files import assumption, check_ct, read_ct_of_head, read_surface_of_head
from vfix_engine.errors import ImageError, MeshError
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.files.volume import Volume

MM = FrameReport("LPS", False)


def ball(radius: float, subdivisions: int = 4) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)


def ct(values: tuple[int, int], spacing: float = 1.0) -> Volume:
    hu = np.full((24, 48, 48), values[0], dtype=np.int16)
    hu[6:18, 12:36, 12:36] = values[1]
    return Volume(hu, np.zeros(3), np.array([1.0, 1.0, spacing]), np.eye(3))


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (ball(0.1), r"0\.2 x 0\.2 x 0\.2 mm large, which cannot be a head\. Its unit is metres, perhaps"),
        (trimesh.Trimesh([[0, 0, 0], [5, 0, 0], [0, 5, 0], [0, 0, 5]], [[0, 2, 1], [0, 1, 3]]), "5 x 5 x 5 mm large"),
        (ball(2000.0), "which cannot be a head"),
        (trimesh.Trimesh([[0, 0, 0], [90, 0, 0], [45, 0, 0]], [[0, 1, 2]], process=False), "are without area"),
    ],
)
def test_surface_that_cannot_be_a_head_is_refused_with_its_size(
    tmp_path: Path, mesh: trimesh.Trimesh, words: str
) -> None:
    """HAZ-09, HAZ-14."""
    mesh.export(tmp_path / "head.stl")
    with pytest.raises(MeshError, match=words):
        read_surface_of_head(tmp_path / "head.stl", "LPS", "mm")


@pytest.mark.parametrize(("named", "given"), [("mm", None), ("m", None), (None, "m")])
def test_a_unit_is_asked_for_only_where_it_can_be_said(tmp_path: Path, named: str | None, given: str | None) -> None:
    """A file that names millimetres has to be corrected itself; of what is in metres already nothing is advised."""
    radius = 0.1 if named == "mm" else 1e-4
    data = ball(radius).export(file_type="ply")
    note = b"ply\n" + (f"comment UNIT={named}\n".encode() if named else b"")
    (tmp_path / "head.ply").write_bytes(data.replace(b"ply\n", note, 1))
    with pytest.raises(MeshError, match="cannot be a head") as refused:
        read_surface_of_head(tmp_path / "head.ply", "LPS", given)
    assert "say so" not in str(refused.value)
    assert ("names mm: correct" in str(refused.value)) == (named == "mm")


def test_metres_are_heard(tmp_path: Path) -> None:
    ball(0.1).export(tmp_path / "head.stl")
    mesh, _, notes = read_surface_of_head(tmp_path / "head.stl", "LPS", "m")
    assert np.allclose(mesh.bounds, [[-100] * 3, [100] * 3], atol=1e-3)
    assert notes == ()


def test_few_triangles_are_noted(tmp_path: Path) -> None:
    ball(60.0, subdivisions=0).export(tmp_path / "head.stl")
    (note,) = read_surface_of_head(tmp_path / "head.stl", "LPS", "mm")[2]
    assert "20 triangles only" in note


def test_only_what_was_assumed_is_said_to_be() -> None:
    """HAZ-14: what the file or the user named is not among it."""
    for missing, words in [
        (("frame", "unit"), "its frame and its unit; LPS and mm were assumed. Check left and right."),
        (("frame",), "its frame; LPS was assumed. Check left and right."),
        (("unit",), "its unit; mm was assumed."),
    ]:
        assert assumption(FrameReport("LPS", True, missing)) == (f"The file does not name {words}",)
    assert assumption(FrameReport("RAS", False)) == ()


@pytest.mark.parametrize(
    ("values", "words"),
    [((0, 3), "2 whole numbers from 0 on are the labels"), ((24, 2024), "1024 is missing"), ((0, 600), "no air")],
)
def test_what_holds_no_air_is_no_ct(values: tuple[int, int], words: str) -> None:
    """Labels are told from an offset that is missing."""
    with pytest.raises(ImageError, match=words):
        check_ct(ct(values), MM)


def test_a_ct_has_the_size_of_a_head() -> None:
    with pytest.raises(ImageError, match="cannot be a head"):
        check_ct(asymmetric_volume(), MM)


@pytest.mark.parametrize(
    ("value", "share", "figures"),
    [
        (-3000, 0.02, "1,106 of 55,296 voxels lie under -2,000 or over 10,000 HU.* from -3,000 to 1,000"),
        (12_000, 0.02, "from -1,000 to 12,000"),
        (32_767, 0.0, "1 of 55,296 voxels.* to 32,767 or more"),
        (-32_768, 0.0, "from -32,768 or less to 1,000"),
        (-3000, 0.005, None),
        (32_766, 0.005, None),
        (10_000, 0.5, None),
    ],
)
def test_values_that_are_no_hounsfield_units_are_noted(value: int, share: float, figures: str | None) -> None:
    """A wrong byte order and values beyond the type's range, which are cut to its ends."""
    hu = ct((-1000, 1000)).hu.copy()
    hu.reshape(-1)[: max(1, round(share * hu.size))] = value
    notes = check_ct(Volume(hu, np.zeros(3), np.ones(3), np.eye(3)), MM)
    assert len(notes) == (figures is not None) + 1  # and that it is small
    if figures:
        assert re.search(figures, notes[0])
        assert "byte order" in notes[0]


@pytest.mark.parametrize(("spacing", "thickness", "said"), [(1.0, 1.0, False), (5.0, 5.0, True), (1.0, 5.0, True)])
def test_thick_slices_are_noted(tmp_path: Path, spacing: float, thickness: float, said: bool) -> None:
    """HAZ-15: 5 mm, by the distance of the slices or by what the scanner took for one, hide thin bone."""
    slices = dicom_slices(ct((-1000, 1000), spacing))
    for one in slices:
        one.SliceThickness = thickness
    volume, _, notes = read_ct_of_head(save_dicom(slices, tmp_path / "series"))
    assert volume.resolution_mm == max(spacing, thickness)
    coarse = [note for note in notes if "The CT is coarse" in note]
    assert len(coarse) == said
    assert all(f"1 x 1 x {spacing:g} mm, its slices 5 mm thick" in note for note in coarse)


@pytest.mark.parametrize("inwards", [False, True])
@pytest.mark.parametrize("open_at_the_top", [False, True])
def test_triangles_that_face_inwards_are_noted(tmp_path: Path, inwards: bool, open_at_the_top: bool) -> None:
    """Without a CT the normals decide whether a path point lies in bone."""
    mesh = ball(60.0)
    if open_at_the_top:
        mesh.update_faces(mesh.triangles_center[:, 2] < 40.0)
    if inwards:
        mesh.invert()
    mesh.export(tmp_path / "head.stl")
    notes = read_surface_of_head(tmp_path / "head.stl", "LPS", "mm")[2]
    assert [("face inwards" in note, "Flip the normals" in note) for note in notes] == [(True, True)] * inwards
