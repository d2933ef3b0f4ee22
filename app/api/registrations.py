"""Registrations: beads of the CT, orders that fit, expected errors, and plans that use one."""

from typing import Annotated

from fastapi import APIRouter, Query

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.registration_models import (
    BeadsRequest,
    ErrorTablePublic,
    PlanRegistrationPublic,
)
from app.registration.point_order import OrderAnswer
from vfix_engine.errors import InputError

router = APIRouter(tags=["registrations"], responses=ERRORS)


@router.post("/registrations/{registration_id}/beads", status_code=202)
def start_beads(registration_id: Identifier, body: BeadsRequest, services: ServicesDep) -> JobPublic:
    """Look for beads in the case's CT as a job; what is found stands in the registration, as one edit."""
    return JobPublic.of(services.registering.start_beads(registration_id, body.diameter_mm, body.threshold_hu))


@router.get("/registrations/{registration_id}/order")
def show_order(registration_id: Identifier, services: ServicesDep) -> OrderAnswer:
    """In which order the measured points fit the places in the image; several where the layout is symmetric."""
    return services.registering.order(services.registrations.get(registration_id).content)


@router.get("/registrations/{registration_id}/errors")
def show_errors(
    registration_id: Identifier, services: ServicesDep, plan_id: Annotated[str | None, Query(max_length=64)] = None
) -> ErrorTablePublic:
    """The error to be expected at the targets of a plan and along its chosen path."""
    document = services.registrations.get(registration_id)
    plan = None if plan_id is None else services.plans.get(plan_id)
    if plan is not None and plan.case_id != document.case_id:
        raise InputError("that plan belongs to another case than the registration.")
    return ErrorTablePublic.of(services.registering.errors(document.content, plan))


@router.get("/plans/{plan_id}/registration")
def show_plan_registration(plan_id: Identifier, services: ServicesDep) -> PlanRegistrationPublic:
    """The registration that a plan uses, and the error to be expected of it; or why it cannot be used."""
    plan = services.plans.get(plan_id)
    used = services.registering.registration_of(plan)
    errors = None if used.document is None else services.registering.errors(used.document.content, plan)
    return PlanRegistrationPublic.of(plan_id, used, errors)
