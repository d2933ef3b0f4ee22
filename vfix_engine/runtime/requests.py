"""Typed requests: changes made once, between two steps, in contrast to a command, which lasts one step.

A world can define its own requests: any frozen dataclass derived from ``Request``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .control_mode import Control
from .settings import WorldSettings


@dataclass(frozen=True)
class Request:
    """Base class of all requests; sent to the control process and recorded with its step number."""


@dataclass(frozen=True)
class Reset(Request):
    """Return to the start, at rest."""


@dataclass(frozen=True)
class SetSettings(Request):
    """Change the settings at the same pose and velocity; refused if the pose violates them."""

    settings: WorldSettings


@dataclass(frozen=True)
class SetTask(Request):
    """Select the operator's task: its name and, if it has one, the number of its target."""

    task: str
    target: int = 0


@dataclass(frozen=True)
class SetControl(Request):
    """Change who leads the tool, and by which device; the commands change by it, the world's state does not."""

    control: Control


@dataclass(frozen=True)
class Straighten(Request):
    """Move the manipulated links back to the conforming shape; ends when it is reached or by the next command."""


@dataclass(frozen=True)
class Bend(Request):
    """Move the manipulated joints to ``goal`` (2L',) in rad from the conforming shape; ends like ``Straighten``."""

    goal: tuple[float, ...]


@dataclass(frozen=True)
class Note(Request):
    """What is recorded with the run at its step and changes nothing, such as a task that begins.

    kind: by which readers find it; content: JSON's types.
    timed: from then on, up to a reset, a control process steps also while nobody holds anything, unless it is paused:
        what is noted counts its time.
    """

    kind: str
    content: Mapping[str, Any]
    timed: bool = False
