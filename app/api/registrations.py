"""Registrations: list, make, change, beads of the CT, pairs, order, expected errors, undo, delete and restore."""

from typing import Annotated

from fastapi import APIRouter, Query

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.plan_models import PlanPublic, StepBack
from app.api.registration_models import (
    BeadsWish,
    BeadWish,
    EditedPair,
    ErrorTablePublic,
    MeasuredPair,
    MeasureWish,
    OrderWish,
    PairCreate,
    PairUpdate,
    PlanRegistrationPublic,
    PlanRegistrationWish,
    RegistrationCreate,
    RegistrationPublic,
    RegistrationUpdate,
    TouchWish,
)
from app.registration.document import RegistrationContent
from app.registration.editor import StoredRegistration
from app.registration.point_order import OrderAnswer
from vfix_engine.errors import InputError

router = APIRouter(tags=["registrations"], responses=ERRORS)

Deleted = Annotated[bool, Query()]
Seen = Annotated[int | None, Query(ge=0)]


@router.get("/cases/{case_id}/registrations")
def list_registrations(
    case_id: Identifier, services: ServicesDep, include_deleted: Deleted = False
) -> list[RegistrationPublic]:
    """Registrations of a case, oldest first."""
    services.cases.get(case_id)
    return [RegistrationPublic.of(one) for one in services.registrations.list(case_id, include_deleted)]


@router.post("/cases/{case_id}/registrations", status_code=201)
def create_registration(
    case_id: Identifier, wish: RegistrationCreate, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Create a registration; If-Match refers to the copied one."""
    expected = condition.expected()
    if wish.copy_of is None:
        if expected is not None:
            raise InputError("a new registration has no revision that If-Match could ask for; leave it out.")
        content = RegistrationContent(to=wish.to or "patient")
        return _told(condition, services.registrations.create(case_id, wish.name, content))
    if wish.to is not None:
        raise InputError("a copy is registered to what the copied one is; leave 'to' out.")
    if services.registrations.get(wish.copy_of).case_id != case_id:
        raise InputError("the registration to copy belongs to another case.")
    return _told(condition, services.registrations.duplicate(wish.copy_of, wish.name, expected_revision=expected))


@router.get("/registrations/{registration_id}")
def show_registration(
    registration_id: Identifier, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """One registration, deleted or not."""
    return _told(condition, services.registrations.get(registration_id))


@router.patch("/registrations/{registration_id}")
def change_registration(
    registration_id: Identifier, change: RegistrationUpdate, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """One per request: rename, lock, state the localisation error, fit the pairs, choose to what, delete or restore."""
    wanted = change.model_dump(exclude={"revision"}, exclude_none=True)
    if len(wanted) != 1:
        raise InputError(f"change one thing of a registration at a time, not {len(wanted)}.")
    expected = condition.expected(change.revision)
    stored, editor = services.registrations, services.registering.editor(registration_id)
    if change.name is not None:
        done = stored.rename(registration_id, change.name, expected_revision=expected)
    elif change.deleted is not None:
        act = stored.delete if change.deleted else stored.restore
        done = act(registration_id, expected_revision=expected)
    elif change.locked is not None:
        done = editor.set_locked(change.locked, expected_revision=expected)
    elif change.fle is not None:
        done = editor.set_fle(change.fle.mm, expected_revision=expected)
    elif change.to is not None:
        done = services.registering.calibrating.register_to(registration_id, change.to, expected_revision=expected)
    else:
        done = editor.fit_pairs(expected_revision=expected)
    return _told(condition, done)


@router.delete("/registrations/{registration_id}")
def delete_registration(
    registration_id: Identifier, services: ServicesDep, condition: ConditionDep, revision: Seen = None
) -> RegistrationPublic:
    """Remove a registration from the lists; it can be restored. A plan that uses it says so."""
    expected = condition.expected(revision)
    return _told(condition, services.registrations.delete(registration_id, expected_revision=expected))


@router.post("/registrations/{registration_id}/restore")
def restore_registration(
    registration_id: Identifier, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Restore a deleted registration."""
    return _told(condition, services.registrations.restore(registration_id, expected_revision=condition.expected()))


@router.post("/registrations/{registration_id}/undo")
def undo(
    registration_id: Identifier, services: ServicesDep, condition: ConditionDep, wish: StepBack | None = None
) -> RegistrationPublic:
    """Undo the newest edit."""
    expected = condition.expected(wish.revision if wish else None)
    return _told(condition, services.registering.editor(registration_id).undo(expected_revision=expected))


@router.post("/registrations/{registration_id}/redo")
def redo(
    registration_id: Identifier, services: ServicesDep, condition: ConditionDep, wish: StepBack | None = None
) -> RegistrationPublic:
    """Redo the newest undone edit."""
    expected = condition.expected(wish.revision if wish else None)
    return _told(condition, services.registering.editor(registration_id).redo(expected_revision=expected))


@router.post("/registrations/{registration_id}/beads", status_code=202)
def start_beads(registration_id: Identifier, wish: BeadsWish, services: ServicesDep) -> JobPublic:
    """Look for beads in the case's CT as a job; what is found stands in the registration, as one edit."""
    return JobPublic.of(services.registering.start_beads(registration_id, wish.diameter_mm, wish.threshold_hu))


@router.patch("/registrations/{registration_id}/beads/{bead_id}")
def judge_bead(
    registration_id: Identifier, bead_id: Identifier, wish: BeadWish, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Confirm a found bead or reject it."""
    editor, expected = services.registering.editor(registration_id), condition.expected(wish.revision)
    return _told(condition, editor.judge_bead(bead_id, confirmed=wish.confirmed, expected_revision=expected))


@router.post("/registrations/{registration_id}/pairs", status_code=201)
def add_pair(
    registration_id: Identifier, wish: PairCreate, services: ServicesDep, condition: ConditionDep
) -> EditedPair:
    """Add a pair: a place in the image (LPS mm), a measured point, or both."""
    editor, expected = services.registering.editor(registration_id), condition.expected(wish.revision)
    pair, done = editor.added_pair(wish.in_image, wish.measured, wish.label, expected_revision=expected)
    return EditedPair(pair=pair, registration=_told(condition, done))


@router.patch("/registrations/{registration_id}/pairs/{pair_id}")
def change_pair(
    registration_id: Identifier, pair_id: Identifier, wish: PairUpdate, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Change a pair; all that is said is one edit."""
    editor, expected = services.registering.editor(registration_id), condition.expected(wish.revision)
    return _told(condition, editor.change_pair(pair_id, wish.fields(), expected_revision=expected))


@router.delete("/registrations/{registration_id}/pairs/{pair_id}")
def delete_pair(
    registration_id: Identifier,
    pair_id: Identifier,
    services: ServicesDep,
    condition: ConditionDep,
    revision: Seen = None,
) -> RegistrationPublic:
    """Delete a pair."""
    editor, expected = services.registering.editor(registration_id), condition.expected(revision)
    return _told(condition, editor.delete_pair(pair_id, expected_revision=expected))


@router.post("/registrations/{registration_id}/pairs/{pair_id}/touch")
def touch(
    registration_id: Identifier, pair_id: Identifier, wish: TouchWish, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Measure a pair with a simulated pointer, for practice: no patient is measured."""
    editor, expected = services.registering.editor(registration_id), condition.expected(wish.revision)
    return _told(condition, editor.touch([pair_id], wish.noise_mm, wish.seed, expected_revision=expected))


@router.post("/registrations/{registration_id}/pairs/{pair_id}/measure")
def measure(
    registration_id: Identifier, pair_id: Identifier, wish: MeasureWish, services: ServicesDep, condition: ConditionDep
) -> MeasuredPair:
    """Measure it with the tracked pointer, whose tip rests on the point for some seconds."""
    expected = condition.expected(wish.revision)
    done, spread = services.registering.measure(registration_id, pair_id, wish.seconds, expected_revision=expected)
    return MeasuredPair(spread_mm=spread, registration=_told(condition, done))


@router.get("/registrations/{registration_id}/order")
def show_order(registration_id: Identifier, services: ServicesDep) -> OrderAnswer:
    """In which order the measured points fit the places in the image; several where the layout is symmetric."""
    return services.registering.order(services.registrations.get(registration_id).content)


@router.post("/registrations/{registration_id}/order")
def use_order(
    registration_id: Identifier, wish: OrderWish, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Take an order, as one edit."""
    editor, expected = services.registering.editor(registration_id), condition.expected(wish.revision)
    return _told(condition, editor.reorder(wish.measured_of, expected_revision=expected))


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


@router.put("/plans/{plan_id}/registration")
def use_registration(
    plan_id: Identifier, wish: PlanRegistrationWish, services: ServicesDep, condition: ConditionDep
) -> PlanPublic:
    """Use a registration of the plan's case, or none, as one edit that undo takes back."""
    expected = condition.expected(wish.revision)
    plan = services.registering.use(plan_id, wish.registration, expected_revision=expected)
    condition.tell(plan.revision)
    return PlanPublic.of(plan)


def _told(condition: Condition, document: StoredRegistration) -> RegistrationPublic:
    condition.tell(document.revision)
    return RegistrationPublic.of(document)
