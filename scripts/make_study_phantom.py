"""Write assets/studies/phantom.json, on which the studies run; a change of it is a new version of every study."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from vfix_engine.anatomy.phantom import BONE, load_bone_surface, load_landmarks, phantom_dir
from vfix_engine.control import ControlSettings
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.study.experiment.apparatus import FILE, ROBOT, SCHEMA, TOOL, sha256_of
from vfix_engine.worlds.rigid.placing import place_robot

TARGET_SHARE = 0.9  # of the path: 'a position at the bottom of the phantom skull' (Li 2007, section V.D)


def main() -> None:
    """Place the robot for the shipped phantom's path, and write what a study needs of both."""
    points = [one.position for one in load_landmarks().corridor]
    path = SplinePath(points)
    placed = place_robot(
        ProximityTree(load_bone_surface()), RobotModel.load(ROBOT), Tool.load(TOOL), path, ControlSettings()
    )
    content = {
        "schema": SCHEMA,
        "version": 1,
        "frame": "LPS",
        "unit": "mm",
        "bone_sha256": sha256_of(phantom_dir() / BONE),
        "path": [point.tolist() for point in points],
        "target": path.position(TARGET_SHARE * path.length).tolist(),
        "beads": [one.centroid.tolist() for one in load_landmarks().beads],
        "base": placed.base.tolist(),
        "q_start": placed.q_start.tolist(),
    }
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
