"""Episodes of a snake under attack: changing settings, controls, operators, and parts of the engine that lie."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.attack import campaign
from vfix_engine.errors import InputError, PathwayError
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.offline.script import ScriptSystem
from vfix_engine.worlds.snake.settings import CONTROLS, DriveSettings
from vfix_engine.worlds.snake.stepping.constants import start_of
from vfix_engine.worlds.snake.stepping.state import SnakeState

from .lies import LIES
from .operators import ATTACKS, Memory, by_operator
from .scenes import BUILDERS, Arena
from .watch import SnakeTally, Watch

LONGEST = 240  # largest number of steps of an episode; the least is a quarter of it
LIED_TO = 0.2  # fraction of the episodes with lies
STARTS = 30  # attempts to find the start of an episode
BY_PLACE = 0.5  # fraction of the episodes with the default bounds, which depend on the place


class SnakeCampaign(campaign.Campaign[Arena, SnakeTally, Memory, ScriptSystem, SnakeState]):
    """Attacks a snake in one lumen.

    sabotage: modifies every system, to prove that the judges detect it. attacks: names. replays: fraction of the steps
    with a motion that are replayed. longest: largest number of steps of an episode.
    """

    scenes, tally_type = BUILDERS, SnakeTally

    def __init__(
        self,
        name: str,
        seed: int,
        steps: int,
        sabotage: Callable[[ScriptSystem], None] | None = None,
        attacks: Sequence[str] = tuple(ATTACKS),
        replays: float = 0.02,
        longest: int = LONGEST,
    ):
        super().__init__(name, seed, steps)
        self._sabotage, self._attacks, self._replays, self._longest = sabotage, attacks, replays, longest

    def size(self) -> dict[str, int]:
        """Return the number of links."""
        return {"links": self.arena.links}

    def motion(self, state: SnakeState) -> bytes:
        """Return joints and base."""
        return state.q.tobytes() + state.base.tobytes()

    def begin(self) -> campaign.Episode[Memory, ScriptSystem, SnakeState]:
        """Return an episode of one attack."""
        system = self._start()
        state = system.start()
        attack, random = str(self.random.choice(self._attacks)), np.random.default_rng(self.random.integers(2**63))
        doing = [attack, f"control: {state.settings.control}"]
        if self.random.random() < LIED_TO:
            lie = str(self.random.choice(list(LIES)))
            LIES[lie](system, random)
            doing.append(f"lie: {lie}")
        if self._sabotage is not None:
            self._sabotage(system)
        watch = Watch(self.tally, system, ", ".join(doing), self._replays, int(self.random.integers(2**63)))
        steps = int(self.random.integers(self._longest // 4, self._longest))
        memory = Memory(random)
        assault = by_operator(ATTACKS[attack], memory)
        return campaign.Episode(system, state, assault, memory, watch.judge, steps, tuple(doing))

    def _start(self) -> ScriptSystem:
        """Return a snake at a place where it is within its bounds.

        Raises:
            InputError: no such place was found.
        """
        arena = self.arena
        for _ in range(STARTS):
            settings, snake = self._settings(), SnakeModel(arena.links)
            tip = float(self.random.uniform(*arena.tips))
            try:
                start = start_of(snake, arena.pathway, settings, arena.curve, arena.slack, tip, plans_here=True)
                return ScriptSystem(start)
            except (InputError, PathwayError):
                self.tally.refused_starts += 1
        raise InputError(f"{self.name}: no start within the bounds in {STARTS} places")

    def _settings(self) -> DriveSettings:
        """Return random settings, most often usual values, and sometimes extreme ones."""
        pick = self.random.choice
        settings = DriveSettings(
            step_s=float(pick((0.001, 0.001, 0.004, 0.02))),
            insertion_step_mm=float(pick((0.5, 0.5, 3.0))),
            bound_mm=None if self.random.random() < BY_PLACE else float(pick(self.arena.bounds)),
            control=CONTROLS[int(self.random.integers(len(CONTROLS)))],
            bends=4,
            vertices_per_link=int(pick((30, 30, 100))),
        )
        return replace(settings, tip_bound_mm=None if self.random.random() < 0.7 else settings.body_bound)
