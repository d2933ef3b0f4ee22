"""What the printable report on a plan says: its verdict, figures and pictures, gathered from the services."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from app.cases.model import Case
from app.cases.service import CaseService
from app.exchange.report.cut import HALF_MM, PLANES, Outlined, Plane, Shown, cut_picture
from app.exchange.report.page import Figure, Picture, ReportPage, TableRow
from app.exchange.report.plot import clearance_plot
from app.kit.values import Position, rounded_up
from app.planning.dry_runs import DryRunJobs
from app.planning.evaluation import Planning
from app.planning.obstacles import Obstacle
from app.planning.path_evaluations import PathEvaluation, PathEvaluations
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.protected_structures import structure_of
from app.planning.rehearsal_options import OptionsByPlan
from app.planning.shape_meshes import shape_surface
from app.planning.verdict_figures import VerdictFigure, verdict_figures
from app.plans.instruments import Instruments, plan_robot, plan_tool
from app.plans.model import Plan
from app.registration.service import Registering
from vfix_engine.errors import StartRefused

BONE = "#8a6d3b"  # colour of bone's outline and curve
_OVERVIEW = next(plane for plane in PLANES if plane.name == "sagittal")  # a path through the nose lies along it
_AROUND = 1.12  # half of a picture of the whole head to half of the head
_MOST_FIGURES, _MOST_ROWS = 8, 10  # so that the page stays one page
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
        plotted = () if evaluation is None else _plotted(plan, evaluation)
        return ReportPage(
            plan=plan.name,
            case=case.name,
            revision=plan.revision,
            modified=plan.modified,
            case_hash=case.content_hash,
            level=chosen.verdict,
            word=chosen.word,
            words=chosen.words,
            instruments=f"{plan_tool(plan.content).title}, {plan_robot(plan.content, self._instruments).title}",
            figures=() if evaluation is None else tuple(_figures(evaluation)),
            pictures=() if evaluation is None else self._pictures(plan, case, evaluation, with_images),
            pictured=""
            if evaluation is None
            else f"Cuts through {_pictured(evaluation)[1]}, {_pictured(evaluation)[0]:.0f} mm along the path",
            plot="" if evaluation is None else clearance_plot(evaluation.profile, plotted, evaluation.length_mm),
            curves=tuple((one.name, colour) for one, colour in plotted),
            has_tissue=evaluation is not None and evaluation.profile.tissue is not None,
            paths=_shortened(
                [_path_row(path, path.path == chosen.path) for path in report.paths if len(report.paths) > 1]
            ),
            targets=_shortened(list(_target_rows(plan, chosen, evaluation))),
            registration=" ".join((registration.words, *registration.doubts)),
            removed=report.removed.words,
            notes=plan.content.notes,
            cautions=case.notes,
        ).html()

    def _pictures(self, plan: Plan, case: Case, evaluation: PlanEvaluation, with_images: bool) -> tuple[Picture, ...]:
        """Three cuts where the path is narrowest, the tool is held, or it pierces tissue, and one of the whole head."""
        run, (s_mm, _, centre) = evaluation.run, _pictured(evaluation)
        row = int(np.abs(run.s - s_mm).argmin())
        bone = self._planning.bone(plan)
        protected = tuple(
            Outlined(shape_surface(self._cases, case.id, zone.shape), zone.drawn_colour)
            for zone in plan.content.zones
            if zone.shape["kind"] != "half_space"
        )
        shown = Shown(
            centre=run.tip[row] if centre is None else np.array(centre),
            surfaces=(Outlined(bone.mesh, BONE), *protected),
            path=evaluation.positions,
            start=run.segments_start[row],
            end=run.segments_end[row],
            radius=evaluation.tool_radius,
            targets=tuple(np.array(target.position) for target in plan.content.targets),
            volume=bone.volume if with_images else None,
        )
        cuts = tuple(Picture(_caption(plane, shown), cut_picture(plane, shown)) for plane in PLANES)
        skull = self._cases.display_meshes(case.id).get("skull", bone.mesh)  # of the shipped head, whose bone is a part
        whole = _whole(shown, (Outlined(skull, BONE), *protected))
        return (*cuts, Picture(f"Whole head, s{_caption(_OVERVIEW, whole)[1:]}", cut_picture(_OVERVIEW, whole)))


def _caption(plane: Plane, shown: Shown) -> str:
    return f"{plane.name.title()}, {_side(shown.centre[plane.through], plane.through)} mm"


def _whole(shown: Shown, surfaces: tuple[Outlined, ...]) -> Shown:
    """The sagittal cut as wide as the head and the path: bone alone, since skin or scan would show a face."""
    places = np.concatenate([surfaces[0].mesh.vertices, shown.path])
    low, high = places.min(axis=0), places.max(axis=0)
    centre = 0.5 * (low + high)
    centre[_OVERVIEW.through] = shown.centre[_OVERVIEW.through]
    across = [_OVERVIEW.right, _OVERVIEW.down[0]]
    half = _AROUND * 0.5 * float((high - low)[across].max())
    return replace(shown, centre=centre, surfaces=surfaces, volume=None, half=max(half, HALF_MM))


def _figures(evaluation: PlanEvaluation) -> Iterator[Figure]:
    """The figures of the verdict, without those of structures beyond the nearest few."""
    figures = verdict_figures(evaluation)
    left_out = set([one for one in figures if one.margin_mm is not None][_MOST_FIGURES:])
    yield from (_figure(figure) for figure in figures if figure not in left_out)
    if left_out:
        yield Figure("Other structures", f"{len(left_out)}", "farther from their margins")


def _pictured(evaluation: PlanEvaluation) -> tuple[float, str, Position | None]:
    """Arc length where the pictures show the tool, what they cut through, and its place where that is not the tip.

    They show what the tool pierces if that decides, else where it is held, or where least is left of a clearance.
    """
    pierced, s_mm = evaluation.verdict.pierced_place, evaluation.verdict.s_mm
    if pierced is not None:
        what = "skin" if evaluation.verdict.reason == "pierced" else "wall"
        return pierced[0], f"the {what} that is pierced", pierced[1]
    if s_mm is not None and evaluation.completed:
        return s_mm, "the tip", None
    stop = evaluation.run.stopped_by
    if stop is None or stop.point is None:
        return evaluation.reached_mm, "the tip", None
    x, y, z = np.asarray(stop.point, dtype=np.float64).tolist()
    return evaluation.reached_mm, "what stops the tool", (x, y, z)


def _figure(figure: VerdictFigure) -> Figure:
    """A figure as the card of the verdict has it, with its margin and place."""
    if figure.value is None:
        value = "?" if figure.level == "unknown" else "✕"
    else:
        whole = "" if figure.whole_mm is None else f" of {figure.whole_mm:.{figure.digits}f}"
        value = f"{'≥ ' if figure.at_least else ''}{figure.value:.{figure.digits}f}{whole} mm"
    margin = "" if figure.margin_mm is None else f"margin {figure.margin_mm:.2f}, "
    where = "" if figure.s_mm is None else f"at {figure.s_mm:.0f} mm"
    return Figure(figure.name[:1].upper() + figure.name[1:], value, f"{margin}{where}".removesuffix(", "), figure.level)


def _plotted(plan: Plan, evaluation: PlanEvaluation) -> tuple[tuple[Obstacle, str], ...]:
    """The obstacles that leave least above their margins, bone among them in any case, with their colours as CSS."""
    bone, *structures = evaluation.verdict.obstacles
    nearest = sorted(structures, key=lambda one: one.left_mm)[: _MOST_FIGURES - 1]
    return ((bone, BONE), *((one, structure_of(one.zones[0], plan.content.zones).drawn_colour) for one in nearest))


def _path_row(path: PathEvaluation, chosen: bool) -> TableRow:
    least = "–" if path.least_clearance_mm is None else f"{path.least_clearance_mm:.2f} mm to {path.nearest}"
    length = "–" if path.length_mm is None else f"{path.length_mm:.0f} mm"
    return TableRow((path.name, path.short, least, length), level=path.verdict, strong=chosen)


def _shortened(rows: list[TableRow]) -> tuple[TableRow, ...]:
    """The first rows and the strong ones, and how many more there are."""
    kept = [row for index, row in enumerate(rows) if index < _MOST_ROWS or row.strong]
    if len(kept) == len(rows):
        return tuple(rows)
    return (*kept, TableRow((f"… and {len(rows) - len(kept)} more", *("" for _ in rows[0].cells[1:]))))


def _target_rows(plan: Plan, chosen: PathEvaluation, evaluation: PlanEvaluation | None) -> Iterator[TableRow]:
    cones = {target.target: target.cone_deg for target in chosen.targets}
    registered = None if evaluation is None else evaluation.registered
    off = None
    if registered is not None and plan.content.targets:
        off = registered.off_mm(np.array([target.position for target in plan.content.targets]))
    for index, target in enumerate(plan.content.targets):
        place = " ".join(_side(value, axis) for axis, value in enumerate(target.position))
        error = "–" if off is None else f"{rounded_up(off[index]):.2f} mm"
        cone = "–" if target.id not in cones else f"{cones[target.id]:.0f}° cone" if cones[target.id] else "not seen"
        yield TableRow((target.label, place, cone, error))


def _side(value: float, axis: int) -> str:
    """One LPS coordinate by the side of the patient: 'R 24.5'."""
    rounded = round(float(value), 1)
    return f"{_SIDES[axis][rounded < 0.0]} {abs(rounded):.1f}"
