"""A world of its own: a point that a hand moves in a straight tube, whose wall and ends it cannot leave."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from vfix_engine.arrays import Array
from vfix_engine.errors import ControlError, InputError
from vfix_engine.runtime import Column, Command, Grip, Request, Snapshot
from vfix_engine.runtime.settings import NoSettings
from vfix_engine.runtime.snapshot import Blocker

RADIUS_MM, LENGTH_MM, POINT_MM = 20.0, 60.0, 5.0  # of the tube along z from the origin; the point is a ball
SPEED_MM_PER_S, PERIOD_S = 40.0, 0.004


@dataclass(frozen=True)
class TubeState:
    steps: int = 0
    place: tuple[float, float, float] = (0.0, 0.0, LENGTH_MM / 2)
    moved: bool = False
    held_by: str = ""  # '' where the last step was certified


def refused_by(place: Array) -> str:
    """The certificate: what a place would leave the tube by; '' where it is in it."""
    if np.hypot(place[0], place[1]) > RADIUS_MM - POINT_MM:
        return "the wall of the tube"
    return "" if POINT_MM <= place[2] <= LENGTH_MM - POINT_MM else "the end of the tube"


class TubeSystem:
    row_layout = tuple(Column(axis, "mm") for axis in "xyz")

    def prepare(self) -> None: ...

    def start(self) -> TubeState:
        return TubeState()

    def step(self, state: TubeState, command: Command) -> TubeState:
        push = np.clip(command.axes + np.array([0.0, 0.0, command.drive]) + command.force, -1.0, 1.0)
        wanted = np.array(state.place) + push * SPEED_MM_PER_S * PERIOD_S
        held_by, moved = refused_by(wanted), bool(push.any())
        place = state.place if held_by else (float(wanted[0]), float(wanted[1]), float(wanted[2]))
        return replace(state, steps=state.steps + 1, place=place, moved=moved, held_by=held_by)

    def apply(self, state: TubeState, request: Request) -> TubeState:
        raise ControlError(f"a tube knows no {type(request).__name__}")

    def settings(self, state: TubeState) -> NoSettings:
        return NoSettings()

    def period_s(self, state: TubeState) -> float:
        return PERIOD_S

    def steps(self, state: TubeState) -> int:
        return state.steps

    def at_rest(self, state: TubeState, running: bool) -> bool:
        return not state.moved

    def grip(self, state: TubeState) -> Grip:
        return Grip(np.array(state.place), stiffness=0.1, cap=1.0)

    def camera(self, state: TubeState) -> None:
        return None

    def row(self, state: TubeState, out: Array) -> None:
        out[:] = state.place

    def snapshot(self, state: TubeState) -> Snapshot:
        tip, held = np.array(state.place), state.held_by
        return Snapshot(
            t=state.steps * PERIOD_S, q=tip, capsules=np.array([[*tip, *tip, POINT_MM]]), tip=tip, camera=np.eye(4),
            outcome="held" if held else "moved" if state.moved else "idle", progress_mm=tip[2], length_mm=LENGTH_MM,
            steps=state.steps, blockers=(Blocker("tube", words=held),) if held else (),
        )  # fmt: skip

    def background(self, state: TubeState) -> None: ...

    def adopt(self, state: TubeState, result: Any, age_s: float) -> TubeState:
        return state


class TubeSpec:
    world, snapshot_type, snapshot_numbers, has_worker = "tube", Snapshot, 10, False

    def build(self) -> TubeSystem:
        return TubeSystem()

    def worker(self) -> Any:
        raise InputError("a tube has no background work")

    def to_parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        return {}, {}

    @classmethod
    def from_parts(cls, values: Any, arrays: Any) -> Self:
        return cls()
