"""Switches of a rehearsal: fixtures that stand beside its task, in force from its start or its next reset."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from app.services import Services
from app.services.instruments import plan_tool
from app.services.plans import Plan
from app.steps.rehearse.sections import OptionsSection
from vfix_engine.errors import PlanError
from vfix_engine.fixtures import CartesianLimits, Fixture, RemoteCentre, SoftZone
from vfix_engine.geometry.path import SplinePath
from vfix_engine.imaging.soft_tissue import lining_mm

TOLERANCE_MM = 3.0  # of the shaft about the nostril: assumed, it is less than a nostril's half width
SPEED_MM_PER_S = 5.0  # of the tip; half of what the hand reaches with the settings as they come
TURN_RAD_PER_S = math.radians(10.0)
STIFFNESS_N_PER_MM = 0.5  # of soft tissue: assumed
THINNEST_MM = 0.2  # of soft tissue that is worth a layer
_SAMPLES = 120  # places of the path at which the layer is measured

_NO_CT = "This head has no CT: nobody knows how thick its soft tissue is."
_OF_ANOTHER = "Another window holds the handle."


@dataclass(frozen=True)
class Options:
    """Which switches are on."""

    soft_tissue: bool = False
    remote_centre: bool = False
    speed_limit: bool = False


NO_OPTIONS = Options()


def fixtures_of(options: Options, services: Services, plan: Plan) -> tuple[Fixture, ...]:
    """The standing fixtures of a rehearsal. Raises PlanError where the CT shows no soft tissue along the path."""
    found: list[Fixture] = []
    if options.soft_tissue:
        found.append(SoftZone("soft tissue", _thickness_mm(services, plan), STIFFNESS_N_PER_MM))
    if options.remote_centre:
        found.append(_remote_centre(plan))
    if options.speed_limit:
        found.append(CartesianLimits(speed_mm_per_s=SPEED_MM_PER_S, turn_rad_per_s=TURN_RAD_PER_S))
    return tuple(found)


def _remote_centre(plan: Plan) -> RemoteCentre:
    """About the entry. A bent tip is there before its shaft is, so that the shaft gets the tip's way off its line.

    Without the soft rows: a pull towards the middle would keep the tip off its path.
    """
    off_line = float(np.hypot(*plan_tool(plan).tip_in_flange[[0, 2]]))
    return RemoteCentre(np.array(plan.points[0].position), TOLERANCE_MM + off_line, weight=0.0)


def _thickness_mm(services: Services, plan: Plan) -> float:
    """The median thickness of what covers the bone along a plan's path, as its CT shows it."""
    volume = services.cases.volume(plan.case_id)
    if volume is None:
        raise PlanError(_NO_CT)
    path = SplinePath(np.array([point.position for point in plan.points], dtype=np.float64))
    places = path.position(np.linspace(0.0, path.length, _SAMPLES))
    nearest = services.cases.tree(plan.case_id).point_distance(places)[1]
    thickness = lining_mm(volume, places, nearest)
    if thickness is None or thickness < THINNEST_MM:
        raise PlanError("the CT shows no soft tissue over the bone along this path; switch the soft tissue off.")
    return thickness


def options_section(
    wanted: Options, in_force: Options | None, points: int, has_ct: bool, may_change: bool
) -> OptionsSection:
    """Switches, what each does, and why one cannot be used.

    in_force: of the robot that is in place; None where there is none.
    """
    refusals = {"soft_tissue": "" if has_ct else _NO_CT, "remote_centre": "", "speed_limit": ""}
    if points == 0:
        refusals["remote_centre"] = "The plan has no entry point yet."
    changed = in_force is not None and in_force != wanted
    return {
        "items": [
            {
                "name": field.name,
                "label": _LABELS[field.name][0],
                "words": _LABELS[field.name][1],
                "on": getattr(wanted, field.name),
                "refusal": refusals[field.name] or ("" if may_change else _OF_ANOTHER),
            }
            for field in fields(Options)
        ],
        "words": "Changed: in force from ‘Start’ at the entry, or from ‘Reset to entry’." if changed else "",
    }


_LABELS = {
    "soft_tissue": (
        "Soft tissue",
        f"A layer over the bone, as thick as the CT shows it along the path, yields with {STIFFNESS_N_PER_MM} N/mm.",
    ),
    "remote_centre": (
        "Remote centre at the nostril",
        f"The shaft passes the first point of the path within {TOLERANCE_MM:g} mm, "
        "and by as much more as a bent tip is off the shaft's line.",
    ),
    "speed_limit": (
        "Speed limits",
        f"The tip moves no faster than {SPEED_MM_PER_S:g} mm/s and turns no faster than "
        f"{math.degrees(TURN_RAD_PER_S):.0f}°/s.",
    ),
}
