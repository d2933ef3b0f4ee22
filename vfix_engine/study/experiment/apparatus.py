"""The apparatus of the studies: bone, path, target, robot and tool, frozen in a versioned file.

Changes of planning or of the shipped sample plan do not move a figure of a study: path, base and first joints are
stored, and the bone is that of the stored hash.
"""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...anatomy.phantom import BONE, phantom_dir
from ...arrays import Array
from ...control import ControlSettings
from ...errors import InputError
from ...files.mesh_files import read_mesh
from ...geometry.path import SplinePath
from ...geometry.shapes import CapsuleShape, Sphere
from ...proximity.proximity import ProximityTree
from ...resources import assets_dir
from ...robots import RobotModel, Tool
from ...virtual_fixtures import Zone
from ...worlds.freehand.spec import of_free_hand
from ...worlds.rigid.dry_run import dry_run
from ...worlds.rigid.presets import PRESETS
from ...worlds.rigid.scene import Scene
from ..operator import Guide

SCHEMA = "vfix-study-phantom/1"
FOLDER = assets_dir() / "studies"
FILE = FOLDER / "phantom.json"
ANATOMIES = ("phantom", "mirrored", "head")
OURS = ("ours", "compensated", "protected")  # our own parameters; with deflection compensation; with structures
RATE_HZ = 50.0  # of ours
COMPENSATED_MM_PER_N = 0.1  # the assumed compliance of the robot
ROBOT, TOOL = "steady_hand", "bent_30"
GAIN = 2.0  # mm/s per N, k of (10): not printed; only its product with the force shows, and the force is fitted
MIRRORED_BONE = "mirrored_bone.ply"
HEAD_BONE, HEAD_PATH = "nose_sinus_bone_lps_mm.ply", "corridor.json"  # in the folder of the real head


class StudyCase(NamedTuple):
    """What a trial is driven in: the arguments of ``apparatus``."""

    variant: str = "li2007"
    anatomy: str = "phantom"
    head: str = ""


PAPERS = StudyCase()


@dataclass(frozen=True, eq=False)
class Apparatus:
    """What every trial shares; patient frame LPS, mm.

    scene, settings: of the papers' program at 30 Hz, or of ours; free_scene, free_settings: of a free hand.
    guide: what the plan shows to a person; beads: (5, 3) fiducials, (0, 3) where there are none.
    structures: of the anatomy, which the scene protects in the variant 'protected'. version: of the stored file.
    """

    scene: Scene
    settings: ControlSettings
    free_scene: Scene
    free_settings: ControlSettings
    guide: Guide
    beads: Array
    structures: tuple[Zone, ...]
    version: int

    @property
    def path(self) -> SplinePath:
        """The curve that is followed, and the reference of every error."""
        return self.guide.path


def sha256_of(file: Path) -> str:
    """Hash of a file's content, hexadecimal."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


@functools.cache
def apparatus(variant: str = "li2007", anatomy: str = "phantom", head: str = "") -> Apparatus:
    """The stored apparatus; made once in each process.

    variant: a paper's parameters, 'li2004' or 'li2007', or one of ``OURS``. anatomy: one of ``ANATOMIES``; head: folder
    of the real head's bone and path, which are not shipped.

    Raises:
        InputError: the bone is not that of the studies, or the head's files are not there.
    """
    stored = json.loads((FOLDER / f"{anatomy}.json").read_text(encoding="utf-8"))
    bone, points = _parts(anatomy, stored, Path(head))
    if sha256_of(bone) != stored["bone_sha256"]:
        raise InputError(
            f"the bone {bone.name} is not that of {anatomy}.json, version {stored['version']}: figures of the "
            "studies would not compare; a new bone needs a new version, by scripts/make_study_phantom.py"
        )
    path, settings = SplinePath(points), ControlSettings()
    scene = Scene(
        ProximityTree(read_mesh(bone, frame="LPS", unit="mm")[0]), RobotModel.load(ROBOT), Tool.load(TOOL),
        np.array(stored["base"]), np.array(stored["q_start"]), path, np.array([stored["target"]]), ("target",),
    )  # fmt: skip
    structures = tuple(_structure(one) for one in stored.get("structures", ()))
    driven, control = _in_variant(variant, scene, settings, structures)
    return Apparatus(
        driven,
        control,
        scene,
        of_free_hand(settings),
        Guide.of(path, dry_run(scene, settings)),
        np.array(stored.get("beads", np.zeros((0, 3)))),
        structures,
        int(stored["version"]),
    )


def missing_files(folder: Path) -> list[str]:
    """The files of the real head that a folder does not have."""
    return [name for name in (HEAD_BONE, HEAD_PATH) if not (folder / name).is_file()]


def _parts(anatomy: str, stored: Mapping[str, Any], head: Path) -> tuple[Path, list[Any]]:
    """File of the bone, and points of the path."""
    if anatomy == "phantom":
        return phantom_dir() / BONE, stored["path"]
    if anatomy == "mirrored":
        return FOLDER / MIRRORED_BONE, stored["path"]
    missing = missing_files(head)
    if missing:
        raise InputError(f"the real head needs {' and '.join(missing)} in its folder {head}")
    return head / HEAD_BONE, head_path(head)


def head_path(folder: Path) -> list[Any]:
    """Points of the path through the real head, LPS mm."""
    return [one["lps"] for one in json.loads((folder / HEAD_PATH).read_text(encoding="utf-8"))["points"]]


def _in_variant(
    variant: str, scene: Scene, settings: ControlSettings, structures: tuple[Zone, ...]
) -> tuple[Scene, ControlSettings]:
    """Scene and settings of the robot's modes."""
    if variant in PRESETS:
        paper = PRESETS[variant]
        return paper.in_scene(scene), replace(paper.in_settings(settings), gain_mm_per_s_per_n=GAIN)
    ours = replace(settings, dt_s=1.0 / RATE_HZ, gain_mm_per_s_per_n=GAIN)
    if variant == "compensated":
        return scene, replace(ours, compliance_mm_per_n=COMPENSATED_MM_PER_N)
    return (replace(scene, zones=structures) if variant == "protected" else scene), ours


def _structure(stored: Mapping[str, Any]) -> Zone:
    """A protected structure: a sphere, or a capsule where it has an ``end``."""
    centre, radius = stored["centre"], stored["radius"]
    solid = CapsuleShape(centre, stored["end"], radius) if "end" in stored else Sphere(centre, radius)
    return Zone(stored["name"], solid, stored["margin_mm"])
