"""Suggested paths and tables of tools of a plan: jobs, what they found, and the use of an alternative."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Response
from pydantic import BaseModel, Field

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, RequestBody, ServicesDep
from app.api.jobs import JobPublic
from app.api.plan_models import Revision
from app.planning.suggestions import described, described_none
from app.planning.tool_tables import ToolRow
from app.planning.verdict import Level
from app.planning.verdict_figures import VerdictFigure
from app.plans.model import NOTICE
from app.plans.operations.points import SetPoints
from app.plans.public import PlanPublic
from vfix_engine.robots import Tool

router = APIRouter(tags=["suggestions"], responses=ERRORS)

Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]
Place = tuple[Number, Number, Number]
Length = Annotated[float | None, Field(description="mm; null where it is not known")]


class SuggestionRequest(RequestBody):
    """Ends of the path in LPS mm; by default the plan's first path point and its first target."""

    entry: Place | None = None
    target: Place | None = None


class SuggestedPoint(BaseModel):
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    roll_deg: float | None


class AlternativePublic(BaseModel):
    """A path with directions of the shaft, and how the tool was driven along it; lengths in mm.

    verdict: the level that the plan has when it is led along it, word: of it, short: in a few words, words: the whole,
    figures: those of the verdict, the one that decides first.
    nearest: bone or the protected structure that leaves least above its margin, margin_mm; nearest_clearance_mm: to it.
    least_clearance_mm: to bone. short_of_target_mm: from the path's end to the target. tight: the verdict is;
    turns: the shaft's direction changes along the path.
    sideways_mm: how far sideways air leads round the tissue that the tool passes; ways that pierce tissue are never
    among the alternatives.
    """

    verdict: Level
    word: str
    short: str
    words: str
    figures: list[VerdictFigure]
    nearest: str
    nearest_clearance_mm: Length
    margin_mm: Length
    short_of_target_mm: float
    length_mm: float
    least_clearance_mm: float
    tightest_mm: float
    tight: bool
    tissue_mm: Length
    tissue_depth_mm: Length
    sideways_mm: Length
    turns: bool
    points: list[SuggestedPoint]


class NonePublic(BaseModel):
    """Why there is no path: where the widest way ends, how far that is from the target, and what was searched.

    short: the reason in at most nine words.
    """

    ends_at: tuple[float, float, float]
    gap_mm: float
    reason: str
    short: str
    searched: str


class SuggestionPublic(BaseModel):
    """Alternatives, the best one first, or why there are none.

    kept_mm: from bone: the margin, and what thinning may have moved the case's surface by. revision: the plan's that
    was searched in.
    """

    id: str
    plan_id: str
    revision: int
    entry: tuple[float, float, float]
    target: tuple[float, float, float]
    tool: str
    kept_mm: float
    alternatives: list[AlternativePublic]
    none: NonePublic | None


class ToolPartPublic(BaseModel):
    """A part of a tool in the plane of its bend, mm: ends of its axis, along the shaft and across it; the tip is 0."""

    start: tuple[float, float]
    end: tuple[float, float]
    radius: float


class ToolPublic(BaseModel):
    """How a tool does along the plan's path; lengths in mm, null where it does not fit at the entry or is not known.

    verdict: the level of the plan with this tool, word: of it. stop: what stops it and where, in figures, '' if nothing
    does. parts: its shape, from the tip on; view: where an
    endoscope looks, a direction in the same plane.
    """

    tool: str
    title: str
    chosen: bool
    as_planned: bool
    reaches: bool
    reached_mm: Length
    length_mm: float
    least_clearance_mm: Length
    tissue_mm: Length
    tissue_depth_mm: Length
    reason: str
    stop: str
    pierces: bool
    verdict: Level
    word: str
    parts: list[ToolPartPublic]
    view: tuple[float, float] | None

    @classmethod
    def of(cls, row: ToolRow, tool: Tool) -> ToolPublic:
        """Return a row of a table, with the shape of its tool."""
        segments = tool.segments(np.eye(3), np.zeros(3))
        axes = zip(segments.start.tolist(), segments.end.tolist(), segments.radius.tolist(), strict=True)
        parts = [ToolPartPublic(start=(a[1], a[2]), end=(b[1], b[2]), radius=radius) for a, b, radius in axes]
        view = None if tool.camera is None else (float(tool.camera.view[1]), float(tool.camera.view[2]))
        return cls(**asdict(row), parts=parts, view=view)


class ToolTablePublic(BaseModel):
    """Every shipped tool along the path of a plan at a revision."""

    id: str
    plan_id: str
    revision: int
    tools: list[ToolPublic]


class UseRequest(RequestBody):
    """The alternative that the chosen path is led along, counted from 0."""

    alternative: Annotated[int, Field(ge=0, strict=True)] = 0
    revision: Revision = None


class UseToolRequest(RequestBody):
    """The tool that the chosen path gets, by its name."""

    tool: Identifier
    revision: Revision = None


@router.post("/plans/{plan_id}/suggestions", status_code=202)
def start_suggestion(plan_id: Identifier, body: SuggestionRequest, services: ServicesDep) -> JobPublic:
    """Look for paths with the plan's tool as a job; its result is the suggestion's id."""
    return JobPublic.of(services.suggestions.start(services.plans.get(plan_id), body.entry, body.target))


@router.get("/suggestions/{suggestion_id}")
def show_suggestion(suggestion_id: Identifier, services: ServicesDep) -> SuggestionPublic:
    """What was found; the newest sixteen are remembered."""
    kept = services.suggestions.paths(suggestion_id)
    values = {name: getattr(kept, name) for name in ("id", "plan_id", "revision", "entry", "target", "tool", "kept_mm")}
    found = {"alternatives": described(kept), "none": described_none(kept.found.none)}
    return SuggestionPublic.model_validate({**values, **found})


@router.post("/suggestions/{suggestion_id}/pictures", status_code=202)
def start_pictures(suggestion_id: Identifier, services: ServicesDep) -> JobPublic:
    """Draw every alternative as a job; its result is the suggestion's id."""
    return JobPublic.of(services.way_pictures.start(services.suggestions.paths(suggestion_id)))


@router.get(
    "/suggestions/{suggestion_id}/pictures/{alternative}",
    response_class=Response,
    responses={200: {"content": {"image/svg+xml": {}}, "description": "Cut through the head, one unit a millimetre"}},
)
def show_picture(
    suggestion_id: Identifier, alternative: Annotated[int, Field(ge=0, le=1000)], services: ServicesDep
) -> Response:
    """A picture of an alternative, once it is drawn: bone, path, and the tool where its clearance is least."""
    picture = services.way_pictures.picture(suggestion_id, alternative)
    return Response(picture, media_type="image/svg+xml", headers={"X-Notice": NOTICE, "Cache-Control": "no-store"})


@router.post("/suggestions/{suggestion_id}/use")
def use_suggestion(
    suggestion_id: Identifier, body: UseRequest, services: ServicesDep, condition: ConditionDep
) -> PlanPublic:
    """Lead the plan's chosen path along an alternative, as one edit that can be undone.

    Without `alternative` it is the first one. 409 where the plan has another tool than the suggestion was made for.
    """
    kept = services.suggestions.paths(suggestion_id)
    points = kept.points_of(kept.plan_id, body.alternative)
    kept.check_tool(services.plans.get(kept.plan_id))
    expected = condition.expected(body.revision)
    plan = services.plans.do(kept.plan_id, SetPoints(points=points), expected_revision=expected)
    return _told(condition, PlanPublic.of(plan))


@router.post("/plans/{plan_id}/tools", status_code=202)
def start_tools(plan_id: Identifier, services: ServicesDep) -> JobPublic:
    """Drive every shipped tool along the plan's path as a job; its result is the table's id."""
    return JobPublic.of(services.suggestions.start_tools(services.plans.get(plan_id)))


@router.get("/tool_tables/{table_id}")
def show_tools(table_id: Identifier, services: ServicesDep) -> ToolTablePublic:
    """The table; the newest sixteen are remembered."""
    table = services.suggestions.table(table_id)
    rows = [ToolPublic.of(row, table.tools[row.tool]) for row in table.rows]
    return ToolTablePublic(id=table.id, plan_id=table.plan_id, revision=table.revision, tools=rows)


@router.post("/tool_tables/{table_id}/use")
def use_tool(table_id: Identifier, body: UseToolRequest, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """Give the plan's chosen path a tool of the table, as one edit that can be undone.

    The shaft has the directions that the tool was simulated with. 409 where it does not fit at the entry, or the path
    has changed since.
    """
    table = services.suggestions.table(table_id)
    edit = table.edit(services.plans.get(table.plan_id), body.tool)
    plan = services.plans.do(table.plan_id, edit, expected_revision=condition.expected(body.revision))
    return _told(condition, PlanPublic.of(plan))


def _told(condition: Condition, plan: PlanPublic) -> PlanPublic:
    condition.tell(plan.revision)
    return plan
