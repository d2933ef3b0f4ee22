"""The scenes of the attack: the two heads and generated anatomy, each with a robot, a tool, a path and targets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks import cases
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.simulation.scene import Scene

from . import meshes

Array = NDArray[np.float64]
Random = np.random.Generator

MARGINS = (0.05, 0.3, 0.3, 0.3, 1.0)
MODES = ("free", "free", "path", "inspect")
STRAIGHT = np.array([[0.0, 0.0, 0.0], [0.0, 7.0, 0.0], [1.0, 14.0, 0.0], [0.0, 24.0, 2.0]])


@dataclass(frozen=True, eq=False)
class Arena:
    """One scene of the attack.

    moves: mm by which the anatomy is shifted between episodes, so that some begin inside the margin; 0: it stays.
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
    far: float = 50.0,
    back: float = 0.0,
    margins: tuple[float, ...] = MARGINS,
    moves: float = 0.0,
) -> Arena:
    """The tool with its tip at the origin and its shaft along +y, then all of it turned and shifted at random."""
    model, held = RobotModel.load(robot), Tool.load(tool)
    turn = Rotation.random(random_state=int(random.integers(2**31))).as_matrix()
    shift = far * random.uniform(-1, 1, 3)
    moved = TriangleMesh(np.asarray(mesh.vertices) @ turn.T + shift, mesh.faces)
    targets = np.array([[0.0, 14.0, 0.0], [1.0, 12.0, 3.0]]) @ turn.T + shift
    q = 0.5 * (model.lower + model.upper)
    scene = Scene(
        ProximityTree(moved), model, held, np.eye(4), q, SplinePath(path @ turn.T + shift), targets, ("one", "two")
    )
    tip = scene.placed_robot().tip(q)
    base, wanted = np.eye(4), shift - back * turn[:, 1]
    base[:3, :3] = turn @ tip.rotation.T
    base[:3, 3] = wanted - base[:3, :3] @ tip.position
    return Arena(name, replace(scene, base=base), margins, moves=moves)


def _head(name: str, case: cases.BenchCase) -> Arena:
    """A head with the robot placed in it as the planner does."""
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
    """Room for the margin of 0.3 mm and 0.005 mm more on either side: less than the rows' buffer."""
    return _arena("slit", meshes.slit(1.5 + 0.305), random, margins=(0.3, 0.3, 0.05, 0.304))


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
    "moving cavern": _one("moving cavern", meshes.cavern, moves=0.6),
    "moving soup": _one("moving soup", meshes.soup, moves=0.6),
}
