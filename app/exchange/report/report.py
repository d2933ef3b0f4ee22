"""What the printable report on a plan says: its verdict, figures and pictures, gathered from the services."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from app.cases.model import Case
from app.cases.service import CaseService
from app.exchange.report.cut import PLANES, Outlined, Shown, cut_picture
from app.exchange.report.page import Figure, Picture, ReportPage, TableRow
from app.exchange.report.plot import clearance_plot
from app.planning.dry_runs import DryRunJobs
from app.planning.evaluation import Planning
from app.planning.path_evaluations import PathEvaluation, PathEvaluations
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.rehearsal_options import OptionsByPlan
from app.planning.shape_meshes import shape_surface
from app.planning.verdict_figures import VerdictFigure, verdict_figures
from app.plans.instruments import Instruments, plan_robot, plan_tool
from app.plans.model import Plan
from app.registration.service import Registering
from vfix_engine.errors import StartRefused

BONE = "#8a6d3b"  # colour of bone's outline and curve
_SIDES = ("LR", "PA", "SI")  # letters of the positive and of the negative side of each LPS axis


class PlanReports:
    """Printable reports on plans; may be used from any thread."""

    def __init__(
        self,
        cases: CaseService,
        instruments: Instruments,
        planning: Planning,
        dry_runs: DryRunJobs,
        evaluations: PathEvaluations,
        options: OptionsByPlan,
        registering: Registering,
    ) -> None:
        self._cases, self._instruments, self._planning, self._dry_runs = cases, instruments, planning, dry_runs
        self._evaluations, self._options, self._registering = evaluations, options, registering

    def html(self, plan: Plan, *, with_images: bool) -> str:
        """The report as a page of HTML without references to other files; takes seconds the first time.

        with_images: the cuts show the scan, which can identify the patient, behind the outlines.
        Raises PlanError for a path of fewer than two points.
        """
        case, report = self._cases.get(plan.case_id), self._evaluations.of_plan(plan)
        try:
            evaluation = self._dry_runs.evaluate(plan, self._options.of(plan.id).in_force)
        except StartRefused:
            evaluation = None
        chosen, registration = report.chosen, self._registering.registration_of(plan)
        return ReportPage(
            plan=plan.name,
            case=case.name,
            revision=plan.revision,
            modified=plan.modified,
            case_hash=case.content_hash,
            level=chosen.verdict,
            word=chosen.word,
            words=chosen.words,
            figures=tuple(self._figures(plan, evaluation)),
            pictures=() if evaluation is None else self._pictures(plan, case, evaluation, with_images),
            plot="" if evaluation is None else _plot(plan, evaluation),
            curves=()
            if evaluation is None
            else tuple(zip(_names(evaluation), _colours(plan, evaluation), strict=True)),
            paths=tuple(_path_row(path, path.path == chosen.path) for path in report.paths),
            targets=tuple(_target_rows(plan, chosen, evaluation)),
            registration=registration.words,
            removed=report.removed.words,
            notes=plan.content.notes,
            cautions=case.notes,
        ).html()

    def _figures(self, plan: Plan, evaluation: PlanEvaluation | None) -> Iterator[Figure]:
        for figure in () if evaluation is None else verdict_figures(evaluation):
            yield _figure(figure)
        yield Figure("Tool", plan_tool(plan.content).title, plan_robot(plan.content, self._instruments).title)

    def _pictures(self, plan: Plan, case: Case, evaluation: PlanEvaluation, with_images: bool) -> tuple[Picture, ...]:
        """Three cuts through the tip where the path is narrowest, or where the tool is held."""
        run = evaluation.run
        s_mm = evaluation.reached_mm if evaluation.verdict.s_mm is None else evaluation.verdict.s_mm
        row = len(run.s) - 1 if not evaluation.completed else int(np.abs(run.s - s_mm).argmin())
        bone = self._planning.bone(plan)
        protected = (
            Outlined(shape_surface(self._cases, case.id, zone.shape), zone.colour)
            for zone in plan.content.zones
            if zone.shape["kind"] != "half_space"
        )
        shown = Shown(
            centre=run.tip[row],
            surfaces=(Outlined(bone.mesh, BONE), *protected),
            path=evaluation.positions,
            start=run.segments_start[row],
            end=run.segments_end[row],
            radius=evaluation.tool_radius,
            targets=tuple(np.array(target.position) for target in plan.content.targets),
            volume=bone.volume if with_images else None,
        )
        where = f"tip at {run.s[row]:.0f} mm"
        return tuple(
            Picture(f"{plane.name.title()} {_side(shown.centre[plane.through], plane.through)} mm, {where}",
                    cut_picture(plane, shown))
            for plane in PLANES
        )  # fmt: skip


def _figure(figure: VerdictFigure) -> Figure:
    """A figure as the card of the verdict has it, with its margin and place."""
    if figure.value is None:
        value = "?" if figure.level == "unknown" else "✕"
    else:
        whole = "" if figure.whole_mm is None else f" of {figure.whole_mm:.{figure.digits}f}"
        value = f"{figure.value:.{figure.digits}f}{whole} mm"
    margin = "" if figure.margin_mm is None else f"margin {figure.margin_mm:.2f}, "
    where = "" if figure.s_mm is None else f"at {figure.s_mm:.0f} mm"
    return Figure(figure.name[:1].upper() + figure.name[1:], value, f"{margin}{where}".removesuffix(", "), figure.level)


def _plot(plan: Plan, evaluation: PlanEvaluation) -> str:
    verdict = evaluation.verdict
    return clearance_plot(evaluation.profile, verdict.obstacles, _colours(plan, evaluation), evaluation.length_mm)


def _names(evaluation: PlanEvaluation) -> tuple[str, ...]:
    return tuple(one.name for one in evaluation.verdict.obstacles)


def _colours(plan: Plan, evaluation: PlanEvaluation) -> tuple[str, ...]:
    """The colour of each obstacle: of a protected structure its own."""
    own = {zone.name: zone.colour for zone in plan.content.zones}
    return tuple(own.get(name, BONE) for name in _names(evaluation))


def _path_row(path: PathEvaluation, chosen: bool) -> TableRow:
    least = "–" if path.least_clearance_mm is None else f"{path.least_clearance_mm:.2f} mm to {path.nearest}"
    length = "–" if path.length_mm is None else f"{path.length_mm:.0f} mm"
    return TableRow((path.name, path.short, least, length), level=path.verdict, strong=chosen)


def _target_rows(plan: Plan, chosen: PathEvaluation, evaluation: PlanEvaluation | None) -> Iterator[TableRow]:
    cones = {target.target: target.cone_deg for target in chosen.targets}
    registered = None if evaluation is None else evaluation.registered
    off = None
    if registered is not None and plan.content.targets:
        off = registered.off_mm(np.array([target.position for target in plan.content.targets]))
    for index, target in enumerate(plan.content.targets):
        place = " ".join(_side(value, axis) for axis, value in enumerate(target.position))
        error = "–" if off is None else f"{off[index]:.2f} mm"
        cone = f"{cones[target.id]:.0f}°" if target.id in cones else "–"
        yield TableRow((target.label, place, cone, error))


def _side(value: float, axis: int) -> str:
    """One LPS coordinate by the side of the patient: 'R 24.5'."""
    rounded = round(float(value), 1)
    return f"{_SIDES[axis][rounded < 0.0]} {abs(rounded):.1f}"
