"""The shipped head: its files, its sizes against published ones, its way through the nose."""

from __future__ import annotations

import hashlib
import json
from collections import Counter

import numpy as np
import pytest

from head_phantom import landmarks as known
from head_phantom import measure
from head_phantom.files import write_nrrd
from vfix_engine.anatomy.phantom import (
    BONE_REPORT,
    DESCRIPTION,
    DISPLAY,
    load_bone_surface,
    load_head_ct,
    load_landmarks,
    load_nose_ct,
    phantom_dir,
)
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree

SIDES = pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])


@pytest.fixture(scope="module")
def nose() -> Volume:
    return load_nose_ct(noise=False)


@pytest.fixture(scope="module")
def bone() -> TriangleMesh:
    return load_bone_surface()


def mirror(side: float) -> np.ndarray:
    return np.array([side, 1.0, 1.0])


def test_the_files_are_the_described_ones_and_small() -> None:
    description = json.loads((phantom_dir() / DESCRIPTION).read_text(encoding="utf-8"))
    assert "Not for clinical use" in description["notice"]
    for name, entry in description["files"].items():
        data = (phantom_dir() / name).read_bytes()
        assert hashlib.sha256(data).hexdigest() == entry["sha256"], name
    assert sum(path.stat().st_size for path in phantom_dir().iterdir()) < 25e6


@SIDES
def test_the_maxillary_sinus_is_of_common_size_and_hangs_on_its_ostium(nose: Volume, side: float) -> None:
    """15.7 ± 5.3 cm³, ostium about 2 mm; plugged, no air gets in."""
    antrum, nasal = known.IN_ANTRUM * mirror(side), known.IN_NOSE * mirror(side)
    plug = measure.Plug(known.OSTIUM_PLUG * mirror(side), known.OSTIUM_PLUG_RADIUS)
    plugged = measure.air_region(nose, antrum, plug)
    assert 15.7 - 5.3 < measure.volume_cm3(nose, plugged) < 15.7 + 5.3
    assert not measure.is_in(nose, plugged, nasal)
    assert measure.is_in(nose, measure.air_region(nose, antrum), nasal)
    ends = known.OSTIUM_IN_ANTRUM * mirror(side), known.OSTIUM_IN_NOSE * mirror(side)
    assert 1.5 < measure.bottleneck_mm(nose, *ends) < 2.6


@SIDES
def test_the_bone_of_the_canine_fossa_is_thin(nose: Volume, side: float) -> None:
    """1.1 ± 0.4 mm."""
    walls = [
        measure.thickness_mm(nose, start * mirror(side), known.CANINE_FOSSA_DIRECTION * mirror(side))
        for start in known.CANINE_FOSSA_RAYS
    ]
    assert min(walls) > 0.5
    assert 0.7 < np.mean(walls) < 1.5


def test_the_bone_surface_is_closed_and_turned_outwards(nose: Volume, bone: TriangleMesh) -> None:
    assert 170_000 < len(bone.faces) < 190_000
    faces = bone.faces[: len(bone.faces) - BONE_REPORT.put_back]  # what was put back comes last, and lies in its place
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    shared = Counter(np.unique(edges, axis=0, return_counts=True)[1].tolist())
    assert set(shared) <= {2, 4}  # bodies may touch in an edge
    assert shared[4] <= 20
    a, b, c = np.moveaxis(bone.triangles, 1, 0)
    assert np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6 > 100_000  # [mm³]
    centres = bone.triangles.mean(axis=1)
    low, high = nose.bounds
    inner = ((centres > low + 1.5) & (centres < high - 1.5)).all(axis=1)
    behind = nose.sample(centres[inner] - 0.4 * bone.face_normals[inner])
    front = nose.sample(centres[inner] + 0.4 * bone.face_normals[inner])
    assert (behind > front).mean() > 0.99


def test_the_bone_surface_is_off_as_far_as_is_told(nose: Volume, bone: TriangleMesh) -> None:
    """Thinned from the CT's own surface, nothing left out: the figures at every vertex both ways, and between them."""
    closed = Volume(np.pad(nose.hu, 1, constant_values=-1000), nose.origin - nose.spacing, nose.spacing, nose.direction)
    whole = extract_surface(closed)
    ways = [ProximityTree(to).point_distance(of.vertices)[0] for of, to in ((whole, bone), (bone, whole))]
    assert max(way.max() for way in ways) == pytest.approx(BONE_REPORT.max_deviation_mm, abs=2e-3)
    assert max(way.mean() for way in ways) == pytest.approx(BONE_REPORT.mean_deviation_mm, abs=1e-3)
    places = np.random.default_rng(4).dirichlet(np.ones(3), len(whole.faces))
    between = np.einsum("fc,fci->fi", places, whole.triangles)
    assert ways[0].max() <= 0.051
    assert ProximityTree(bone).point_distance(between)[0].max() <= BONE_REPORT.error_mm


def test_the_corridor_stays_in_air_and_off_bone(nose: Volume, bone: TriangleMesh) -> None:
    tree, corridor = ProximityTree(bone), load_landmarks().corridor
    points = np.array([point.position for point in corridor])
    assert len({point.label for point in corridor}) == 8
    assert tree.point_distance(points)[0].min() >= 4.0
    path = SplinePath(points)
    way = path.position(np.arange(0.0, path.length, 0.25))
    assert nose.sample(way).max() < -950
    assert tree.point_distance(way)[0].min() > 3.5


def test_targets_lie_on_tissue(nose: Volume) -> None:
    """Air and tissue are both within 1.5 mm."""
    targets = load_landmarks().targets
    assert {"maxillary ostium left", "sphenoid ostium left"} <= {target.label for target in targets}
    directions = np.random.default_rng(4).normal(size=(400, 3))
    directions *= 1.5 / np.linalg.norm(directions, axis=1, keepdims=True)
    for target in targets:
        around = nose.sample(target.position + directions)
        assert around.min() < -700, target.label
        assert around.max() > -100, target.label


def test_bead_centroids_are_found_in_the_noisy_ct() -> None:
    ct, beads = load_head_ct(), load_landmarks().beads
    assert len(beads) == 5
    spread = np.array([bead.centroid for bead in beads])
    assert np.linalg.matrix_rank(spread - spread.mean(axis=0), tol=10.0) == 3  # not in a plane
    for bead in beads:
        assert np.linalg.norm(measure.bead_centroid(ct, bead.centroid) - bead.centroid) < 0.15


def test_display_surfaces_are_light_and_whole() -> None:
    surfaces = {name: read_mesh(phantom_dir() / file)[0] for name, file in DISPLAY.items()}
    assert len(surfaces["skull"].faces) <= 60_000
    assert len(surfaces["skull_half"].faces) <= 60_000
    assert len(surfaces["skin"].faces) <= 30_000
    assert surfaces["skull_half"].bounds[0, 0] > 1.0
    assert np.ptp(surfaces["skull"].bounds, axis=0) == pytest.approx([141, 200, 210], abs=14)
    assert (surfaces["skin"].bounds[0] < surfaces["skull"].bounds[0] + 0.1).all()


def test_noise_is_the_same_every_time_and_of_a_scanner(nose: Volume) -> None:
    noisy, again = load_nose_ct(), load_nose_ct()
    np.testing.assert_array_equal(noisy.hu, again.hu)
    added = noisy.hu[:, 100:200, 100] - nose.hu[:, 100:200, 100]
    assert 10 < added[nose.hu[:, 100:200, 100] > -900].std() < 18


def test_equal_volumes_make_equal_files(nose: Volume, tmp_path) -> None:
    small = Volume(nose.hu[:4, :5, :6].copy(), nose.origin, nose.spacing, nose.direction)
    write_nrrd(tmp_path / "a.nrrd", small)
    write_nrrd(tmp_path / "b.nrrd", small)
    assert (tmp_path / "a.nrrd").read_bytes() == (tmp_path / "b.nrrd").read_bytes()
