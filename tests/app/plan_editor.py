"""One plan of a test, with the shortest way to its operations."""

from __future__ import annotations

from app.operations.operation import Change
from app.plans.operations.base import PlanEdit
from app.plans.service import Plan, PlanService


class PlanEditor:
    """A plan by its id: as it is stored, and what is done to it."""

    def __init__(self, plans: PlanService, plan_id: str) -> None:
        self._plans, self._id = plans, plan_id
        self._document = plans.documents.editor(plan_id)

    @property
    def plan(self) -> Plan:
        return self._plans.get(self._id)

    @property
    def revision(self) -> int:
        return self.plan.revision

    def history(self) -> tuple[bool, bool]:
        """Whether there is something to undo, and something to redo."""
        return self._document.history()

    def do(self, operation: Change, *, expected_revision: int | None = None) -> Plan:
        """The plan after an operation."""
        return self._plans.do(self._id, operation, expected_revision=expected_revision)

    def add(self, operation: PlanEdit, *, expected_revision: int | None = None) -> str:
        """Id of what an operation adds."""
        return operation.added(self.do(operation, expected_revision=expected_revision).content)
