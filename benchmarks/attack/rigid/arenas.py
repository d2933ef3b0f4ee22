"""The scenes of the attack: the two heads and generated anatomy, each with a robot, a tool, a path and targets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks import cases
from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Sphere
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.virtual_fixtures import (
    CartesianLimits,
    Fixture,
    OrientationCone,
    RemoteCentre,
    SoftZone,
    Zone,
    weighted,
)
from vfix_engine.worlds.rigid.scene import Scene

from . import meshes

Random = np.random.Generator

MARGINS = (0.05, 0.3, 0.3, 0.3, 1.0)
MODES = ("free", "free", "path", "inspect")
STRAIGHT = np.array([[0.0, 0.0, 0.0], [0.0, 7.0, 0.0], [1.0, 14.0, 0.0], [0.0, 24.0, 2.0]])


@dataclass(frozen=True, eq=False)
class Arena:
    """One scene of the attack.

    moves: mm by which the anatomy is shifted between episodes, so that some begin inside the margin; 0: not at all.
    """

    name: str
    scene: Scene
    margins: tuple[float, ...] = MARGINS
    modes: tuple[str, ...] = MODES
    moves: float = 0.0


def _arena(
    name: str,
    mesh: TriangleMesh,
    random: Random,
    *,
    path: Array = STRAIGHT,
    tool: str = "bent_30",
    robot: str = "steady_hand",
    zones: Callable[[Array, Array], tuple[Zone, ...]] | None = None,
    fixtures: Callable[[Array, Array], tuple[Fixture, ...]] | None = None,
    far: float = 50.0,
    back: float = 0.0,
    margins: tuple[float, ...] = MARGINS,
    moves: float = 0.0,
) -> Arena:
    """Return a scene with the tool's tip at the origin and its shaft along +y, rotated and shifted at random."""
    model, held = RobotModel.load(robot), Tool.load(tool)
    turn = Rotation.random(random_state=int(random.integers(2**31))).as_matrix()
    shift = far * random.uniform(-1, 1, 3)
    moved = TriangleMesh(np.asarray(mesh.vertices) @ turn.T + shift, mesh.faces)
    targets = np.array([[0.0, 14.0, 0.0], [1.0, 12.0, 3.0]]) @ turn.T + shift
    q = np.array(model.home)
    scene = Scene(
        ProximityTree(moved), model, held, np.eye(4), q, SplinePath(path @ turn.T + shift), targets, ("one", "two")
    )
    tip = scene.placed_robot().tip(q)
    base, wanted = np.eye(4), shift - back * turn[:, 1]
    base[:3, :3] = turn @ tip.rotation.T
    base[:3, 3] = wanted - base[:3, :3] @ tip.position
    scene = replace(
        scene,
        base=base,
        zones=() if zones is None else zones(turn, shift),
        fixtures=() if fixtures is None else fixtures(turn, shift),
    )
    return Arena(name, scene, margins, moves=moves)


def _head(name: str, case: cases.BenchCase) -> Arena:
    """Return a head with the robot placed as by the planner."""
    scene = cases.drive(case).scene
    ends = case.path.points[-2:]
    return Arena(name, replace(scene, targets=ends, target_names=("before the end", "the end")))


def _phantom(random: Random) -> Arena:
    return _head("phantom", cases.phantom())


def _real_head(random: Random) -> Arena | str:
    case = cases.real_head()
    return case if isinstance(case, str) else _head("real head", case)


def _tube(name: str, radius: float, bend_radius: float, taper: float = 0.0) -> Callable[[Random], Arena]:
    def build(random: Random) -> Arena:
        mesh, centre = meshes.tube(radius, bend_radius, taper=taper)
        return _arena(name, mesh, random, path=centre - centre[0] * [1, 0, 1], back=0.5)

    return build


def _one(name: str, mesh: Callable[[Random], TriangleMesh], **options: Any) -> Callable[[Random], Arena]:
    def build(random: Random) -> Arena:
        return _arena(name, mesh(random), random, **options)

    return build


def _slit(random: Random) -> Arena:
    """Return a slit with the margin of 0.3 mm and 0.005 mm more on either side, less than the buffer of the rows."""
    return _arena("slit", meshes.slit(1.5 + 0.305), random, margins=(0.3, 0.3, 0.05, 0.304))


def _shapes(turn: Array, shift: Array) -> tuple[Zone, ...]:
    """Return a zone of every kind around the tool, so near to each other that corners form between them."""
    pose = np.eye(4)
    pose[:3, :3] = turn @ Rotation.from_euler("xyz", (0.4, 0.2, -0.3)).as_matrix()
    pose[:3, 3] = turn @ [-7.5, 4.0, 0.0] + shift
    return (
        Zone("ball", Sphere(turn @ [0.0, 9.0, 0.0] + shift, 3.0), 0.7),
        Zone("nerve", CapsuleShape(turn @ [5.0, -30.0, 2.0] + shift, turn @ [4.0, 12.0, -3.0] + shift, 0.8), 1.5),
        Zone("block", Box(pose, [3.0, 2.0, 6.0]), 0.0),
        Zone("floor", HalfSpace(turn @ [0.0, 0.0, 6.0] + shift, turn @ [0.0, 0.1, -1.0]), 0.2),
    )


def _patches(turn: Array, shift: Array) -> tuple[Zone, ...]:
    """Return two patches of a wall with different margins, one larger than the usual range of the boundary."""
    ahead, beside = (
        meshes.wall(9.0, 8.0, 12),
        meshes.plane(np.array([9.0, -20, 0]), np.eye(3)[1] * 30, np.eye(3)[2] * 9),
    )
    zones = []
    for name, mesh, margin in (("vessel", ahead, 4.0), ("wall", beside, 0.0)):
        moved = TriangleMesh(np.asarray(mesh.vertices) @ turn.T + shift, mesh.faces)
        zones.append(Zone.of_faces(name, moved, np.arange(0, len(moved.faces), 1), margin))
    return tuple(zones)


def _standing(turn: Array, shift: Array) -> tuple[Fixture, ...]:
    """Return all standing fixtures together: remote centre, cone, speed limits, tissue over bone and a soft ball."""
    return (
        RemoteCentre(turn @ [0.0, -60.0, -7.5] + shift, tolerance_mm=2.0),
        weighted(OrientationCone.of_shaft(turn[:, 1], 0.4), 0.5),
        CartesianLimits(speed_mm_per_s=30.0, acceleration_mm_per_s2=2000.0),
        SoftZone("mucosa", 1.5, 2.0),
        SoftZone("swelling", 0.0, 0.5, Sphere(turn @ [3.0, 5.0, 0.0] + shift, 3.0)),
    )


BUILDERS: dict[str, Callable[[Random], Arena | str]] = {
    "phantom": _phantom,
    "real head": _real_head,
    "tube 6 mm": _tube("tube 6 mm", 6.0, 120.0),
    "tube 9 mm": _tube("tube 9 mm", 9.0, 60.0),
    "funnel": _tube("funnel", 9.0, 200.0, taper=7.5),
    "wall": _one("wall", lambda random: meshes.wall(5.0)),
    "two huge triangles": _one("two huge triangles", lambda random: meshes.wall(4.0, 2000.0, 1), far=1000.0),
    "blunt wedge": _one("blunt wedge", lambda random: meshes.wedge(0.9)),
    "sharp wedge": _one("sharp wedge", lambda random: meshes.wedge(0.25), tool="straight_pointer"),
    "corner": _one("corner", lambda random: meshes.corner()),
    "thin plates": _one("thin plates", lambda random: meshes.plates()),
    "spikes": _one("spikes", meshes.spikes),
    "lattice": _one("lattice", lambda random: meshes.lattice(), tool="straight_pointer"),
    "soup": _one("soup", meshes.soup),
    "needles": _one("needles", meshes.needles),
    "cavern": _one("cavern", meshes.cavern),
    "slit": _slit,
    "broken wall": _one("broken wall", meshes.broken_wall),
    "no area": _one("no area", meshes.no_area),
    "open edges": _one("open edges", lambda random: meshes.open_edges(), tool="shaver_40"),
    "teeth": _one("teeth", lambda random: meshes.teeth()),
    "rings": _one("rings", lambda random: meshes.rings()),
    "room": _one("room", lambda random: meshes.room(), tool="endoscope_70"),
    "grains": _one("grains", meshes.grains),
    "far away": _one("far away", meshes.cavern, far=1e5),
    "nothing near": _one("nothing near", lambda random: meshes.wall(900.0)),
    "shapes to keep out of": _one("shapes to keep out of", lambda random: meshes.wall(30.0), zones=_shapes),
    "patches to keep out of": _one("patches to keep out of", meshes.cavern, zones=_patches),
    "standing fixtures": _one("standing fixtures", meshes.cavern, fixtures=_standing),
    "everything at once": _one("everything at once", meshes.soup, zones=_shapes, fixtures=_standing),
    "dVRK arm in a cavern": _one("dVRK arm in a cavern", meshes.cavern, robot="dvrk_psm", tool="straight_pointer"),
    "6 joints among spikes": _one("6 joints among spikes", meshes.spikes, robot="arm_6"),
    "7 joints in a soup": _one("7 joints in a soup", meshes.soup, robot="arm_7"),
    "7 joints between plates": _one("7 joints between plates", lambda random: meshes.plates(), robot="arm_7"),
    "moving cavern": _one("moving cavern", meshes.cavern, moves=0.6),
    "moving soup": _one("moving soup", meshes.soup, moves=0.6),
}
