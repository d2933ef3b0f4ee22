"""What operations on plans have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

from app.documents import Document
from app.kit.errors import NotFound
from app.operations.operation import Context, Edit
from app.plans.model import PlanContent
from app.plans.service import PlanService

Plans = Context[PlanContent, PlanService]
StoredPlan = Document[PlanContent]


class PlanEdit(Edit, frozen=True):
    """An edit of a plan's content. As a message it is about the plan that the client has open."""

    of_open = True

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        raise NotImplementedError

    def added(self, content: PlanContent) -> str:
        """Id of what it added to the content that it made, which a client selects; '' for none."""
        return ""


class _Named(Protocol):
    @property
    def id(self) -> str: ...


Item = TypeVar("Item", bound=_Named)


def found(items: Sequence[Item], item_id: str, what: str) -> Item:
    """The item of that id. Raises NotFound."""
    for item in items:
        if item.id == item_id:
            return item
    raise NotFound(f"there is no {what} {item_id!r:.80} in this plan.")


def put(items: Sequence[Item], changed: Item) -> tuple[Item, ...]:
    """The items with one changed, by its id."""
    return tuple(changed if item.id == changed.id else item for item in items)


def without(items: Sequence[Item], item_id: str, what: str) -> tuple[Item, ...]:
    """The items without the one of that id. Raises NotFound."""
    gone = found(items, item_id, what)
    return tuple(item for item in items if item is not gone)
