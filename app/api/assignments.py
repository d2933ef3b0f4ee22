"""Assignments as files, and the results of their runs."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.uploads import form_of, receive_small
from app.assignments.file import MAX_BYTES
from app.assignments.results import results_csv

router = APIRouter(prefix="/assignments", tags=["assignments"], responses=ERRORS)

_FORM = form_of({"file": ".json, see docs/formats.md"}, {}, frame=False)


class AskedPublic(BaseModel):
    """A criterion: 'max_' and 'min_' of its name say which limit it is, without either the value is the limit."""

    name: str
    label: str
    unit: str
    limit: bool | float


class CriterionPublic(AskedPublic):
    """A criterion of one run; value: null where the run has none."""

    value: bool | float | None
    passed: bool


class RunResultPublic(BaseModel):
    """A run of an assignment; trouble: why it cannot be scored, '' where it can."""

    run: str
    recorded: str
    criteria: list[CriterionPublic]
    passed: bool
    trouble: str


class ResultsPublic(BaseModel):
    """Results of an assignment, its runs the oldest first. passed: number of runs that passed every criterion.

    since: runs before it do not count. wanted: how many have to pass; complete: as many have.
    """

    name: str
    plan_id: str
    mode: str
    since: str
    wanted: int
    criteria: list[AskedPublic]
    runs: list[RunResultPublic]
    passed: int
    complete: bool


class AssignmentOpened(BaseModel):
    """What a file says to set up. case_id, plan_id: of the plan to drive; preset: null for any."""

    id: str
    case_id: str
    plan_id: str
    mode: Literal["freehand", "hands-on", "teleoperated"]
    preset: Literal["li2004", "li2007"] | None


@router.post("", status_code=201, openapi_extra=_FORM)
async def open_assignment(request: Request, services: ServicesDep) -> AssignmentOpened:
    """Open the file of an assignment; one that is open already keeps its runs."""
    _, data, _ = await receive_small(request, MAX_BYTES, ())
    opened = await run_in_threadpool(services.assignments.open, data)
    content = opened.content
    return AssignmentOpened(
        id=opened.id, case_id=opened.case_id, plan_id=content.plan_id, mode=content.mode, preset=content.preset
    )


@router.get(
    "/{assignment_id}/results",
    response_model=ResultsPublic,
    responses={200: {"content": {"text/csv": {}}}},
)
def assignment_results(
    assignment_id: Identifier,
    services: ServicesDep,
    form: Annotated[Literal["json", "csv"], Query(alias="format")] = "json",
) -> ResultsPublic | Response:
    """Each run of the assignment by each criterion; runs that were never scored take some seconds each."""
    results = services.assignments.results(assignment_id)
    if form == "csv":
        headers = {"Content-Disposition": f'attachment; filename="{assignment_id}.csv"', "Cache-Control": "no-store"}
        return Response(results_csv(results), media_type="text/csv", headers=headers)
    return ResultsPublic.model_validate(results.to_dict())
