"""Snapshot of a free tool after a step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...geometry.path import SplinePath
from ...geometry.rotations import rotation_vector
from ...runtime.snapshot import Blocker, Snapshot
from ..rigid.scene import Scene
from ..rigid.snapshot import ToolOfSnapshot, camera_at
from .state import FreehandState


@dataclass(frozen=True)
class Contact:
    """Contacts of one part of the tool with one structure so far: how many, the deepest, and the depth now in mm."""

    structure: str
    part: str
    count: int
    max_depth_mm: float
    depth_mm: float


@dataclass(frozen=True, kw_only=True)
class FreehandSnapshot(ToolOfSnapshot, Snapshot):
    """The fields of every world, and those of a free tool: positions (3,) in LPS mm, force in N, torque in N·mm.

    q: the tip's position, then its rotation vector. certified is False: bone does not stop this tool.
    phase: 'approach', 'follow', 'done', 'inspect_approach', 'inspect_hold' or 'free'.
    contacts: with every structure that was touched so far; blockers: what is touched now, the deepest first.
    clearance_mm: of the whole tool to bone, negative in contact, cut at threshold_mm.
    target_error_mm: |P_v − P_t|, NaN outside inspection.
    """

    rotation: Array
    grip: Array
    virtual_point: Array
    force: Array
    torque: Array
    mode: str
    phase: str
    held: bool
    contacts: tuple[Contact, ...]
    tip_error_mm: float
    clearance_mm: float
    threshold_mm: float
    target_error_mm: float

    @property
    def reason(self) -> str:
        """What is touched now, the deepest first; '' where nothing is."""
        return self.blockers[0].words if self.blockers else ""


def snapshot_of(scene: Scene, structures: tuple[str, ...], state: FreehandState) -> FreehandSnapshot:
    """The snapshot of a state."""
    tool, settings = scene.tool, state.settings
    tip, rotation, segments = state.position, state.rotation, state.segments
    centre = tip + settings.view_distance_mm * tool.direction(rotation)
    contacts = contacts_of(structures, tool.segment_names, state)
    error, progress, length = _on_path(scene.path, state)
    away = float(np.linalg.norm(centre - scene.targets[state.target])) if state.mode == "inspect" else float("nan")
    touched = sorted((one for one in contacts if one.depth_mm > 0.0), key=lambda one: -one.depth_mm)
    return FreehandSnapshot(
        t=state.t,
        q=np.concatenate([tip, rotation_vector(rotation)]),
        capsules=np.column_stack([segments.start, segments.end, segments.radius]),
        tip=tip,
        camera=camera_at(rotation, tip, tool),
        outcome=state.outcome,
        blockers=tuple(_blocker(one) for one in touched),
        forces=state.push,
        rotation=rotation,
        grip=tool.grip(rotation, tip),
        virtual_point=centre,
        force=state.force,
        torque=state.torque,
        mode=state.mode,
        phase=state.phase,
        held=state.outcome == "held",
        contacts=contacts,
        tip_error_mm=error,
        clearance_mm=float(state.distance[0].min()),
        threshold_mm=settings.reach_mm,
        target_error_mm=away,
        progress_mm=progress,
        length_mm=length,
        steps=state.steps,
        certified=False,
    )


def contacts_of(structures: tuple[str, ...], parts: tuple[str, ...], state: FreehandState) -> tuple[Contact, ...]:
    """The contacts of a state so far, by structure and part."""
    return tuple(
        Contact(
            structures[body], parts[part], int(state.count[body, part]), float(state.deepest[body, part]),
            max(-float(state.distance[body, part]), 0.0),
        )
        for body, part in np.argwhere(state.count > 0)
    )  # fmt: skip


def _blocker(one: Contact) -> Blocker:
    words = f"the {one.part} is {one.depth_mm:.1f} mm in {one.structure}"
    return Blocker("contact", one.structure, one.part, -one.depth_mm, None, words)


def _on_path(path: SplinePath | None, state: FreehandState) -> tuple[float, float, float]:
    """Distance of the tip to the path, arc length there, and the path's length; zeros without a path."""
    if path is None or state.nearest is None:
        return 0.0, 0.0, 0.0
    s, position = state.nearest.s, state.nearest.position
    if state.mode != "path":
        s, position, _ = path.closest(state.position)
    return float(np.linalg.norm(position - state.position)), s, path.length
