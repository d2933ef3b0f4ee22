"""Operators, arms and metrics by name: those of vfix, and those of installed packages by entry point."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import entry_points
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...errors import InputError
from ...robots import Tool
from ...runtime.command import Command
from ...runtime.run import Run
from ...runtime.snapshot import Snapshot
from ...runtime.system import SystemSpec
from ...worlds.rigid.presets import PRESETS
from ...worlds.rigid.scene import Scene
from ..metrics.score import Errors, RunScore
from ..operator import Guide, PursuitOperator
from ..person import Person
from .file import PLAIN, nearest

OPERATORS, ARMS, METRICS = "vfix.operators", "vfix.arms", "vfix.metrics"  # groups of entry points

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class HandAtWork:
    """What an operator of a trial is made of.

    guide: what the plan shows; person: the simulated subject in this trial; tool, settings: of the world; seed: of
    every random number. device_axes: (3, 3) axes of a rate device in the patient's frame, as columns; None where the
    hand is on the tool or the robot.
    """

    guide: Guide
    person: Person
    tool: Tool
    settings: ControlSettings
    seed: np.random.SeedSequence
    device_axes: Array | None


Hand = Callable[[Snapshot], Command | None]  # None once the end seems reached
OperatorMaker = Callable[[HandAtWork], Hand]
Arm = Callable[[Scene, ControlSettings], tuple[Scene, ControlSettings]]


@dataclass(frozen=True, eq=False)
class ScoredTrial:
    """What a metric sees of a trial. completed: the end of the path was reached."""

    run: Run
    spec: SystemSpec
    score: RunScore
    completed: bool


class Metric(NamedTuple):
    """unit: as it is printed, '' without one. of: the value of a trial; None where it has none."""

    unit: str
    of: Callable[[ScoredTrial], float | None]


def operator_named(name: str) -> OperatorMaker:
    """An operator. Raises InputError for a name that is not known."""
    return named(OPERATORS, _OPERATORS, name, "operator")


def arm_named(name: str) -> Arm:
    """An arm. Raises InputError for a name that is not known."""
    return named(ARMS, _ARMS, name, "arm")


def metric_named(name: str) -> Metric:
    """A metric. Raises InputError for a name that is not known, and for an entry point that is no ``Metric``."""
    found = named(METRICS, _METRICS, name, "metric")
    if not isinstance(found, Metric):
        raise InputError(f"the entry point '{name}' of {METRICS} is no Metric(unit, of)")
    return found


def named(group: str, own: Mapping[str, T], name: str, what: str) -> T:
    """One of vfix's own by name, else the entry point of that name in a group; what: it is, in messages.

    Raises:
        InputError: a name that is not known, or an entry point that cannot be loaded.
    """
    if name in own:
        return own[name]
    found = {one.name: one for one in entry_points(group=group)}
    if name not in found:
        raise InputError(f"there is no {what} {name!r:.60}{nearest(name, [*own, *found])}")
    try:
        loaded: Any = found[name].load()
    except Exception as error:
        raise InputError(f"the {what} '{name}' cannot be loaded: {type(error).__name__}: {error}") from error
    return loaded  # type: ignore[no-any-return]


def _pursuit(at: HandAtWork) -> Hand:
    return PursuitOperator(at.guide, at.person, at.tool, at.settings, at.seed, at.device_axes)


_OPERATORS: Mapping[str, OperatorMaker] = {
    "person": _pursuit,
    "steady": lambda at: _pursuit(replace(at, person=Person.exact())),
}


def _plain(scene: Scene, settings: ControlSettings) -> tuple[Scene, ControlSettings]:
    return scene, settings


def _of_paper(name: str) -> Arm:
    """A paper's program and printed parameters, in a scene without soft zones, which the papers do not have."""

    def arm(scene: Scene, settings: ControlSettings) -> tuple[Scene, ControlSettings]:
        return PRESETS[name].in_scene(replace(scene, fixtures=())), PRESETS[name].in_settings(settings)

    return arm


_ARMS: Mapping[str, Arm] = {PLAIN: _plain} | {name: _of_paper(name) for name in PRESETS}


def _error(kind: str) -> Callable[[ScoredTrial], float | None]:
    def of(trial: ScoredTrial) -> float | None:
        errors: Errors | None = trial.score.path_error_mm
        return None if errors is None else float(getattr(errors.robot_frame, kind))

    return of


_METRICS: Mapping[str, Metric] = {
    "time_s": Metric("s", lambda trial: trial.score.time_s),
    "path_error_mm": Metric("mm", _error("mean")),
    "max_path_error_mm": Metric("mm", _error("max")),
    "path_length_mm": Metric("mm", lambda trial: trial.score.path_length_mm),
    "smoothness": Metric("", lambda trial: trial.score.spectral_arc_length),
    "contacts": Metric("", lambda trial: float(trial.score.contacts)),
    "max_depth_mm": Metric("mm", lambda trial: trial.score.max_depth_mm),
    "least_clearance_mm": Metric("mm", lambda trial: min(trial.score.least_clearance_mm.values(), default=None)),
    "held_s": Metric("s", lambda trial: trial.score.held_s),
    "completed": Metric("", lambda trial: float(trial.completed)),
}
