"""Values that sections of the view model are made of, and the messages that the planner sends.

A section is a typed dictionary of plain JSON values; one that does not exist is None.
Lengths are in mm, forces in N, positions in the patient frame (LPS).
Each step declares its sections in its own ``sections.py``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, NotRequired, TypedDict

Sections = Mapping[str, object]  # by name; each section is a TypedDict or None


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


class HelloMessage(TypedDict):
    """The first message to a client: the version of all that follow, and the steps in the order of their tabs."""

    type: Literal["hello"]
    version: int
    steps: list[TabEntry]


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
