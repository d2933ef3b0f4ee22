"""What the planner knows of a tab before a client opens it."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.messages.fields import ClientMessage

if TYPE_CHECKING:  # slow to load, and the address needs none of it
    from app.cases.structures import CaseKind

Input = Literal["none", "edit", "drive"]
Endoscope = Literal["none", "offered", "first"]


@dataclass(frozen=True)
class TabSpec:
    """A tab of the page, declared as ``SPEC`` by the package that is its folder.

    name: names the tab in commands and addresses; lower-case letters and digits.
    label: on its tab. order: of the tabs, ascending.
    package: dotted name of its folder, which is its ``__name__``. tab: the subclass of
    ``Tab`` in its ``tab.py``.
    commands: what its clients may send. sections: a TypedDict whose keys are the sections that it publishes.
    input: what keys of the page and clicks in its slices do: nothing of the tab's own, edit the open plan, or drive
    the robot, whose figures the status bar shows then.
    endoscope: whether the page offers the picture of one beside the scene; 'first': shows it large until another layout
    is chosen there.
    documents: kinds of documents whose operations it does itself, since one may be open in it; those of other kinds
    are done in the store.
    kinds: of cases that it is for; empty: for any, and shown without one, too.
    needs: what has to be open before the tab can be.
    has_routes: its ``routes.py`` has a ``router``, whose addresses lie below ``/api/v1/steps/NAME/``.
    """

    name: str
    label: str
    order: int
    package: str
    tab: str
    commands: tuple[type[ClientMessage], ...] = ()
    sections: type | None = None
    input: Input = "none"
    has_routes: bool = False
    documents: tuple[str, ...] = ()
    kinds: tuple[CaseKind, ...] = ()
    needs: Literal["nothing", "case", "plan"] = "nothing"
    endoscope: Endoscope = "none"

    @property
    def for_heads(self) -> bool:
        """Whether it needs what the planner gets ready for a head; what a lumen needs is told by its own tabs."""
        return not self.kinds or "head" in self.kinds

    @property
    def folder(self) -> Path:
        """Where ``panel.js`` lies."""
        file = importlib.import_module(self.package).__file__
        assert file is not None
        return Path(file).parent
