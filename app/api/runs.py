"""Runs of drives; read-only except for deletion."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Flag, Identifier, RequestBody, ServicesDep
from app.api.lumen_scores import BehindWallPublic
from app.api.plan_reports import PiercedPublic
from app.api.run_comments import CommentPublic
from app.drives.stored_run import RunOrigin, StoredRun
from app.plans.model import NOTICE
from app.services import Services

router = APIRouter(tags=["runs"], responses=ERRORS)

Named = Annotated[str | None, Query(max_length=64)]


class RunFilePublic(BaseModel):
    sha256: str
    size_bytes: int


class ShortScore(BaseModel):
    """Figures of a run's score; lengths in mm. clearance_mm: least one to any structure, negative in contact.

    completed: the path was followed to its end. error_mm, error_max_mm: mean and largest tip error in the robot's
    frame, null where no sample follows a path.
    """

    certified: bool
    completed: bool
    time_s: float
    error_mm: float | None
    error_max_mm: float | None
    clearance_mm: float
    contacts: int
    held_s: float

    @classmethod
    def of(cls, score: dict[str, Any]) -> ShortScore:
        error = (score["path_error_mm"] or {}).get("robot_frame", {})
        return cls(
            certified=score["certified"],
            completed=score["completed"],
            time_s=score["time_s"],
            error_mm=error.get("mean"),
            error_max_mm=error.get("max"),
            clearance_mm=min(score["least_clearance_mm"].values()),
            contacts=score["contacts"],
            held_s=score["held_s"],
        )


class ShortLumenScore(BaseModel):
    """Figures of the score of a run in a lumen; lengths in mm.

    completed: as in `LumenScorePublic`. depth_mm: the tip's deepest place, null on a fixed base. deviation_mm: the
    largest of the link nearest to its bound, null in a run whose rows do not have it. beyond_bound_mm: 0 where no link
    was beyond it. bound_mm, behind_wall: what stands beside a certificate, as in `LumenScorePublic`. task: its
    title, null where the run was of none.
    """

    certified: bool
    completed: bool
    time_s: float
    depth_mm: float | None
    deviation_mm: float | None
    beyond_bound_mm: float
    bound_mm: float
    behind_wall: BehindWallPublic | None
    held_s: float
    task: str | None

    @classmethod
    def of(cls, score: dict[str, Any]) -> ShortLumenScore:
        nearest, task = score["nearest_mm"], score.get("task")
        same = ("certified", "completed", "time_s", "depth_mm", "beyond_bound_mm", "bound_mm", "behind_wall", "held_s")
        return cls(
            deviation_mm=None if nearest is None else nearest["max"],
            task=None if task is None else task["title"],
            **{name: score[name] for name in same},
        )


class RunTitle(BaseModel):
    """A run; ticks: number of recorded steps, lost: number of steps that were not recorded.

    mode: 'freehand', 'hands-on' or 'teleoperated', 'mixed' where it was changed on the way, null for a snake.
    arm: 'manual', 'guided' or 'certified' of a snake, links: how many it has; both null for a rigid tool.
    certified: every motion was certified, by the run's world, its rows and the arm.
    whole is false, and ticks and lost are null, for an interrupted run.
    pierced: what the tool pierced while it was driven; null where that was not measured.
    score: null where nobody has asked for it yet, see `/runs/{run_id}/score`, and where there is none.
    teacher: whether it is marked as the teacher's, of which a plan has one at most. comments: in the order of time.
    """

    id: str
    case_id: str | None
    plan_id: str | None
    origin: RunOrigin
    world: str
    mode: str | None
    arm: str | None
    links: int | None
    certified: bool
    recorded: str
    size_bytes: int
    whole: bool
    ticks: int | None
    lost: int | None
    pierced: PiercedPublic | None
    score: ShortScore | ShortLumenScore | None
    files: dict[str, RunFilePublic]
    teacher: bool
    comments: list[CommentPublic]

    @classmethod
    def values(cls, run: StoredRun, services: Services) -> dict[str, Any]:
        """The fields of a stored run."""
        known = services.run_scores.known(run)
        end = run.end or {}
        files = {name: vars(file) for name, file in run.files.items()}
        comments = [vars(one) for one in run.comments]
        told = {"world": run.world, "mode": run.mode, "arm": run.arm, "links": run.links, "certified": run.certified}
        told |= {"whole": run.whole, "ticks": end.get("ticks"), "lost": end.get("lost")}
        short = ShortScore if run.arm is None else ShortLumenScore
        return {**vars(run), **told, "files": files, "comments": comments, "score": known and short.of(known)}


class RunPublic(RunTitle):
    """A run with its manifest: spec, settings, hashes, seed, versions and columns."""

    manifest: dict[str, Any]


@router.get("/runs")
def list_runs(services: ServicesDep, case_id: Named = None, plan_id: Named = None) -> list[RunTitle]:
    """Runs of a case or plan, or all, newest first."""
    return [RunTitle.model_validate(RunTitle.values(run, services)) for run in services.runs.list(case_id, plan_id)]


@router.get("/cases/{case_id}/runs")
def list_runs_of_case(case_id: Identifier, services: ServicesDep, plan_id: Named = None) -> list[RunTitle]:
    """Runs of a case, newest first."""
    services.cases.get(case_id)
    return list_runs(services, case_id, plan_id)


@router.get("/runs/{run_id}")
def show_run(run_id: Identifier, services: ServicesDep) -> RunPublic:
    """One run, with its manifest."""
    return RunPublic.model_validate(RunPublic.values(services.runs.get(run_id), services))


@router.get(
    "/runs/{run_id}/files/{name}",
    response_class=FileResponse,
    responses={200: {"content": {"application/octet-stream": {}}, "description": "The file as it was written"}},
)
def run_file(run_id: Identifier, name: Identifier, services: ServicesDep) -> FileResponse:
    """A file of a run."""
    headers = {"X-Notice": NOTICE, "Cache-Control": "no-store"}
    return FileResponse(services.runs.file(run_id, name), media_type="application/octet-stream", headers=headers)


class RunChange(RequestBody):
    """What may be said of a run. teacher: whether it is the teacher's, in place of another one of its plan."""

    teacher: Flag


@router.patch("/runs/{run_id}")
def change_run(run_id: Identifier, change: RunChange, services: ServicesDep) -> RunTitle:
    """Mark a run as the teacher's, or take the mark away."""
    run = services.runs.mark_teacher(run_id, change.teacher)
    return RunTitle.model_validate(RunTitle.values(run, services))


@router.delete("/runs/{run_id}", status_code=204, response_class=Response)
def delete_run(run_id: Identifier, services: ServicesDep) -> None:
    """Delete a run permanently."""
    services.runs.delete(run_id)
