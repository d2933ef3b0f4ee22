"""The protocols of everything that is driven: the rigid tool, the snake, and whatever comes next.

The loop owns clock, heartbeats, the decay of the hand's force, and the recorder.
A system owns its world: a pure step from state and command to state, certificate included.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, Self, TypeVar

from numpy.typing import NDArray

from ..arrays import Array
from .command import Command
from .requests import Request
from .settings import WorldSettings
from .snapshot import Snapshot

S = TypeVar("S")
A = TypeVar("A", contravariant=True)  # what a certificate knows of the state
M = TypeVar("M", contravariant=True)  # a motion
V = TypeVar("V", covariant=True)  # the verdict

Worker = Callable[[Any], Any]  # from the inputs of a ``Background`` to its result; runs in a process of its own


class Column(NamedTuple):
    """One column of a row: its name and unit, '' for a number without one."""

    name: str
    unit: str


class Grip(NamedTuple):
    """Where a hand holds the robot, and the virtual coupling between the two.

    position: (3,) in LPS mm; stiffness in N/mm; cap: largest force in N.
    """

    position: Array
    stiffness: float
    cap: float


@dataclass(frozen=True)
class Background:
    """Work that takes longer than a step, for the worker process.

    inputs: what the spec's worker is called with; plain values and arrays.
    steps: of the state that it was asked for; results are adopted with the age that they have by then.
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
    """A world that is driven step by step. Its state is immutable and knows everything that the next step needs.

    Settings in force are part of the state, so that ``step`` is a pure function and any state can be gone back to.
    """

    @property
    def row_layout(self) -> tuple[Column, ...]:
        """Names and units of the numbers that ``row`` writes; constant."""
        ...

    def prepare(self) -> None:
        """Compile and load every kernel that a step may need, allocate; nothing moves."""
        ...

    def start(self) -> S:
        """The state at the start, at rest.

        Raises:
            StartRefused: the start violates a limit or margin.
        """
        ...

    def step(self, state: S, command: Command) -> S:
        """One control period; certified within. Never raises for a finite command: what cannot be done is held."""
        ...

    def apply(self, state: S, request: Request) -> S:
        """The state after a typed request; the loop handles ``Reset`` by ``start``.

        Raises:
            ControlError, InputError: what cannot be done; the state is as it was.
        """
        ...

    def settings(self, state: S) -> WorldSettings:
        """The settings in force."""
        ...

    def period_s(self, state: S) -> float:
        """The control period in s, which settings may change."""
        ...

    def steps(self, state: S) -> int:
        """Control periods since the start."""
        ...

    def at_rest(self, state: S, running: bool) -> bool:
        """Whether steps without a command would change nothing: the loop then takes none.

        running: the clock runs; a moving lumen then never rests, and a tool that has speed rests in neither case.
        """
        ...

    def grip(self, state: S) -> Grip | None:
        """Where the operator's hand pulls; None where the world has no such place."""
        ...

    def row(self, state: S, out: Array) -> None:
        """Write the numbers of ``row_layout`` into ``out`` (len(row_layout),), at every tick; a few µs at most."""
        ...

    def snapshot(self, state: S) -> Snapshot:
        """The picture of a state, at display rate."""
        ...

    def background(self, state: S) -> Background | None:
        """What the worker is to compute next, or None; asked at every tick at which the worker is free; cheap."""
        ...

    def adopt(self, state: S, result: Any, age_s: float) -> S:
        """The state with a worker's result; ``age_s``: simulated time since the state that it was asked for.

        A result that no longer fits the state is dropped: the state is returned as it is.
        """
        ...


class SystemSpec(Protocol):
    """A world as plain values and arrays, to be sent to another process and written into a run's manifest."""

    @property
    def world(self) -> str:
        """'rigid', 'snake', or the name of another world."""
        ...

    @property
    def snapshot_type(self) -> type[Snapshot]:
        """The class of the snapshots that the system makes; they cross as MessagePack."""
        ...

    @property
    def snapshot_numbers(self) -> int:
        """How many numbers the joints, the capsules (7 each) and whatever else grows with the robot have at most."""
        ...

    def build(self) -> System[Any]:
        """The system itself.

        Raises:
            VfixError: what the spec describes cannot be built.
        """
        ...

    @property
    def has_worker(self) -> bool:
        """Whether the system asks for background work, so that a worker process is started."""
        ...

    def worker(self) -> Worker:
        """The function from ``Background.inputs`` to a result; called once, in the worker process.

        Inputs and results are plain values: numbers, text, lists, dictionaries and arrays.
        """
        ...

    def to_parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Plain values for JSON, and arrays by name, from which ``from_parts`` makes an equal spec.

        Raises:
            InputError: part of it cannot be written, such as a fixture of one's own; the message names it.
        """
        ...

    @classmethod
    def from_parts(cls, values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Self:
        """The inverse. Raises InputError."""
        ...
