"""The attack on one scene of any world: episodes of hostile input to a system, every step judged."""

from __future__ import annotations

import hashlib
import time
import zlib
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from vfix_engine.runtime.operator import Act
from vfix_engine.runtime.system import System

Random = np.random.Generator

NONSENSE = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e-320, 0.0, 5.0)  # of the operators
FAILURES_KEPT = 5  # of a scene, with the data to reproduce them


@dataclass
class Memory:
    """What an attacker remembers within an episode; count: steps so far."""

    random: Random
    count: int = 0


@dataclass
class Tally:
    """The findings in one scene; ``failures`` holds the data to reproduce the first few.

    deepest_mm: the largest violation. least_room_mm: the least distance to one. used: counts by what was used.
    """

    steps: int = 0
    violations: int = 0
    deepest_mm: float = 0.0
    held: int = 0
    moved: int = 0
    nan: int = 0
    remeasured: int = 0
    replayed: int = 0
    replay_hits: int = 0
    disagreements: int = 0
    limit_violations: int = 0
    exceptions: int = 0
    refused_starts: int = 0
    least_room_mm: float = np.inf
    used: Counter[str] = field(default_factory=Counter)
    failures: list[dict[str, Any]] = field(default_factory=list)

    def report(self) -> dict[str, Any]:
        """Return everything by name; None for a room of which nothing was measured."""
        room = self.least_room_mm if np.isfinite(self.least_room_mm) else None
        return vars(self) | {"least_room_mm": room, "used": dict(sorted(self.used.items()))}

    def fail(self, kind: str, **details: Any) -> None:
        """Keep the data to reproduce a failure."""
        if len(self.failures) < FAILURES_KEPT:
            self.failures.append({"kind": kind, "step": self.steps, **details})


Sys = TypeVar("Sys", bound=System[Any])
S = TypeVar("S")
M = TypeVar("M", bound=Memory)
T = TypeVar("T", bound=Tally)
A = TypeVar("A")  # a scene of the world

Attack = Callable[[M, Sys, S], Act]  # an operator once its memory is bound
Assault = Callable[[Sys, S], S]  # one hostile step of a system, by an operator or past it


@dataclass(eq=False)
class Episode(Generic[M, Sys, S]):
    """A system in a state, what is done to it, and the judge of each step's states before and after.

    steps: at most. doing: names of what is used. around: the context of the steps.
    """

    system: Sys
    state: S
    assault: Assault[Sys, S]
    memory: M
    judge: Callable[[S, S], None]
    steps: int
    doing: tuple[str, ...]
    around: AbstractContextManager[None] = field(default_factory=nullcontext)


class Campaign(ABC, Generic[A, T, M, Sys, S]):
    """Attacks one scene for a number of steps; a function of scene, seed and steps alone (HAZ-13).

    scenes: builders by name; a builder returns the reason if its data are missing. tally_type: class of ``tally``.
    input_key: key of a failure for the names of what was used.
    """

    scenes: ClassVar[Mapping[str, Callable[[Random], Any]]]
    tally_type: ClassVar[type[Any]]
    input_key: ClassVar[str] = "doing"
    arena: A

    def __init__(self, name: str, seed: int, steps: int):
        self.name, self.steps = name, steps
        self.tally: T = self.tally_type()
        self.random = np.random.default_rng([seed, zlib.crc32(name.encode())])

    @abstractmethod
    def size(self) -> dict[str, int]:
        """Return figures of the scene for the report."""

    @abstractmethod
    def begin(self) -> Episode[M, Sys, S] | None:
        """Return the next episode; None if its start was refused."""

    def motion(self, state: Any) -> bytes:
        """Return what of a state enters the hash: its joints."""
        joints: bytes = state.q.tobytes()
        return joints

    @staticmethod
    def shares(total: dict[str, Any]) -> dict[str, float]:
        """Return further figures of all scenes together, from their counts."""
        return {}

    def between(self, episode: Episode[M, Sys, S]) -> None:
        """Change an episode between two steps."""

    def run(self) -> dict[str, Any]:
        """Run the campaign and return its figures; ``skipped`` states the reason if there are none."""
        begin, digest = time.perf_counter(), hashlib.sha256()
        arena = self.scenes[self.name](self.random)
        if isinstance(arena, str):
            return {"name": self.name, "skipped": arena}
        self.arena = arena
        while self.tally.steps < self.steps:
            episode = self.begin()
            if episode is None:
                self.tally.refused_starts += 1
            else:
                self._attack(episode, digest.update)
        figures = self.size() | self.tally.report()
        return {"name": self.name, **figures, "hash": digest.hexdigest(), "seconds": time.perf_counter() - begin}

    def _attack(self, episode: Episode[M, Sys, S], hashed: Callable[[bytes], None]) -> None:
        tally = self.tally
        tally.used.update(episode.doing)
        with episode.around:
            for _ in range(min(episode.steps, self.steps - tally.steps)):
                tally.steps += 1
                try:
                    after = episode.assault(episode.system, episode.state)
                except Exception as error:  # of any type, since a step must never raise
                    tally.exceptions += 1
                    tally.fail("exception", error=repr(error), **{self.input_key: ", ".join(episode.doing)})
                    return
                hashed(self.motion(after))
                episode.judge(episode.state, after)
                episode.memory.count += 1
                episode.state = after
                self.between(episode)
