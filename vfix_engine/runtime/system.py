"""Protocols of every world that can be driven, such as the rigid tool and the snake.

The loop owns clock, heartbeats, the attenuation of the hand's force, and the recorder.
A system owns its world: a pure step function from state and command to state, including the certificate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .camera_hand import DrivenCamera
from .command import Command
from .requests import Request
from .settings import WorldSettings
from .snapshot import Snapshot

UPRIGHT = np.eye(3)
UPRIGHT.setflags(write=False)
NO_LEVER = np.zeros(3)
NO_LEVER.setflags(write=False)

S = TypeVar("S")
A = TypeVar("A", contravariant=True)  # what a certificate knows of the state
M = TypeVar("M", contravariant=True)  # a motion
V = TypeVar("V", covariant=True)  # the verdict

Worker = Callable[[Any], Any]  # maps the inputs of a ``Background`` to its result; runs in a process of its own


class Column(NamedTuple):
    """Name and unit of one column of a row; the unit is '' for a dimensionless number."""

    name: str
    unit: str


class Grip(NamedTuple):
    """Point where the operator holds the robot, and the virtual coupling to the hand.

    position: (3,) in LPS mm; stiffness in N/mm; cap: largest force in N.
    axes: (3, 3) of a device that is pushed and turned, as columns in the patient frame: right and down in the picture
        and into it, or the axes of the robot's base. lever: (3,) in mm from the tip to the grip.
    """

    position: Array
    stiffness: float
    cap: float
    axes: Array = UPRIGHT
    lever: Array = NO_LEVER


@dataclass(frozen=True)
class Background:
    """Work that takes longer than a step, for the worker process.

    inputs: argument of the spec's worker; plain values and arrays.
    steps: of the state that requests it; the age of the result at its adoption is counted from there.
    """

    inputs: Any
    steps: int


class Certificate(Protocol[A, M, V]):
    """What decides whether a motion may be made, whoever proposes it: asked about the whole of it, from start to end.

    A motion that is certified keeps every bound or margin, and every joint within its range.
    """

    def certify(self, state: A, motion: M, /) -> V:
        """The verdict on a motion from a state; nothing moves by it."""
        ...


class System(Protocol[S]):
    """A world that is driven step by step. Its state is immutable and contains everything that the next step needs.

    Settings in force are part of the state, so that ``step`` is a pure function and any state can be restored.
    """

    @property
    def row_layout(self) -> tuple[Column, ...]:
        """Names and units of the numbers that ``row`` writes; constant."""
        ...

    def prepare(self) -> None:
        """Compile and load every kernel that a step can need, and allocate memory; nothing moves."""
        ...

    def start(self) -> S:
        """Return the initial state, at rest.

        Raises:
            StartRefused: the start violates a limit or margin.
        """
        ...

    def step(self, state: S, command: Command) -> S:
        """Advance by one certified control period. Never raises for a finite command: an infeasible motion is held."""
        ...

    def apply(self, state: S, request: Request) -> S:
        """Return the state after a typed request; the loop handles ``Reset`` by ``start``.

        Raises:
            ControlError, InputError: the request cannot be carried out; the state is unchanged.
        """
        ...

    def settings(self, state: S) -> WorldSettings:
        """The settings in force."""
        ...

    def period_s(self, state: S) -> float:
        """Return the control period in s, which settings can change."""
        ...

    def steps(self, state: S) -> int:
        """Control periods since the start."""
        ...

    def at_rest(self, state: S, running: bool) -> bool:
        """Whether steps without a command would change nothing, so that the loop can stop stepping.

        running: the clock runs; a moving lumen is then never at rest, and a moving tool is never at rest.
        """
        ...

    def grip(self, state: S) -> Grip | None:
        """Return the point that the operator's hand pulls; None if the world has none."""
        ...

    def camera(self, state: S) -> DrivenCamera | None:
        """Return the camera that a drag in its picture moves; None if the world has none."""
        ...

    def row(self, state: S, out: Array) -> None:
        """Write the numbers of ``row_layout`` into ``out`` (len(row_layout),); called at every tick; a few µs."""
        ...

    def snapshot(self, state: S) -> Snapshot:
        """Return the view of a state, at display rate."""
        ...

    def background(self, state: S) -> Background | None:
        """Return the next job of the worker, or None; called at every tick while the worker is free; must be cheap."""
        ...

    def adopt(self, state: S, result: Any, age_s: float) -> S:
        """Return the state with a worker's result; ``age_s``: simulated time since the state that requested it.

        A result that no longer fits is discarded: the state is returned unchanged.
        """
        ...


class SystemSpec(Protocol):
    """A world as plain values and arrays, which can be sent to another process and stored in a run's manifest."""

    @property
    def world(self) -> str:
        """'rigid', 'snake', or the name of another world."""
        ...

    @property
    def snapshot_type(self) -> type[Snapshot]:
        """Class of the system's snapshots, which are sent as MessagePack."""
        ...

    @property
    def snapshot_numbers(self) -> int:
        """Largest number of floats in the joints, the capsules (7 each) and other arrays that grow with the robot."""
        ...

    def build(self) -> System[Any]:
        """Build the system.

        Raises:
            VfixError: the system that the spec describes cannot be built.
        """
        ...

    @property
    def has_worker(self) -> bool:
        """Whether the system requests background work, so that a worker process is started."""
        ...

    def worker(self) -> Worker:
        """Return the function from ``Background.inputs`` to a result; called once, in the worker process.

        Inputs and results are plain values: numbers, text, lists, dictionaries and arrays.
        """
        ...

    def to_parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Return plain values for JSON, and arrays by name, from which ``from_parts`` creates an equal spec.

        Raises:
            InputError: a part cannot be written, such as a user-defined fixture; the message names it.
        """
        ...

    @classmethod
    def from_parts(cls, values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Inverse of ``to_parts``. Raises InputError."""
        ...
