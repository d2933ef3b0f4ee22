"""The six labels of study II of Kwok 2013, frozen in a versioned file, in the cavity that comes along."""

from __future__ import annotations

import functools
import json
from dataclasses import replace
from typing import NamedTuple

from ...errors import InputError
from ...resources import assets_dir
from ...worlds.snake.cavity import cavity_case
from ...worlds.snake.settings import Arm
from ..diathermy.labels import Label
from ..endoscopy.label_run import Cavity
from .colon import hash_of

SCHEMA = "vfix-study-cavity/1"
FILE = assets_dir() / "studies" / "cavity.json"
STEP_S = 0.01  # of a trial


class StoredCavity(NamedTuple):
    """The labels and the version of the file."""

    labels: tuple[Label, ...]
    version: int


@functools.cache
def stored_labels() -> StoredCavity:
    """What is stored of the study; read once in each process.

    Raises:
        InputError: the cavity is not that of the study.
    """
    stored = json.loads(FILE.read_text(encoding="utf-8"))
    if hash_of(cavity_case().mesh) != stored["surface_sha256"]:
        raise InputError(
            f"the cavity is not that of {FILE.name}, version {stored['version']}: figures of the study would not "
            "compare; a new cavity needs a new version, by scripts/make_study_cavity.py"
        )
    return StoredCavity(tuple(Label.from_dict(one) for one in stored["labels"]), int(stored["version"]))


@functools.cache
def cavity_of(arm: Arm) -> Cavity:
    """The study's cavity with its drive in one arm; the hand of the simulated person yields by itself."""
    case = cavity_case()
    spec = case.script(arm, STEP_S)
    spec = replace(spec, drive=replace(spec.drive, yield_mm_per_s_per_n=0.0))
    return Cavity(case.mesh, stored_labels().labels, spec)
