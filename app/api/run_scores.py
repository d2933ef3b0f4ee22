"""What a run is worth, and its series for plots and for a replay; read-only."""

from __future__ import annotations

import re
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.lumen_scores import LumenScorePublic, LumenSeriesPublic
from app.api.score_parts import HeldPublic, HoldPublic, MeanMaxPublic, Numbers, Triple
from app.drives.stored_run import StoredRun
from app.exchange.run_report.report import report_html
from app.exchange.run_report.reported import RunToReport
from app.exchange.run_report.stored import stored_to_report
from app.plans.model import NOTICE
from app.services import Services
from vfix_engine.runtime.run import Run

router = APIRouter(prefix="/runs/{run_id}", tags=["runs"], responses=ERRORS)

Pair = tuple[float, float]


class ErrorsPublic(BaseModel):
    """An error in mm, where the robot has the tool and where it truly was."""

    robot_frame: MeanMaxPublic
    true_frame: MeanMaxPublic


class ApproachPublic(BaseModel):
    """The samples before the path was followed."""

    time_s: float
    path_length_mm: float


class ContactsPublic(BaseModel):
    """Contacts of one part of the tool with one structure."""

    structure: str
    part: str
    count: int
    max_depth_mm: float
    time_s: float


class ScorePublic(BaseModel):
    """The score of a run, see docs/metrics.md; lengths in mm, angles in degrees, times in s.

    completed: the path was followed to its end. reach_mm: least distance at which a clearance is cut.
    whole: it was recorded to its end; lost: number of steps that were not recorded. led_by: shares of the samples by
    hand, position of a master, and rate of a device. holds: in the order of time.
    """

    world: str
    mode: str | None
    certified: bool
    whole: bool
    lost: int
    led_by: dict[str, float]
    completed: bool
    samples: int
    time_s: float
    approach: ApproachPublic
    path_error_mm: ErrorsPublic | None
    path_length_mm: float
    spectral_arc_length: float | None
    log_dimensionless_jerk: float | None
    jerk_filter: str
    contacts: int
    max_depth_mm: float
    contacts_by: list[ContactsPublic]
    least_clearance_mm: dict[str, float]
    reach_mm: float
    held_s: float
    held_by: list[HeldPublic] | None
    target_error_mm: ErrorsPublic | None
    angle_deg: float | None
    holds: list[HoldPublic]


class JointPublic(BaseModel):
    """A joint, and the unit of its speed less the 1/s."""

    name: str
    unit: str


class SeriesPublic(BaseModel):
    """The series of a run at 30 Hz at most, n samples of S tool parts, J joints and B structures; LPS mm.

    t_s (n): driven time. tip (n, 3). segments (n, S, 6): start and end of the axis of each part of the tool, from the
    tip on; radii_mm (S). side (n, 3): unit vector across the first part, to which a bend or lens points.
    speed (J, n): of the joints. clearance_mm (B, n): least of each interval, null beyond
    reach_mm (n). nearest (n): number of the nearest structure, -1 for none within reach. force_n (n): of the hand.
    error_mm (n): largest of each interval, of the path or of the target, null where there is none.
    progress_mm (n): along the path. flat_mm (n, 2): the tip in the plane of the path; path_mm (m, 2): the path there,
    from its entry on; across_mm (2, n): error of the path within that plane and off it; all null without a path.
    phase (n): numbers of phases. held (n): 1 where the tool was held.
    """

    run: str
    world: str
    mode: str | None
    certified: bool
    structures: list[str]
    joints: list[JointPublic]
    radii_mm: list[float]
    phases: list[str]
    t_s: list[float]
    tip: list[Triple]
    segments: list[list[Annotated[list[float], Field(min_length=6, max_length=6)]]]
    side: list[Triple]
    speed: list[list[float]]
    clearance_mm: list[Numbers]
    reach_mm: list[float]
    nearest: list[int]
    force_n: list[float]
    error_mm: Numbers
    progress_mm: Numbers
    flat_mm: list[Pair] | None
    across_mm: list[Numbers] | None
    path_mm: list[Pair] | None
    phase: list[int]
    held: list[int]


@router.get("/score")
def run_score(run_id: Identifier, services: ServicesDep) -> ScorePublic | LumenScorePublic:
    """The score of a run, with what held it; of a run that was never asked for it takes some seconds."""
    score = services.run_scores.of(run_id)
    return (ScorePublic if "arm" not in score else LumenScorePublic).model_validate(score)


@router.get("/series", response_class=Response, responses={200: {"model": SeriesPublic | LumenSeriesPublic}})
def run_series(run_id: Identifier, services: ServicesDep) -> Response:
    """What is plotted over a run, and where the tool was: all that a replay of its motion needs."""
    headers: dict[str, Any] = {"X-Notice": NOTICE, "Cache-Control": "no-store"}
    return Response(services.run_scores.series(run_id), media_type="application/json", headers=headers)


@router.get(
    "/report",
    response_class=Response,
    responses={200: {"content": {"text/html": {}}, "description": "one page to print, without references to others"}},
)
def run_report(
    run_id: Identifier, services: ServicesDep, beside: Annotated[list[str] | None, Query(max_length=5)] = None
) -> Response:
    """The report on a run to print, beside it those on others; takes some seconds."""
    page = report_html([_to_report(services, one) for one in dict.fromkeys([run_id, *(beside or [])])])
    headers = {"X-Notice": NOTICE, "Cache-Control": "no-store"}
    headers["Content-Disposition"] = f'attachment; filename="{report_name(services.runs.get(run_id))}"'
    return Response(page, media_type="text/html", headers=headers)


def report_name(run: StoredRun) -> str:
    """Name of the file of a report on a run: a file that is passed on says how the tool was driven (HAZ-41)."""
    certificate = "" if run.certified else "-without-certificate"
    return f"{run.id}-{re.sub('[^a-z-]+', '-', run.mode or run.world)}{certificate}.html"


def _to_report(services: Services, run_id: str) -> RunToReport:
    """A run with the names of what was driven."""
    stored = services.runs.get(run_id)
    with services.runs.laid_out(run_id) as place:
        run = Run.read(place)
    return stored_to_report(run, stored, services.cases, services.plans, services.lumen_routes)
