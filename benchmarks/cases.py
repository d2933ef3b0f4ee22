"""The heads of the benchmarks: the shipped phantom and, if its data are available, a real head; or a user's files."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.exchange.plan_files import read_plan
from app.exchange.resolve import read_bytes
from benchmarks.report import BenchmarkRefused
from vfix_engine.anatomy.phantom import load_bone_surface, load_landmarks
from vfix_engine.control import ControlSettings
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.worlds.rigid.dry_run import DryRun
from vfix_engine.worlds.rigid.placing import place_robot
from vfix_engine.worlds.rigid.scene import Scene

DEFAULT_TRIAL_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
NAMES = ("phantom", "head")
ROBOT, TOOL = "steady_hand", "bent_30"


@dataclass(frozen=True, eq=False)
class BenchCase:
    """A surface and a path through it, LPS mm."""

    name: str
    mesh: TriangleMesh
    path: SplinePath


@dataclass(frozen=True)
class Cases:
    """The cases found, and a sentence by name for each that is missing."""

    found: tuple[BenchCase, ...]
    missing: dict[str, str]

    def measure(self, one: Callable[[BenchCase], dict[str, Any]]) -> dict[str, Any]:
        """Return `cases`, the result of each by name or None if its data are missing, and `missing`, the reasons."""
        results: dict[str, Any] = {case.name: one(case) for case in self.found}
        return {"cases": results | dict.fromkeys(self.missing), "missing": self.missing}


@dataclass(frozen=True, eq=False)
class Driven:
    """A case with the robot placed in it and the poses of the controller along the path."""

    scene: Scene
    run: DryRun

    def joints(self, count: int) -> np.ndarray:
        """Return joints (count, n) of poses spread evenly over the reached part of the path."""
        picked = np.linspace(0, len(self.run.q) - 1, count).round().astype(int)
        return np.asarray(self.run.q[picked])

    def segments(self, count: int) -> list[Segments]:
        """Return the tool in each of ``count`` poses spread evenly over the reached part of the path."""
        robot, tool = self.scene.placed_robot(), self.scene.tool
        tips = [robot.tip(q) for q in self.joints(count)]
        return [tool.segments(tip.rotation, tip.position) for tip in tips]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options that choose the cases."""
    parser.add_argument("--case", choices=(*NAMES, "all"), default="all", help="the head to measure on")
    parser.add_argument("--surface", type=Path, metavar="FILE", help="measure on this surface instead, with --path")
    parser.add_argument("--path", type=Path, metavar="FILE", help="a plan or Markups file with the corridor")


def find_cases(args: argparse.Namespace) -> Cases:
    """Return the cases chosen by the options.

    Raises:
        BenchmarkRefused: only one of --surface and --path is given, or the only chosen case is missing.
        InputError: a file cannot be used.
    """
    if (args.surface is None) != (args.path is None):
        raise BenchmarkRefused("--surface and --path go together: the corridor must lie in the surface's head")
    if args.surface is not None:
        return Cases((_from_files(args.surface.name, args.surface, args.path),), {})
    wanted = NAMES if args.case == "all" else (args.case,)
    found, missing = [], {}
    for name in wanted:
        case = phantom() if name == "phantom" else real_head()
        if isinstance(case, BenchCase):
            found.append(case)
        else:
            missing[name] = case
    if not found:
        raise BenchmarkRefused("; ".join(missing.values()))
    return Cases(tuple(found), missing)


def phantom() -> BenchCase:
    """Return the head phantom shipped with vfix."""
    corridor = np.array([point.position for point in load_landmarks().corridor])
    return BenchCase("phantom", load_bone_surface(), SplinePath(corridor))


def real_head() -> BenchCase | str:
    """Return the real head, or why it is missing. Its data are not part of vfix; VFIX_TRIAL_DATA names their folder."""
    folder = Path(os.environ.get("VFIX_TRIAL_DATA", DEFAULT_TRIAL_DATA)) / "head_ct"
    surface, corridor = folder / "nose_sinus_bone_lps_mm.ply", folder / "corridor.mrk.json"
    if not (surface.is_file() and corridor.is_file()):
        return f"the real head is not at {folder}; VFIX_TRIAL_DATA names the folder of its data"
    return _from_files("head", surface, corridor)


def drive(case: BenchCase, settings: ControlSettings | None = None) -> Driven:
    """Place the robot as the planner does and drive along the path, so that the poses are those of a rehearsal.

    Raises StartRefused if the tool does not fit at the entry.
    """
    settings = settings or ControlSettings()
    tree, robot, tool = ProximityTree(case.mesh), RobotModel.load(ROBOT), Tool.load(TOOL)
    placing = place_robot(tree, robot, tool, case.path, settings)
    return Driven(Scene(tree, robot, tool, placing.base, placing.q_start, case.path), placing.run)


def _from_files(name: str, surface: Path, corridor: Path) -> BenchCase:
    points = [point.position for point in read_plan(corridor.name, read_bytes(corridor)).content.points]
    if len(points) < 2:
        raise BenchmarkRefused(f"{corridor.name} holds no path of at least two points")
    return BenchCase(name, read_mesh(surface, assume=True)[0], SplinePath(np.array(points)))
