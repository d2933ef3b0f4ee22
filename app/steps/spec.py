"""What the planner knows of a step before a client opens it."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from app.messages.fields import Command

Input = Literal["none", "edit", "drive"]


@dataclass(frozen=True)
class StepSpec:
    """A step of the page, declared as ``SPEC`` by the package that is its folder.

    name: names the step in commands and addresses; lower-case letters and digits.
    label: on its tab. order: of the tabs, ascending.
    package: dotted name of its folder, which is its ``__name__``. step: the subclass of
    ``Step`` in its ``step.py``.
    commands: what its clients may send. sections: a TypedDict whose keys are the sections that it publishes.
    input: what keys of the page and clicks in its slices do: nothing of the step's own, edit the open plan, or drive
    the robot, whose figures the status bar shows then.
    has_routes: its ``routes.py`` has a ``router``, whose addresses lie below ``/api/v1/steps/NAME/``.
    """

    name: str
    label: str
    order: int
    package: str
    step: str
    commands: tuple[type[Command], ...] = ()
    sections: type | None = None
    input: Input = "none"
    has_routes: bool = False

    @property
    def folder(self) -> Path:
        """Where ``panel.js`` lies."""
        file = importlib.import_module(self.package).__file__
        assert file is not None
        return Path(file).parent
