"""A snapshot of the rehearsal as the page's sections."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from app.drives import view as of_any_drive
from app.drives.sections import DetailsSection
from app.drives.view import drive_section, number, place
from app.planning.nearness import REACH_MM, Nearness, nearness
from app.tabs.rehearse.drive_figures import FELT_N, DriveFigures
from app.tabs.rehearse.drive_session import RehearsalRecord
from app.tabs.rehearse.options import not_held
from app.tabs.rehearse.sections import (
    ApproachSection,
    ContactView,
    ControlView,
    MotionView,
    NearnessView,
    RehearsalSection,
    SettingsSection,
    ToolSection,
)
from app.tabs.rehearse.tool_snapshot import ToolSnapshot
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.control import ControlSettings
from vfix_engine.runtime.control_mode import FREEHAND
from vfix_engine.runtime.requests import SetTask
from vfix_engine.virtual_fixtures import SoftRegion, SoftZone, Zone
from vfix_engine.worlds.freehand.snapshot import Contact, FreehandSnapshot
from vfix_engine.worlds.rigid.dry_run import TIGHT_MM

# Settings with a slider on the page; the others come from the plan.
SHOWN_SETTINGS = {
    "margin_mm": (0.05, 2, (0.1, 1.5)),
    "stiffness_n_per_mm": (0.05, 2, (0.05, 1.0)),
    "force_cap_n": (0.5, 1, (0.5, 10.0)),
    "gain_mm_per_s_per_n": (0.1, 1, (0.5, 5.0)),
    "view_distance_mm": (1.0, 0, (5.0, 40.0)),
}


ROUNDED_MM = 5e-3  # of a clearance that is shown
STOOD_MM = 1e-3  # a grip that moved less between two snapshots counts as still
_ACROSS = {  # by phase: why a force moves nothing without an obstacle
    "follow": "The pull is across the path: it moves the tool neither forward nor back",
    "done": "The pull is across the path: it moves the tool neither forward nor back",
    "inspect_hold": "The pull is along the shaft: it does not turn the tool about the target",
}
FREE_APPROACH = "Nothing leads a free hand; choose Hands-on or Teleoperated."
_END = "the end of the path"  # as the world names it
_STANDS = "The pull points where the tool does not go in this mode"


def rehearsal_section(
    now: RehearsalRecord, before: ToolSnapshot | None = None, so_far: DriveFigures | None = None
) -> RehearsalSection:
    """Lengths in mm, force in N; numbers that do not exist are null. before: the snapshot shown before this one."""
    snapshot, state = now.snapshot, now.shown_state
    base = cast(RehearsalSection, {**drive_section(now), "target_id": _target_id(now), "control": control_view(now)})
    if snapshot is None or state not in ("ready", "running", "paused"):
        return base
    motion: MotionView = {
        "mode": snapshot.mode,
        "phase": snapshot.phase,
        "held": snapshot.held,
        "reason": snapshot.reason,
        "holding": holding_words(snapshot, before, "" if so_far is None else so_far.held_last),
        "so_far": "" if so_far is None else so_far.words,
        "force_n": number(np.linalg.norm(snapshot.force), 3),
        "tip_error_mm": number(snapshot.tip_error_mm, 4),
        "clearance_mm": number(snapshot.clearance_mm, 3),
        "clearance_capped": bool(snapshot.clearance_mm >= snapshot.threshold_mm),
        "margin_mm": None if isinstance(snapshot, FreehandSnapshot) else number(snapshot.margin_mm, 3),
        "progress_mm": number(snapshot.progress_mm, 2),
        "length_mm": number(snapshot.length_mm, 2),
        "target_error_mm": number(snapshot.target_error_mm, 4),
        "path_done": snapshot.phase == "done" or snapshot.mode == "inspect",
        "tip": place(snapshot.tip),
        "grip": place(snapshot.grip),
        "virtual_point": place(snapshot.virtual_point),
    }
    if isinstance(snapshot, FreehandSnapshot):
        deepest = sorted(snapshot.contacts, key=lambda one: (-one.depth_mm, -one.max_depth_mm))
        return {**base, **motion, "contacts": [_contact(one) for one in deepest]}
    return {**base, **motion}


def control_view(now: RehearsalRecord) -> ControlView:
    """How the tool is driven, or will be."""
    control = now.control
    return {
        "mode": control.mode,
        "device": control.device,
        "preset": now.preset,
        "certified": is_certified(now),
    }


def is_certified(now: RehearsalRecord) -> bool:
    """Whether every motion of what is there is certified; where nothing is, of what will be (HAZ-41)."""
    return now.control.mode != FREEHAND and (now.snapshot is None or now.snapshot.certified)


def _contact(one: Contact) -> ContactView:
    depths = {"max_depth_mm": number(one.max_depth_mm, 2), "depth_mm": number(one.depth_mm, 2)}
    return cast(ContactView, {"structure": one.structure, "part": one.part, "count": one.count, **depths})


def holding_words(snapshot: ToolSnapshot, before: ToolSnapshot | None, held_last: str = "") -> str:
    """The active constraints as a sentence; a tool at rest under a force is not free to move.

    A constraint that acts without slowing the tool, such as bone that it slides along, is named as well.
    held_last: the constraint that stopped the last push, which is still shown after a release. In a free hand it is
    what the tool touches.
    """
    if isinstance(snapshot, FreehandSnapshot):
        return f"Touches: {snapshot.reason}" if snapshot.reason else "Nothing touched; nothing holds the tool"
    if snapshot.reason or snapshot.held:
        return snapshot.reason or "held"
    if held_last and float(np.linalg.norm(snapshot.force)) <= FELT_N:
        return "At the end of the path" if held_last == _END else f"Stopped last by {held_last}"
    driven = before is not None and snapshot.steps > before.steps
    stands = before is not None and float(np.linalg.norm(snapshot.grip - before.grip)) < STOOD_MM
    if driven and stands and float(np.linalg.norm(snapshot.force)) > FELT_N:
        return _ACROSS.get(snapshot.phase, _STANDS)
    if driven and snapshot.active:
        return f"Nothing slows it; acting: {snapshot.active[0]}"
    return "Nothing, the tool is free to move"


def _target_id(now: RehearsalRecord) -> str | None:
    """The inspected target, of those of the present robot."""
    if now.snapshot is None or now.snapshot.mode != "inspect" or now.prepared is None:
        return None
    targets = [item.id for item in now.prepared.items if item.kind == "target"]
    asked = now.requested
    return targets[asked.target] if isinstance(asked, SetTask) and asked.target < len(targets) else None


def approach_section(now: RehearsalRecord) -> ApproachSection | None:
    """Where the tip can be led to on the driven path; None where nothing stands there."""
    prepared = now.prepared
    if prepared is None:
        return None
    length = math.floor(10.0 * prepared.path.length) / 10.0  # a place that is offered is on the path
    return {
        "points": [
            {"id": item.id, "label": f"{number}: {item.label}", "at_mm": round(at, 1)}
            for number, (item, at) in enumerate(prepared.point_places(), 1)
        ],
        "length_mm": length,
        "refusal": FREE_APPROACH if prepared.free else "" if now.may_instruct else not_held(now.holder is None),
    }


def details_section(snapshot: ToolSnapshot | None) -> DetailsSection:
    """Timing of the control loop, with the rows of its program."""
    found = of_any_drive.details_section(snapshot)
    return found if snapshot is None or isinstance(snapshot, FreehandSnapshot) else {**found, "rows": snapshot.rows}


def nearness_section(
    snapshot: ToolSnapshot | None, zones: Sequence[Zone | SoftZone | SoftRegion], bone_margin_mm: float
) -> list[NearnessView]:
    """Clearance of the tool to bone, and to the protected structures of the driven plan."""
    if snapshot is None:
        return []
    bone = Nearness("bone", min(snapshot.clearance_mm, snapshot.threshold_mm), bone_margin_mm)
    others = nearness(zones, snapshot.segments_start, snapshot.segments_end, snapshot.radius)
    return [_near(bone, snapshot.threshold_mm), *(_near(one, REACH_MM) for one in others)]


def _near(one: Nearness, reach_mm: float) -> NearnessView:
    left = one.clearance_mm - one.margin_mm
    return {
        "name": one.name,
        "clearance_mm": round(one.clearance_mm, 2),
        "margin_mm": round(one.margin_mm, 2),
        "at_least": one.clearance_mm >= reach_mm,
        "soft": one.soft,
        "level": "fits" if left >= TIGHT_MM else "blocked" if left < -ROUNDED_MM and not one.soft else "tight",
    }


def settings_section(
    settings: ControlSettings,
    answered: int,
    refusal: str = "",
    uncertainty: SurfaceUncertainty | None = None,
    certified: bool = True,
) -> SettingsSection:
    """Sliders with range, unit and label; answered: counts changes, so that a refused one puts its slider back.

    refusal: why the newest change was refused. uncertainty: of the bone, which the margin in force may not cover.
    certified: False of a free hand, which keeps no margin.
    """
    warning = "" if uncertainty is None or not certified else uncertainty.warning(settings.margin_mm)
    bounds, values = ControlSettings.bounds(), settings.to_dict()
    return {
        "answered": answered,
        "words": refusal,
        "warning": warning,
        "fields": [
            {
                "name": name,
                "label": bounds[name].label,
                "unit": bounds[name].unit,
                "lo": low,
                "hi": high,
                "step": step,
                "digits": digits,
                "value": round(values[name], 4),
            }
            for name, (step, digits, (low, high)) in SHOWN_SETTINGS.items()
            if certified or name != "margin_mm"
        ],
    }


def tool_section(snapshot: ToolSnapshot | None) -> ToolSection:
    """The tool for the slices."""
    if snapshot is None:
        return {"segments": [], "radii_mm": []}
    pairs = zip(snapshot.segments_start, snapshot.segments_end, strict=True)
    segments = [[[round(float(v), 2) for v in end] for end in pair] for pair in pairs]
    return {"segments": segments, "radii_mm": [round(float(radius), 3) for radius in snapshot.radius]}
