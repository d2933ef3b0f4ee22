"""Suggested paths and tables of tools: the engine's search in the head of a case, as jobs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

import numpy as np

from app.cases.service import Case, CaseService
from app.cases.settings import settings_in_case
from app.clock import utc_now
from app.kit.cache import Cache
from app.kit.errors import NotFound, PlanConflict
from app.kit.jobs import Job, JobKind, Jobs, Progress
from app.kit.values import Position, check_position
from app.planning.distance_fields import Fields
from app.planning.evaluation import Planning
from app.planning.piercing import sideways_of
from app.planning.previews import with_points
from app.planning.rehearsal_options import SwitchBoard
from app.planning.remote_centre import path_of
from app.planning.shaft import shaft_of
from app.planning.suggestion_ends import check_ends
from app.planning.verdict import Level, Verdict, refused
from app.plans.instruments import Instruments, plan_tool, shipped_tools
from app.plans.model import Plan, PlanContent, PlanPoint, new_point_id
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError, StartRefused
from vfix_engine.progress import ProgressCallback
from vfix_engine.proximity.fields.opened_field import opened_field
from vfix_engine.robots import Tool
from vfix_engine.suggestion import (
    RANKINGS,
    Alternative,
    NoWay,
    Room,
    SearchSpace,
    Suggestion,
    best_drives,
    drive_plan,
    suggest_path,
)
from vfix_engine.worlds.rigid import preparation

WORTH_TELLING_MM = 0.5  # a path that ends farther than this from its target says so
_KEPT = 16  # answers that are remembered
_FIELDS_SHARE = 0.05  # of a job, where its fields are measured
_JUDGED_SHARE = 0.95  # from where on what was found is judged
_ORDER: dict[Level, int] = {"fits": 0, "tight": 1, "unknown": 2}  # what is suggested, the best first


@dataclass(frozen=True, eq=False)
class SuggestedPaths:
    """What was found from an entry to a target; both in LPS mm.

    tool: its name; tool_shape: its shape where it is not as shipped. kept_mm: the clearance to bone that was kept, the
    margin and what thinning may have moved the surface by. verdicts: on each alternative, as the plan has it that is
    led along it.
    """

    id: str
    plan_id: str
    entry: Position
    target: Position
    tool: str
    kept_mm: float
    found: Suggestion
    tool_shape: Mapping[str, float] = field(default_factory=dict)
    verdicts: tuple[Verdict, ...] = ()

    def points_of(self, plan_id: str, alternative: int) -> tuple[PlanPoint, ...]:
        """The points of an alternative, counted from 0. Raises PlanError for another plan, NotFound for no such one."""
        if self.plan_id != plan_id:
            raise PlanError("that suggestion was made for another plan; look for a path anew.")
        if alternative >= len(self.found.alternatives):
            raise NotFound(f"this suggestion has {len(self.found.alternatives)} alternatives.")
        return suggested_points(self.found.alternatives[alternative])

    def check_tool(self, plan: Plan) -> None:
        """Raises PlanConflict for a plan that has another tool now: it may not fit where this one was driven."""
        if self.tool != plan_tool(plan).name:
            raise PlanConflict(
                f"that suggestion was made for the tool {self.tool!r}, and the plan has {plan.tool!r} now; look for a "
                "path anew, or choose that tool again."
            )
        if dict(self.tool_shape) != dict(plan.tool_shape):
            raise PlanConflict("that suggestion was made for another shape of the tool; look for a path anew.")


@dataclass(frozen=True)
class ToolRow:
    """How a tool does along the path of a plan; lengths in mm.

    reaches: it gets to the end; reason: what holds it where it does not. as_planned: with the directions of the plan,
    else with the best that were found. least_clearance_mm and reached_mm: None where it does not fit at the entry.
    tissue_mm, tissue_depth_mm: None without a CT. pierces: it goes through skin or a wall, and is told not to reach.
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
    pierces: bool = False


@dataclass(frozen=True)
class ToolTable:
    """Every shipped tool along the path of a plan, as the plan was at a revision."""

    id: str
    plan_id: str
    revision: int
    rows: tuple[ToolRow, ...]


class Suggestions:
    """Looks for paths and tools; may be used from any thread."""

    def __init__(
        self,
        jobs: Jobs,
        cases: CaseService,
        instruments: Instruments,
        fields: Fields,
        planning: Planning,
        switches: SwitchBoard,
    ) -> None:
        self._jobs, self._cases, self._instruments = jobs, cases, instruments
        self._fields, self._planning, self._switches = fields, planning, switches
        self._paths: Cache[str, SuggestedPaths] = Cache(_KEPT)
        self._tables: Cache[str, ToolTable] = Cache(_KEPT)

    def start(self, plan: Plan, entry: Sequence[float] | None = None, target: Sequence[float] | None = None) -> Job:
        """Look for paths with a plan's tool as a job; its result is the id that `paths` takes.

        entry: by default the first path point; target: by default the first target. Raises PlanError without them,
        and as `check_ends`.
        """
        ends = entry_and_target(plan, entry, target)
        check_ends(self._cases.get(plan.case_id), *ends)

        def work(progress: Progress) -> str:
            answer = self.look(plan, *ends, progress)
            return self._paths.get(answer.id, lambda: answer).id

        return self._submit(work, "suggestion", plan, ends)

    def start_tools(self, plan: Plan) -> Job:
        """Drive every shipped tool along a plan's path as a job; its result is the id that `table` takes."""
        path_of(plan)

        def work(progress: Progress) -> str:
            answer = self.tools(plan, progress)
            return self._tables.get(answer.id, lambda: answer).id

        return self._submit(work, "tools", plan, ())

    def paths(self, suggestion_id: str) -> SuggestedPaths:
        """What a job has found. Raises NotFound for one that is not remembered."""
        return _kept(self._paths, suggestion_id, "suggestion")

    def table(self, table_id: str) -> ToolTable:
        """What a job has measured. Raises NotFound for one that is not remembered."""
        return _kept(self._tables, table_id, "table of tools")

    def look(self, plan: Plan, entry: Position, target: Position, tell: ProgressCallback) -> SuggestedPaths:
        """Paths from an entry to a target, for the tool, robot and settings of a plan, among its structures to spare.

        Each is judged as the plan is that is led along it; what is blocked or pierces a wall is left out, and of the
        others those that fit are the first, in the order of the search.
        Raises InputError where entry or target cannot be used, before anything is measured where that is known.
        """
        check_ends(self._cases.get(plan.case_id), entry, target)
        around, settings = self._around(plan, [entry, target], tell), self._settings(plan)
        robot, tool = self._instruments.robot(plan.robot), plan_tool(plan)
        found = suggest_path(around, robot, tool, entry, target, settings, partial(_search_share, tell))
        found, verdicts = self._judged(plan, found, target, tell)
        return SuggestedPaths(
            new_point_id(), plan.id, entry, target, tool.name, settings.kept_mm, found, plan.tool_shape, verdicts
        )

    def _judged(
        self, plan: Plan, found: Suggestion, target: Position, tell: ProgressCallback
    ) -> tuple[Suggestion, tuple[Verdict, ...]]:
        """What was found without what is blocked or pierces a wall, the best verdicts first, and these."""
        judged = [(one, self._verdict(plan, one, tell)) for one in found.alternatives]
        passing = [pair for pair in judged if pair[1].level in _ORDER]
        passing.sort(key=lambda pair: _ORDER[pair[1].level])
        if judged and not passing:
            one, verdict = judged[0]
            end = one.run.tip[-1]
            gap = float(np.linalg.norm(end - target))
            reason = f"every way that was found is blocked or pierces a wall. {verdict.words}".rstrip(".")
            return Suggestion((), NoWay(end, gap, reason, f"{len(judged)} ways")), ()
        return Suggestion(tuple(one for one, _ in passing), found.none), tuple(verdict for _, verdict in passing)

    def _verdict(self, plan: Plan, one: Alternative, tell: ProgressCallback) -> Verdict:
        """The verdict on a plan that is led along an alternative."""
        led = with_points(plan, suggested_points(one))
        try:
            judging = partial(_judging_share, tell)
            return self._planning.evaluate(led, judging, self._switches.of(plan.id).in_force.along(led)).verdict
        except StartRefused as error:
            return refused(error).beside(led)

    def tools(self, plan: Plan, tell: ProgressCallback) -> ToolTable:
        """Every shipped tool along the path of a plan."""
        points = [point.position for point in plan.points]
        path = path_of(plan)
        around, settings = self._around(plan, points, tell), self._settings(plan)
        robot, shaft, rows = self._instruments.robot(plan.robot), shaft_of(plan, path), list[ToolRow]()
        every = [plan_tool(plan) if tool.name == plan.tool else tool for tool in shipped_tools()]
        for number, tool in enumerate(every):
            share = _FIELDS_SHARE + (1.0 - _FIELDS_SHARE) * number / len(every)

            def step(stage: str, _: float, at: float = share, title: str = tool.title) -> None:
                tell(f"Driving {title}", at)

            planned = shaft is not None and tool.name == plan.tool
            if planned and shaft is not None:
                own = drive_plan(around, robot, tool, path, shaft, settings, lambda: step("", 0.0))
                drives = [] if own is None else [own]
            else:
                drives = best_drives(around, robot, tool, np.array(points), settings, RANKINGS[:1], 1, step)
            rows.append(_row(tool, drives[0] if drives else None, tool.name == plan.tool, planned, path.length))
        rows.sort(key=lambda row: (not row.reaches, row.tissue_mm or 0.0, -(row.least_clearance_mm or 0.0)))
        return ToolTable(new_point_id(), plan.id, plan.revision, tuple(rows))

    def _settings(self, plan: Plan) -> ControlSettings:
        return settings_in_case(plan.settings, self._cases.get(plan.case_id).uncertainty)

    def _submit(self, work: Callable[[Progress], str], kind: JobKind, plan: Plan, ends: Sequence[Position]) -> Job:
        lane = f"dry_run {plan.case_id}"  # one drive of a case at a time
        same = f"{kind} {plan.id} {plan.revision} {tuple(ends)}"
        return self._jobs.submit(work, kind=kind, lane=lane, case_id=plan.case_id, subject=plan.name, same=same)

    def _around(self, plan: Plan, places: Sequence[Position], tell: ProgressCallback) -> SearchSpace:
        """Bone, soft tissue and structures to spare around places."""
        preparation.wait(lambda: tell("Preparing the engine", 0.0))
        case = self._cases.get(plan.case_id)

        def measuring(stage: str, share: float) -> None:
            tell(stage, _FIELDS_SHARE * share)

        fields, zones = self._fields.around(case, np.array(places), measuring), self._planning.zones(plan)
        bone = self._planning.bone(plan)
        tissue = None if fields.tissue is None else opened_field(fields.tissue, bone.regions)
        room = Room(opened_field(fields.bone, bone.regions), tissue)
        ways = None if tissue is None else Ways(tissue, self._fields.air(case), places[0])
        return SearchSpace(bone.tree, room, zones.zones, zones.soft_zones, case.structure_names(), ways)


def draft(case: Case, content: PlanContent, name: str = "") -> Plan:
    """A plan of a case that is not stored."""
    now = utc_now()
    return Plan(
        id="", name=name, case_id=case.id, case_hash=case.content_hash, **vars(content), created=now, modified=now
    )  # fmt: skip


def entry_and_target(
    plan: Plan, entry: Sequence[float] | None, target: Sequence[float] | None
) -> tuple[Position, Position]:
    """Both ends of a path to look for, by default the first path point and the first target. Raises PlanError."""
    if entry is None and not plan.points:
        raise PlanError("a suggestion needs an entry: click into a nostril, or give 'entry'.")
    if target is None and not plan.targets:
        raise PlanError("a suggestion needs a target: add one to the plan, or give 'target'.")
    first = check_position(plan.points[0].position if entry is None else entry)
    return first, check_position(plan.targets[0].position if target is None else target)


def suggested_points(one: Alternative) -> tuple[PlanPoint, ...]:
    """The points of an alternative as a plan has them, with the shaft's direction and roll."""
    rolls = [None] * len(one.points) if one.rolls is None else [math.degrees(roll) for roll in one.rolls]
    rows = zip(one.points.tolist(), one.directions.tolist(), rolls, strict=True)
    return tuple(
        PlanPoint(new_point_id(), f"P{number}", tuple(place), tuple(direction), roll)
        for number, (place, direction, roll) in enumerate(rows, 1)
    )


def with_alternative(content: PlanContent, one: Alternative) -> PlanContent:
    """The content with the chosen path led along an alternative; its tool stays."""
    return content.with_points(suggested_points(one))


def described(looked: SuggestedPaths) -> list[dict[str, Any]]:
    """The alternatives of what was looked for, for a client: lengths in mm, positions in LPS."""
    pairs = zip(looked.found.alternatives, looked.verdicts, strict=True)
    return [_described(one, verdict, looked) for one, verdict in pairs]


def _described(one: Alternative, verdict: Verdict, looked: SuggestedPaths) -> dict[str, Any]:
    return {
        "verdict": verdict.level,
        "short": verdict.short,
        "words": verdict.words,
        "nearest": verdict.nearest,
        "nearest_clearance_mm": verdict.least_clearance_mm,
        "margin_mm": verdict.margin_mm,
        "short_of_target_mm": float(np.linalg.norm(one.points[-1] - looked.target)),
        "length_mm": one.run.length_mm,
        "least_clearance_mm": one.least_clearance_mm,
        "tightest_mm": one.tightest_mm,
        "tight": verdict.level == "tight",
        "tissue_mm": one.passage.tissue_mm,
        "tissue_depth_mm": one.passage.tissue_depth_mm,
        "sideways_mm": sideways_of(one.piercing),
        "turns": bool(np.ptp(one.directions, axis=0).max() > 1e-6),
        "points": [
            {"position": point.position, "direction": point.direction, "roll_deg": point.roll_deg}
            for point in suggested_points(one)
        ],
    }


def _search_share(tell: ProgressCallback, stage: str, share: float) -> None:
    tell(stage, _JUDGED_SHARE * share)


def _judging_share(tell: ProgressCallback, stage: str, share: float) -> None:
    tell("Judging the ways", _JUDGED_SHARE)


def described_none(none: NoWay | None) -> dict[str, Any] | None:
    """Why there is no path, for a client."""
    if none is None:
        return None
    ends = [float(x) for x in none.ends_at]
    return {"ends_at": ends, "gap_mm": none.gap_mm, "reason": none.reason, "searched": none.searched}


def none_in_words(none: NoWay) -> str:
    """Why there is no path, as text."""
    return (
        f"No way found: {none.reason}. It ends {none.gap_mm:.1f} mm from the target. Looked through: {none.searched}. "
        "Bone that is to be opened, a thinner tool or another entry may make one."
    )


def _row(tool: Tool, one: Alternative | None, chosen: bool, planned: bool, length: float) -> ToolRow:
    if one is None:
        blank = (False, None, length, None, None, None, "it does not fit at the entry")
        return ToolRow(tool.name, tool.title, chosen, planned, *blank)
    done, run, reason = one.run.completed and not one.pierces, one.run, one.run.reason
    if one.pierces and one.run.completed:
        reason = "it pierces skin or a wall between two airs"
    return ToolRow(
        tool.name, tool.title, chosen, planned, done, run.reached_mm, length, one.least_clearance_mm,
        one.passage.tissue_mm, one.passage.tissue_depth_mm, reason, one.pierces,
    )  # fmt: skip


_Value = TypeVar("_Value")


def _kept(cache: Cache[str, _Value], key: str, what: str) -> _Value:
    def missing() -> _Value:
        raise NotFound(f"there is no {what} {key!r:.80}; it may be forgotten: start it again.")

    return cache.get(key, missing)
