"""Plans and their points: list, make, change, undo, evaluate, delete and restore."""

import math
from typing import Annotated

from fastapi import APIRouter, Query

from app.api.dependencies import ERRORS, Condition, ConditionDep, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.plan_models import (
    EditedPoint,
    EvaluationPublic,
    PlanCreate,
    PlanPublic,
    PlanUpdate,
    PointCreate,
    PointUpdate,
    SnapPublic,
    SnapWish,
    SoftTissuePublic,
    StepBack,
    TargetCreate,
    TargetsTake,
)
from app.kit.errors import NotFound
from app.plans.model import check_robot
from app.plans.service import Plan
from vfix_engine.errors import InputError, PlanError

router = APIRouter(tags=["plans"], responses=ERRORS)

Deleted = Annotated[bool, Query()]
Seen = Annotated[int | None, Query(ge=0)]


@router.get("/plans")
def list_plans(
    services: ServicesDep, case_id: Annotated[str | None, Query(max_length=64)] = None, include_deleted: Deleted = False
) -> list[PlanPublic]:
    """Plans of a case, or of all, oldest first."""
    return [PlanPublic.of(plan) for plan in services.plans.list(case_id, include_deleted)]


@router.get("/cases/{case_id}/plans")
def list_plans_of_case(
    case_id: Identifier, services: ServicesDep, include_deleted: Deleted = False
) -> list[PlanPublic]:
    """Plans of a case, oldest first."""
    services.cases.get(case_id)
    return [PlanPublic.of(plan) for plan in services.plans.list(case_id, include_deleted)]


@router.post("/cases/{case_id}/plans", status_code=201)
def create_plan(case_id: Identifier, wish: PlanCreate, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """Create a plan; If-Match refers to the copied one."""
    expected = condition.expected()
    if wish.copy_of is None:
        if expected is not None:
            raise InputError("a new plan has no revision that If-Match could ask for; leave it out.")
        return _told(condition, services.plans.create(case_id, wish.name))
    if services.plans.get(wish.copy_of).case_id != case_id:
        raise PlanError("the plan to copy belongs to another case.")
    return _told(condition, services.plans.duplicate(wish.copy_of, wish.name, expected_revision=expected))


@router.get("/plans/{plan_id}")
def show_plan(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """One plan, deleted or not."""
    return _told(condition, services.plans.get(plan_id))


@router.patch("/plans/{plan_id}")
def change_plan(plan_id: Identifier, change: PlanUpdate, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """One per request: rename, lock or unlock, set settings, robot or tool, delete or restore."""
    wanted = change.model_dump(exclude={"revision"}, exclude_none=True)
    if len(wanted) != 1:
        raise PlanError(f"change one thing of a plan at a time, not {len(wanted)}.")
    expected = condition.expected(change.revision)
    if change.name is not None:
        plan = services.plans.rename(plan_id, change.name, expected_revision=expected)
    elif change.deleted is not None:
        act = services.plans.delete if change.deleted else services.plans.restore
        plan = act(plan_id, expected_revision=expected)
    elif change.locked is not None:
        plan = services.plans.editor(plan_id).set_locked(change.locked, expected_revision=expected)
    elif change.robot is not None:
        robot = change.robot.model_dump(exclude_none=True)
        services.instruments.robot(check_robot(robot))
        plan = services.plans.editor(plan_id).choose_robot(robot, expected_revision=expected)
    elif change.tool is not None:
        choose = services.plans.editor(plan_id).choose_tool
        plan = choose(change.tool.name, change.tool.shape(), expected_revision=expected)
    else:
        plan = services.plans.editor(plan_id).set_settings(change.settings or {}, expected_revision=expected)
    return _told(condition, plan)


@router.post("/plans/{plan_id}/placing")
def place_robot(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """Keep the placing that the dry run finds for the plan's robot with the plan, as one edit."""
    expected = condition.expected()
    plan = services.plans.get(plan_id)
    robot = services.planning.placed_robot(plan)
    seen = plan.revision if expected is None else expected
    return _told(condition, services.plans.editor(plan_id).set_robot(robot, expected_revision=seen))


@router.delete("/plans/{plan_id}")
def delete_plan(
    plan_id: Identifier, services: ServicesDep, condition: ConditionDep, revision: Seen = None
) -> PlanPublic:
    """Remove a plan from the lists; it can be restored."""
    return _told(condition, services.plans.delete(plan_id, expected_revision=condition.expected(revision)))


@router.post("/plans/{plan_id}/restore")
def restore_plan(plan_id: Identifier, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """Restore a deleted plan."""
    return _told(condition, services.plans.restore(plan_id, expected_revision=condition.expected()))


@router.post("/plans/{plan_id}/points", status_code=201)
def add_point(plan_id: Identifier, wish: PointCreate, services: ServicesDep, condition: ConditionDep) -> EditedPoint:
    """Add a path point at the given position; `snap` finds one that is clear of bone."""
    expected = condition.expected(wish.revision)
    add = services.plans.editor(plan_id).added_point
    return _point(condition, *add(wish.position, wish.label, wish.index, expected_revision=expected))


@router.post("/plans/{plan_id}/targets", status_code=201)
def add_target(plan_id: Identifier, wish: TargetCreate, services: ServicesDep, condition: ConditionDep) -> EditedPoint:
    """Add a target."""
    add = services.plans.editor(plan_id).added_target
    return _point(condition, *add(wish.position, wish.label, expected_revision=condition.expected(wish.revision)))


@router.post("/plans/{plan_id}/targets/take")
def take_targets(plan_id: Identifier, wish: TargetsTake, services: ServicesDep, condition: ConditionDep) -> PlanPublic:
    """Add the targets of another plan of the same head, as one edit; those that are here already are left out."""
    other, expected = services.plans.get(wish.plan), condition.expected(wish.revision)
    return _told(condition, services.plans.editor(plan_id).take_targets(other, expected_revision=expected))


@router.patch("/plans/{plan_id}/points/{point_id}")
def change_point(
    plan_id: Identifier, point_id: Identifier, change: PointUpdate, services: ServicesDep, condition: ConditionDep
) -> EditedPoint:
    """Move a path point or a target, or change its label: one per request."""
    if (change.position is None) == (change.label is None):
        raise PlanError("give either a position or a label.")
    editor, expected = services.plans.editor(plan_id), condition.expected(change.revision)
    if change.label is not None:
        plan = editor.rename_point(point_id, change.label, expected_revision=expected)
    else:
        assert change.position is not None
        move = editor.move_target if _is_target(editor.plan, point_id) else editor.move_point
        plan = move(point_id, change.position, expected_revision=expected)
    return _point(condition, point_id, plan)


@router.delete("/plans/{plan_id}/points/{point_id}")
def delete_point(
    plan_id: Identifier,
    point_id: Identifier,
    services: ServicesDep,
    condition: ConditionDep,
    revision: Seen = None,
) -> PlanPublic:
    """Delete a path point or a target."""
    editor = services.plans.editor(plan_id)
    act = editor.delete_target if _is_target(editor.plan, point_id) else editor.delete_point
    return _told(condition, act(point_id, expected_revision=condition.expected(revision)))


@router.post("/plans/{plan_id}/undo")
def undo(
    plan_id: Identifier, services: ServicesDep, condition: ConditionDep, wish: StepBack | None = None
) -> PlanPublic:
    """Undo the newest edit."""
    expected = condition.expected(wish.revision if wish else None)
    return _told(condition, services.plans.editor(plan_id).undo(expected_revision=expected))


@router.post("/plans/{plan_id}/redo")
def redo(
    plan_id: Identifier, services: ServicesDep, condition: ConditionDep, wish: StepBack | None = None
) -> PlanPublic:
    """Redo the newest undone edit."""
    expected = condition.expected(wish.revision if wish else None)
    return _told(condition, services.plans.editor(plan_id).redo(expected_revision=expected))


@router.post("/cases/{case_id}/snap")
def snap(case_id: Identifier, wish: SnapWish, services: ServicesDep) -> SnapPublic:
    """The nearest point clear of bone, and what surrounds it."""
    return SnapPublic.model_validate(
        services.planning.snap(services.cases.get(case_id), wish.position), from_attributes=True
    )


@router.post("/plans/{plan_id}/evaluation", status_code=202)
def start_evaluation(plan_id: Identifier, services: ServicesDep) -> JobPublic:
    """Start a dry run of the plan as a job; afterwards the evaluation is available at once."""
    return JobPublic.of(
        services.dry_runs.start(services.plans.get(plan_id), services.rehearsal_options.of(plan_id).in_force)
    )


@router.get("/plans/{plan_id}/evaluation")
def evaluate(plan_id: Identifier, services: ServicesDep) -> EvaluationPublic:
    """Dry run of the plan; takes seconds the first time."""
    plan = services.plans.get(plan_id)
    result = services.dry_runs.evaluate(plan, services.rehearsal_options.of(plan_id).in_force)
    clearance = [None if math.isnan(value) else value for value in result.clearance.tolist()]
    return EvaluationPublic(
        revision=plan.revision,
        verdict=result.verdict.level,
        short=result.verdict.short,
        words=result.verdict.words,
        s_mm=result.s.tolist(),
        positions=result.positions.tolist(),
        clearance_mm=clearance,
        min_clearance_mm=result.min_clearance_mm,
        bone_clearance_mm=clearance,
        min_bone_clearance_mm=result.min_clearance_mm,
        soft_tissue=SoftTissuePublic.model_validate(result.soft_tissue, from_attributes=True),
        completed=result.completed,
        reason=result.reason,
        reached_mm=result.reached_mm,
        length_mm=result.length_mm,
        degree=result.degree,
        transform_base_to_patient=None if result.placement is None else result.placement.tolist(),
        transform_base_to_image=result.base.tolist(),
        q_start=result.q_start.tolist(),
        removed_mm3=result.removed_mm3,
    )


def _is_target(plan: Plan, point_id: str) -> bool:
    return any(target.id == point_id for target in plan.targets)


def _told(condition: Condition, plan: Plan) -> PlanPublic:
    condition.tell(plan.revision)
    return PlanPublic.of(plan)


def _point(condition: Condition, point_id: str, plan: Plan) -> EditedPoint:
    condition.tell(plan.revision)
    for point in (*plan.points, *plan.targets):
        if point.id == point_id:
            return EditedPoint(**vars(point), revision=plan.revision)
    raise NotFound(f"there is no point {point_id!r:.80} in this plan.")
