"""Paths that a pointer has traced, into a plan: of a table, of the tracked pointer, or simulated."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, Number, RequestBody, ServicesDep
from app.api.plan_models import Revision
from app.api.surface_models import Seconds
from app.api.uploads import form_of, receive_small
from app.kit.names import check_name
from app.plans.public import PlanPublic
from app.registration.files import read_traced
from app.registration.simulated_touch import DEFAULT_NOISE_MM
from app.registration.tracing import Traced, TracedFrom

router = APIRouter(tags=["plans"], responses=ERRORS)

MAX_BYTES = 4 << 20
RegistrationId = Annotated[str | None, Field(min_length=1, max_length=64)]

_TABLE = form_of(
    {"file": ".csv with the columns x, y, z, its unit and its frame"},
    {"registration": "id of the registration; else the plan's", "name": "of the path; else 'Traced path 1' and so on"},
    frame=False,
)


class TracedPublic(BaseModel):
    """A traced path that was added to a plan and chosen; lengths in mm.

    residual_mm, largest_mm: rms and largest distance of the samples from it; the registration's error comes on top.
    used: places of the samples that were fitted.
    """

    path: str
    name: str
    points: int
    length_mm: float
    residual_mm: float
    largest_mm: float
    samples: int
    used: int
    traced_from: TracedFrom
    registration: str
    words: str
    plan: PlanPublic


class TraceSimulatedRequest(RequestBody):
    """noise_mm: rms length of the simulated pointer's error; seed: of the errors, null for new ones.

    registration: null for the plan's.
    """

    noise_mm: Number = DEFAULT_NOISE_MM
    seed: Annotated[int | None, Field(ge=0, lt=2**63, strict=True)] = None
    registration: RegistrationId = None
    revision: Revision = None


class TraceTrackedRequest(RequestBody):
    """The last seconds, in which the tracked pointer traced the path. registration: null for the plan's."""

    seconds: Seconds
    registration: RegistrationId = None
    revision: Revision = None


@router.post("/plans/{plan_id}/traced", status_code=201, openapi_extra=_TABLE)
async def read_traced_path(
    plan_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> TracedPublic:
    """Add a path through samples of a pointer's tip, of a table, and choose it, as one edit."""
    _, data, fields = await receive_small(request, MAX_BYTES, ("registration", "name"))
    expected, named = condition.expected(), fields.get("registration")
    name = check_name(fields["name"], "path's name") if "name" in fields else None

    def work() -> TracedPublic:
        samples = read_traced(data, services.tracing.registration(plan_id, named).content)
        done = services.tracing.add(plan_id, samples, "file", named, name, expected_revision=expected)
        return _told(condition, done)

    return await run_in_threadpool(work)


@router.post("/plans/{plan_id}/traced/simulated", status_code=201)
def trace_simulated(
    plan_id: Identifier, body: TraceSimulatedRequest, services: ServicesDep, condition: ConditionDep
) -> TracedPublic:
    """Trace the chosen path with a simulated pointer, for practice."""
    expected = condition.expected(body.revision)
    done = services.tracing.simulated(
        plan_id, body.noise_mm, body.seed, body.registration, expected_revision=expected
    )  # fmt: skip
    return _told(condition, done)


@router.post("/plans/{plan_id}/traced/tracked", status_code=201)
def take_tracked_path(
    plan_id: Identifier, body: TraceTrackedRequest, services: ServicesDep, condition: ConditionDep
) -> TracedPublic:
    """Take the way that the tip of the tracked pointer went in the last seconds."""
    expected = condition.expected(body.revision)
    return _told(
        condition, services.tracing.tracked(plan_id, body.seconds, body.registration, expected_revision=expected)
    )


def _told(condition: Condition, traced: Traced) -> TracedPublic:
    condition.tell(traced.plan.revision)
    values = {name: getattr(traced, name) for name in TracedPublic.model_fields if name not in ("path", "plan")}
    return TracedPublic(path=traced.path_id, plan=PlanPublic.of(traced.plan), **values)
