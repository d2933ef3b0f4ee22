"""What can be a head and what cannot, and what is said of one that is doubtful."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from imaging_phantoms import asymmetric_volume, dicom_slices, save_dicom

from vfix_engine.errors import ImageError, MeshError
from vfix_engine.imaging.frame_report import FrameReport
from vfix_engine.imaging.head_files import assumption, check_ct, read_ct_of_head, read_surface_of_head
from vfix_engine.imaging.volume import Volume


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
        check_ct(ct(values))


def test_a_ct_has_the_size_of_a_head() -> None:
    with pytest.raises(ImageError, match="cannot be a head"):
        check_ct(asymmetric_volume())


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
