"""Hostile steps of the rigid tool: by an operator, or past it by joint steps and programs that no task would state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.attack import campaign
from benchmarks.attack.campaign import NONSENSE
from vfix_engine.arrays import Array
from vfix_engine.control import StepRequest, qp
from vfix_engine.runtime.operator import after
from vfix_engine.virtual_fixtures import Constraint, Objective
from vfix_engine.worlds.rigid.operators import RigidOperator
from vfix_engine.worlds.rigid.state import ZEROS, LastStep, RehearsalState
from vfix_engine.worlds.rigid.system import RigidSystem

from .operators import ATTACKS, Attack, Memory

Assault = campaign.Assault[RigidSystem, RehearsalState]

INVALID = (*NONSENSE[:-1], 1.0)


def by_operator(attack: Attack, memory: Memory) -> Assault:
    """Return an assault by an operator's acts, which are processed as a person's."""
    operator: RigidOperator = partial(attack, memory)

    def step(system: RigidSystem, state: RehearsalState) -> RehearsalState:
        stepped = after(system, state, operator(system, state))
        memory.held = stepped.last is not None and stepped.last.report.held
        return stepped

    return step


def past_the_program(memory: Memory, system: RigidSystem, state: RehearsalState) -> RehearsalState:
    """Take joint steps as from a lying solver, from far too small to through the whole anatomy at once.

    No row, bound or residual protects the margin here: only the certificate does.
    """
    random, robot = memory.random, system.scene.robot
    kind = random.integers(7)
    box = robot.speed * state.settings.dt_s
    size = len(state.tool.q)
    if kind == 0:
        step = box * random.uniform(-1, 1, size)
    elif kind == 1:
        step = box * random.normal(size=size) * 10.0 ** random.uniform(-3, 3)
    elif kind == 2:
        step = random.uniform(robot.lower, robot.upper) - state.tool.q
    elif kind == 3:  # one joint far, or back by half as much
        step = np.zeros(size)
        joint = int(random.integers(size))
        step[joint] = (1.0 if robot.revolute[joint] else 40.0) * random.normal()
    elif kind >= 5:
        step = _grazing(memory, system, state)
    else:
        step = np.where(random.random(size) < 0.3, random.choice(INVALID, size=size), box * random.normal(size=size))
    within = np.clip(step, robot.lower - state.tool.q, robot.upper - state.tool.q) if kind != 4 else step
    tool = system.controller.certify(state.tool, within)
    return replace(state, tool=state.tool if tool is None else tool, last=None)


def _grazing(memory: Memory, system: RigidSystem, state: RehearsalState) -> Array:
    """Return a step straight at the nearest bone, up to the margin or a little further, and sideways as well."""
    tip, random = state.tool.tip, memory.random
    pair = system.scene.tree.closest(state.tool.segments)
    lever = pair.on_tool - tip.position
    jacobian = tip.jacobian[:3] + np.cross(tip.jacobian[3:].T, lever).T
    room = pair.distance - state.settings.margin_mm
    way = room * random.uniform(0.8, 1.2) + random.choice((0.0, 1e-3, 0.03)) * random.random()
    aside = random.choice((0.0, 0.1, 1.0, 5.0)) * np.cross(pair.normal, random.normal(size=3))
    step: Array = np.linalg.lstsq(jacobian, aside - way * pair.normal, rcond=1e-6)[0]
    return step


def with_rows(memory: Memory, system: RigidSystem, state: RehearsalState) -> RehearsalState:
    """Add contradictory rows of any size, some of them NaN or infinite (HAZ-03, HAZ-05)."""
    random = memory.random
    size = len(state.tool.q) + 1
    scale = 10.0 ** random.uniform(-6, 3)
    target = scale * random.normal(size=4)
    matrix = random.normal(size=(4, size)) * 10.0 ** random.uniform(-3, 3)
    rows = random.normal(size=(4, size))
    bound = scale * random.uniform(-1, 1, 4)
    if random.random() < 0.5:  # infeasible for certain: a row and its contrary
        rows[1], bound[:2] = -rows[0], -scale
    if random.random() < 0.3:
        spoilt = (target, matrix, rows, bound)[int(random.integers(4))]
        spoilt.flat[int(random.integers(spoilt.size))] = random.choice(INVALID)
    constraint = Constraint("target", rows, bound, np.arange(4))
    task = StepRequest((Objective(matrix, target),), (constraint,), scale, np.ones(size - 1))
    report = system.controller.step(state.tool, task)
    return replace(
        state,
        tool=report.state,
        steps=state.steps + 1,
        emergencies=state.emergencies + report.emergency,
        last=LastStep(report, ZEROS, ZEROS, "", False),
    )


class _Liar:
    """Replaces daqp and returns wrong solutions, of another problem or of none, marked as optimal."""

    def __init__(self, honest: Any, random: np.random.Generator):
        self._honest, self._random = honest, random

    def solve(self, *problem: Any) -> tuple[Array, float, int, dict[str, Any]]:
        """Return sometimes the correct solution, and otherwise a wrong one with the flag of success."""
        x, value, flag, info = self._honest.solve(*problem)
        random, kind = self._random, self._random.integers(6)
        x = np.array(x, dtype=float)
        if kind == 0:
            return x, value, flag, info
        if kind == 1:
            with np.errstate(all="ignore"):  # for programs that are themselves invalid
                x = x + np.abs(x).max() * random.normal(size=len(x)) * 10.0 ** random.uniform(-6, 6)
        elif kind == 2:
            x = random.normal(size=len(x)) * 10.0 ** random.uniform(-3, 6)
        elif kind == 3:
            x[int(random.integers(len(x)))] = random.choice(INVALID)
        elif kind == 4:
            x = -x
        multiplier = np.array(info["lam"], dtype=float)
        if kind == 5:
            multiplier = random.choice(INVALID) * random.normal(size=len(multiplier))
        return x, value, 1, {**info, "lam": multiplier}


@contextmanager
def lying_solver(random: np.random.Generator) -> Iterator[None]:
    """Replace the native solver by a lying one in this context (HAZ-03)."""
    seat: Any = qp
    honest = seat.daqp
    seat.daqp = _Liar(honest, random)
    try:
        yield
    finally:
        seat.daqp = honest


# What makes an assault of a memory.
ASSAULTS: dict[str, Callable[[Memory], Assault]] = {
    f"hand: {name}": partial(by_operator, attack) for name, attack in ATTACKS.items()
} | {
    "past the program": partial(partial, past_the_program),
    "rows": partial(partial, with_rows),
}
