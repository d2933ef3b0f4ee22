"""Lying replacements of untrusted parts, whose results the certificate has to check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.attack.campaign import Random
from vfix_engine.arrays import Array
from vfix_engine.geometry.curve import Curve
from vfix_engine.snake.conform.conformance import ShapeSolution
from vfix_engine.snake.control.tip_control import DistalContext
from vfix_engine.worlds.snake.offline.script import ScriptSystem
from vfix_engine.worlds.snake.stepping.inline_planner import InlinePlanner


def _wild(random: Random, q: Array, q_max: float) -> Array:
    """Return absurd joints."""
    kind = int(random.integers(5))
    if kind == 0:
        return np.asarray(random.uniform(-q_max, q_max, len(q)))
    if kind == 1:
        return np.asarray(q + random.normal(size=len(q)) * 10.0 ** random.uniform(-4.0, 3.0))
    found = np.clip(q + random.normal(size=len(q)) * 10.0 ** random.uniform(-3.0, 0.0), -q_max, q_max)
    if kind == 2 and random.random() < 0.3:
        found[int(random.integers(len(q)))] = random.choice([np.nan, np.inf, 1e300])
    return np.asarray(found)


def control(system: ScriptSystem, random: Random) -> None:
    """The control of the distal links wants anything."""
    part: Any = system.start().control
    part.wanted = lambda q, camera_mm, most: _wild(random, q, system.constants.snake.q_max)


class _LyingPlanner(InlinePlanner):
    """The shape that is to conform lies anywhere."""

    random: Random

    def following(self, curve: Curve, tip_s: float, near: ShapeSolution, most: float) -> ShapeSolution:
        return self._wrong(super().following(curve, tip_s, near, most))

    def inserted(self, curve: Curve, place_mm: float, last: ShapeSolution, planned: ShapeSolution) -> ShapeSolution:
        return self._wrong(super().inserted(curve, place_mm, last, planned))

    def _wrong(self, found: ShapeSolution) -> ShapeSolution:
        random, q_max = self.random, self.snake.q_max
        base = found.base.copy()
        base[:3, 3] += random.normal(size=3) * 10.0 ** random.uniform(-3.0, 1.0)
        q = np.clip(_wild(random, found.q, q_max), -q_max, q_max)
        return replace(found, q=np.where(np.isfinite(q), q, 0.0), base=base, exact=False)


def conformance(system: ScriptSystem, random: Random) -> None:
    """The shape that is to conform lies anywhere."""
    honest = system.constants.planner
    assert honest is not None
    liar = _LyingPlanner(honest.snake, honest.pathway, honest.insertion, honest.every_s)
    object.__setattr__(liar, "random", random)
    system.constants = replace(system.constants, planner=liar)


def easing(system: ScriptSystem, random: Random) -> None:
    """The program that is to find a way back within the bounds finds something else."""
    honest = system.constants.eased

    def lying(context: DistalContext, q: Array, most: float) -> Array:
        found = honest(context, q, most)
        found = context.rest if found is None else found
        change = random.normal(size=len(found)) * 10.0 ** random.uniform(-5.0, -1.0)
        # The joints' speed is kept by the program's box, not by the certificate.
        return system.constants.snake.clamp(np.clip(found + change, q - most, q + most))

    system.constants = replace(system.constants, eased=lying)


LIES: dict[str, Callable[[ScriptSystem, Random], None]] = {
    "control": control,
    "conformance": conformance,
    "easing": easing,
}
