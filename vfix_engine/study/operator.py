"""A person who pursues a point ahead on the path, from what is seen of a snapshot to a command.

Seen are the tool and the path in a picture, late and not quite where they are; joints and clearances are not. In free
hand the person moves the tip and turns the tool at once, as the plan shows it; a robot turns by itself.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Array
from ..control import ControlSettings
from ..geometry.path import SplinePath
from ..robots import Tool
from ..runtime.command import Command
from ..runtime.operator import Act
from ..runtime.snapshot import Snapshot
from ..worlds.rigid.dry_run import DryRun
from ..worlds.rigid.system import END_MM as ROBOT_END_MM
from .person import DriftNoise, Person, Tremor

END_MM = 0.5  # remaining arc length, as seen, at which a free hand has finished
SEARCH_MM = 10.0  # progress is searched this far from the last one
VIEW = np.array([0.87, 0.35, 0.35]) / np.linalg.norm([0.87, 0.35, 0.35])  # axis of the picture, LPS: assumed
DEVICE_COUNTS = 32  # steps of a rate device's axis to full deflection: assumed
DEVICE_NOISE = 3.0  # of a deflection, in those of a force: assumed
_STRAIGHT = 1e-3  # sine of a bend below which a tool has no side


class Seen(NamedTuple):
    """What a person sees of a snapshot: tip (3,), direction of the shaft (3,), and side towards which the tool bends
    (3,), 0 for a straight one; the camera's axes (3, 3) as columns."""

    tip: Array
    shaft: Array
    side: Array
    camera: Array


def seen(snapshot: Snapshot) -> Seen:
    """The one place where an operator reads a snapshot."""
    shaft, side = shaft_and_side(snapshot.capsules[:, :3], snapshot.capsules[:, 3:6])
    return Seen(snapshot.tip, shaft, side, snapshot.camera[:3, :3])


def shaft_and_side(start: Array, end: Array) -> tuple[Array, Array]:
    """Direction (3,) of a tool's shaft towards its tip, and unit vector (3,) to the side of its bend, 0 if straight.

    start, end: (S, 3) of the axis segments from the tip on.
    """
    shaft = _unit(end[-1] - start[-1])
    first = _unit(end[0] - start[0])
    side = first - (first @ shaft) * shaft
    size = float(np.linalg.norm(side))
    return shaft, side / size if size > _STRAIGHT else np.zeros(3)


@dataclass(frozen=True, eq=False)
class Guide:
    """What the plan shows to a person: the path, and how the tool lies along it.

    s: (n,) arc lengths, increasing; shaft, side: (n, 3) as of ``shaft_and_side``.
    """

    path: SplinePath
    s: Array
    shaft: Array
    side: Array

    @classmethod
    def of(cls, path: SplinePath, dry: DryRun) -> Guide:
        """The poses of a dry run along its path."""
        s, rows = np.unique(np.maximum.accumulate(dry.s), return_index=True)
        both = [shaft_and_side(dry.segments_start[row], dry.segments_end[row]) for row in rows]
        return cls(path, s, np.stack([one[0] for one in both]), np.stack([one[1] for one in both]))

    def at(self, s: float) -> tuple[Array, Array]:
        """Shaft and side at an arc length."""
        place = int(np.clip(np.searchsorted(self.s, s), 1, len(self.s) - 1)) if len(self.s) > 1 else 0
        if place == 0:
            return self.shaft[0], self.side[0]
        share = float(np.clip((s - self.s[place - 1]) / (self.s[place] - self.s[place - 1]), 0.0, 1.0))
        pairs = [(1.0 - share) * one[place - 1] + share * one[place] for one in (self.shaft, self.side)]
        return _unit(pairs[0]), _unit(pairs[1])


class PursuitOperator:
    """Pursues a point ahead on the path: ``Snapshot → Command``, None once the end seems reached.

    guide: what the plan shows; person: who it is; settings: of the world, for what a force does; seed: of every
    random number: the same snapshots make the same commands. device_axes: (3, 3) axes of a rate device in the patient's
    frame, as columns; None: the hand is on the tool or on the robot.
    """

    def __init__(
        self,
        guide: Guide,
        person: Person,
        tool: Tool,
        settings: ControlSettings,
        seed: int | np.random.SeedSequence = 0,
        device_axes: Array | None = None,
    ):
        self._guide, self._person, self._settings, self._device_axes = guide, person, settings, device_axes
        random, dt = np.random.default_rng(seed), settings.dt_s
        self._full_turn = settings.rotation_gain_rad_per_s_per_nmm * settings.force_cap_n * tool.grip_from_bend
        self._drift, self._noise = DriftNoise(random, dt, person.drift_s), DriftNoise(random, dt, 0.3)
        self._aim, self._tremor = DriftNoise(random, dt, 1.0), Tremor(random, dt)
        self._turned: Array = np.zeros(3) if device_axes is None else random.standard_normal(3)
        across = np.eye(3) - np.outer(VIEW, VIEW)
        self._wrong = person.see_across_mm * across / np.sqrt(2.0) + person.see_depth_mm * np.outer(VIEW, VIEW)
        self._late: deque[Seen] = deque(maxlen=1 + round(person.delay_s / dt))
        self._velocity = np.zeros(3)
        self.progress_mm = 0.0  # as seen

    def __call__(self, snapshot: Snapshot) -> Command | None:
        """The hand's command for the next control period."""
        self._late.append(seen(snapshot))
        now = self._late[0]
        if len(self._late) < (self._late.maxlen or 1):  # nobody moves before having seen the start
            return Command(np.zeros(3))
        path, person = self._guide.path, self._person
        tip = now.tip + self._wrong @ self._drift.next()
        self.progress_mm = max(path.closest(tip, self.progress_mm, SEARCH_MM)[0], self.progress_mm)
        if snapshot.certified:
            return None if snapshot.length_mm - snapshot.progress_mm <= ROBOT_END_MM else self._lead(tip)
        if self.progress_mm >= path.length - END_MM:
            return None
        towards = path.position(min(self.progress_mm + person.look_ahead_mm, path.length)) - tip
        wanted = towards * person.hand_speed_mm_per_s / max(float(np.linalg.norm(towards)), END_MM)
        noisy = wanted * (1.0 + person.motion_noise * self._noise.next())
        share = self._settings.dt_s / (self._settings.dt_s + person.hand_lag_s)
        self._velocity = self._velocity + share * (noisy - self._velocity)
        velocity = self._velocity + person.tremor_mm * self._tremor.next()
        axes, twist = self._turn(now)
        return Command(velocity / self._settings.gain_mm_per_s_per_n, twist=twist, axes=axes)

    def _lead(self, tip: Array) -> Command:
        """Lead a robot: a force along the path as seen, of which the robot makes what the fixtures admit."""
        path, person, s = self._guide.path, self._person, self.progress_mm
        forwards = path.position(min(s + person.look_ahead_mm, path.length)) - path.position(max(s - END_MM, 0.0))
        direction, off = _unit(forwards), self._aim.next()
        axes, noise = self._device_axes, float(self._noise.next()[0])
        if axes is None:
            size = person.force_n * (1.0 + person.force_noise * noise)
            return Command(size * _tilted(direction, person.aim_rad, off))
        off = (self._turned + off) * np.sqrt(0.5)  # half of it lies in how this person holds the device
        size = person.device_n * (1.0 + DEVICE_NOISE * person.force_noise * noise)
        full = self._settings.force_cap_n
        shares = axes.T @ (size / full * _tilted(direction, person.device_aim_rad, off))
        counts = np.round(DEVICE_COUNTS * shares) / DEVICE_COUNTS
        return Command(full * axes @ np.where(np.abs(shares) < person.dead_band, 0.0, counts))

    def _turn(self, now: Seen) -> tuple[tuple[float, float, float], float]:
        """Axes and twist that turn the tool towards its orientation in the plan."""
        shaft, side = self._guide.at(self.progress_mm)
        error = np.cross(now.shaft, shaft)
        if side.any() and now.side.any():
            roll = float(np.cross(now.side, side) @ now.shaft)
            error = error - (error @ now.shaft) * now.shaft + roll * now.shaft
        rate = error / self._person.turn_s / self._full_turn
        # The three turns that a command has: the view to the right, down, and about the shaft.
        turns = np.column_stack([now.camera[:, 1], -now.camera[:, 0], now.shaft])
        right, down, twist = np.linalg.lstsq(turns, rate, rcond=None)[0].tolist()
        most = max(abs(right), abs(down), abs(twist), 1.0)
        return (right / most, down / most, 0.0), twist / most


def as_operator(person: PursuitOperator) -> Callable[[Any, Any], Act | None]:
    """The same as an ``Operator`` of any world: it sees the snapshot of the state."""

    def act(system: Any, state: Any) -> Act | None:
        command = person(system.snapshot(state))
        return None if command is None else Act(command)

    return act


def _tilted(direction: Array, angle_rad: float, noise: Array) -> Array:
    """A unit vector (3,) that is off a direction (3,) by an angle of this rms; noise: (3,) of unit variance."""
    across = noise - direction * (noise @ direction)
    return _unit(direction + angle_rad / np.sqrt(2.0) * across)


def _unit(vector: Array) -> Array:
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0.0 else vector
