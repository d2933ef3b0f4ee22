"""Adversarial operators of a snake: each returns a command for its state, and a request for the step's duration."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.attack import campaign
from benchmarks.attack.campaign import NONSENSE
from vfix_engine.arrays import Array
from vfix_engine.runtime.command import BUTTON_STRAIGHTEN, Command
from vfix_engine.runtime.operator import Act, after
from vfix_engine.worlds.snake.offline.script import ScriptSystem
from vfix_engine.worlds.snake.requests import SetPeriod
from vfix_engine.worlds.snake.stepping.state import SnakeState

PACES = (1.0, 1.0, 1.0, 10.0, 40.0)  # durations as multiples of the settings' step


@dataclass
class Memory(campaign.Memory):
    """What an operator remembers within an episode."""

    until: int = 0
    angle: float = 0.0
    size: float = 100.0
    pace: float = 1.0
    forwards: bool = True
    notes: dict[str, float] = field(default_factory=dict)

    def kept(self, longest: int) -> Array:
        """Return a velocity in the camera's plane that stays for a random number of steps."""
        if self.count >= self.until:
            self.angle = float(self.random.uniform(0.0, 2.0 * math.pi))
            self.size = float(10.0 ** self.random.uniform(0.5, 4.0))
            self.pace = float(self.random.choice(PACES))
            self.until = self.count + int(self.random.integers(5, longest))
        return self.size * np.array([math.cos(self.angle), math.sin(self.angle)])


Attack = campaign.Attack[Memory, ScriptSystem, SnakeState]
Assault = campaign.Assault[ScriptSystem, SnakeState]


def by_operator(attack: Attack, memory: Memory) -> Assault:
    """Return an assault by an operator's acts, which are processed as a person's."""
    operator = partial(attack, memory)

    def step(system: ScriptSystem, state: SnakeState) -> SnakeState:
        act = operator(system, state)
        with np.errstate(invalid="ignore", over="ignore"):  # for invalid numbers from lying parts
            return after(system, state, act)

    return step


def _act(camera: ArrayLike = (0.0, 0.0), insert: float = 0.0, straighten: bool = False, *, dt: float) -> Act:
    """Return a step of ``dt`` s with the camera's and the insertion's speed in mm/s."""
    x, y = (float(value) for value in np.asarray(camera))
    command = Command(np.zeros(3), axes=(x, y, insert), buttons=BUTTON_STRAIGHTEN if straighten else 0)
    return Act(command, (SetPeriod(dt),))


def _outwards(system: ScriptSystem, state: SnakeState) -> Array:
    """Return the camera's direction that moves the distal vertex nearest to its bound farther out."""
    snake, first = system.constants.snake, system.constants.first
    link = first + int((state.deviation.depth - state.bound)[first:].argmax())
    frame = snake.frames(state.q, state.base)[link + 1]
    own = system.constants.query.vertices.points[state.deviation.vertex[link]]
    vertex = frame[:3, :3] @ own + frame[:3, 3]
    segment = state.packed.rows[state.deviation.segment[link]]
    away = vertex - segment[0:3]
    away = away - (away @ segment[19:22]) * segment[19:22]
    camera = snake.camera(state.q, state.base)
    return np.asarray(camera[:3, :2].T @ away)


def pushing(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """One direction for a long time."""
    return _act(memory.kept(150), dt=memory.pace * state.settings.step_s)


def spinning(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """Round and round along the wall."""
    memory.kept(200)
    memory.angle += 0.2
    way = memory.size * np.array([math.cos(memory.angle), math.sin(memory.angle)])
    return _act(way, dt=memory.pace * state.settings.step_s)


def jumping(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """Another direction in every step, at any speed and for any duration."""
    way = memory.random.normal(size=2) * 10.0 ** memory.random.uniform(0.0, 6.0)
    dt = state.settings.step_s * float(memory.random.choice((1.0, 5.0, 50.0)))
    return _act(way, dt=dt)


def into_the_wall(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """The direction that moves the vertex nearest to its bound farther out."""
    memory.kept(60)
    out = _outwards(system, state)
    size = float(np.linalg.norm(out))
    way = memory.size * (out / size if size > 1e-9 else memory.kept(60) / memory.size)
    return _act(way, dt=memory.pace * state.settings.step_s)


def resonating(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """Reverses as soon as it is stopped, and swings with a varying duration."""
    held = state.outcome in ("held", "shrunk") and state.limit != "speed"
    if held or memory.count % max(1, int(memory.notes.get("period", 20.0))) == 0:
        memory.notes["sign"] = -memory.notes.get("sign", 1.0)
        memory.notes["period"] = float(memory.random.integers(2, 60))
    way = memory.kept(300) * memory.notes.get("sign", 1.0)
    return _act(way, dt=memory.pace * state.settings.step_s)


def alternating(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """Into the wall and out of it in alternate steps, at the highest speed of a command."""
    sign = 1.0 if memory.count % 2 else -1.0
    memory.kept(60)
    way = sign * (_outwards(system, state) + 1e-3) * 1e3
    return _act(way, dt=memory.pace * state.settings.step_s)


def nonsense(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """NaN, infinite and huge values, and valid ones in between."""
    x, y, speed = (float(v) for v in memory.random.choice(NONSENSE, size=3))
    if memory.random.random() < 0.5:
        speed = 0.0
    return _act((x, y), speed, bool(memory.random.random() < 0.1), dt=state.settings.step_s)


def contradicting(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """Contradictory commands: in and out, sideways and straight at the same time."""
    speed = float(memory.random.choice((0.0, 1.0, -1.0))) * 10.0 ** memory.random.uniform(-3.0, 4.0)
    way, straighten = memory.kept(40), bool(memory.random.random() < 0.5)
    return _act(way, speed, straighten, dt=memory.pace * state.settings.step_s)


def jittering(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """Steps of a microsecond to ten seconds, along the wall."""
    dt = float(10.0 ** memory.random.uniform(-6.0, 1.0))
    return _act(memory.kept(40) + _outwards(system, state), dt=dt)


def inserting(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """In and out at any speed, straight if required."""
    if memory.count >= memory.until:
        memory.forwards = bool(memory.random.random() < 0.75) if state.tip_s < state.tissue.length_mm - 1.0 else False
    memory.kept(250)
    if not state.straight and state.outcome == "held":
        return _act(straighten=True, dt=state.settings.step_s * 10.0)
    usual = state.settings.insertion_step_mm / state.settings.insertion_mm_per_s
    speed = 10.0 ** memory.random.uniform(0.0, 3.0)
    dt = usual * float(memory.random.choice((0.1, 1.0, 1.0, 4.0, 100.0)))
    return _act(insert=speed if memory.forwards else -speed, dt=dt)


def to_and_fro(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """In and out in alternate steps, with a bend between them when it is straight."""
    memory.kept(60)
    turn = memory.count % 5
    if turn == 4:
        return _act(memory.kept(60), dt=state.settings.step_s)
    if turn == 0 and not state.straight:
        return _act(straighten=True, dt=state.settings.step_s * memory.pace)
    return _act(insert=1e3 if turn % 2 else -1e3, dt=0.025 * memory.pace)


def waiting(memory: Memory, system: ScriptSystem, state: SnakeState) -> Act:
    """No command while the tissue moves, and sometimes a push."""
    if memory.random.random() < 0.8:
        return _act(dt=state.settings.step_s * float(memory.random.choice((1.0, 10.0))))
    return _act(memory.kept(60), dt=state.settings.step_s)


ATTACKS: dict[str, Attack] = {
    "pushing": pushing,
    "spinning": spinning,
    "jumping": jumping,
    "into the wall": into_the_wall,
    "resonating": resonating,
    "alternating": alternating,
    "nonsense": nonsense,
    "contradicting": contradicting,
    "jittering": jittering,
    "inserting": inserting,
    "to and fro": to_and_fro,
    "waiting": waiting,
}
