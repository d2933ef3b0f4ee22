"""Meshes of the shapes of a plan (protected structures, removed bone), for the scene and for other programs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from app.cases.service import CaseService
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shape_patch import patch_around
from vfix_engine.proximity.axes import rotation_z_to

if TYPE_CHECKING:
    import trimesh

Mesh = tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]  # vertices (n, 3) LPS mm, faces (m, 3)

PLANE_MM = 45.0  # half width of the square that shows a half-space
NOTHING: Mesh = (np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32))


def shape_mesh(cases: CaseService, case_id: str, shape: Mapping[str, Any]) -> Mesh:
    """Return the mesh of a shape; a degenerate triangle if its structure is no longer in the case."""
    try:
        made = shape_surface(cases, case_id, shape)
    except InputError:
        return NOTHING
    return np.asarray(made.vertices, np.float32), np.asarray(made.faces, np.uint32)


def shape_surface(cases: CaseService, case_id: str, shape: Mapping[str, Any]) -> TriangleMesh:
    """Return the surface of a shape in LPS mm; a half-space as a square of its plane.

    Raises InputError if its structure is no longer in the case.
    """
    made = _made(cases, case_id, shape)
    return made if isinstance(made, TriangleMesh) else TriangleMesh(made.vertices, made.faces)


def _made(cases: CaseService, case_id: str, shape: Mapping[str, Any]) -> Any:
    import trimesh  # imported here: slow to load

    match shape["kind"]:
        case "sphere":
            return _at(trimesh.creation.icosphere(subdivisions=3, radius=shape["radius"]), np.eye(3), shape["centre"])
        case "capsule":
            return _chain([shape["start"], shape["end"]], shape["radius"])
        case "capsules":
            return _chain(shape["points"], shape["radius"])
        case "box":
            box = trimesh.creation.box(2.0 * np.array(shape["half_size"]))
            return box.apply_transform(np.reshape(shape["transform_box_to_patient"], (4, 4)))
        case "half_space":
            square = trimesh.creation.box((2.0 * PLANE_MM, 2.0 * PLANE_MM, 0.2))
            return _at(square, rotation_z_to(shape["normal"]), shape["point"])
        case "patch":
            surface = cases.structure_mesh(case_id, shape.get("structure", cases.get(case_id).anatomy.id))
            return patch_around(surface, shape["centre"], shape["radius"])
    return cases.structure_mesh(case_id, shape["structure"])


def _chain(points: list[Any], radius: float) -> Any:
    """Return capsules from one place to the next, or a ball for a single place."""
    import trimesh  # imported here: slow to load

    places = np.array(points, dtype=np.float64)
    parts = [_at(trimesh.creation.icosphere(subdivisions=2, radius=radius), np.eye(3), place) for place in places]
    for start, end in itertools.pairwise(places):
        length = float(np.linalg.norm(end - start))
        if length > 1e-6:
            tube = trimesh.creation.cylinder(radius=radius, height=length, sections=24)
            parts.append(_at(tube, rotation_z_to(end - start), 0.5 * (start + end)))
    return trimesh.util.concatenate(parts)


def _at(mesh: trimesh.Trimesh, rotation: npt.NDArray[np.float64], place: Any) -> trimesh.Trimesh:
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, place
    mesh.apply_transform(transform)
    return mesh
