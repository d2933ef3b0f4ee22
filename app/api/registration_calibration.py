"""Calibrations of registrations: the pointer's tip, the tracker beside the robot, and registrations to its base."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.concurrency import run_in_threadpool

from app.api.calibration_models import SimulateWish, SwingWish, ToBaseWish
from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, ServicesDep
from app.api.uploads import form_of, receive, receive_small
from app.registration.editor import StoredRegistration
from app.registration.pose_tables import MAX_POSES_BYTES
from app.registration.public import RegistrationPublic
from vfix_engine.errors import InputError

router = APIRouter(tags=["registrations"], responses=ERRORS)

Seen = Annotated[int | None, Query(ge=0)]

_POINTER = form_of({"file": ".csv of the pointer's poses: x, y, z, qx, qy, qz, qw, unit and kind"}, {}, frame=False)
_ROBOT = form_of(
    {
        "file": ".csv of the marker's poses as the tracker measured them, of the kind marker_to_tracker",
        "robot": ".csv of the flange's poses at the same moments, of the kind flange_to_base; needed as well",
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


@router.post("/registrations/{registration_id}/pointer/track")
def track_pointer(
    registration_id: Identifier, wish: SwingWish, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Find the tip of the tracked pointer, which is swung about it for some seconds."""
    expected, calibrating = condition.expected(wish.revision), services.registering.calibrating
    return _told(condition, calibrating.track_pointer(registration_id, wish.seconds, expected_revision=expected))


@router.post("/registrations/{registration_id}/pointer/simulate")
def simulate_pointer(
    registration_id: Identifier, wish: SimulateWish, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Find the tip of a simulated pointer, for practice."""
    expected, calibrating = condition.expected(wish.revision), services.registering.calibrating
    done = calibrating.simulate_pointer(registration_id, wish.noise_mm, wish.seed, expected_revision=expected)
    return _told(condition, done)


@router.delete("/registrations/{registration_id}/pointer")
def clear_pointer(
    registration_id: Identifier, services: ServicesDep, condition: ConditionDep, revision: Seen = None
) -> RegistrationPublic:
    """Forget the pointer's tip: the tracker tells where the tip is."""
    expected, calibrating = condition.expected(revision), services.registering.calibrating
    return _told(condition, calibrating.set_pointer(registration_id, None, expected_revision=expected))


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


@router.post("/registrations/{registration_id}/robot/simulate")
def simulate_robot(
    registration_id: Identifier, wish: SimulateWish, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Find where a simulated tracker stands beside a simulated robot, for practice."""
    expected, calibrating = condition.expected(wish.revision), services.registering.calibrating
    done = calibrating.simulate_robot(registration_id, wish.noise_mm, wish.seed, expected_revision=expected)
    return _told(condition, done)


@router.delete("/registrations/{registration_id}/robot")
def clear_robot(
    registration_id: Identifier, services: ServicesDep, condition: ConditionDep, revision: Seen = None
) -> RegistrationPublic:
    """Forget where the tracker stands beside the robot."""
    expected, calibrating = condition.expected(revision), services.registering.calibrating
    return _told(condition, calibrating.set_robot(registration_id, None, expected_revision=expected))


@router.post("/registrations/{registration_id}/to-base", status_code=201)
def make_to_base(
    registration_id: Identifier, wish: ToBaseWish, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Make a new registration to the robot's base: this one's points, taken through its robot's calibration."""
    expected, calibrating = condition.expected(wish.revision), services.registering.calibrating
    return _told(condition, calibrating.to_base(registration_id, wish.name, expected_revision=expected))


def _told(condition: Condition, document: StoredRegistration) -> RegistrationPublic:
    condition.tell(document.revision)
    return RegistrationPublic.of(document)
