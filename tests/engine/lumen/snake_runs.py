"""Scripted runs of the snake's system, for its tests: plans are adopted so many steps after they were asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
from lumen_shapes import arc

from vfix_engine.lumen.drive.drive_state import DriveSettings
from vfix_engine.lumen.pathway.pathway import TissueMotion
from vfix_engine.lumen.pathway.tissue_motion import breathing
from vfix_engine.lumen.system import LumenContours, SnakeSettings, SnakeState, SnakeSystem, SnakeSystemSpec
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import Command, no_command

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
    plan = plan or system.planner
    waiting: tuple[int, object] | None = None
    for command in commands:
        if waiting is not None and state.steps >= waiting[0]:
            state = system.adopt(state, waiting[1], age * system.period_s(state))
            waiting = None
        if waiting is None:
            asked = system.background(state)
            if asked is not None:
                waiting = (asked.steps + age, plan(asked.inputs))
        state = system.step(state, command)
        yield state


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
