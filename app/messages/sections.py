"""Values that sections of the view model are made of, and the messages that the planner sends.

A section is a typed dictionary of plain JSON values; one that does not exist is None.
Lengths are in mm, forces in N, positions in the patient frame (LPS).
Each tab declares its sections in its own ``sections.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Generic, Literal, NotRequired, TypedDict, TypeVar

Value = TypeVar("Value", covariant=True)
_Cheap = TypeVar("_Cheap")


@dataclass(frozen=True)
class Section(Generic[Value]):
    """A section as it is now, not built yet.

    key: whatever its value depends on; while it is equal to the key of what is shown, nothing is built. build: makes
    the value, a TypedDict or None.
    """

    key: object
    build: Callable[[], Value]

    @staticmethod
    def of(value: _Cheap) -> Section[_Cheap]:
        """A value that costs less than to tell whether it is another one."""
        return Section(value, lambda: value)


Sections = Mapping[str, Section[object]]  # by name


@dataclass(frozen=True)
class Length:
    """Number of entries of an annotated list; it becomes a tuple in the declarations."""

    count: int


Position = Annotated[list[float], Length(3)]


class TabEntry(TypedDict):
    """A tab of the page: the label of its tab, and the address of the module that draws its panel."""

    name: str
    label: str
    panel: str


class OperationEntry(TypedDict):
    """An operation on a document: the type of its message, and its name for people."""

    type: str
    name: str


class HelloMessage(TypedDict):
    """The first message to a client: the version of all that follow, the tabs in their order, and the operations."""

    type: Literal["hello"]
    version: int
    steps: list[TabEntry]
    operations: list[OperationEntry]


class StateMessage(TypedDict):
    """Sections that changed, by name."""

    type: Literal["state"]
    sections: dict[str, object]


class ErrorMessage(TypedDict):
    """Why a command was refused."""

    message: str


class NoteMessage(TypedDict):
    """Words for the user."""

    type: Literal["note"]
    words: str
    error: bool


class ReplyMessage(TypedDict):
    """The answer to a command that asked for one by its id."""

    type: Literal["reply"]
    id: int
    ok: bool
    result: NotRequired[object]
    error: NotRequired[ErrorMessage]
