"""A stored run as a report takes it: with the names of what was driven, and the wall of its lumen."""

from __future__ import annotations

from app.cases.service import CaseService
from app.drives.stored_run import StoredRun
from app.exchange.run_report.reported import RunToReport
from app.lumen.service import RouteService
from app.plans.service import PlanService
from vfix_engine.runtime.run import Run


def stored_to_report(
    run: Run, stored: StoredRun, cases: CaseService, plans: PlanService, routes: RouteService
) -> RunToReport:
    """run: as it was read. Raises NotFound for a case that is gone."""
    case = None if stored.case_id is None else cases.get(stored.case_id)
    in_lumen = case is not None and case.kind == "lumen"
    titles = () if case is None else routes.documents.titles(case.id, include_deleted=True)
    named = titles if in_lumen else plans.titles(include_deleted=True)
    names = {one.id: one.name for one in named}
    return RunToReport(
        run, stored.id, names.get(stored.plan_id or "", ""), "" if case is None else case.name, stored.recorded,
        stored.comments, routes.tasks.known_wall(stored.case_id) if in_lumen else None,
    )  # fmt: skip
