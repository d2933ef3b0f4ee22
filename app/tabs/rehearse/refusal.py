"""Refusal of a rehearsal with a remote centre or soft tissue whose dry run does not reach the end."""

from __future__ import annotations

from dataclasses import replace

from app.kit.errors import JobCancelled
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.rehearsal_options import RehearsalOptions
from app.plans.instruments import shipped_tools
from app.plans.service import Plan
from app.services import Services
from vfix_engine.errors import PlanError, VfixError

NO_LESS_MM = 1.0  # an option that costs less of the path than this does not stop the tool


def refuse_where_centre_stops(services: Services, plan: Plan, options: RehearsalOptions, found: PlanEvaluation) -> None:
    """Raise PlanError where the tool gets further without the remote centre.

    found: the dry run of the plan with these options.
    """
    if not options.remote_centre or found.completed:
        return
    without = _farther(services, plan, replace(options, remote_centre=False), found)
    if without is None:
        return
    raise PlanError(
        f"with {found.standing.words} the tool gets {found.reached_mm:.0f} of {found.length_mm:.0f} mm: "
        f"{found.reason}. Without the remote centre it gets {_to(without)}. {_remedy(services, plan, options, found)}"
    )


def _farther(services: Services, plan: Plan, options: RehearsalOptions, found: PlanEvaluation) -> PlanEvaluation | None:
    """The dry run with fewer options if it gets further than the one that was found, else None."""
    try:
        without = services.dry_runs.evaluate(plan, options, through=found.registered)
    except JobCancelled:
        raise
    except VfixError:
        return None
    return without if without.reached_mm >= found.reached_mm + NO_LESS_MM else None


def refuse_where_tissue_stops(services: Services, plan: Plan, options: RehearsalOptions, found: PlanEvaluation) -> None:
    """Raise PlanError where the tool gets further without the soft tissue's greatest depth.

    found: the dry run of the plan with these options.
    """
    if not options.soft_tissue or found.completed:
        return
    without = _farther(services, plan, replace(options, soft_tissue=False), found)
    if without is None:
        return
    deepest = without.verdict.tissue_depth_mm
    deep = "" if deepest is None else f", {deepest:.1f} mm deep in it"
    raise PlanError(
        f"with {found.standing.words} the tool gets {found.reached_mm:.0f} of {found.length_mm:.0f} mm: "
        f"{found.reason}. Without the soft tissue it gets {_to(without)}{deep}. Choose another tool or other "
        "directions of the shaft in Plan, or switch the soft tissue off."
    )


def _to(found: PlanEvaluation) -> str:
    return "to the end" if found.completed else f"to {found.reached_mm:.0f} mm"


def _remedy(services: Services, plan: Plan, options: RehearsalOptions, found: PlanEvaluation) -> str:
    """The first other tool that reaches the end with the same options, and other remedies."""
    for tool in shipped_tools():
        if tool.name == plan.content.tool:
            continue
        other = replace(plan, content=plan.content.with_tool(tool.name))
        try:
            if services.dry_runs.evaluate(other, options, through=found.registered).completed:
                return f"The tool ‘{tool.title}’ gets to the end: choose it in Plan, or another place for the centre."
        except JobCancelled:
            raise
        except VfixError:
            continue  # this one does not fit at the entry
    return "No other tool that comes along gets to the end either: choose another place for the centre."
