"""Evaluations of the paths of a plan before any motion: verdict, soft tissue, and inspection cones of the targets."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from app.planning.dry_runs import DryRunJobs
from app.planning.evaluation import Planning
from app.planning.piercing import NOT_KNOWN, PiercedReport
from app.planning.rehearsal_options import OptionsByPlan, RehearsalOptions
from app.planning.removed_volumes import RemovedVolumes, RemovedVolumeService
from app.planning.soft_depths import SoftDepth
from app.planning.verdict import Level, Reason, TissueLevel, Verdict, refused
from app.plans.model import NOTICE, Plan
from vfix_engine.errors import PlanError, StartRefused

if TYPE_CHECKING:
    from app.planning.plan_evaluation import PlanEvaluation


@dataclass(frozen=True)
class TargetReport:
    """A target, and the full opening angle in degrees of the circular cone from which it can be inspected."""

    target: str
    label: str
    cone_deg: float


@dataclass(frozen=True)
class PathEvaluation:
    """The verdict on one path; lengths in mm. Unknown values are None.

    verdict, reason: the level and what decided it. word: of the level; short: both in a few words, words: the full
    verdict; each starts with the one before.
    nearest: bone or the protected structure with the least clearance above its margin. least_clearance_mm: from the
    whole tool to it. margin_mm: its margin. part: the nearest part of the tool. s_mm: arc length of the tip there.
    tissue_mm: largest length of the tool in soft tissue; nostril_mm: the part of it within 20 mm of the entry.
    tissue_depth_mm: greatest depth; tissue_s_mm: arc length of the tip there. None without a CT.
    side_caution: a sentence if the entry lies on the other side than the path states, also at the end of words.
    pierced: whether the tool goes through skin or a wall, and how far sideways air leads around the tissue.
    soft_structures: the soft protected structures that the tool touches, the deepest first.
    """

    path: str
    name: str
    verdict: Level
    reason: Reason
    word: str
    short: str
    words: str
    least_clearance_mm: float | None = None
    margin_mm: float | None = None
    nearest: str | None = None
    part: str | None = None
    s_mm: float | None = None
    tissue_level: TissueLevel = "unknown"
    tissue_mm: float | None = None
    nostril_mm: float | None = None
    tissue_depth_mm: float | None = None
    tissue_s_mm: float | None = None
    soft_structures: tuple[SoftDepth, ...] = ()
    pierced: PiercedReport = field(default_factory=lambda: PiercedReport.of(NOT_KNOWN))
    side_caution: str = ""
    completed: bool = False
    reached_mm: float = 0.0
    length_mm: float | None = None
    targets: tuple[TargetReport, ...] = ()


@dataclass(frozen=True)
class PlanReport:
    """The evaluation of a plan's chosen path, and of each of its paths with at least two points.

    removed: volumes of the bone that the plan removes first, for all of its paths.
    """

    plan: str
    name: str
    case: str
    chosen: PathEvaluation
    paths: tuple[PathEvaluation, ...]
    notice: str = NOTICE
    removed: RemovedVolumes = field(default_factory=RemovedVolumes)


class PathEvaluations:
    """Evaluates paths of plans, stored or not, as they would be driven now. Thread-safe."""

    def __init__(
        self, planning: Planning, dry_runs: DryRunJobs, removed: RemovedVolumeService, options: OptionsByPlan
    ) -> None:
        self._planning, self._dry_runs, self._removed, self._options = planning, dry_runs, removed, options

    def of_plan(self, plan: Plan, path: str | None = None) -> PlanReport:
        """Return the evaluation of a plan.

        path: id or name of the only path to evaluate; if None, the chosen path and all others are evaluated.
        Raises PlanError if there is no such path or it has fewer than two points.
        """
        chosen = plan if path is None else replace(plan, content=plan.content.along(path))
        if len(chosen.content.points) < 2:
            raise PlanError(
                f"the path {chosen.content.path.name!r:.80} has fewer than two points; there is nothing to evaluate."
            )
        options = self._options.of(plan.id).in_force
        own = self._of_path(
            chosen, options if chosen.content.path_id == plan.content.path_id else options.along(chosen)
        )
        removed = self._removed.of_plan(plan)
        if path is not None:
            return PlanReport(plan.id, plan.name, plan.case_id, own, (own,), removed=removed)
        content = plan.content
        others = {
            one.id: replace(plan, content=content.along(one.id))
            for one in content.paths
            if len(one.points) > 1 and one.id != content.path_id
        }
        reports = (own if one.id == content.path_id else self._of_path(others[one.id], options.along(others[one.id]))
                   for one in content.paths if one.id == content.path_id or one.id in others)  # fmt: skip
        return PlanReport(plan.id, plan.name, plan.case_id, own, tuple(reports), removed=removed)

    def _of_path(self, plan: Plan, options: RehearsalOptions) -> PathEvaluation:
        try:
            evaluation = self._dry_runs.evaluate(plan, options)
        except StartRefused as error:
            return _report(plan, refused(error).with_remarks(plan, self._planning.midplane(plan)), None, ())
        cones = self._planning.cones(plan, options, evaluation.registered)
        targets = tuple(TargetReport(t.id, t.label, round(cones[t.id].cone_deg, 1)) for t in plan.content.targets)
        return _report(plan, evaluation.verdict, evaluation, targets)


def _report(
    plan: Plan, verdict: Verdict, evaluation: PlanEvaluation | None, targets: tuple[TargetReport, ...]
) -> PathEvaluation:
    """Build the evaluation of a path. evaluation: None if the tool does not fit at the entry."""
    return PathEvaluation(
        path=plan.content.path_id,
        name=plan.content.path.name,
        verdict=verdict.level,
        reason=verdict.reason,
        word=verdict.word,
        short=verdict.short,
        words=verdict.words,
        least_clearance_mm=verdict.least_clearance_mm,
        margin_mm=verdict.margin_mm,
        nearest=verdict.nearest or None,
        part=verdict.part or None,
        s_mm=verdict.s_mm,
        tissue_level=verdict.tissue_level,
        tissue_mm=verdict.tissue_mm,
        nostril_mm=verdict.nostril_mm,
        tissue_depth_mm=verdict.tissue_depth_mm,
        tissue_s_mm=verdict.tissue_s_mm,
        soft_structures=verdict.soft,
        pierced=PiercedReport.of(verdict.pierced),
        side_caution=verdict.side_caution,
        completed=evaluation is not None and evaluation.completed,
        reached_mm=0.0 if evaluation is None else evaluation.reached_mm,
        length_mm=None if evaluation is None else evaluation.length_mm,
        targets=targets,
    )
