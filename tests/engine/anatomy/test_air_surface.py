"""The surface that an endoscope sees, of a made-up cavity: where it lies, its normals, its light and its colours."""

from __future__ import annotations

import numpy as np
import pytest

from vfix_engine.anatomy.endoscopy import mucosa
from vfix_engine.anatomy.endoscopy.air_surface import BEYOND_MM, CORNER_STEP_MM, AirSurface, air_surface, box_about
from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shapes import Box, Sphere

RADIUS = 3.0  # mm, of the cavity about the origin
BONE_SIDE = 4.0  # mm: right of this x there is bone
SPACING = np.array([0.7, 0.6, 0.5])
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # directions of i, j, k in columns
BOX = np.array([[-8.0, -8.0, -8.0], [8.0, 8.0, 8.0]])


def cavity(radius: float = RADIUS) -> Volume:
    """A ball of air in tissue, whose border is at the level that the surface has; bone on the left side."""
    counts = np.array([40, 44, 48])
    grid = Volume(np.zeros(counts[::-1], np.int16), np.zeros(3), SPACING, TURNED)
    origin = -grid.index_to_lps((counts - 1) / 2.0)
    k, j, i = np.indices(counts[::-1])
    at = grid.index_to_lps(np.stack([i, j, k], axis=-1).reshape(-1, 3)) + origin
    from_centre = np.linalg.norm(at, axis=1)
    hu = np.clip(TISSUE_HU + 500.0 * (from_centre - radius), -1000.0, 40.0)
    hu = np.where((at[:, 0] > BONE_SIDE) & (from_centre > radius + 0.5), 1000.0, hu)
    return Volume(np.rint(hu.reshape(counts[::-1])).astype(np.int16), origin, SPACING, TURNED)


@pytest.fixture(scope="module")
def surface() -> AirSurface:
    return air_surface(cavity(), BOX)


def outward(surface: AirSurface) -> Array:
    return surface.mesh.vertices / np.linalg.norm(surface.mesh.vertices, axis=1, keepdims=True)


def test_it_lies_at_the_level_of_tissue_and_its_normals_point_into_the_air(surface: AirSurface) -> None:
    assert np.abs(np.linalg.norm(surface.mesh.vertices, axis=1) - RADIUS).max() < 0.1
    assert (surface.normals * -outward(surface)).sum(axis=1).min() > 0.99
    middles = surface.mesh.triangles.mean(axis=1)
    assert (surface.mesh.face_normals * -middles).sum(axis=1).min() > 0.0
    fewer = air_surface(cavity(), BOX, triangles=500)
    assert len(fewer.mesh.faces) <= 500 < len(surface.mesh.faces)
    assert np.abs(np.linalg.norm(fewer.mesh.vertices, axis=1) - RADIUS).max() < 0.1


@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_where_bone_is_removed_there_is_air(turn: float) -> None:
    """A box from within the cavity into the bone beside it, and a ball apart from both."""
    at = np.eye(4)
    at[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    at[:3, 3] = [5.0, 0.0, 0.0]
    centre, radius = np.array([-1.0, -1.0, 6.0]), 1.5
    found = air_surface(cavity(), BOX, removed=[Box(at, [2.5, 1.2, 1.2]), Sphere(centre, radius)])
    vertices = found.mesh.vertices
    off = np.min(
        [
            np.abs(np.linalg.norm(vertices, axis=1) - RADIUS),
            np.abs(signed_distance(Box(at, [2.5, 1.2, 1.2]), vertices)),
            np.abs(np.linalg.norm(vertices - centre, axis=1) - radius),
        ],
        axis=0,
    )
    assert off.max() < 0.45, "edges and corners are round by the blur"
    assert np.median(off) < 0.15
    deep = np.array([[1.0, 0.0, 0.0]])
    assert Wall(found.mesh).seen(np.zeros(3), deep)[0][0] > 5.0, "the cavity is open to where the bone was"
    apart = np.linalg.norm(vertices - centre, axis=1) < radius + 0.3
    assert apart.sum() > 50
    assert ((vertices[apart] - centre) * found.normals[apart]).sum(axis=1).max() < -0.9 * radius


def test_where_there_is_no_air_it_says_so() -> None:
    solid = Volume(np.full((20, 20, 20), 40, np.int16), np.zeros(3), np.ones(3), np.eye(3))
    with pytest.raises(ImageError, match="no air"):
        air_surface(solid, np.array([[2.0, 2.0, 2.0], [9.0, 9.0, 9.0]]))
    with pytest.raises(ImageError, match="does not reach"):
        air_surface(solid, BOX + 100.0)


def test_a_box_of_more_voxels_than_a_machine_holds_is_refused_before_any_is_made() -> None:
    wide = Volume(np.zeros((20, 20, 20), np.int16), np.zeros(3), np.full(3, 20.0), np.eye(3))
    with pytest.raises(ImageError, match="too far apart"):
        air_surface(wide, np.array([[0.0, 0.0, 0.0], [380.0, 380.0, 380.0]]))


def test_the_box_holds_path_and_targets_and_stays_while_they_are_edited_a_little() -> None:
    places = np.array([[5.0, -14.0, -6.0], [3.0, 65.0, 27.4]])
    low, high = box_about(places)
    assert (low <= places.min(axis=0) - BEYOND_MM).all()
    assert (high >= places.max(axis=0) + BEYOND_MM).all()
    assert ((high - low) % CORNER_STEP_MM == 0.0).all()
    assert np.array_equal(box_about(places + 0.5), [low, high])


def test_light_in_a_ball_is_what_the_integral_says(surface: AirSurface) -> None:
    """From a wall of a ball with radius R, the ray at an angle t to the normal is 2 R cos t long."""
    expected = 0.8 * np.sqrt(2.0 * RADIUS / mucosa.REACH_MM)
    found = mucosa.openness(surface, rays=48)
    assert np.abs(found - expected).max() < 0.06
    assert abs(found.mean() - expected) < 0.02


def test_lining_over_bone_is_paler(surface: AirSurface) -> None:
    found = mucosa.colours(cavity(), surface)
    x = surface.mesh.vertices[:, 0]
    over_bone, over_tissue = found[x > 2.5].mean(axis=0), found[x < -2.5].mean(axis=0)
    assert (over_bone - over_tissue)[1:].min() > 0.1
    assert 0.0 <= found.min() <= found.max() <= 1.0
    assert found[x < -2.5].std(axis=0).max() > 0.005  # mottled
