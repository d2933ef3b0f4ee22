"""Simulated hands: one that does the job, one that pushes into bone with all its force."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ...arrays import Array
from .rehearsal import Command, Rehearsal, RehearsalState


class Operator(Protocol):
    """Anything that answers a state with a command."""

    def command(self, rehearsal: Rehearsal, state: RehearsalState) -> Command: ...


class ScriptedOperator:
    """Drives along the path at full force; in inspection draws the view onto the target, then swings around it."""

    def __init__(self, drive: int = 1, swing_period_steps: int = 4000):
        self._direction, self._period = drive, swing_period_steps
        self._swung = 0

    def command(self, rehearsal: Rehearsal, state: RehearsalState) -> Command:
        if state.mode != "inspect":
            return Command(np.zeros(3), drive=self._direction)
        cap = rehearsal.settings.force_cap_n
        if state.phase == "inspect_approach":
            return Command(np.zeros(3), drive=1)
        angle = 2 * np.pi * self._swung / self._period
        self._swung += 1
        across, upwards = state.tool.tip.rotation[:, 0], state.tool.tip.rotation[:, 2]
        force = 0.5 * cap * (np.cos(angle) * across + np.sin(angle) * upwards)
        return Command(force, twist=int(np.sign(np.sin(2 * angle))))


class PushingOperator:
    """Full force into bone, the direction changing: towards the nearest bone, at random, or forwards and sideways."""

    def __init__(self, seed: int = 0, episode_steps: int = 150):
        self._random = np.random.default_rng(seed)
        self._episode, self._count = episode_steps, 0
        self._kind, self._push = 0, np.zeros(3)

    def command(self, rehearsal: Rehearsal, state: RehearsalState) -> Command:
        settings, tip = rehearsal.settings, state.tool.tip
        fresh = self._count % self._episode == 0
        self._count += 1
        if fresh:
            # The first two episodes make contact; from then on the direction changes.
            self._kind = int(self._random.integers(4)) if self._count > 2 * self._episode else 0
            self._push = self._unit(self._random.normal(size=3))
        if self._kind == 0:
            nearest = rehearsal.scene.tree.closest(state.tool.segments)
            direction = -nearest.normal
        elif self._kind == 1:
            direction = self._push
        else:
            ahead = tip.rotation[:, 1] if state.nearest is None else state.nearest.tangent
            direction = self._unit(ahead + (0.3 if self._kind == 2 else -0.3) * self._push)
        return Command(settings.force_cap_n * direction, twist=int(self._random.integers(-1, 2)) if fresh else 0)

    @staticmethod
    def _unit(vector: Array) -> Array:
        return vector / float(np.linalg.norm(vector))
