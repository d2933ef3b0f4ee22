"""A headrest's shell is left out of the bone; whatever may be part of the patient stays, bit by bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from vfix_engine.anatomy.beside_head import LARGEST_THIN_PART_MM, bone_of_plates
from vfix_engine.anatomy.bone import bone_of_volume
from vfix_engine.anatomy.phantom import load_head_ct
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import no_progress

RADIUS, SKULL = 40.0, 33.0  # mm: the skin, and the skull's outside; the mouth is in front of it
AIR, SOFT, BONE = -1000, 40, 900


def places() -> tuple[Array, Array, Array]:
    z, y, x = np.meshgrid(np.arange(-50, 50), np.arange(-52, 68), np.arange(-82, 83), indexing="ij")
    return x.astype(float), y.astype(float), z.astype(float)


def scan(change: Callable[[Array, Array, Array, np.ndarray], None] = lambda x, y, z, hu: None) -> Volume:
    """A ball of soft tissue with a skull and an open mouth in which a tooth stands alone, and what `change` adds."""
    x, y, z = places()
    r = np.linalg.norm([x, y, z], axis=0)
    hu = np.where(r < RADIUS, SOFT, AIR)
    hu[(r < SKULL) & (r > SKULL - 4.0)] = BONE
    mouth = (y < 0.0) & (np.hypot(x, z) < 7.0) & (r > 20.0)
    hu[mouth] = AIR
    hu[(np.abs(x) < 2.0) & (np.abs(z) < 2.0) & (np.abs(y + 30.0) < 4.0)] = BONE
    change(x, y, z, hu)
    return Volume(hu.astype(np.int16), [x.min(), y.min(), z.min()], np.ones(3), np.eye(3))


def shell(x: Array, y: Array, z: Array, gap: float, width: float = 150.0) -> BoolArray:
    """A flat shell of 3 mm behind the head, up to the last slices."""
    found: BoolArray = (np.abs(y - (RADIUS + gap + 1.0)) < 1.6) & (np.abs(x) < 0.5 * width) & (np.abs(z) < 46.0)
    return found


def triangles(mesh: TriangleMesh) -> set[bytes]:
    return {one.tobytes() for one in mesh.triangles}


@pytest.mark.parametrize("gap", [-2.0, 0.0, 6.0], ids=["pressed", "touching", "apart"])
def test_a_headrest_is_left_out_and_the_head_stays_bit_by_bit(gap: float) -> None:
    def rest(x: Array, y: Array, z: Array, hu: np.ndarray) -> None:
        hu[shell(x, y, z, gap)] = BONE

    head, found = scan(), bone_of_volume(scan(rest), progress=no_progress)
    assert triangles(found.control) == triangles(extract_surface(head))
    assert found.display.vertices[:, 1].max() < RADIUS - 4.0
    dropped = found.control_report.dropped
    assert dropped.pieces == 1
    assert dropped.triangles == len(extract_surface(scan(rest)).faces) - len(found.control.faces)
    assert dropped.extent_mm == pytest.approx(np.linalg.norm([149.0, 91.0, 3.0]), abs=3.0)
    (note,) = found.notes
    assert note.startswith("Not in the bone: 1 piece beside the head, as of a headrest. ")
    assert f"{dropped.triangles:,} triangles" in note


def arm(x: Array, y: Array, z: Array, hu: np.ndarray) -> None:
    hu[(np.hypot(y - 56.0, z) < 10.0) & (np.abs(x) < 79.0)] = SOFT
    hu[(np.hypot(y - 56.0, z) < 5.0) & (np.abs(x) < 77.0)] = BONE


def arm_at_the_head(x: Array, y: Array, z: Array, hu: np.ndarray) -> None:
    arm(x, y + 8.0, z, hu)


def small_plate(x: Array, y: Array, z: Array, hu: np.ndarray) -> None:
    hu[shell(x, y, z, 6.0, width=100.0)] = BONE


def frame_with_a_pin(x: Array, y: Array, z: Array, hu: np.ndarray) -> None:
    hu[shell(x, y, z, 6.0)] = BONE
    hu[(np.hypot(x, z) < 2.0) & (y > 25.0) & (y < 47.0)] = BONE


def two_small_plates(x: Array, y: Array, z: Array, hu: np.ndarray) -> None:
    hu[shell(np.abs(x) - 40.0, y, z, 6.0, width=60.0)] = BONE


@pytest.mark.parametrize("change", [arm, arm_at_the_head, small_plate, two_small_plates, frame_with_a_pin])
def test_what_is_thick_or_small_or_held_by_bone_stays(
    change: Callable[[Array, Array, Array, np.ndarray], None],
) -> None:
    volume = scan(change)
    found = bone_of_volume(volume, progress=no_progress)
    assert found.control.content_hash == extract_surface(volume).content_hash
    assert found.control_report.dropped.pieces == 0
    assert found.notes == ()


def test_nothing_is_told_apart_where_the_scan_cuts_the_head() -> None:
    """A side that lies beyond the scan can join what seems to be apart; its first and last slices may cut the head."""

    def rest(x: Array, y: Array, z: Array, hu: np.ndarray) -> None:
        hu[shell(x, y, z, 6.0)] = BONE

    whole = scan(rest)
    cut = Volume(whole.hu[:, 20:], whole.index_to_lps([0.0, 20.0, 0.0]), whole.spacing, whole.direction)
    assert bone_of_plates(cut) is None
    ended = Volume(whole.hu[30:], whole.index_to_lps([0.0, 0.0, 30.0]), whole.spacing, whole.direction)
    assert bone_of_plates(ended) is not None
    hu = whole.hu.copy()
    hu[:, :20] = -2000
    assert bone_of_plates(Volume(hu, whole.origin, whole.spacing, whole.direction)) is None, (
        "nothing was measured there"
    )


def test_a_volume_without_bone_or_without_a_body_has_none() -> None:
    hu = np.full((20, 20, 20), AIR, np.int16)
    hu[10, 10, 10] = BONE
    for values in (hu, np.full_like(hu, SOFT)):
        assert bone_of_plates(Volume(values, np.zeros(3), np.ones(3), np.eye(3))) is None


def test_the_shipped_head_is_unchanged() -> None:
    assert bone_of_plates(load_head_ct()) is None


def test_a_real_head_loses_its_headrest_and_nothing_else(trial_data: Path) -> None:
    volume = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")[0]
    told = bone_of_plates(volume)
    assert told is not None
    assert (told.pieces, int(told.voxels.sum())) == (10, 436)
    assert told.extent_mm > LARGEST_THIN_PART_MM
    rows = volume.origin[1] + np.flatnonzero(told.voxels.any(axis=(0, 2)))
    assert rows.min() > 107.0, "behind the skull, whose last voxel is at 106.5"
