"""The apparatus of the studies: bone, path, target, robot and tool, frozen in a versioned file.

Changes of planning or of the shipped sample plan do not move a figure of a study: path, base and first joints are
stored, and the bone is that of the stored hash.
"""

from __future__ import annotations

import functools
import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...anatomy.phantom import BONE, load_bone_surface, phantom_dir
from ...arrays import Array
from ...control import ControlSettings
from ...errors import InputError
from ...geometry.path import SplinePath
from ...proximity.proximity import ProximityTree
from ...resources import assets_dir
from ...robots import RobotModel, Tool
from ...worlds.freehand.spec import of_free_hand
from ...worlds.rigid.dry_run import dry_run
from ...worlds.rigid.presets import PRESETS
from ...worlds.rigid.scene import Scene
from ..operator import Guide

SCHEMA = "vfix-study-phantom/1"
FILE = assets_dir() / "studies" / "phantom.json"
ROBOT, TOOL = "steady_hand", "bent_30"
GAIN = 2.0  # mm/s per N, k of (10): not printed; only its product with the force shows, and the force is fitted


@dataclass(frozen=True, eq=False)
class Apparatus:
    """What every trial shares; patient frame LPS, mm.

    scene, settings: of the papers' program at 30 Hz; free_scene, free_settings: of a free hand.
    guide: what the plan shows to a person; beads: (5, 3) fiducials; version: of the stored file.
    """

    scene: Scene
    settings: ControlSettings
    free_scene: Scene
    free_settings: ControlSettings
    guide: Guide
    beads: Array
    version: int

    @property
    def path(self) -> SplinePath:
        """The curve that is followed, and the reference of every error."""
        return self.guide.path


def sha256_of(file: Path) -> str:
    """Hash of a file's content, hexadecimal."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


@functools.cache
def apparatus(preset: str = "li2007") -> Apparatus:
    """The stored apparatus with a paper's parameters; made once in each process.

    Raises:
        InputError: the shipped bone is not that of the studies.
    """
    stored = json.loads(FILE.read_text(encoding="utf-8"))
    if sha256_of(phantom_dir() / BONE) != stored["bone_sha256"]:
        raise InputError(
            f"the bone of the shipped phantom is not that of {FILE.name}, version {stored['version']}: figures of the "
            "studies would not compare; a new phantom needs a new version, by scripts/make_study_phantom.py"
        )
    path, settings, paper = SplinePath(stored["path"]), ControlSettings(), PRESETS[preset]
    scene = Scene(
        ProximityTree(load_bone_surface()), RobotModel.load(ROBOT), Tool.load(TOOL), np.array(stored["base"]),
        np.array(stored["q_start"]), path, np.array([stored["target"]]), ("target",),
    )  # fmt: skip
    return Apparatus(
        paper.in_scene(scene),
        replace(paper.in_settings(settings), gain_mm_per_s_per_n=GAIN),
        scene,
        of_free_hand(settings),
        Guide.of(path, dry_run(scene, settings)),
        np.array(stored["beads"]),
        int(stored["version"]),
    )
