"""Edits of a plan's zones, of its removed bone and of what lies over it: each an edit of its document."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from app.cases.second_volume import SecondVolume, check_second
from app.documents import DocumentEditor
from app.plans.document import plan_of
from app.plans.edits import BoneEdits, ZoneEdits
from app.plans.model import Plan, PlanContent, check_content


class PlanEditor:
    """Edits that are no operations yet, each of which returns the plan that it made, or the id of what it added."""

    def __init__(self, document: DocumentEditor[PlanContent]) -> None:
        self._document = document
        self.zones = ZoneEdits(self._edit)
        self.removed_bone = BoneEdits(self._edit)

    @property
    def plan(self) -> Plan:
        """The plan as stored now."""
        return plan_of(self._document.document)

    def become(self, content: PlanContent, *, expected_revision: int | None = None) -> Plan:
        """Take over another content as one edit; the settings, which are no step of the history, stay."""
        checked = check_content(content)
        return self._edit(lambda c: replace(checked, settings=c.settings), expected_revision)

    def lay_over(self, second: SecondVolume | None, *, expected_revision: int | None = None) -> Plan:
        """Lay a second volume over the head's slices; None takes it away."""
        checked = check_second(second)
        return self._edit(lambda content: replace(content, second_volume=checked), expected_revision)

    def _edit(self, change: Callable[[PlanContent], PlanContent], expected_revision: int | None) -> Plan:
        return plan_of(self._document.edit(change, expected_revision=expected_revision))
