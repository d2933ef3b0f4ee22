"""Plans as files: export and import."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, cast, get_args
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep
from app.api.passing_file import PassingFile
from app.api.uploads import form_of, receive_small, safe_name
from app.exchange.patient_images import WITH_IMAGES, check_images, holds_images
from app.exchange.plan_files import MEDIA_TYPES, PlanFormat, PointsAs, export_text, read_plan
from app.plans.imported_places import content_notes
from app.plans.model import NOTICE
from app.plans.public import PlanPublic
from app.store.errors import StorageError
from vfix_engine.errors import InputError

router = APIRouter(tags=["plan files"], responses=ERRORS)

MAX_PLAN_BYTES = 2 << 20  # all who are served wait while a file is parsed; on the command line it may be larger

_FORM = form_of(
    {"file": ".json, .mrk.json, .csv or .fcsv"},
    {
        "name": "of the plan; else the file's",
        "frame": {"type": "string", "enum": ["LPS", "RAS"], "description": "where the file names none"},
        "points_as": {
            "type": "string",
            "enum": list(get_args(PointsAs)),
            "description": "what a list of points without a curve is",
        },
        "other_case": {"type": "string", "enum": ["yes"], "description": "made for another case: known"},
    },
    frame=False,
)


@router.get(
    "/plans/{plan_id}/export",
    response_class=Response,
    responses={200: {"content": {"application/json": {}, "text/csv": {}}, "description": "The file"}},
)
def export_plan(
    plan_id: Identifier,
    services: ServicesDep,
    form: Annotated[PlanFormat, Query(alias="format")] = "json",
    frame: Annotated[Literal["image", "base"], Query(description="base: of the placed robot, json or csv")] = "image",
    registration: Annotated[str | None, Query(max_length=200, description="of the image, for frame=base")] = None,
) -> Response:
    """The plan as vfix JSON, 3D Slicer Markups with the path as driven, or a table. Not for clinical use."""
    plan = services.plans.get(plan_id)
    if frame == "base":
        text = services.base_export.text(plan, form, registration)
    else:
        curve, remark = services.planning.curve(plan) if form == "mrk.json" else ((), "")
        text = export_text(plan, form, curve, remark, services.instruments.carried(plan.content, form))
    return Response(text, media_type=MEDIA_TYPES[form], headers=_attachment(plan.name, form))


@router.get(
    "/plans/{plan_id}/export/slicer",
    response_class=FileResponse,
    responses={200: {"content": {"application/zip": {}}, "description": "A folder for 3D Slicer"}},
)
def export_slicer(
    plan_id: Identifier,
    services: ServicesDep,
    with_images: Annotated[bool, Query(description=WITH_IMAGES)] = False,
) -> PassingFile:
    """Plan and head as a zipped folder that 3D Slicer opens by its scene; takes seconds. Not for clinical use.

    Images can identify their patient: a head that has some is exported with `with_images=true` only.
    """
    plan = services.plans.get(plan_id)
    check_images(services.cases.get(plan.case_id), with_images, "with_images=true")
    place = services.store.exports.new_place()
    try:
        name = safe_name(plan.name)
        services.slicer.write(plan, place / "folder" / name)
        path = Path(shutil.make_archive(str(place / "slicer"), "zip", place / "folder", name))
    except OSError as error:
        shutil.rmtree(place, ignore_errors=True)
        raise StorageError(f"the export could not be written: {error.strerror or error}.") from error
    except BaseException:
        shutil.rmtree(place, ignore_errors=True)
        raise
    headers = {"X-Notice": NOTICE, "Cache-Control": "no-store"}
    return PassingFile(path, media_type="application/zip", filename=f"{name}.zip", headers=headers)


@router.get(
    "/plans/{plan_id}/report/page",
    response_class=Response,
    responses={200: {"content": {"text/html": {}}, "description": "One page of A4"}},
)
def report_page(
    plan_id: Identifier,
    services: ServicesDep,
    with_images: Annotated[bool, Query(description=WITH_IMAGES)] = False,
) -> Response:
    """The report on a plan as a page of HTML to print: verdict, figures, pictures; seconds the first time.

    Its pictures show outlines of bone and, with `with_images=true` or of a head that shows nobody, the scan.
    """
    plan = services.plans.get(plan_id)
    images = with_images or not holds_images(services.cases.get(plan.case_id))
    text = services.plan_reports.html(plan, with_images=images)
    return Response(text, media_type="text/html", headers=_attachment(plan.name, "html"))


def _attachment(name: str, suffix: str) -> dict[str, str]:
    """Headers of a file that is saved. They are Latin-1: the name goes in percent-encoded, a plain one beside it."""
    disposition = (
        f"attachment; filename=\"{safe_name(name)}.{suffix}\"; filename*=UTF-8''{quote(name, safe='')}.{suffix}"
    )
    return {"Content-Disposition": disposition, "X-Notice": NOTICE, "Cache-Control": "no-store"}


@router.post("/cases/{case_id}/plans/import", status_code=201, openapi_extra=_FORM)
async def import_plan(
    case_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> PlanPublic:
    """Create a plan from a file; a missing frame, or the meaning of a list of points, has to be given.

    What is doubtful about the file, such as a unit that it does not name, is in `told`.
    """
    file_name, data, fields = await receive_small(request, MAX_PLAN_BYTES, ("name", "frame", "points_as", "other_case"))

    def work() -> PlanPublic:
        services.cases.get(case_id)
        file = read_plan(file_name, data, fields.get("frame"), _points_as(fields.get("points_as")))
        other = fields.get("other_case") == "yes"
        plan = services.plans.add_file(case_id, file, name=fields.get("name"), other_case=other)
        condition.tell(plan.revision)
        doubts = (*file.notes, *content_notes(file.content, services.cases.get(case_id).surfaces[0].bounds_lps_mm))
        return PlanPublic.of(replace(plan, told=" ".join(doubts)))

    return await run_in_threadpool(work)


def _points_as(word: str | None) -> PointsAs | None:
    if word not in (None, *get_args(PointsAs)):
        raise InputError(f"points_as is {word!r:.20}; say {' or '.join(get_args(PointsAs))}.")
    return cast(PointsAs | None, word)
