"""Scripted runs of the snake's system, for its tests: plans are adopted so many steps after they were asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from lumen_shapes import arc

from benchmarks.attack.snake.judge import Judge
from vfix_engine.pathway.pathway import TissueMotion
from vfix_engine.pathway.tissue_motion import breathing, peristalsis
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.background import InlineWorker
from vfix_engine.runtime.command import Command, no_command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.operator import Act
from vfix_engine.worlds.snake import LumenContours, SnakeDrive, SnakeSettings, SnakeState, SnakeSystem, SnakeSystemSpec
from vfix_engine.worlds.snake.offline.operators import SnakeOperator
from vfix_engine.worlds.snake.settings import DriveSettings

BREATH = breathing((0.0, 0.3, 1.0), 6.0, 1.0, 60.0)  # up to 18 mm/s: a hurried breath
AGE = 20  # steps from asking for a plan to adopting it


def made_spec(
    tissue: TissueMotion | None = None, links: int = 7, tip_s: float = 150.0, settings: SnakeSettings | None = None
) -> SnakeSystemSpec:
    """Seven links in a bend of 130 mm radius, 13 mm wide."""
    pathway = arc(bend=130.0, turn=2.2, radius=13.0, contours=31)
    contours = LumenContours(pathway.centre, pathway.radius, 61)
    fixed = DriveSettings(bends=4, vertices_per_link=30)
    return SnakeSystemSpec(contours, SnakeModel(links), settings or SnakeSettings(), fixed, tissue, tip_s)


def hand(x: float = 0.0, y: float = 0.0, insert: float = 0.0, buttons: int = 0) -> Command:
    """A command of the axes alone."""
    return replace(no_command(), axes=(x, y, insert), buttons=buttons)


def run(
    system: SnakeSystem,
    state: SnakeState,
    commands: Iterable[Command],
    plan: Callable[[object], object] | None = None,
    age: int = AGE,
) -> Iterator[SnakeState]:
    """Every state; plans are ``plan``'s, the system's own planner's by default."""
    driver = Driver(system, InlineWorker(plan or system.planner, age))
    driver.state = state
    for command in commands:
        yield driver.step(command)


def rows(system: SnakeSystem, states: Iterable[SnakeState]) -> np.ndarray:
    """The recorder's rows of states."""
    found = []
    for state in states:
        row = np.empty(len(system.row_layout))
        system.row(state, row)
        found.append(row)
    return np.array(found)


def tour(steps: int, seed: int = 0) -> list[Command]:
    """In, about, straight, out: what each stretch does is drawn by the seed."""
    random = np.random.default_rng(seed)
    found: list[Command] = []
    while len(found) < steps:
        kind = int(random.integers(4))
        x, y = random.uniform(-1.0, 1.0, 2)
        one = [hand(insert=1.0), hand(x, y), hand(buttons=1), hand(insert=-1.0)][kind]
        found += [one] * int(random.integers(30, 500 if kind == 1 else 150))
    return found[:steps]


TIGHT = SnakeSettings(bound_mm=2.0, tip_bound_mm=1.0)
SAME_MM = 1e-9


def wall_that_gives_way() -> SnakeSystemSpec:
    """A narrow bound in a lumen that a wave widens."""
    return made_spec(peristalsis(0.3, 300.0, 150.0), settings=TIGHT)


class Verdicts(NamedTuple):
    """What another measure says of states one after the other.

    violations: links beyond what is promised, their bound or what they had before in the same pathway. disagreements:
    depths that the engine told otherwise. deepest_mm: beyond a bound. fastest: rad/s of a joint.
    """

    violations: int
    disagreements: int
    deepest_mm: float
    fastest: float


def acts(drive: SnakeDrive, operator: SnakeOperator) -> Iterator[Act]:
    """What an operator does with a drive, until it has finished; who asks for it carries it out."""
    while (act := operator(drive.system, drive.state)) is not None:
        yield act


def judged(system: SnakeSystem, first: SnakeState, states: Iterable[SnakeState]) -> Verdicts:
    """As benchmarks/attack/snake does: kinematics and depths as printed, every vertex against every segment."""
    before, violations, disagreements, deepest, fastest = first, 0, 0, -np.inf, 0.0
    judge = Judge(system.constants.snake, system.constants.query.vertices)
    for now in states:
        deep = judge.depth(now.packed, now.windows, now.measured, now.q, now.base)
        was = judge.depth(now.packed, now.windows, now.measured, before.q, before.base)
        violations += bool((deep - np.maximum(now.bound, was) > SAME_MM)[now.measured].any())
        disagreements += bool((np.abs(deep - now.deviation.depth) > SAME_MM)[now.measured].any())
        deepest = max(deepest, float((deep - now.bound)[now.measured].max()))
        fastest = max(fastest, float(np.abs(now.q - before.q).max()) / now.period_s)
        before = now
    return Verdicts(violations, disagreements, deepest, fastest)
