"""Plans as documents."""

from __future__ import annotations

from typing import Any

from app.cases.structures import BONE
from app.documents import DocumentErrors, DocumentKind, Ref
from app.kit.errors import PlanConflict, PlanLocked
from app.plans.diff import changes
from app.plans.model import (
    PlanContent,
    check_content,
    content_from_json,
    content_to_json,
)
from app.plans.paths import FIRST_NAME, FIRST_PATH
from vfix_engine.errors import PlanError

# Of a stored content. A vfix from before there were zones must refuse it, not drive without them; the schema of files,
# which have had each new key beside the old ones, is another one.
STORED = "vfix-plan/2"
BEFORE_PATHS = "vfix-plan/1"


def _with_paths(data: dict[str, Any]) -> dict[str, Any]:
    """What was stored before there were several paths: its path is called 'Path 1'."""
    return {**data, "path_id": FIRST_PATH, "paths": [{"id": FIRST_PATH, "name": FIRST_NAME}]}


def _refs(content: PlanContent) -> tuple[Ref, ...]:
    """The structure that the controller keeps away from, those that zones are parts of, and the registration."""
    named = [zone.shape["structure"] for zone in content.zones if "structure" in zone.shape]
    structures = tuple(Ref("structure", one) for one in dict.fromkeys([BONE, *named]))
    return structures if content.registration is None else (*structures, Ref("document", content.registration))


PLAN = DocumentKind(
    name="plan",
    noun="plan",
    schema=STORED,
    empty=PlanContent,
    read=content_from_json,
    write=content_to_json,
    check=check_content,  # what is acknowledged can be read again, whichever edit made it
    refs=_refs,
    upgrades={BEFORE_PATHS: (STORED, _with_paths)},
    errors=DocumentErrors(refused=PlanError, conflict=PlanConflict, locked=PlanLocked),
    changes=changes,
    undo_hint=(
        "Undo its newest edit with POST /api/v1/plans/{id}/undo. Or set its settings anew with "
        "PATCH /api/v1/plans/{id}, or delete it."
    ),
)
