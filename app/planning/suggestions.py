"""Suggested paths and tool comparisons: the engine's search in the head of a case, as jobs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any, TypeVar

import numpy as np

from app.cases.service import Case, CaseService
from app.cases.settings import settings_in_case
from app.kit.cache import Cache
from app.kit.errors import NotFound, PlanConflict
from app.kit.jobs import Job, JobKind, Jobs, Progress
from app.kit.values import Position, check_position
from app.planning.distance_fields import DistanceFields
from app.planning.evaluation import Planning
from app.planning.piercing import sideways_of
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.previews import with_points
from app.planning.rehearsal_options import OptionsByPlan
from app.planning.remote_centre import path_of
from app.planning.suggestion_ends import check_ends
from app.planning.tool_tables import ToolRun, ToolTable, tool_table, with_shaft
from app.planning.verdict import Level, Verdict, refused
from app.planning.verdict_figures import VerdictFigure, verdict_figures
from app.plans.document import PLAN
from app.plans.instruments import Instruments, plan_tool, shipped_tools
from app.plans.model import Plan, PlanContent, PlanPoint, new_point_id
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.arrays import Array
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError, StartRefused
from vfix_engine.kernels.threads import threads
from vfix_engine.progress import ProgressCallback
from vfix_engine.proximity.fields.opened_field import opened_field
from vfix_engine.suggestion import (
    RANKINGS,
    Alternative,
    NoWay,
    Room,
    SearchSpace,
    Suggestion,
    best_drives,
    suggest_path,
)
from vfix_engine.worlds.rigid import preparation

REPORTED_GAP_MM = 0.5  # a path that ends farther than this from its target is reported
_KEPT = 16  # cached results
_FIELDS_FRACTION = 0.05  # fraction of a job that computes the distance fields
_EVALUATION_FRACTION = 0.95  # fraction of a job after which the found paths are evaluated
_ORDER: dict[Level, int] = {"fits": 0, "tight": 1, "unknown": 2}  # levels that are suggested, the best first


@dataclass(frozen=True, eq=False)
class SuggestedPaths:
    """Paths found from an entry to a target, both in LPS mm.

    tool: name of the tool. tool_shape: its shape if it is not as shipped. kept_mm: the clearance kept from bone, which
    is the margin plus the error of the surface from thinning. verdicts: the verdict on the plan along each alternative,
    figures: the figures of each. revision: the plan's that was searched in.
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
    figures: tuple[tuple[VerdictFigure, ...], ...] = ()
    revision: int = 0

    def points_of(self, plan_id: str, alternative: int) -> tuple[PlanPoint, ...]:
        """Return the points of an alternative (index from 0).

        Raises PlanError for another plan, and NotFound if there is no such alternative.
        """
        if self.plan_id != plan_id:
            raise PlanError("that suggestion was made for another plan; look for a path anew.")
        if alternative >= len(self.found.alternatives):
            raise NotFound(f"this suggestion has {len(self.found.alternatives)} alternatives.")
        return suggested_points(self.found.alternatives[alternative])

    def check_tool(self, plan: Plan) -> None:
        """Raise PlanConflict if the plan has another tool or shape now, which may not fit along these paths."""
        if self.tool != plan_tool(plan.content).name:
            raise PlanConflict(
                f"that suggestion was made for {self.tool!r}, not {plan.content.tool!r}; "
                "look for a path anew, or choose that tool again."
            )
        if dict(self.tool_shape) != dict(plan.content.tool_shape):
            raise PlanConflict("that suggestion was made for another shape of the tool; look for a path anew.")


class Suggestions:
    """Searches paths and compares tools. Thread-safe."""

    def __init__(
        self,
        jobs: Jobs,
        cases: CaseService,
        instruments: Instruments,
        distance_fields: DistanceFields,
        planning: Planning,
        options: OptionsByPlan,
    ) -> None:
        self._jobs, self._cases, self._instruments = jobs, cases, instruments
        self._distance_fields, self._planning, self._options = distance_fields, planning, options
        self._paths: Cache[str, SuggestedPaths] = Cache(_KEPT)
        self._tables: Cache[str, ToolTable] = Cache(_KEPT)

    def start(self, plan: Plan, entry: Sequence[float] | None = None, target: Sequence[float] | None = None) -> Job:
        """Search paths for a plan's tool as a job named after its target; its result is an id for `paths`.

        entry: LPS mm, by default the first path point. target: LPS mm, by default the first target.
        Raises PlanError without them, and as `check_ends`.
        """
        ends = entry_and_target(plan, entry, target)
        check_ends(self._cases.get(plan.case_id), *ends)

        def work(progress: Progress) -> str:
            answer = self.look(plan, *ends, progress)
            return self._paths.get(answer.id, lambda: answer).id

        return self._submit(work, "suggestion", plan, ends)

    def start_tools(self, plan: Plan) -> Job:
        """Drive every shipped tool along a plan's path as a job; its result is an id for `table`."""
        path_of(plan)

        def work(progress: Progress) -> str:
            answer = self.tools(plan, progress)
            return self._tables.get(answer.id, lambda: answer).id

        return self._submit(work, "tools", plan, ())

    def paths(self, suggestion_id: str) -> SuggestedPaths:
        """Return the result of a search job. Raises NotFound if it is no longer cached."""
        return _kept(self._paths, suggestion_id, "suggestion")

    def table(self, table_id: str) -> ToolTable:
        """Return the result of a tool comparison job. Raises NotFound if it is no longer cached."""
        return _kept(self._tables, table_id, "table of tools")

    def look(self, plan: Plan, entry: Position, target: Position, progress: ProgressCallback) -> SuggestedPaths:
        """Search paths from an entry to a target with the tool, robot, settings and protected structures of a plan.

        Each path is evaluated as a plan along it. Paths that are blocked or pierce a wall are dropped; of the others
        those that fit come first, otherwise in the order of the search.
        Raises InputError if entry or target cannot be used, before the search if possible.
        """
        case = self._cases.get(plan.case_id)
        check_ends(case, entry, target)
        around, settings = self._around(plan, [entry, target], progress), self._settings(plan)
        robot, tool = self._instruments.robot(plan.content.robot), plan_tool(plan.content)
        with threads(1) as beside:  # the verdicts need the fields about the path: they are measured during the search

            def routed(points: Array) -> None:
                places = [*points.tolist(), *(one.position for one in plan.content.targets)]
                beside.submit(lambda: self._distance_fields.around(case, places).tissue)

            telling = partial(_search_progress, progress)
            found = suggest_path(around, robot, tool, entry, target, settings, telling, routed)
        found, verdicts, figures = self._evaluated(plan, found, target, progress)
        return SuggestedPaths(
            new_point_id(),
            plan.id,
            entry,
            target,
            tool.name,
            settings.kept_mm,
            found,
            plan.content.tool_shape,
            verdicts,
            figures,
            plan.revision,
        )

    def _evaluated(
        self, plan: Plan, found: Suggestion, target: Position, progress: ProgressCallback
    ) -> tuple[Suggestion, tuple[Verdict, ...], tuple[tuple[VerdictFigure, ...], ...]]:
        """Return the alternatives that are neither blocked nor pierce a wall, the best first.

        With each come its verdict and the figures of that.
        """
        evaluated = [(one, *self._judged(plan, one, progress)) for one in found.alternatives]
        passing = [one for one in evaluated if one[1].level in _ORDER]
        passing.sort(key=lambda one: _ORDER[one[1].level])
        if evaluated and not passing:
            one, verdict, _ = evaluated[0]
            end = one.run.tip[-1]
            gap = float(np.linalg.norm(end - target))
            reason = f"every way that was found is blocked. {verdict.words}".rstrip(".")
            short = "every way is blocked"
            return Suggestion((), NoWay(end, gap, reason, short, f"{len(evaluated)} ways")), (), ()
        alternatives, verdicts, figures = zip(*passing, strict=True) if passing else ((), (), ())
        return Suggestion(alternatives, found.none), verdicts, figures

    def _judged(
        self, plan: Plan, one: Alternative, progress: ProgressCallback
    ) -> tuple[Verdict, tuple[VerdictFigure, ...]]:
        """Return the verdict on the plan along an alternative, and its figures."""
        led = with_points(plan, suggested_points(one))
        evaluation = self._evaluation(plan, led, partial(_evaluation_progress, progress))
        if isinstance(evaluation, StartRefused):
            return refused(evaluation).with_remarks(led, self._planning.midplane(led)), ()
        return evaluation.verdict, verdict_figures(evaluation)

    def _evaluation(self, plan: Plan, led: Plan, progress: ProgressCallback) -> PlanEvaluation | StartRefused:
        """Return the evaluation of a plan that is led otherwise, with the rehearsal options of the plan."""
        try:
            return self._planning.evaluate(led, progress, self._options.of(plan.id).in_force.along(led))
        except StartRefused as error:
            return error

    def tools(self, plan: Plan, progress: ProgressCallback) -> ToolTable:
        """Simulate every shipped tool along the path of a plan.

        The plan's own tool is evaluated as the plan is, each other one with the best directions of the shaft found.
        """
        places = np.array([point.position for point in plan.content.points])
        path = path_of(plan)
        around, settings = self._around(plan, places.tolist(), progress), self._settings(plan)
        robot, runs = self._instruments.robot(plan.content.robot), list[ToolRun]()
        every = [plan_tool(plan.content) if tool.name == plan.content.tool else tool for tool in shipped_tools()]
        for number, tool in enumerate(every):
            fraction = _FIELDS_FRACTION + (1.0 - _FIELDS_FRACTION) * number / len(every)

            def step(stage: str, _: float, at: float = fraction, title: str = tool.title) -> None:
                progress(f"Driving {title}", at)

            led: Plan | None = plan
            if tool.name != plan.content.tool:
                drives = best_drives(around, robot, tool, places, settings, RANKINGS[:1], 1, step)
                led = with_shaft(plan, tool.name, suggested_points(drives[0])) if drives else None
            runs.append(ToolRun(tool, led, None if led is None else self._evaluation(plan, led, step)))
        return tool_table(plan, runs, path.length)

    def _settings(self, plan: Plan) -> ControlSettings:
        return settings_in_case(plan.content.settings, self._cases.get(plan.case_id).uncertainty)

    def _submit(self, work: Callable[[Progress], str], kind: JobKind, plan: Plan, ends: Sequence[Position]) -> Job:
        lane = f"search {plan.case_id}"  # one search in a head at a time, and none before the verdict on a path
        same = f"{kind} {plan.id} {plan.revision} {tuple(ends)}"
        searched = (one.label for one in plan.content.targets if ends and one.position == ends[-1])
        subject = next(searched, plan.name)
        return self._jobs.submit(
            work, kind=kind, lane=lane, case_id=plan.case_id, subject=subject, document_id=plan.id, same=same
        )

    def _around(self, plan: Plan, places: Sequence[Position], progress: ProgressCallback) -> SearchSpace:
        """Return bone, soft tissue and protected structures around places."""
        preparation.wait(lambda: progress("Preparing the engine", preparation.progress()))
        case = self._cases.get(plan.case_id)

        def measuring(stage: str, fraction: float) -> None:
            progress(stage, _FIELDS_FRACTION * fraction)

        to_bone, to_tissue = self._distance_fields.around(case, np.array(places), measuring).both()
        zones, bone = self._planning.zones(plan), self._planning.bone(plan)
        tissue = None if to_tissue is None else opened_field(to_tissue, bone.regions)
        room = Room(opened_field(to_bone, bone.regions), tissue)
        ways = None if tissue is None else Ways(tissue, self._distance_fields.air(case), places[0])
        return SearchSpace(bone.tree, room, zones.zones, zones.soft_zones, case.structure_names(), ways)


def draft(case: Case, content: PlanContent, name: str = "") -> Plan:
    """Return a plan of a case that is not stored."""
    return PLAN.draft(case.id, case.content_hash, name, content)


def entry_and_target(
    plan: Plan, entry: Sequence[float] | None, target: Sequence[float] | None
) -> tuple[Position, Position]:
    """Return both ends of a path search, by default the first path point and the first target.

    Raises PlanError if an end is missing.
    """
    if entry is None and not plan.content.points:
        raise PlanError("a suggestion needs an entry: click into a nostril, or give 'entry'.")
    if target is None and not plan.content.targets:
        raise PlanError("a suggestion needs a target: add one to the plan, or give 'target'.")
    first = check_position(plan.content.points[0].position if entry is None else entry)
    return first, check_position(plan.content.targets[0].position if target is None else target)


def suggested_points(one: Alternative) -> tuple[PlanPoint, ...]:
    """Return the points of an alternative as path points, with the shaft's direction and roll."""
    rolls = [None] * len(one.points) if one.rolls is None else [math.degrees(roll) for roll in one.rolls]
    rows = zip(one.points.tolist(), one.directions.tolist(), rolls, strict=True)
    return tuple(
        PlanPoint(new_point_id(), f"P{number}", tuple(place), tuple(direction), roll)
        for number, (place, direction, roll) in enumerate(rows, 1)
    )


def with_alternative(content: PlanContent, one: Alternative) -> PlanContent:
    """Return the content with the chosen path replaced by an alternative; the tool stays."""
    return content.with_points(suggested_points(one))


def described(looked: SuggestedPaths) -> list[dict[str, Any]]:
    """Return the alternatives as JSON values: lengths in mm, positions in LPS."""
    every = zip(looked.found.alternatives, looked.verdicts, looked.figures, strict=True)
    return [_described(one, verdict, figures, looked) for one, verdict, figures in every]


def _described(
    one: Alternative, verdict: Verdict, figures: Sequence[VerdictFigure], looked: SuggestedPaths
) -> dict[str, Any]:
    return {
        "figures": [asdict(figure) for figure in figures],
        "verdict": verdict.level,
        "word": verdict.word,
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


def _search_progress(progress: ProgressCallback, stage: str, fraction: float) -> None:
    progress(stage, _FIELDS_FRACTION + (_EVALUATION_FRACTION - _FIELDS_FRACTION) * fraction)


def _evaluation_progress(progress: ProgressCallback, stage: str, fraction: float) -> None:
    progress("Judging the ways", _EVALUATION_FRACTION)


def described_none(none: NoWay | None) -> dict[str, Any] | None:
    """Return why there is no path as JSON values."""
    if none is None:
        return None
    ends = [float(x) for x in none.ends_at]
    told = {"reason": none.reason, "short": none.short, "searched": none.searched}
    return {"ends_at": ends, "gap_mm": none.gap_mm, **told}


def none_in_words(none: NoWay) -> str:
    """Return why there is no path as text."""
    return (
        f"No way found: {none.reason}. It ends {none.gap_mm:.1f} mm from the target. Looked through: {none.searched}. "
        "Bone that is to be opened, a thinner tool or another entry may make one."
    )


_Value = TypeVar("_Value")


def _kept(cache: Cache[str, _Value], key: str, what: str) -> _Value:
    def missing() -> _Value:
        raise NotFound(f"there is no {what} {key!r:.80}; it may be forgotten: start it again.")

    return cache.get(key, missing)
