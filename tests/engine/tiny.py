"""The smallest world: a number that the hand pushes, and a worker that halves it."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from vfix_engine.errors import ControlError, InputError
from vfix_engine.runtime import (
    Background,
    Column,
    Command,
    Grip,
    Request,
    SetSettings,
    Snapshot,
    Worker,
)

Array = NDArray[np.float64]
EVERY = 10  # steps between two requests for background work


@dataclass(frozen=True)
class TinyLimit:
    low: float
    high: float
    unit: str = ""
    label: str = ""


@dataclass(frozen=True)
class TinySettings:
    gain: float = 1.0
    period_s: float = 0.002

    @staticmethod
    def bounds() -> dict[str, TinyLimit]:
        return {"gain": TinyLimit(0.0, 10.0), "period_s": TinyLimit(1e-4, 0.1)}

    def clamped(self, /, **changes: float) -> Self:
        return replace(self, **changes)

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any], /) -> Self:
        return cls(**data)


@dataclass(frozen=True)
class Jump(Request):
    """Elsewhere at once."""

    to: float


@dataclass(frozen=True)
class TinyState:
    settings: TinySettings
    steps: int = 0
    x: float = 0.0
    half: float = 0.0
    half_age_s: float = 0.0
    pushed: bool = False


@dataclass(frozen=True, kw_only=True)
class TinySnapshot(Snapshot):
    half: float


class TinySystem:
    def __init__(self, settings: TinySettings):
        self._settings = settings
        self.row_layout = (Column("t", "s"), Column("x", "mm"), Column("half", "mm"), Column("half_age", "s"))

    def prepare(self) -> None:
        pass

    def start(self) -> TinyState:
        return TinyState(self._settings)

    def step(self, state: TinyState, command: Command) -> TinyState:
        push = float(command.force[0]) + command.drive + command.axes[2]
        x = state.x + math.sin(state.settings.gain * push) * state.settings.period_s + 1e-3 * state.half
        return replace(state, steps=state.steps + 1, x=x, pushed=push != 0.0)

    def apply(self, state: TinyState, request: Request) -> TinyState:
        if isinstance(request, SetSettings) and isinstance(request.settings, TinySettings):
            return replace(state, settings=request.settings)
        if isinstance(request, Jump):
            return replace(state, x=request.to)
        raise ControlError(f"no {type(request).__name__} here")

    def settings(self, state: TinyState) -> TinySettings:
        return state.settings

    def period_s(self, state: TinyState) -> float:
        return state.settings.period_s

    def steps(self, state: TinyState) -> int:
        return state.steps

    def at_rest(self, state: TinyState, running: bool) -> bool:
        return not state.pushed

    def grip(self, state: TinyState) -> Grip | None:
        return Grip(np.array([state.x, 0.0, 0.0]), 0.5, 2.0)

    def camera(self, state: TinyState) -> None:
        return None

    def row(self, state: TinyState, out: Array) -> None:
        out[:] = state.steps * state.settings.period_s, state.x, state.half, state.half_age_s

    def snapshot(self, state: TinyState) -> TinySnapshot:
        return TinySnapshot(
            t=state.steps * state.settings.period_s,
            q=np.array([state.x]),
            capsules=np.zeros((0, 7)),
            tip=np.array([state.x, 0.0, 0.0]),
            camera=np.eye(4),
            outcome="moved" if state.pushed else "idle",
            progress_mm=state.x,
            length_mm=0.0,
            steps=state.steps,
            half=state.half,
        )

    def background(self, state: TinyState) -> Background | None:
        if state.steps % EVERY or not state.steps:
            return None
        return Background({"x": np.array([state.x])}, state.steps)

    def adopt(self, state: TinyState, result: Any, age_s: float) -> TinyState:
        return replace(state, half=float(result["half"][0]), half_age_s=age_s)


def halved(inputs: dict[str, Array]) -> dict[str, Any]:
    """The worker; a negative number fails, and one below -100 ends its process."""
    if -100.0 <= inputs["x"][0] < -50.0:
        raise ValueError("too low")
    if inputs["x"][0] < -100.0:
        os._exit(3)
    return {"half": 0.5 * inputs["x"], "process": os.getpid()}


@dataclass(frozen=True)
class TinySpec:
    gain: float = 1.0

    world = "tiny"
    snapshot_type = TinySnapshot
    snapshot_numbers = 0
    has_worker = True

    def build(self) -> TinySystem:
        return TinySystem(TinySettings(self.gain))

    def worker(self) -> Worker:
        return halved

    def to_parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        return {"gain": self.gain}, {"nothing": np.arange(3)}

    @classmethod
    def from_parts(cls, values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Self:
        if "gain" not in values:
            raise InputError("no gain")
        return cls(values["gain"])
