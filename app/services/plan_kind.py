"""Plans as documents."""

from __future__ import annotations

from app.services.documents import Document, DocumentErrors, DocumentKind, Ref
from app.services.errors import PlanConflict, PlanLocked
from app.services.plan_model import (
    SCHEMA,
    Plan,
    PlanContent,
    check_content,
    content_from_json,
    content_to_json,
)
from app.services.structures import BONE
from vfix_engine.errors import PlanError

PLAN = DocumentKind(
    name="plan",
    noun="plan",
    schema=SCHEMA,
    empty=PlanContent,
    read=content_from_json,
    write=content_to_json,
    check=check_content,
    refs=lambda content: (Ref("structure", BONE),),  # the structure that the controller keeps away from
    errors=DocumentErrors(refused=PlanError, conflict=PlanConflict, locked=PlanLocked),
    undo_hint=(
        "Take its newest edit back with POST /api/plans/{id}/undo, set its settings anew with PATCH /api/plans/{id}, "
        "or delete it."
    ),
)


def plan_of(document: Document[PlanContent]) -> Plan:
    """A document of this kind as the plan that clients see."""
    content = document.content
    return Plan(
        id=document.id,
        name=document.name,
        case_id=document.case_id,
        case_hash=document.case_hash,
        points=content.points,
        targets=content.targets,
        tool=content.tool,
        tool_shape=content.tool_shape,
        robot=content.robot,
        settings=content.settings,
        created=document.created,
        modified=document.modified,
        revision=document.revision,
        locked=document.locked,
        deleted_at=document.deleted_at,
        unreadable=document.unreadable,
        schema=document.schema,
    )
