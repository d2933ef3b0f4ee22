"""How the lining of the nose looks in a picture: how open each place is to light, and its colour from the CT below it.

The colours are chosen by eye; they are no measurement. Thin lining over bone is paler, thick soft tissue a deeper red.
"""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.endoscopy.air_surface import AirSurface
from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.arrays import Array
from vfix_engine.files.volume import Volume
from vfix_engine.progress import ProgressCallback, no_progress

RAYS = 64  # from each vertex
REACH_MM = 8.0  # what is farther away takes no light
_OFF_MM = 0.15  # distance from the surface at which its rays start
_LINING, _OVER_BONE, _THICK = (0.80, 0.34, 0.29), (0.93, 0.66, 0.54), (0.66, 0.20, 0.19)  # sRGB
_DEPTHS_MM = np.array([0.6, 1.0, 1.5, 2.2, 3.0])  # below the surface, at which the CT is read
_NEAR = np.array([1.0, 0.9, 0.7, 0.4, 0.2])  # weight of bone at these depths
_BONE_HU = (150.0, 650.0)  # from which on it counts as bone, in part and wholly
_PALER, _DEEPER = 0.75, 0.55  # shares of the other colours
_SPOTS_MM, _SPOTS = (5.0, 1.6), 0.06  # sizes of the mottle, and its standard deviation
_COLON, _COLON_SPOTS_MM, _COLON_SPOTS = (0.90, 0.60, 0.50), (14.0, 5.0), 0.07


def openness(
    surface: AirSurface, *, rays: int = RAYS, reach_mm: float = REACH_MM, progress: ProgressCallback = no_progress
) -> Array:
    """Share (V,) of the light from all sides that reaches each vertex: ambient occlusion, 1 where nothing is near.

    Rays are weighted by the cosine to the normal; a wall at a distance d of up to reach_mm leaves √(d / reach).
    """
    wall = Wall(surface.mesh)
    normals = surface.normals
    first, second = _across(normals)
    start = surface.mesh.vertices + _OFF_MM * normals
    found = np.zeros(len(normals))
    for number, (x, y, z) in enumerate(_cosine_directions(rays)):
        progress("Preparing the picture", number / rays)
        distance, _ = wall.seen(start, x * first + y * second + z * normals)
        found += np.sqrt(np.minimum(distance / reach_mm, 1.0))
    return found / rays


def colours(volume: Volume, surface: AirSurface) -> Array:
    """Colours (V, 3) in sRGB from 0 to 1, by what the CT shows below each vertex."""
    places, normals = surface.mesh.vertices, surface.normals
    below = np.stack([volume.sample(places - depth * normals) for depth in _DEPTHS_MM])
    least, whole = _BONE_HU
    bone = np.clip((below - least) / (whole - least), 0.0, 1.0)
    paler = _PALER * (bone * _NEAR[:, None]).max(axis=0)
    deeper = _DEEPER * (1.0 - bone.max(axis=0))
    lining = np.array(_LINING)
    mixed = lining + (np.array(_OVER_BONE) - lining) * paler[:, None] + (np.array(_THICK) - lining) * deeper[:, None]
    return _mottled(places, mixed, _SPOTS_MM, _SPOTS)


def lumen_colours(surface: AirSurface) -> Array:
    """Colours (V, 3) in sRGB from 0 to 1 of the wall of a lumen, of which no CT says more."""
    places = surface.mesh.vertices
    return _mottled(places, np.tile(_COLON, (len(places), 1)), _COLON_SPOTS_MM, _COLON_SPOTS)


def _mottled(places: Array, colours: Array, sizes_mm: tuple[float, ...], deviation: float) -> Array:
    """Colours (V, 3) with spots of these sizes, the redder the darker."""
    spots = np.mean([_noise(places, size, seed) for seed, size in enumerate(sizes_mm)], axis=0)
    redder = np.stack([np.ones_like(spots), 1.0 - 0.07 * spots, 1.0 - 0.07 * spots], axis=-1)
    found: Array = np.clip(colours * (1.0 + deviation * spots)[:, None] * redder, 0.0, 1.0)
    return found


def _across(normals: Array) -> tuple[Array, Array]:
    """Two unit vectors (n, 3) each at right angles to unit vectors (n, 3)."""
    other = np.where(np.abs(normals[:, :1]) < 0.8, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(normals, other)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
    return first, np.cross(normals, first)


def _cosine_directions(count: int) -> Array:
    """Unit vectors (count, 3) about z, as many as the cosine to it, along a golden spiral."""
    share = (np.arange(count) + 0.5) / count
    radius, turn = np.sqrt(share), np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - share)])


def _noise(places: Array, size_mm: float, seed: int) -> Array:
    """Smooth noise (n,) at places (n, 3), about normal, with spots of a size; the same for the same places."""
    from scipy import ndimage  # imported here: slow to load

    low = places.min(axis=0)
    shape = tuple(((places.max(axis=0) - low) / size_mm).astype(int) + 3)
    grid = np.random.default_rng(seed).standard_normal(shape)
    found: Array = ndimage.map_coordinates(grid, ((places - low) / size_mm + 1.0).T, order=3, mode="reflect")
    return found
