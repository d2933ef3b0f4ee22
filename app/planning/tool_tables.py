"""Tables of tools: every shipped tool along the path of a plan, each with the verdict of a plan that has it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from app.kit.errors import NotFound, PlanConflict
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.verdict import WORDS, Level
from app.plans.model import Plan, PlanContent, PlanPoint, new_point_id
from app.plans.operations.instruments import TakeTool
from vfix_engine.errors import StartRefused
from vfix_engine.robots import Tool

_STOPPED: tuple[Level, ...] = ("blocked", "pierces")


@dataclass(frozen=True, eq=False)
class ToolRun:
    """A tool along the path of a plan. led: the plan with it, None if no direction of the shaft fits at the entry.

    evaluation: of that plan, or why the tool does not start.
    """

    tool: Tool
    led: Plan | None
    evaluation: PlanEvaluation | StartRefused | None


@dataclass(frozen=True)
class ToolRow:
    """One tool along the path of a plan; lengths in mm.

    as_planned: with the shaft directions of the plan, otherwise with the best ones found. verdict: the level of a plan
    with this tool and these directions, from which all figures are; word: of the level. reaches: the tool gets to the
    end and pierces nothing. reason: what stops it if it does not; stop: the same with its place, in at most six words.
    least_clearance_mm (to bone), reached_mm: None if the
    tool does not fit at the entry. tissue_mm, tissue_depth_mm: None without a CT. pierces: the tool goes through skin
    or a wall.
    """

    tool: str
    title: str
    chosen: bool
    as_planned: bool
    reaches: bool
    reached_mm: float | None
    length_mm: float
    least_clearance_mm: float | None
    tissue_mm: float | None
    tissue_depth_mm: float | None
    reason: str
    stop: str
    pierces: bool
    verdict: Level
    word: str


@dataclass(frozen=True, eq=False)
class ToolTable:
    """Every shipped tool along the path of a plan at a revision, those that get to its end first.

    tools: their shapes. led: by tool, the plan with it, where it fits at the entry.
    """

    id: str
    plan_id: str
    revision: int
    rows: tuple[ToolRow, ...]
    tools: Mapping[str, Tool]
    led: Mapping[str, Plan]

    def edit(self, plan: Plan, tool: str) -> TakeTool:
        """Return the edit that gives a plan a tool of the table, with the directions that it was simulated with.

        Raises NotFound for a tool that the table does not have, and PlanConflict if the tool does not fit at the entry
        or the path, or what the tools were simulated among, has changed since.
        """
        if tool not in self.tools:
            raise NotFound(f"the table has no tool {tool!r:.80}.")
        if tool not in self.led:
            raise PlanConflict("that tool does not fit at the entry, whatever its shaft's direction.")
        content = self.led[tool].content
        if [point.position for point in content.points] != [point.position for point in plan.content.points]:
            raise PlanConflict("the path has changed since the tools were simulated; compare them anew.")
        if _among(content) != _among(plan.content):
            raise PlanConflict("the plan has changed since the tools were simulated; compare them anew.")
        return TakeTool(tool=tool, tool_shape=content.tool_shape, points=content.points)


def _among(content: PlanContent) -> tuple[Any, ...]:
    """What a tool is driven by and among, as far as a plan says it."""
    zones = [
        (zone.shape, zone.kind, zone.margin_mm, zone.stiffness_n_per_mm, zone.max_depth_mm) for zone in content.zones
    ]
    robot = (content.robot["name"], content.robot.get("urdf"))
    return robot, content.settings, zones, [one.shape for one in content.removed_bone], content.registration


def with_shaft(plan: Plan, tool: str, directed: Sequence[PlanPoint]) -> Plan:
    """Return the plan with another tool, as shipped, and the shaft's directions of other points; nothing is stored."""
    points = [
        replace(point, direction=other.direction, roll_deg=other.roll_deg)
        for point, other in zip(plan.content.points, directed, strict=True)
    ]
    return replace(plan, content=plan.content.with_tool(tool).with_points(points).without_placement())


def tool_table(plan: Plan, runs: Sequence[ToolRun], length_mm: float) -> ToolTable:
    """Return the table of tools along the path of a plan, of that length."""
    rows = [_row(run, run.tool.name == plan.content.tool, length_mm) for run in runs]
    rows.sort(key=lambda row: (not row.reaches, row.tissue_mm or 0.0, -(row.least_clearance_mm or 0.0)))
    return ToolTable(
        new_point_id(),
        plan.id,
        plan.revision,
        tuple(rows),
        {run.tool.name: run.tool for run in runs},
        {run.tool.name: run.led for run in runs if run.led is not None},
    )


def _row(run: ToolRun, chosen: bool, length_mm: float) -> ToolRow:
    tool, found = run.tool, run.evaluation
    if not isinstance(found, PlanEvaluation):
        reason = "it does not fit at the entry" if found is None else str(found)
        blank = (False, None, length_mm, None, None, None, reason, "does not fit at the entry", False)
        return ToolRow(tool.name, tool.title, chosen, chosen, *blank, verdict="blocked", word=WORDS["blocked"])
    verdict, pierces = found.verdict, found.verdict.pierced.state in ("room", "wall")
    reaches, reason = verdict.level not in _STOPPED, found.reason
    if pierces and found.completed:
        reason = "it pierces skin or a wall between two air spaces"
    return ToolRow(
        tool.name, tool.title, chosen, chosen, reaches, found.reached_mm, length_mm, verdict.obstacles[0].least_mm,
        verdict.tissue_mm, verdict.tissue_depth_mm, reason, _stop(found), pierces, verdict.level, verdict.word,
    )  # fmt: skip


def _stop(found: PlanEvaluation) -> str:
    """Return what stops a tool and where, '' for one that gets to the end and pierces nothing."""
    pierced = found.verdict.pierced
    if pierced.state in ("room", "wall") and pierced.s_mm is not None:
        return f"pierces {'skin' if pierced.state == 'room' else 'a wall'} at {pierced.s_mm:.0f} mm"
    return "" if found.completed else f"reaches {found.reached_mm:.0f} of {found.length_mm:.0f} mm"
