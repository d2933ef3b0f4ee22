"""What can be done to an assignment: it is opened from a file, taken off the list and restored."""

from __future__ import annotations

from app.assignments.kind import ASSIGNMENT
from app.operations.spec import DocumentSpec
from app.operations.standard import Delete, SetDeleted


class DeleteAssignment(Delete, frozen=True):
    """Take it off the lists; it can be restored, and its runs stay."""

    message = ""


SPEC = DocumentSpec(
    kind=ASSIGNMENT,
    path="assignments",
    id="assignment_id",
    operations=(SetDeleted, DeleteAssignment),
    service="assignments",
)
