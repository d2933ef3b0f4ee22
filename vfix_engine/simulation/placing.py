"""Placing the robot: where its base stands and how the tool is turned so that the path can be driven."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..control import ControlSettings
from ..errors import StartRefused
from ..fixtures import Fixture, Zone
from ..geometry.path import SplinePath
from ..geometry.proximity import Proximity
from ..robots import RobotModel, Tool
from .base_placement import BasePlacement, tip_freedom
from .dry_run import DryRun, dry_run
from .scene import Scene

Array = NDArray[np.float64]

_TILTS = (0.0, 12.0, 24.0)  # degrees between shaft and chord of the path
_CHORD = 0.7  # share of the path that the chord spans
_ROLLS = 12  # turns of the bend about the shaft
_TRIED = 6  # placings that get a dry run, best first
_SAMPLES = 24  # poses along the path that rank a placing


@dataclass(frozen=True)
class Placing:
    """base: transform_base_to_patient (4, 4); q_start (n,); run: the dry run that this placing was chosen by."""

    base: Array
    q_start: Array
    run: DryRun


def place_robot(
    tree: Proximity,
    robot: RobotModel,
    tool: Tool,
    path: SplinePath,
    settings: ControlSettings,
    zones: tuple[Zone, ...] = (),
    fixtures: tuple[Fixture, ...] = (),
    go_on: Callable[[], object] = bool,
    structure_names: Mapping[str, str] | None = None,
) -> Placing:
    """The placing from which the controller gets furthest along the path.

    Directions of the shaft around the path's chord and turns of the bend are ranked by the clearance of the unmoving
    orientation at samples of the path; the best few are driven dry, among zones and with standing fixtures where there
    are any, and the first that arrives is taken.
    A robot that arrives in none of them is placed where it gets furthest, and ``run.reason`` says what holds it there.
    ``go_on`` is called between all of these steps; what it raises ends the search.
    ``structure_names``: as of ``Scene``, for the words of the reason.

    Raises:
        StartRefused: the tool does not fit at the entry in any of these directions.
    """
    stand, names = BasePlacement(robot, tool), structure_names or {}

    def room(orientation: _Orientation) -> float:
        go_on()
        return _room(tree, tool, path, orientation.tip, settings)

    ranked = sorted(_orientations(path, tool), key=room, reverse=True)
    best: Placing | None = None
    reason = ""
    tried = 0
    for orientation in ranked:
        try:
            base, q_start = stand.at(orientation.tip, path.position(0.0), orientation.roll)
            scene = Scene(tree, robot, tool, base, q_start, path, zones=zones, fixtures=fixtures, structure_names=names)
            run = dry_run(scene, settings, go_on)
        except StartRefused as error:
            reason = reason or str(error)  # of the best one
            continue
        if best is None or run.reached_mm > best.run.reached_mm:
            best = Placing(base, q_start, run)
        tried += 1
        if run.completed or tried == _TRIED:
            break
    if best is None:
        raise StartRefused(f"the tool fits at the entry in no direction: {reason}")
    freedom = tip_freedom(robot.placed(best.base, tool), best.q_start)
    if freedom < 3 and not best.run.completed:
        less = f"{robot.title} can move its tip in {freedom} of 3 directions; {best.run.reason}"
        best = replace(best, run=replace(best.run, reason=less))
    return best


@dataclass(frozen=True)
class _Orientation:
    """tip: rotation (3, 3); roll: how far it is turned about the shaft from where it is as upright as can be."""

    roll: float
    tip: Array


def _orientations(path: SplinePath, tool: Tool) -> Iterator[_Orientation]:
    """Shafts (+y) near the path's chord, the bend turned about each; a straight tool looks the same from all sides."""
    from scipy.spatial.transform import Rotation  # not needed to start, and slow to import

    bent = any(part.bend > 0.0 for part in tool.parts)
    rolls = (np.arange(_ROLLS) + 0.5) * 2 * np.pi / _ROLLS - np.pi if bent else np.zeros(1)
    entry = path.position(0.0)
    chord = path.position(_CHORD * path.length) - entry
    chord = chord / np.linalg.norm(chord)
    side, up = _across(chord)
    for tilt in np.radians(_TILTS):
        for around in np.arange(8) * np.pi / 4 if tilt else (0.0,):
            lean = np.cos(around) * side + np.sin(around) * up
            shaft = np.cos(tilt) * chord + np.sin(tilt) * lean
            x, z = _across(shaft)
            upright = np.column_stack([x, shaft, z])
            for roll in rolls:
                yield _Orientation(float(roll), upright @ Rotation.from_euler("y", roll).as_matrix())


def _across(shaft: Array) -> tuple[Array, Array]:
    """Unit vectors to the right of the shaft and, as far as can be, upwards (superior)."""
    superior, posterior = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    side = np.cross(shaft, superior if abs(shaft[2]) < 0.95 else posterior)
    side /= np.linalg.norm(side)
    return side, np.cross(side, shaft)


def _room(tree: Proximity, tool: Tool, path: SplinePath, rotation: Array, settings: ControlSettings) -> float:
    """Mean clearance along the path with this orientation, each sample cut at the threshold."""
    cap = settings.reach_mm
    stations = np.linspace(0.0, path.length, _SAMPLES)
    clearances = [min(tree.clearance(tool.segments(rotation, path.position(s)), cap), cap) for s in stations]
    # A tool that cannot even stand at the entry is ranked behind all that can.
    entry = -cap if clearances[0] < settings.margin_mm else 0.0
    return float(np.mean(clearances)) + entry
