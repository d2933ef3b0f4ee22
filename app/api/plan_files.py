"""Plans as files: export and import."""

from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep
from app.api.plan_models import PlanPublic
from app.api.uploads import receive_small, safe_name
from app.services.exchange import MEDIA_TYPES, Format, export_text, read_plan
from app.services.exchange_parts import MAX_TEXT
from app.services.plan_model import NOTICE

router = APIRouter(tags=["plan files"], responses=ERRORS)

_FORM: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file"],
                    "properties": {
                        "file": {
                            "type": "string",
                            "format": "binary",
                            "description": ".json, .mrk.json, .csv or .fcsv",
                        },
                        "name": {"type": "string", "description": "of the plan; else the file's"},
                        "frame": {"type": "string", "enum": ["LPS", "RAS"], "description": "where the file names none"},
                        "other_case": {
                            "type": "string",
                            "enum": ["yes"],
                            "description": "made for another case: known",
                        },
                    },
                }
            }
        },
    }
}


@router.get(
    "/plans/{plan_id}/export",
    response_class=Response,
    responses={200: {"content": {"application/json": {}, "text/csv": {}}, "description": "The file"}},
)
def export_plan(
    plan_id: Identifier, services: ServicesDep, form: Annotated[Format, Query(alias="format")] = "json"
) -> Response:
    """The plan as vfix JSON, 3D Slicer Markups with the path as driven, or a table. Not for clinical use."""
    plan = services.plans.get(plan_id)
    curve, remark = services.planning.curve(plan) if form == "mrk.json" else ((), "")
    # Headers are Latin-1: the name goes in percent-encoded, with a plain one for clients that cannot read that.
    plain, full = safe_name(plan.name), quote(plan.name, safe="")
    disposition = f"attachment; filename=\"{plain}.{form}\"; filename*=UTF-8''{full}.{form}"
    return Response(
        export_text(plan, form, curve, remark),
        media_type=MEDIA_TYPES[form],
        headers={"Content-Disposition": disposition, "X-Notice": NOTICE, "Cache-Control": "no-store"},
    )


@router.post("/cases/{case_id}/plans/import", status_code=201, openapi_extra=_FORM)
async def import_plan(
    case_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> PlanPublic:
    """Make a plan of a file; one that does not name its frame is not guessed at."""
    file_name, data, fields = await receive_small(request, MAX_TEXT, ("name", "frame", "other_case"))

    def work() -> PlanPublic:
        services.cases.get(case_id)
        file = read_plan(file_name, data, fields.get("frame"))
        other = fields.get("other_case") == "yes"
        plan = services.plans.add_file(case_id, file, name=fields.get("name"), other_case=other)
        condition.tell(plan.revision)
        return PlanPublic.of(plan)

    return await run_in_threadpool(work)
