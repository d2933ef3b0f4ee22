"""The attack in one lumen: episodes with changing settings, controls, hands and lies, every step judged."""

from __future__ import annotations

import hashlib
import time
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from vfix_engine.errors import InputError, PathwayError
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.settings import CONTROLS, DriveSettings
from vfix_engine.worlds.snake.snake_drive import SnakeDrive

from .hands import HANDS, Memory
from .lies import LIES
from .scenes import BUILDERS, Arena
from .watch import Tally, Watch

LONGEST = 240  # largest number of steps of an episode; the least is a quarter of it
LIED_TO = 0.2  # fraction of the episodes with lies
STARTS = 30  # attempts to find the start of an episode
BY_PLACE = 0.5  # fraction of the episodes with the default bounds, which depend on the place


class Campaign:
    """Attacks one scene for a number of steps; a function of scene, seed and steps alone (HAZ-13)."""

    def __init__(
        self,
        name: str,
        seed: int,
        steps: int,
        sabotage: Callable[[SnakeDrive], None] | None = None,
        hands: tuple[str, ...] = tuple(HANDS),
        replays: float = 0.02,
        longest: int = LONGEST,
    ):
        """Prepare the campaign.

        sabotage: modifies every drive, to prove that the judges detect it. hands: names. replays: fraction of the steps
        with a motion that are replayed. longest: largest number of steps of an episode.
        """
        self._name, self._steps, self._sabotage, self._hands = name, steps, sabotage, hands
        self._random = np.random.default_rng([seed, zlib.crc32(name.encode())])
        self.tally, self._replays, self._longest = Tally(), replays, longest
        self._used: Counter[str] = Counter()
        self._digest = hashlib.sha256()

    def run(self) -> dict[str, Any]:
        """Run the campaign and return its figures; ``skipped`` states the reason if there are none."""
        begin = time.perf_counter()
        arena = BUILDERS[self._name]()
        if isinstance(arena, str):
            return {"name": self._name, "skipped": arena}
        while self.tally.steps < self._steps:
            self._episode(arena)
        return {
            "name": self._name,
            "links": arena.links,
            **self.tally.told(),
            "used": dict(sorted(self._used.items())),
            "hash": self._digest.hexdigest(),
            "seconds": time.perf_counter() - begin,
        }

    def _episode(self, arena: Arena) -> None:
        """Run one episode of one hand."""
        drive = self._begin(arena)
        hand, random = str(self._random.choice(self._hands)), np.random.default_rng(self._random.integers(2**63))
        doing = [hand, f"control: {drive.settings.control}"]
        if self._random.random() < LIED_TO:
            lie = str(self._random.choice(list(LIES)))
            LIES[lie](drive, random)
            doing.append(f"lie: {lie}")
        if self._sabotage is not None:
            self._sabotage(drive)
        self._used.update(doing)
        memory = Memory(random)
        watch = Watch(self.tally, drive, ", ".join(doing), self._replays, int(self._random.integers(2**63)))
        for _ in range(
            min(int(self._random.integers(self._longest // 4, self._longest)), self._steps - self.tally.steps)
        ):
            command, dt = HANDS[hand](memory, drive)
            try:
                with np.errstate(invalid="ignore", over="ignore"):  # for invalid numbers from lying parts
                    state = drive.step(command, dt)
            except Exception as error:  # of any type, since a step must never raise
                self.tally.steps += 1
                self.tally.exceptions += 1
                self.tally.fail("exception", error=repr(error), doing=", ".join(doing))
                return
            watch.judge(state, dt)
            self._digest.update(state.q.tobytes() + state.base.tobytes())
            memory.count += 1

    def _begin(self, arena: Arena) -> SnakeDrive:
        """Return a drive at a place where it is within its bounds.

        Raises:
            InputError: no such place was found.
        """
        for _ in range(STARTS):
            settings = self._settings(arena)
            tip = float(self._random.uniform(*arena.tips))
            try:
                return SnakeDrive(SnakeModel(arena.links), arena.pathway, settings, arena.curve, arena.slack, tip)
            except (InputError, PathwayError):
                self.tally.refused_starts += 1
        raise InputError(f"{self._name}: no start within the bounds in {STARTS} places")

    def _settings(self, arena: Arena) -> DriveSettings:
        """Return random settings, most often usual values, and sometimes extreme ones."""
        pick = self._random.choice
        settings = DriveSettings(
            step_s=float(pick((0.001, 0.001, 0.004, 0.02))),
            insertion_step_mm=float(pick((0.5, 0.5, 3.0))),
            bound_mm=None if self._random.random() < BY_PLACE else float(pick(arena.bounds)),
            control=CONTROLS[int(self._random.integers(len(CONTROLS)))],
            bends=4,
            vertices_per_link=int(pick((30, 30, 100))),
        )
        return replace(settings, tip_bound_mm=None if self._random.random() < 0.7 else settings.body_bound)
