"""Thinning with a bound, and the slabs that a surface is extracted in."""

import numpy as np
import pytest
from imaging_phantoms import asymmetric_volume

from vfix_engine.anatomy import bone as bone_module
from vfix_engine.anatomy.bone import bone_of_volume, surfaces_of
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.anatomy.thinning import bound_over, collapsed, within
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree


def rough_ball(seed: int = 2) -> Volume:
    """A dense ball with noise in whole HU, so that many voxels have the very value of the threshold."""
    k, j, i = np.indices((40, 36, 44)).astype(float)
    distance = np.sqrt((k - 20) ** 2 + (j - 17) ** 2 + (i - 22) ** 2)
    noise = np.random.default_rng(seed).normal(size=distance.shape)
    hu = np.clip(np.rint(250 + 10 * (13 - distance) + 4 * noise), -1000, 1500)
    return Volume(hu.astype(np.int16), [3.0, -5.0, 7.0], [0.5, 0.6, 0.8], np.eye(3))


def edges_of(mesh: TriangleMesh) -> np.ndarray:
    faces = mesh.faces.astype(np.int64)
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def is_watertight(mesh: TriangleMesh) -> bool:
    """Every edge is run along as often one way as the other."""
    there = edges_of(mesh)
    count = len(mesh.vertices)
    ways = np.sort(there[:, 0] * count + there[:, 1]), np.sort(there[:, 1] * count + there[:, 0])
    return bool(np.array_equal(*ways))


def sorted_triangles(mesh: TriangleMesh) -> np.ndarray:
    flat = np.round(mesh.triangles, 4).reshape(len(mesh.faces), 9)
    turned = [np.roll(flat.reshape(-1, 3, 3), turn, axis=1).reshape(-1, 9) for turn in range(3)]
    first = np.lexsort(np.stack([[one[:, 0], one[:, 1], one[:, 2]] for one in turned]).transpose(1, 0, 2)[::-1], axis=0)
    least = np.stack(turned)[first[0], np.arange(len(flat))]
    return least[np.lexsort(least.T[::-1])]


@pytest.mark.parametrize("slab", [1, 7, 13, 39])
@pytest.mark.parametrize("volume", [rough_ball(), asymmetric_volume()], ids=["rough", "asymmetric"])
def test_slabs_give_the_surface_of_the_whole(volume: Volume, slab: int) -> None:
    whole, parts = extract_surface(volume, slab_slices=10**6), extract_surface(volume, slab_slices=slab)
    assert (len(parts.vertices), len(parts.faces)) == (len(whole.vertices), len(whole.faces))
    np.testing.assert_allclose(sorted_triangles(parts), sorted_triangles(whole), atol=2e-4)
    assert is_watertight(parts) == is_watertight(whole)


def test_a_voxel_of_the_thresholds_value_leaves_no_hole() -> None:
    """Marching cubes at that very level leaves dozens there."""
    volume = rough_ball()
    assert (volume.hu == BONE_HU).sum() > 100, "many voxels have that value"
    mesh = extract_surface(volume, slab_slices=5)
    assert is_watertight(mesh)
    inside = volume.hu >= BONE_HU
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    enclosed = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert enclosed == pytest.approx(np.count_nonzero(inside) * np.prod(volume.spacing), rel=0.03)


def test_the_bound_holds_between_the_vertices() -> None:
    """Against the distance of points all over every triangle, also where it had to be split."""
    mesh = extract_surface(rough_ball())
    fewer = collapsed(mesh, len(mesh.faces) // 6)
    tree = ProximityTree(fewer)
    weights = np.random.default_rng(5).dirichlet(np.ones(3), 12)
    points = np.einsum("pc,fci->fpi", weights, mesh.triangles)
    true = tree.point_distance(points.reshape(-1, 3))[0].reshape(len(mesh.faces), -1).max(axis=1)
    for enough in (np.inf, 0.05):
        bound = bound_over(mesh.triangles, tree, enough)
        assert (bound >= true - 1e-9).all()
    unsplit = bound_over(mesh.triangles, tree, np.inf)
    assert bound.mean() < unsplit.mean(), "splitting tightens it"


def test_what_deviates_is_put_back_and_the_rest_certified() -> None:
    mesh = extract_surface(rough_ball())
    fewer = collapsed(mesh, len(mesh.faces) // 6)
    off = ProximityTree(fewer).point_distance(mesh.vertices)[0].max()
    assert off > 0.15
    found = within(mesh, fewer, 0.1)
    tree = ProximityTree(found.mesh)
    assert 0 < found.put_back == len(found.mesh.faces) - len(fewer.faces) < len(mesh.faces)
    assert tree.point_distance(mesh.vertices)[0].max() <= 0.1
    weights = np.random.default_rng(6).dirichlet(np.ones(3), 30)
    inner = np.einsum("pc,fci->fpi", weights, mesh.triangles).reshape(-1, 3)
    assert found.certified_mm is not None
    assert tree.point_distance(inner)[0].max() <= found.certified_mm <= 0.15
    both = (tree.point_distance(mesh.vertices)[0], ProximityTree(mesh).point_distance(found.mesh.vertices)[0])
    assert found.max_deviation_mm == max(way.max() for way in both)
    assert within(mesh, mesh, 0.1).put_back == 0


def test_bone_is_kept_whole_up_to_a_size_and_then_within_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    volume = rough_ball()
    kept = bone_of_volume(volume, progress=lambda stage, share: None)
    assert kept.control.content_hash == extract_surface(volume).content_hash
    assert kept.control_report.error_mm == 0.0
    assert bone_module.CONTROL_TRIANGLES >= bone_module.THINNED_TRIANGLES >= 3_000_000
    monkeypatch.setattr(bone_module, "CONTROL_TRIANGLES", 2000)
    monkeypatch.setattr(bone_module, "THINNED_TRIANGLES", 1000)
    thinned = surfaces_of(kept.control, progress=lambda stage, share: None)
    assert len(thinned.control.faces) < len(kept.control.faces)
    report = thinned.control_report
    assert report.put_back > 0
    assert 0.0 < report.error_mm == report.certified_mm <= 0.15


def test_small_pieces_stay_in_the_bone_and_leave_the_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    volume = rough_ball()
    hu = volume.hu.copy()
    hu[2:4, 2:4, 2:4] = 1000
    speck = Volume(hu, volume.origin, volume.spacing, volume.direction)
    monkeypatch.setattr(bone_module, "DISPLAY_TRIANGLES", 500)
    found = bone_of_volume(speck, progress=lambda stage, share: None)
    at = speck.index_to_lps([2.5, 2.5, 2.5])
    assert np.linalg.norm(found.control.vertices - at, axis=1).min() < 2.0
    assert np.linalg.norm(found.display.vertices - at, axis=1).min() > 4.0
    assert found.display_report.dropped.pieces >= 1
    assert found.control_report.dropped.pieces == 0


@pytest.mark.parametrize("most", [100_000, 2000])
def test_what_is_done_is_told_in_shares_that_only_grow(monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    """No stage takes more of the whole than measured on the head; the longest is named while it goes on."""
    monkeypatch.setattr(bone_module, "DISPLAY_TRIANGLES", 500)
    monkeypatch.setattr(bone_module, "CONTROL_TRIANGLES", most)
    monkeypatch.setattr(bone_module, "THINNED_TRIANGLES", most // 2)
    told: list[tuple[str, float]] = []
    bone_of_volume(rough_ball(), progress=lambda stage, share: told.append((stage, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert max(np.diff([*shares, 1.0])) < 0.45
    assert len([stage for stage, _ in told if stage.endswith("making the picture of it")]) >= 4
