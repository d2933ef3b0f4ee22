"""Custom robots: URDFs that are read, checked and stored."""

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, ServicesDep
from app.api.plan_models import OwnRobotPublic
from app.api.uploads import form_of, receive_small
from app.plans.instruments import MAX_URDF_BYTES

router = APIRouter(tags=["robots"], responses=ERRORS)

_FORM = form_of({"file": "a URDF, UTF-8; without meshes"}, {"tool_frame": "the link that holds the tool"}, frame=False)


@router.post("/robots", status_code=201, openapi_extra=_FORM)
async def add_robot(request: Request, services: ServicesDep) -> OwnRobotPublic:
    """Check a URDF and store it by its hash; `PATCH /api/v1/plans/{plan_id}` makes it the robot of a plan."""
    file_name, data, fields = await receive_small(request, MAX_URDF_BYTES, ("tool_frame",))

    def work() -> OwnRobotPublic:
        own = services.instruments.add_urdf(file_name, data, fields.get("tool_frame"))
        return OwnRobotPublic.model_validate(own, from_attributes=True)

    return await run_in_threadpool(work)
