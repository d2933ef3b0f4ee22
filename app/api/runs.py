"""Runs of drives; read-only except for deletion."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.plan_reports import PiercedPublic
from app.drives.runs import RunOrigin, StoredRun
from app.plans.model import NOTICE

router = APIRouter(tags=["runs"], responses=ERRORS)

Named = Annotated[str | None, Query(max_length=64)]


class RunFilePublic(BaseModel):
    sha256: str
    size_bytes: int


class RunTitle(BaseModel):
    """A run; ticks: number of recorded steps, lost: number of steps that were not recorded.

    mode: 'freehand', 'hands-on' or 'teleoperated', 'mixed' where it was changed on the way, null for a snake.
    whole is false, and ticks and lost are null, for an interrupted run.
    pierced: what the tool pierced while it was driven; null where that was not measured.
    """

    id: str
    case_id: str | None
    plan_id: str | None
    origin: RunOrigin
    world: str
    mode: str | None
    recorded: str
    size_bytes: int
    whole: bool
    ticks: int | None
    lost: int | None
    pierced: PiercedPublic | None
    files: dict[str, RunFilePublic]

    @classmethod
    def values(cls, run: StoredRun) -> dict[str, Any]:
        """The fields of a stored run."""
        end = run.end or {}
        files = {name: vars(file) for name, file in run.files.items()}
        told = {"world": run.world, "mode": run.mode, "whole": run.whole}
        told |= {"ticks": end.get("ticks"), "lost": end.get("lost")}
        return {**vars(run), **told, "files": files}


class RunPublic(RunTitle):
    """A run with its manifest: spec, settings, hashes, seed, versions and columns."""

    manifest: dict[str, Any]


@router.get("/runs")
def list_runs(services: ServicesDep, case_id: Named = None, plan_id: Named = None) -> list[RunTitle]:
    """Runs of a case or plan, or all, newest first."""
    return [RunTitle.model_validate(RunTitle.values(run)) for run in services.runs.list(case_id, plan_id)]


@router.get("/cases/{case_id}/runs")
def list_runs_of_case(case_id: Identifier, services: ServicesDep, plan_id: Named = None) -> list[RunTitle]:
    """Runs of a case, newest first."""
    services.cases.get(case_id)
    return list_runs(services, case_id, plan_id)


@router.get("/runs/{run_id}")
def show_run(run_id: Identifier, services: ServicesDep) -> RunPublic:
    """One run, with its manifest."""
    return RunPublic.model_validate(RunPublic.values(services.runs.get(run_id)))


@router.get(
    "/runs/{run_id}/files/{name}",
    response_class=FileResponse,
    responses={200: {"content": {"application/octet-stream": {}}, "description": "The file as it was written"}},
)
def run_file(run_id: Identifier, name: Identifier, services: ServicesDep) -> FileResponse:
    """A file of a run."""
    headers = {"X-Notice": NOTICE, "Cache-Control": "no-store"}
    return FileResponse(services.runs.file(run_id, name), media_type="application/octet-stream", headers=headers)


@router.delete("/runs/{run_id}", status_code=204, response_class=Response)
def delete_run(run_id: Identifier, services: ServicesDep) -> None:
    """Delete a run permanently."""
    services.runs.delete(run_id)
