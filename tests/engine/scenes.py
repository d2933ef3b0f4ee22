"""Scenes for closed-loop tests, and coal as the independent judge of clearance."""

from __future__ import annotations

import json
from pathlib import Path

import coal
import numpy as np
import trimesh

from vfix_engine.control import ControlSettings
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.worlds.rigid.placing import place_robot
from vfix_engine.worlds.rigid.scene import Scene


def curved_tube(radius: float = 6.0, bend_radius: float = 120.0) -> tuple[TriangleMesh, np.ndarray]:
    """A tube along an arc from the origin, +y first, and points (6, 3) along its centreline; normals point inwards."""
    angles = np.linspace(0.0, 70.0 / bend_radius, 60)
    centre = np.column_stack([np.zeros_like(angles), bend_radius * np.sin(angles), bend_radius * (1 - np.cos(angles))])
    around = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    vertices = []
    for place, angle in zip(centre, angles, strict=True):
        up = np.array([0.0, -np.sin(angle), np.cos(angle)])
        ring = np.cos(around)[:, None] * np.array([1.0, 0.0, 0.0]) + np.sin(around)[:, None] * up
        vertices.append(place + radius * ring)
    i, j = np.meshgrid(np.arange(59), np.arange(40), indexing="ij")
    a, b = i * 40 + j, i * 40 + (j + 1) % 40
    faces = np.concatenate([np.stack([a, b, a + 40], -1), np.stack([b, b + 40, a + 40], -1)]).reshape(-1, 3)
    return TriangleMesh(np.concatenate(vertices), faces), centre[2:55:10]


def wall(y: float, size: float = 60.0) -> TriangleMesh:
    """A square wall across +y, finely triangulated."""
    steps = np.linspace(-size, size, 41)
    x, z = np.meshgrid(steps, steps, indexing="ij")
    vertices = np.column_stack([x.ravel(), np.full(x.size, y), z.ravel()])
    i, j = np.meshgrid(np.arange(40), np.arange(40), indexing="ij")
    a = (i * 41 + j).ravel()
    faces = np.concatenate([np.column_stack([a, a + 1, a + 41]), np.column_stack([a + 1, a + 42, a + 41])])
    return TriangleMesh(vertices, faces)


def placed_scene(mesh: TriangleMesh, points: np.ndarray, settings: ControlSettings | None = None) -> Scene:
    """A scene with the robot placed automatically."""
    settings = settings or ControlSettings()
    robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
    path, tree = SplinePath(points), ProximityTree(mesh)
    placing = place_robot(tree, robot, tool, path, settings)
    return Scene(tree, robot, tool, placing.base, placing.q_start, path)


def straight_scene(mesh: TriangleMesh, points: np.ndarray | None = None) -> Scene:
    """A scene with the tip at the patient's origin and the shaft along +y, whatever that means for the tool."""
    robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
    path = None if points is None else SplinePath(points)
    base = np.eye(4)
    base[:3, 3] = -tool.tip_in_flange
    return Scene(ProximityTree(mesh), robot, tool, base, np.zeros(7), path)


def head_mesh(trial_data: Path) -> TriangleMesh:
    """The real head's bone around nose and sinuses."""
    loaded = trimesh.load(trial_data / "head_ct" / "nose_sinus_bone_lps_mm.ply", process=False)
    return TriangleMesh(np.asarray(loaded.vertices), np.asarray(loaded.faces))


def head_corridor(trial_data: Path) -> np.ndarray:
    """Points (12, 3) of the hand-checked corridor."""
    points = json.loads((trial_data / "head_ct" / "corridor.json").read_text())["points"]
    return np.array([p["lps"] for p in points])


class CoalJudge:
    """Clearance of capsules to a mesh by coal, which shares no line with ours."""

    def __init__(self, mesh: TriangleMesh):
        self._model = coal.BVHModelOBBRSS()
        self._model.beginModel(len(mesh.faces), len(mesh.vertices))
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for vertex in mesh.vertices:
            points.append(vertex)
        for a, b, c in mesh.faces:
            triangles.append(coal.Triangle(int(a), int(b), int(c)))
        self._model.addSubModel(points, triangles)
        self._model.endModel()

    def clearance(self, segments: Segments) -> float:
        """Smallest distance of the whole tool; not positive means contact."""
        least = np.inf
        for start, end, radius in zip(segments.start, segments.end, segments.radius, strict=True):
            along = end - start
            length = float(np.linalg.norm(along))
            rotation = _turning_z_to(along / length)
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            capsule = coal.Capsule(float(radius), length)
            place = coal.Transform3s(rotation, (start + end) / 2)
            least = min(least, coal.distance(self._model, coal.Transform3s.Identity(), capsule, place, request, result))
        return float(least)


def _turning_z_to(direction: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) whose third column is ``direction``."""
    helper = np.eye(3)[int(np.abs(direction).argmin())]
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
