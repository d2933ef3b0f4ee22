"""The robot and the tool of a plan as the page shows them, and what can be chosen instead."""

from __future__ import annotations

import math
from functools import cache

from app.plans.instruments import (
    MAX_BEND_DEG,
    SHAFT_RADIUS_MM,
    Instruments,
    UsesInstruments,
    plan_tool,
    robot_words,
    shipped_robots,
    shipped_tools,
    tool_words,
)
from app.tabs.plan.sections import InstrumentsSection, PlanRobotView, PlanToolView
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError


@cache
def instruments_section() -> InstrumentsSection:
    """Robots and tools that come along, and bounds of what can be set."""
    margin = ControlSettings.bounds()["margin_mm"]
    return {
        "robots": [{"name": one.name, "title": one.title, "words": robot_words(one)} for one in shipped_robots()],
        "tools": [
            {
                "name": one.name,
                "title": one.title,
                "words": tool_words(one),
                "bend_deg": _degrees(one.bend),
                "shaft_radius_mm": one.shaft_radius,
            }
            for one in shipped_tools()
        ],
        "bend_bounds_deg": [0.0, round(MAX_BEND_DEG, 6)],
        "radius_bounds_mm": list(SHAFT_RADIUS_MM),
        "margin_bounds_mm": [margin.low, margin.high],
    }


def robot_view(plan: UsesInstruments, instruments: Instruments) -> PlanRobotView:
    """The plan's robot; one that cannot be read says why."""
    said = plan.robot
    view: PlanRobotView = {
        "name": said["name"],
        "title": said["name"],
        "words": "",
        "urdf": said.get("urdf"),
        "tool_frame": said.get("tool_frame"),
        "links": [],
        "is_placed": said.get("base") is not None,
        "notes": [],
        "trouble": "",
    }
    try:
        robot = instruments.robot(said)
        view |= {"title": robot.title, "words": robot_words(robot), "notes": list(robot.notes)}
        if said.get("urdf") is not None:
            view["links"] = list(instruments.frames(said["urdf"]))
    except InputError as error:
        view["trouble"] = str(error)
    return view


def tool_view(plan: UsesInstruments) -> PlanToolView:
    """The plan's tool; one that cannot be read says why."""
    view: PlanToolView = {
        "name": plan.tool,
        "title": plan.tool,
        "words": "",
        "bend_deg": None,
        "shaft_radius_mm": 0.0,
        "changed": bool(plan.tool_shape),
        "trouble": "",
    }
    try:
        tool = plan_tool(plan)
    except InputError as error:
        view["trouble"] = str(error)
        return view
    bent = any(known.name == tool.name and known.bend > 0.0 for known in shipped_tools())
    bend = _degrees(tool.bend) if bent else None
    return view | {
        "title": tool.title,
        "words": tool_words(tool),
        "bend_deg": bend,
        "shaft_radius_mm": tool.shaft_radius,
    }


def _degrees(angle: float) -> float:
    return round(math.degrees(angle), 3)
