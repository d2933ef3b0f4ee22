"""Adversarial hands: each returns a command for the state of a driven snake, and its duration."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.worlds.snake.command import SnakeCommand
from vfix_engine.worlds.snake.snake_drive import SnakeDrive

Order = tuple[SnakeCommand, float]

NONSENSE = (math.nan, math.inf, -math.inf, 1e300, -1e300, 1e-320, 0.0, 5.0)
PACES = (1.0, 1.0, 1.0, 10.0, 40.0)  # durations as multiples of the settings' step


@dataclass
class Memory:
    """What a hand remembers within an episode."""

    random: np.random.Generator
    count: int = 0
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


Hand = Callable[[Memory, SnakeDrive], Order]


def _camera(way: Array) -> tuple[float, float]:
    return float(way[0]), float(way[1])


def _outwards(drive: SnakeDrive) -> Array:
    """Return the camera's direction that moves the distal vertex nearest to its bound farther out."""
    state = drive.state
    link = int((state.deviation.depth - drive.bound)[-drive.distal.links :].argmax()) + len(drive.bound)
    link -= drive.distal.links
    frame = drive.snake.frames(state.q, state.base)[link + 1]
    own = drive.query.vertices.points[state.deviation.vertex[link]]
    vertex = frame[:3, :3] @ own + frame[:3, 3]
    segment = state.packed.rows[state.deviation.segment[link]]
    away = vertex - segment[0:3]
    away = away - (away @ segment[19:22]) * segment[19:22]
    camera = drive.snake.camera(state.q, state.base)
    return np.asarray(camera[:3, :2].T @ away)


def pushing(memory: Memory, drive: SnakeDrive) -> Order:
    """One direction for a long time."""
    return SnakeCommand(camera_mm_per_s=_camera(memory.kept(150))), memory.pace * drive.settings.step_s


def spinning(memory: Memory, drive: SnakeDrive) -> Order:
    """Round and round along the wall."""
    memory.kept(200)
    memory.angle += 0.2
    way = memory.size * np.array([math.cos(memory.angle), math.sin(memory.angle)])
    return SnakeCommand(camera_mm_per_s=_camera(way)), memory.pace * drive.settings.step_s


def jumping(memory: Memory, drive: SnakeDrive) -> Order:
    """Another direction in every step, at any speed and for any duration."""
    way = memory.random.normal(size=2) * 10.0 ** memory.random.uniform(0.0, 6.0)
    dt = drive.settings.step_s * float(memory.random.choice((1.0, 5.0, 50.0)))
    return SnakeCommand(camera_mm_per_s=_camera(way)), dt


def into_the_wall(memory: Memory, drive: SnakeDrive) -> Order:
    """The direction that moves the vertex nearest to its bound farther out."""
    memory.kept(60)
    out = _outwards(drive)
    size = float(np.linalg.norm(out))
    way = memory.size * (out / size if size > 1e-9 else memory.kept(60) / memory.size)
    return SnakeCommand(camera_mm_per_s=_camera(way)), memory.pace * drive.settings.step_s


def resonating(memory: Memory, drive: SnakeDrive) -> Order:
    """Reverses as soon as it is stopped, and swings with a varying duration."""
    held = drive.state.outcome in ("held", "shrunk") and drive.state.limit != "speed"
    if held or memory.count % max(1, int(memory.notes.get("period", 20.0))) == 0:
        memory.notes["sign"] = -memory.notes.get("sign", 1.0)
        memory.notes["period"] = float(memory.random.integers(2, 60))
    way = memory.kept(300) * memory.notes.get("sign", 1.0)
    return SnakeCommand(camera_mm_per_s=_camera(way)), memory.pace * drive.settings.step_s


def alternating(memory: Memory, drive: SnakeDrive) -> Order:
    """Into the wall and out of it in alternate steps, at the highest speed of a command."""
    sign = 1.0 if memory.count % 2 else -1.0
    memory.kept(60)
    way = sign * (_outwards(drive) + 1e-3) * 1e3
    return SnakeCommand(camera_mm_per_s=_camera(way)), memory.pace * drive.settings.step_s


def nonsense(memory: Memory, drive: SnakeDrive) -> Order:
    """NaN, infinite and huge values, and valid ones in between."""
    x, y, speed = (float(v) for v in memory.random.choice(NONSENSE, size=3))
    if memory.random.random() < 0.5:
        speed = 0.0
    return SnakeCommand(speed, (x, y), bool(memory.random.random() < 0.1)), drive.settings.step_s


def contradicting(memory: Memory, drive: SnakeDrive) -> Order:
    """Contradictory commands: in and out, sideways and straight at the same time."""
    speed = float(memory.random.choice((0.0, 1.0, -1.0))) * 10.0 ** memory.random.uniform(-3.0, 4.0)
    way, straighten = memory.kept(40), bool(memory.random.random() < 0.5)
    return SnakeCommand(speed, _camera(way), straighten), memory.pace * drive.settings.step_s


def jittering(memory: Memory, drive: SnakeDrive) -> Order:
    """Steps of a microsecond to ten seconds, along the wall."""
    dt = float(10.0 ** memory.random.uniform(-6.0, 1.0))
    return SnakeCommand(camera_mm_per_s=_camera(memory.kept(40) + _outwards(drive))), dt


def inserting(memory: Memory, drive: SnakeDrive) -> Order:
    """In and out at any speed, straight if required."""
    if memory.count >= memory.until:
        memory.forwards = bool(memory.random.random() < 0.75) if drive.tip_s < drive.length_mm - 1.0 else False
    memory.kept(250)
    if not drive.straight and drive.state.outcome == "held":
        return SnakeCommand(straighten=True), drive.settings.step_s * 10.0
    usual = drive.settings.insertion_step_mm / drive.settings.insertion_mm_per_s
    speed = 10.0 ** memory.random.uniform(0.0, 3.0)
    dt = usual * float(memory.random.choice((0.1, 1.0, 1.0, 4.0, 100.0)))
    return SnakeCommand(speed if memory.forwards else -speed), dt


def to_and_fro(memory: Memory, drive: SnakeDrive) -> Order:
    """In and out in alternate steps, with a bend between them when it is straight."""
    memory.kept(60)
    turn = memory.count % 5
    if turn == 4:
        return SnakeCommand(camera_mm_per_s=_camera(memory.kept(60))), drive.settings.step_s
    if turn == 0 and not drive.straight:
        return SnakeCommand(straighten=True), drive.settings.step_s * memory.pace
    return SnakeCommand(1e3 if turn % 2 else -1e3), 0.025 * memory.pace


def waiting(memory: Memory, drive: SnakeDrive) -> Order:
    """No command while the tissue moves, and sometimes a push."""
    if memory.random.random() < 0.8:
        return SnakeCommand(), drive.settings.step_s * float(memory.random.choice((1.0, 10.0)))
    return SnakeCommand(camera_mm_per_s=_camera(memory.kept(60))), drive.settings.step_s


HANDS: dict[str, Hand] = {
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
