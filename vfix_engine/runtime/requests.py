"""Typed requests: changes that happen once, between two steps, in contrast to a command, which lasts one step.

A world may have requests of its own beyond these: any frozen dataclass that derives from ``Request``.
"""

from __future__ import annotations

from dataclasses import dataclass

from .settings import WorldSettings


@dataclass(frozen=True)
class Request:
    """Base of all requests; it crosses to the control process and is recorded with its step number."""


@dataclass(frozen=True)
class Reset(Request):
    """Back to the start, at rest."""


@dataclass(frozen=True)
class SetSettings(Request):
    """Other settings at the same pose and speed; refused where the pose violates them."""

    settings: WorldSettings


@dataclass(frozen=True)
class SetTask(Request):
    """What the operator does from now on: a task's name and, where it has one, the number of its target."""

    task: str
    target: int = 0


@dataclass(frozen=True)
class Straighten(Request):
    """Bring the manipulated links back to the shape that conforms; it lasts until they are there or a command comes."""


@dataclass(frozen=True)
class Bend(Request):
    """Bring the manipulated joints to ``goal`` (2L',) in rad off the conforming shape; it lasts like ``Straighten``."""

    goal: tuple[float, ...]
