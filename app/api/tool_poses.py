"""Where the tool lies along a plan's path, as the dry run drives it."""

from fastapi import APIRouter
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.cases.settings import settings_in_case
from app.kit.errors import NotFound
from app.plans.instruments import plan_tool

router = APIRouter(tags=["plans"], responses=ERRORS)

Triple = tuple[float, float, float]


class ToolPosesPublic(BaseModel):
    """Poses of the tool, every 0.5 mm of the path that was driven and the last; lengths in mm, positions in LPS.

    s_mm (n): arc length where the tip is. segments (n, parts): start and end of the axis of each part, from the tip on.
    radii_mm (parts): of these parts. margin_mm: the distance from the bone's surface that is kept, the plan's margin
    and what the surface may be off.
    """

    s_mm: list[float]
    segments: list[list[tuple[Triple, Triple]]]
    radii_mm: list[float]
    margin_mm: float


@router.get("/plans/{plan_id}/tool-poses")
def tool_poses(plan_id: Identifier, services: ServicesDep) -> ToolPosesPublic:
    """Poses of the tool in the plan's dry run, which must have been made: `POST /api/v1/plans/{plan_id}/evaluation`."""
    plan = services.plans.get(plan_id)
    options = services.rehearsal_options.of(plan_id).in_force
    if not services.planning.is_evaluated(plan, options):
        raise NotFound("this plan is not simulated yet as it is now; ask for its evaluation first.")
    stations = list(services.planning.evaluate(plan, options=options).run.stations())
    return ToolPosesPublic(
        s_mm=[round(s, 3) for s, _, _ in stations],
        segments=[
            [(_rounded(a), _rounded(b)) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]
            for _, starts, ends in stations
        ],
        radii_mm=plan_tool(plan.content).radius.tolist(),
        margin_mm=settings_in_case(plan.content.settings, services.cases.get(plan.case_id).uncertainty).kept_mm,
    )


def _rounded(position: list[float]) -> Triple:
    x, y, z = (round(value, 3) for value in position)
    return (x, y, z)
