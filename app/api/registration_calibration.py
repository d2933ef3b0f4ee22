"""Tables of poses that calibrate a registration: of the pointer, and of the tracker beside the robot."""

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, ServicesDep
from app.api.uploads import form_of, receive, receive_small
from app.registration.document import StoredRegistration
from app.registration.pose_tables import MAX_POSES_BYTES
from app.registration.public import RegistrationPublic
from vfix_engine.errors import InputError

router = APIRouter(tags=["registrations"], responses=ERRORS)

_POINTER = form_of({"file": ".csv of the pointer's poses: x, y, z, qx, qy, qz, qw, unit and kind"}, {}, frame=False)
_ROBOT = form_of(
    {
        "file": ".csv of the marker's poses from the tracker, of the kind marker_to_tracker",
        "robot": ".csv of the flange's poses at the same moments, kind flange_to_base",
    },
    {},
    frame=False,
)


@router.post("/registrations/{registration_id}/pointer", openapi_extra=_POINTER)
async def read_pointer(
    registration_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Find the pointer's tip from a table of poses of a pointer that was swung about it."""
    _, data, _ = await receive_small(request, MAX_POSES_BYTES, ())
    expected = condition.expected()

    def work() -> RegistrationPublic:
        calibrating = services.registering.calibrating
        return _told(condition, calibrating.read_pointer(registration_id, data, expected_revision=expected))

    return await run_in_threadpool(work)


@router.post("/registrations/{registration_id}/robot", openapi_extra=_ROBOT)
async def read_robot(
    registration_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Find where the tracker stands beside the robot from two tables of poses of the same moments."""
    upload = await receive(request, services.store.scratch, 2 * MAX_POSES_BYTES, (), beside=("robot",))

    def work() -> RegistrationPublic:
        try:
            robot = upload.beside.get("robot")
            if robot is None:
                raise InputError("send the robot's poses as 'robot' beside the tracker's, which are 'file'.")
            poses, expected = (robot.read_bytes(), upload.path.read_bytes()), condition.expected()
            done = services.registering.calibrating.read_robot(registration_id, *poses, expected_revision=expected)
            return _told(condition, done)
        finally:
            upload.remove()

    return await run_in_threadpool(work)


def _told(condition: Condition, document: StoredRegistration) -> RegistrationPublic:
    condition.tell(document.revision)
    return RegistrationPublic.of(document)
