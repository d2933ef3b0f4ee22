"""Inside or outside of a surface: against trimesh's containment on closed meshes, and against the CT on bone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from geometry_meshes import ball, coinciding, slivers

from vfix_engine.anatomy.phantom import load_bone_surface, load_nose_ct
from vfix_engine.errors import InputError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.files.readers import read_volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.fields.side import SurfaceSide
from vfix_engine.proximity.fit import nearest_free_point
from vfix_engine.proximity.proximity import ProximityTree

BONE_HU = 250.0


def star() -> trimesh.Trimesh:
    """A ball with spikes and dents: corners so sharp that the mean of the faces' normals would mislead."""
    made = trimesh.creation.icosphere(subdivisions=2, radius=10.0)
    made.vertices *= np.random.default_rng(3).uniform(0.3, 1.7, (len(made.vertices), 1))
    return made


def wedge() -> trimesh.Trimesh:
    """A knife's edge of four needles: one long face beside many short ones."""
    return trimesh.convex.convex_hull([[0, 0, 0], [100, 0, 0.1], [100, 0.1, 0], [0, 5, 0.02], [50, -1, 30]])


def shell() -> trimesh.Trimesh:
    """A hollow ball: its cavity is outside."""
    inner = trimesh.creation.icosphere(subdivisions=3, radius=6.0)
    inner.invert()
    return trimesh.util.concatenate([trimesh.creation.icosphere(subdivisions=3, radius=10.0), inner])


@pytest.mark.parametrize("made", [star(), wedge(), shell(), trimesh.creation.box((3, 4, 5))])
@pytest.mark.parametrize("own_corners", [False, True])
def test_a_closed_surface_has_trimeshs_inside(made: trimesh.Trimesh, own_corners: bool) -> None:
    assert made.is_watertight
    mesh = TriangleMesh(made.vertices, made.faces)
    if own_corners:  # as STL files have them
        mesh = TriangleMesh(mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))
    random = np.random.default_rng(4)
    low, high = mesh.bounds
    # Near corners and edges the choice of the normal matters most.
    at = np.concatenate([mesh.vertices, mesh.triangles[:, :2].mean(axis=1)])
    near = at[random.integers(0, len(at), 3000)] + random.normal(scale=0.05 * (high - low).min(), size=(3000, 3))
    points = np.concatenate([random.uniform(low - 2.0, high + 2.0, (3000, 3)), near])
    tree = ProximityTree(mesh)
    clear = tree.point_distance(points)[0] > 1e-6
    assert (SurfaceSide(tree).outside(points) != made.contains(points))[clear].all()


def test_a_point_of_no_side_is_not_outside() -> None:
    side = SurfaceSide(ProximityTree(ball(2)))
    assert not side.outside(ball(2).vertices).any()
    assert side.outside([[0, 0, 11.0]]).all()
    with pytest.raises(InputError):
        side.outside([[np.nan, 0, 0]])


@pytest.mark.parametrize("mesh", [slivers(np.random.default_rng(5)), coinciding()])
def test_any_mesh_has_an_answer(mesh: TriangleMesh) -> None:
    points = np.random.default_rng(6).uniform(-12, 12, (500, 3))
    assert SurfaceSide(ProximityTree(mesh)).outside(points).shape == (500,)


def test_a_triangle_without_area_between_others_tells_the_side() -> None:
    box = trimesh.creation.box((2, 2, 2))
    a, b, _ = box.faces[0]
    vertices = np.vstack([box.vertices, 0.5 * (box.vertices[a] + box.vertices[b])])
    mesh = TriangleMesh(vertices, np.vstack([[[a, len(box.vertices), b]], box.faces]))
    points = np.random.default_rng(7).uniform(-2, 2, (2000, 3))
    inside = (np.abs(points) < 1.0).all(axis=1)
    assert (SurfaceSide(ProximityTree(mesh)).outside(points) != inside).all()


def test_bone_of_the_phantom_has_the_side_that_its_ct_shows() -> None:
    """Where the CT is clear, one voxel from the surface and inside its box."""
    tree, volume = ProximityTree(load_bone_surface()), load_nose_ct()
    random = np.random.default_rng(8)
    at = tree.mesh.vertices[random.integers(0, len(tree.mesh.vertices), 4000)]
    points = at + random.normal(scale=3.0, size=at.shape)
    low, high = volume.bounds[0] + 3.0, volume.bounds[1] - 3.0
    clear = (tree.point_distance(points)[0] > 0.7) & (points > low).all(axis=1) & (points < high).all(axis=1)
    bone = volume.sample(points[clear]) >= BONE_HU
    assert min(bone.sum(), (~bone).sum()) > 300
    assert (SurfaceSide(tree).outside(points[clear]) != bone).all()


def test_points_of_a_real_surface_fit_in_air_without_its_ct(trial_data: Path) -> None:
    """HAZ-04: of 120 corners of the bone, none may be put where the CT shows bone."""
    folder = trial_data / "head_ct"
    mesh, _ = read_mesh(folder / "nose_sinus_bone_lps_mm.ply", "LPS", "mm")
    tree, volume = ProximityTree(mesh), read_volume(folder / "cthead_hu_lps.nrrd")[0]
    side = SurfaceSide(tree)
    chosen = mesh.vertices[np.linspace(0, len(mesh.vertices) - 1, 120).astype(int)]
    places = np.array([nearest_free_point(tree, p, 1.8, inside_bone=lambda at: ~side.outside(at)) for p in chosen])
    assert (volume.sample(places) >= BONE_HU).sum() == 0
