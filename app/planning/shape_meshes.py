"""Meshes of the shapes of a plan (protected structures, removed bone), for the scene and for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from app.cases.service import CaseService
from vfix_engine.arrays import Array, IndexArray
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


def _chain(points: list[Any], radius: float) -> TriangleMesh:
    """Return capsules from one place to the next, or a ball for a single place."""
    places = np.array(points, dtype=np.float64)
    steps = np.diff(places, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    steps, middles, lengths = (values[lengths > 1e-6] for values in (steps, places[:-1] + 0.5 * steps, lengths))
    (ball, ball_faces), (tube, tube_faces) = _unit_parts()
    turns = np.array([rotation_z_to(step) for step in steps]).reshape(-1, 3, 3)
    stretched = tube * np.stack([np.full_like(lengths, radius)] * 2 + [lengths], axis=-1)[:, None]
    tubes = stretched @ turns.transpose(0, 2, 1) + middles[:, None]
    balls = radius * ball + places[:, None]
    vertices = np.concatenate([balls.reshape(-1, 3), tubes.reshape(-1, 3)])
    tube_start = np.arange(len(tubes))[:, None, None] * len(tube) + balls.shape[0] * balls.shape[1]
    ball_start = np.arange(len(balls))[:, None, None] * len(ball)
    faces = [(ball_faces + ball_start).reshape(-1, 3), (tube_faces + tube_start).reshape(-1, 3)]
    return TriangleMesh(vertices, np.concatenate(faces))


@cache
def _unit_parts() -> tuple[tuple[Array, IndexArray], tuple[Array, IndexArray]]:
    """Vertices and faces of a ball and of a tube along z, of radius and height 1."""
    import trimesh  # imported here: slow to load

    ball, tube = trimesh.creation.icosphere(subdivisions=2), trimesh.creation.cylinder(1.0, 1.0, sections=24)
    return (np.array(ball.vertices), np.array(ball.faces)), (np.array(tube.vertices), np.array(tube.faces))


def _at(mesh: trimesh.Trimesh, rotation: npt.NDArray[np.float64], place: Any) -> trimesh.Trimesh:
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, place
    mesh.apply_transform(transform)
    return mesh
