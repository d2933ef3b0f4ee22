"""Placement of the robot: the pose of its base and the orientation of its tool from which the path can be driven."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...errors import StartRefused
from ...geometry.path import SplinePath
from ...geometry.shaft_directions import ShaftDirections, roll_of, upright_frame
from ...geometry.shaft_kernels import turn_between
from ...kernels.triples import triple
from ...proximity.proximity import Proximity
from ...robots import PlacedRobot, RobotModel, Tool
from ...robots.inverse import inverse_kinematics
from ...virtual_fixtures import Fixture, Zone
from .base_placement import BasePlacement, tip_freedom
from .dry_run import DryRun, dry_run
from .scene import Scene

_TILTS = (0.0, 12.0, 24.0)  # degrees between shaft and chord of the path
_CHORD = 0.7  # share of the path that the chord spans
_ROLLS = 12  # turns of the bend about the shaft
_TRIED = 6  # placements that get a dry run, best first
_RANKING = 0.3  # fraction of the search, for its progress
_SAMPLES = 24  # poses along the path that rank a placement


@dataclass(frozen=True)
class Placing:
    """base: transform_base_to_image (4, 4); q_start (n,); run: the dry run by which this placement was chosen."""

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
    tell: Callable[[float], object] = bool,
    shaft: ShaftDirections | None = None,
    base: Array | None = None,
) -> Placing:
    """The placement from which the controller gets furthest along the path.

    Directions of the shaft around the path's chord and rolls of the bend are ranked by the clearance of the constant
    orientation at samples of the path; the best few are simulated with zones and fixtures, and the first that
    reaches the end is used.
    If none does, the robot is placed where it gets furthest, and ``run.reason`` says why it stops.
    ``go_on`` is called between all of these steps; an exception ends the search.
    ``tell`` gets the completed fraction of the search, 0 … 1; the search ends early where a placement reaches the end.
    ``structure_names``: as in ``Scene``, for the words of the reason.
    ``shaft``: planned directions, which are then the only ones; a bent tool with an open roll is tried
    with rolls about the shaft.
    ``base``: transform_base_to_image (4, 4) of a robot with a fixed base, from a registration; only its joints at
    the entry are computed.

    Raises:
        StartRefused: the tool does not fit at the entry in any of these directions, or the robot does not reach the
            entry.
    """
    placement, names = BasePlacement(robot, tool, base), structure_names or {}

    every = _orientations(path, tool) if shaft is None else _planned(path, tool, shaft)
    ranked = _ranked(tree, tool, path, every, settings, go_on, tell)
    best: Placing | None = None
    reason = ""
    tried = 0
    for orientation in ranked:
        try:
            placed, q_start = placement.at(orientation.tip, path.position(0.0), orientation.roll)
            scene = Scene(
                tree, robot, tool, placed, q_start, path, zones=zones, fixtures=fixtures, structure_names=names,
                shaft=shaft,
            )  # fmt: skip
            run = dry_run(scene, settings, go_on, partial(_tell_share, tell, tried))
        except StartRefused as error:
            reason = reason or str(error)  # of the best one
            continue
        if best is None or run.reached_mm > best.run.reached_mm:
            best = Placing(placed, q_start, run)
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


def placed_along(robot: RobotModel, tool: Tool, path: SplinePath, shaft: ShaftDirections) -> tuple[Array, Array]:
    """Base (4, 4) and joints (n,) at the entry with the planned direction of the shaft; without a roll, upright.

    Raises:
        StartRefused: a robot whose base is upright cannot hold the tool in this pose.
    """
    frame = shaft.frame(0.0)
    # A roll about the direction is an opposite one about the frame's y axis.
    return BasePlacement(robot, tool).at(frame, path.position(0.0), -roll_of(frame))


def started_at(placed: PlacedRobot, q_start: Array, path: SplinePath, shaft: ShaftDirections | None = None) -> Array:
    """Joints (n,) with the tip at the entry of another path and an unchanged base.

    The tool keeps its orientation at ``q_start``; with planned directions it is rotated onto the one at the
    entry, and rolled only where they specify a roll.

    Raises:
        StartRefused: the robot does not reach that from its base.
    """
    rotation = placed.tip_pose(q_start)[0]
    if shaft is not None:
        frame = shaft.frame(0.0)
        rotation = frame if shaft.has_roll else _smallest_turn(rotation[:, 1], frame[:, 1]) @ rotation
    reached = inverse_kinematics(placed, rotation, path.position(0.0), q_start)
    if not reached.found:
        raise StartRefused("the robot does not reach the entry from where it stands; that is too far for its joints")
    return reached.q


def _smallest_turn(start: Array, end: Array) -> Array:
    """The rotation (3, 3) with the smallest angle that turns one unit vector onto another."""
    from scipy.spatial.transform import Rotation  # not needed to start, and slow to import

    across = np.cross(start, np.eye(3)[int(np.abs(start).argmin())])  # an arbitrary axis for a half turn
    axis, angle = turn_between(triple(start), triple(end), triple(across / np.linalg.norm(across)))
    turn: Array = Rotation.from_rotvec(angle * np.array(axis)).as_matrix()
    return turn


def _ranked(
    tree: Proximity,
    tool: Tool,
    path: SplinePath,
    given: Iterable[_Orientation],
    settings: ControlSettings,
    go_on: Callable[[], object],
    tell: Callable[[float], object],
) -> list[_Orientation]:
    """The orientations, those with the most clearance along the path first."""
    every, found = tuple(given), list[tuple[float, _Orientation]]()
    for number, orientation in enumerate(every):
        go_on()
        tell(_RANKING * number / len(every))
        found.append((_mean_clearance(tree, tool, path, orientation.tips, settings), orientation))
    return [orientation for _, orientation in sorted(found, key=lambda one: one[0], reverse=True)]


def _tell_share(tell: Callable[[float], object], tried: int, along: float) -> None:
    """The completed fraction of the search during a dry run, at the fraction ``along`` of its path."""
    tell(_RANKING + (1.0 - _RANKING) * (tried + along) / _TRIED)


@dataclass(frozen=True)
class _Orientation:
    """roll: rotation about the shaft from the most upright orientation, in rad.

    tips: rotations (k, 3, 3) of the tip at the samples of the path, from the entry on; one if constant.
    """

    roll: float
    tips: Array

    @property
    def tip(self) -> Array:
        """Rotation (3, 3) at the entry."""
        first: Array = self.tips[0]
        return first


def _orientations(path: SplinePath, tool: Tool) -> Iterator[_Orientation]:
    """Shafts (+y) near the path's chord with rolls of the bend about each; a straight tool is symmetric."""
    from scipy.spatial.transform import Rotation  # not needed to start, and slow to import

    bent = any(part.bend > 0.0 for part in tool.parts)
    rolls = (np.arange(_ROLLS) + 0.5) * 2 * np.pi / _ROLLS - np.pi if bent else np.zeros(1)
    entry = path.position(0.0)
    chord = path.position(_CHORD * path.length) - entry
    chord = chord / np.linalg.norm(chord)
    side, _, up = upright_frame(chord).T
    for tilt in np.radians(_TILTS):
        for around in np.arange(8) * np.pi / 4 if tilt else (0.0,):
            lean = np.cos(around) * side + np.sin(around) * up
            shaft = np.cos(tilt) * chord + np.sin(tilt) * lean
            upright = upright_frame(shaft)
            for roll in rolls:
                yield _Orientation(float(roll), (upright @ Rotation.from_euler("y", roll).as_matrix())[None])


def _planned(path: SplinePath, tool: Tool, shaft: ShaftDirections) -> Iterator[_Orientation]:
    """The planned orientation; with rolls of the bend about it where the plan leaves the roll open."""
    from scipy.spatial.transform import Rotation  # not needed to start, and slow to import

    frames = shaft.frame(np.linspace(0.0, path.length, _SAMPLES))
    free = tool.bend > 0.0 and not shaft.has_roll
    for turn in np.arange(_ROLLS) * 2 * np.pi / _ROLLS if free else np.zeros(1):
        tips = frames @ Rotation.from_euler("y", turn).as_matrix()
        yield _Orientation(-roll_of(tips[0]), tips)  # about the tip's y axis, not the direction towards the tail


def _mean_clearance(tree: Proximity, tool: Tool, path: SplinePath, tips: Array, settings: ControlSettings) -> float:
    """Mean clearance along the path with these orientations, each sample limited to the threshold."""
    cap = settings.reach_mm
    places = path.position(np.linspace(0.0, path.length, _SAMPLES))
    every = np.broadcast_to(tips, (_SAMPLES, 3, 3))
    clearances = [
        min(tree.clearance(tool.segments(tip, place), cap), cap) for tip, place in zip(every, places, strict=True)
    ]
    # A tool that does not fit at the entry is ranked behind all that do.
    entry = -cap if clearances[0] < settings.kept_mm else 0.0
    return float(np.mean(clearances)) + entry
