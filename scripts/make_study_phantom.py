"""Write the anatomies of the studies, assets/studies/ANATOMY.json, of which a change is a new version of every study.

    python scripts/make_study_phantom.py phantom
    python scripts/make_study_phantom.py mirrored
    python scripts/make_study_phantom.py head --head FOLDER

'mirrored' writes its bone, too: the phantom's own generator with another septum, its left side made the right one.
'head' needs bone and path of the real head, which are not stored; where the robot stands is.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from vfix_engine.anatomy.phantom import BONE, load_landmarks, phantom_dir
from vfix_engine.control import ControlSettings
from vfix_engine.files.mesh_files import read_mesh, write_ply
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.study.experiment.apparatus import (
    ANATOMIES,
    FOLDER,
    HEAD_BONE,
    MIRRORED_BONE,
    ROBOT,
    SCHEMA,
    TOOL,
    head_path,
    sha256_of,
)
from vfix_engine.worlds.rigid.placing import place_robot

TARGET_SHARE = 0.9  # of the path: 'a position at the bottom of the phantom skull' (Li 2007, section V.D)
MIRROR = np.array([-1.0, 1.0, 1.0])
# Of the mirrored variant: the bend of its septum, 1.1 mm in the phantom, and the part of the nose that is made.
SEPTUM_BEND_MM = 3.0
BOX = ((-24.0, -36.0, -24.0), (24.0, 84.0, 48.0))
TRIANGLES = 70_000
# Protected structures, by places on the path and how far beside it, away from the midline of the nose; all assumed.
BESIDE_MM = 4.3


def main() -> None:
    """Place the robot for an anatomy's path, and write what a study needs of both."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("anatomy", choices=ANATOMIES)
    parser.add_argument("--head", type=Path, default=Path(), help="folder of the real head's bone and path")
    args = parser.parse_args()
    bone, points, beads = _parts(args.anatomy, args.head)
    path = SplinePath(points)
    placed = place_robot(
        ProximityTree(read_mesh(bone, frame="LPS", unit="mm")[0]),
        RobotModel.load(ROBOT),
        Tool.load(TOOL),
        path,
        ControlSettings(),
    )
    content = {
        "schema": SCHEMA,
        "version": 2,
        "frame": "LPS",
        "unit": "mm",
        "bone_sha256": sha256_of(bone),
        "path": [point.tolist() for point in points],
        "target": path.position(TARGET_SHARE * path.length).tolist(),
        "beads": [bead.tolist() for bead in beads],
        "base": placed.base.tolist(),
        "q_start": placed.q_start.tolist(),
        "structures": structures(path, -1.0 if args.anatomy == "mirrored" else 1.0),
    }
    if args.anatomy == "head":  # its path is read from its own folder
        content = {name: value for name, value in content.items() if name not in ("path", "beads")}
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{args.anatomy}.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def structures(path: SplinePath, side: float) -> list[dict[str, Any]]:
    """A turbinate along the path and the opening of the auditory tube; side: +1 to the left of the path."""
    beside = np.array([side * BESIDE_MM, 0.0, 0.0])

    def at(share: float) -> list[float]:
        place: list[float] = np.round(path.position(share * path.length) + beside, 3).tolist()
        return place

    return [
        {"name": "inferior turbinate", "centre": at(0.45), "end": at(0.75), "radius": 2.0, "margin_mm": 1.0},
        {"name": "opening of the auditory tube", "centre": at(0.97), "radius": 2.5, "margin_mm": 1.0},
    ]


def _parts(anatomy: str, head: Path) -> tuple[Path, list[Any], list[Any]]:
    """File of the bone, points of the path, and beads."""
    if anatomy == "head":
        return head / HEAD_BONE, [np.array(one) for one in head_path(head)], []
    landmarks = load_landmarks()
    points, beads = [one.position for one in landmarks.corridor], [one.centroid for one in landmarks.beads]
    if anatomy == "phantom":
        return phantom_dir() / BONE, points, beads
    _write_mirrored()
    return FOLDER / MIRRORED_BONE, [MIRROR * one for one in points], [MIRROR * one for one in beads]


def _write_mirrored() -> None:
    """Make the bone of the nose with another septum, and mirror it in the sagittal plane."""
    from head_phantom import surfaces  # of the scripts alone
    from head_phantom.generate import generate

    bone, _ = surfaces.bone_around_nose(generate(0.5, BOX, SEPTUM_BEND_MM), TRIANGLES)
    write_ply(FOLDER / MIRRORED_BONE, TriangleMesh(bone.vertices * MIRROR, bone.faces[:, ::-1]))


if __name__ == "__main__":
    main()
