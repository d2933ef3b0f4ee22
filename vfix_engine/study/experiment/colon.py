"""The colon of study I of Kwok 2013, its ten polyps and the drive in each arm, frozen in a versioned file.

Changes of how a lumen is prepared, or polyps are placed, do not move a figure of the study: contours, the robot's curve
and the polyps are stored, and the surface is that of the stored hash.
"""

from __future__ import annotations

import functools
import hashlib
import json
from typing import Any

import numpy as np

from ...anatomy.lumen.colon_case import colon_case
from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...resources import assets_dir
from ...worlds.snake.offline.script import DriveSpec
from ...worlds.snake.presets import PRESETS
from ...worlds.snake.settings import Arm, Control
from ...worlds.snake.spec import LumenContours
from ..endoscopy.polyp_run import Colon
from ..polyps.task import PolypTask

SCHEMA = "vfix-study-colon/1"
FILE = assets_dir() / "studies" / "colon.json"
STEP_S = 0.01  # of a trial: the paper's is less than 1 ms
CONTROL: Control = "parameterised"  # the paper's in every arm, so that guided and certified differ by the certificate
ARRAYS = ("centre", "radius", "knots", "curve_points", "slack", "wall_radius", "first")


def hash_of(mesh: TriangleMesh) -> str:
    """Of vertices, to a tenth of a micrometre, and faces of a surface, hexadecimal."""
    places = np.round(mesh.vertices * 1e4).astype(np.int64)
    return hashlib.sha256(places.tobytes() + mesh.faces.astype(np.int64).tobytes()).hexdigest()


def stored_contours(stored: dict[str, Any]) -> LumenContours:
    """The lumen of the file."""
    arrays = {name: np.array(stored["lumen"][name], dtype=np.float64) for name in ARRAYS}
    return LumenContours(
        count=int(stored["lumen"]["count"]), curve_step_mm=float(stored["lumen"]["curve_step_mm"]), **arrays
    )


@functools.cache
def stored_colon() -> tuple[TriangleMesh, dict[str, Any]]:
    """The surface, and what is stored of the study; read once in each process.

    Raises:
        InputError: the synthetic colon is not that of the study.
    """
    stored: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    mesh = colon_case().mesh
    if hash_of(mesh) != stored["surface_sha256"]:
        raise InputError(
            f"the synthetic colon is not that of {FILE.name}, version {stored['version']}: figures of the study would "
            "not compare; a new colon needs a new version, by scripts/make_study_colon.py"
        )
    return mesh, stored


@functools.cache
def colon_of(arm: Arm) -> Colon:
    """The study's colon with its drive in one arm. Raises as ``stored_colon``.

    The hand of the simulated person yields by itself, so the drive adds no admittance.
    """
    mesh, stored = stored_colon()
    preset = PRESETS["kwok2013"]
    settings = preset.settings(arm=arm, control=CONTROL, step_s=STEP_S, yield_mm_per_s_per_n=0.0)
    spec = DriveSpec(stored_contours(stored), preset.robot(), drive=settings)
    return Colon(mesh, PolypTask.from_dict(stored["task"]), spec)
