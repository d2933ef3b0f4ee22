"""Snapshot of a rigid tool after a step, for the page and the recorder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np

from ...arrays import Array
from ...control import LimitingConstraint as Reason
from ...control.relaxations import SLOWED_SHARE
from ...control.tasks import view_point
from ...robots import Tool
from ...runtime import snapshot as of_any_world
from ...runtime.snapshot import Blocker, Timing
from ...virtual_fixtures import StepState
from .scene import Scene
from .state import LastStep, RehearsalState
from .teleoperation import spring

__all__ = ["RigidSnapshot", "Timing", "camera_of", "lazy_snapshot", "snapshot_of"]


class ToolOfSnapshot:
    """What the capsules and the camera of a snapshot say of a rigid tool, on a robot or in a free hand."""

    capsules: Array
    camera: Array

    @property
    def segments_start(self) -> Array:
        """(S, 3) starts of the tool's axis segments, from the tip on."""
        return self.capsules[:, :3]

    @property
    def segments_end(self) -> Array:
        """(S, 3) their ends."""
        return self.capsules[:, 3:6]

    @property
    def radius(self) -> Array:
        """(S,) radii of the segments."""
        return self.capsules[:, 6]

    @property
    def shaft(self) -> Array:
        """(3,) unit vector along the tool's first part, to its tip."""
        way: Array = self.segments_end[0] - self.segments_start[0]
        return way / np.linalg.norm(way)

    @property
    def side(self) -> Array:
        """(3,) unit vector across the shaft, to which a bend or an angled lens of the tool points."""
        towards = self.camera[:3, 2] - self.camera[:3, 1]  # the view and up in its picture: not both along the shaft
        across: Array = towards - (towards @ self.shaft) * self.shaft
        return across / np.linalg.norm(across)


@dataclass(frozen=True, kw_only=True)
class RigidSnapshot(ToolOfSnapshot, of_any_world.Snapshot):
    """The fields of every world, and those of the rigid tool: positions (3,) in LPS mm, force in N, torque in N·mm.

    phase: 'approach', 'follow', 'done', 'inspect_approach', 'inspect_hold' or 'free'.
    held: the hand pushes and the tool does not move; slowed: it moves less than commanded; reason says why, in words.
    active: in words, every constraint that acts on the step, strongest first, also where it costs no motion.
    clearance_mm: of the whole tool, exact up to threshold_mm.
    target_error_mm: |P_v − P_t|, of the deflected point, NaN outside inspection.
    deflection: (3,) in mm of the tip under the hand, which is compensated; tip_error_mm is of the deflected tip.
    emergencies: steps so far that had to exceed a joint's acceleration limit.
    teleoperated: a master or a rate device drives; ``reflection`` is the force on a master then, no more than the
        force cap; a rate device has springs of its own, and gets none.
    """

    grip: Array
    virtual_point: Array
    force: Array
    torque: Array
    mode: str
    phase: str
    held: bool
    slowed: bool
    reason: str
    active: tuple[str, ...]
    blocking_point: Array | None
    tip_error_mm: float
    clearance_mm: float
    margin_mm: float
    threshold_mm: float
    target_error_mm: float
    rows: int
    emergencies: int = field(default_factory=int)
    teleoperated: bool = field(default_factory=bool)
    deflection: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def reflection(self) -> Array:
        """(3,) in N, force on a master; another name of ``forces``."""
        return self.forces


def snapshot_of(scene: Scene, state: RehearsalState, last: LastStep | None) -> RigidSnapshot:
    """The snapshot of a state; ``last``: the step that led to it, None for the pose alone."""
    tool, settings = state.tool, state.settings
    tip, rotation, segments = tool.tip.position, tool.tip.rotation, tool.segments
    centre = view_point(tool, scene.tool, settings.view_distance_mm)
    error, progress, length = _on_path(scene, state)
    target_error = float("nan")
    if state.mode == "inspect":
        believed = centre + state.deflection
        target_error = float(np.linalg.norm(believed - scene.targets[state.target]))
    report = None if last is None else last.report
    active = () if report is None else report.active_constraints()
    held = report is not None and report.held
    less = report is not None and (held or report.share * report.ramp_fraction < SLOWED_SHARE)
    why = active if less else ()
    names = scene.structure_names
    end = "" if last is None else last.end
    teleoperated = last is not None and last.teleoperated
    return RigidSnapshot(
        t=state.t,
        q=tool.q,
        capsules=np.column_stack([segments.start, segments.end, segments.radius]),
        tip=tip,
        camera=camera_of(tool, scene.tool),
        outcome="idle" if report is None else report.outcome,
        blockers=tuple(_blocker(one, names) for one in why),
        forces=-spring(state.lag, settings) if teleoperated else np.zeros(3),
        grip=scene.tool.grip(rotation, tip),
        virtual_point=centre,
        force=np.zeros(3) if last is None else last.force,
        torque=np.zeros(3) if last is None else last.torque,
        mode=state.mode,
        phase=state.phase,
        held=held,
        slowed=bool(why) and not held,
        reason=end or (why[0].words_with(names) if why else ""),
        active=tuple(b.words_with(names) for b in active),
        blocking_point=next((b.point for b in why if b.point is not None), None),
        tip_error_mm=error,
        clearance_mm=tool.clearance,
        margin_mm=settings.kept_mm,
        threshold_mm=settings.reach_mm,
        progress_mm=progress,
        length_mm=length,
        target_error_mm=target_error,
        rows=0 if report is None else report.rows,
        steps=state.steps,
        emergencies=state.emergencies,
        teleoperated=teleoperated,
        deflection=state.deflection,
        certified=True,
    )


def lazy_snapshot(scene: Scene, state: RehearsalState) -> RigidSnapshot:
    """The same snapshot of a state and its last step, made when one of its fields is first read."""
    return _Lazy.of(scene, state)


def camera_of(tool: StepState, kind: Tool) -> Array:
    """transform_camera_to_patient (4, 4); for a tool without a camera one at its tip that looks along it."""
    return camera_at(tool.tip.rotation, tool.tip.position, kind)


def camera_at(rotation: Array, position: Array, kind: Tool) -> Array:
    """The same for a tip at (3, 3) and (3,)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    if kind.camera is not None:
        camera: Array = pose @ kind.camera.transform_camera_to_tip
        return camera
    view, across = kind.direction(rotation), rotation[:, 0]
    pose[:3, :3] = np.column_stack([across, np.cross(view, across), view])
    return pose


def view_axes(kind: Tool) -> Array:
    """(3, 3) axes of the camera in the frame of the tip, as columns; a tip's rotation brings them to the patient's."""
    return camera_at(np.eye(3), np.zeros(3), kind)[:3, :3]


def _on_path(scene: Scene, state: RehearsalState) -> tuple[float, float, float]:
    """Distance of the tip to the path, arc length there, and the path's length; zeros without a path."""
    if scene.path is None or state.nearest is None:
        return 0.0, 0.0, 0.0
    tip, near = state.believed_tip, state.nearest
    s, position = near.s, near.position
    if state.mode != "path":  # off the path the tip may be anywhere: no branch is preferred there
        s, position, _ = scene.path.closest(tip)
    return float(np.linalg.norm(position - tip)), s, scene.path.length


def _blocker(reason: Reason, names: Mapping[str, str]) -> Blocker:
    words = reason.words_with(names)
    return Blocker(reason.kind, reason.structure, reason.part, reason.distance_mm, reason.point, words)


class _Lazy(RigidSnapshot):
    """A snapshot whose fields are made when the first of them is read."""

    @classmethod
    def of(cls, scene: Scene, state: RehearsalState) -> RigidSnapshot:
        one = object.__new__(cls)
        one.__dict__["_of"] = (scene, state)
        return one

    def __getattr__(self, name: str) -> object:
        if name not in _FIELDS:
            raise AttributeError(f"a snapshot has no '{name}'")
        scene, state = self.__dict__.pop("_of")
        self.__dict__.update(snapshot_of(scene, state, state.last).__dict__)
        return self.__dict__[name]


_FIELDS = frozenset(one.name for one in fields(RigidSnapshot))
