"""Operators of the rigid tool: one that does the job, one that pushes, a recorded hand; and each behind a device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...control.admittance import saturate
from ...control.tasks import view_point
from ...errors import InputError
from ...kernels.triples import triple
from ...runtime.command import Command, Master
from ...runtime.control_mode import MODES, TELEOPERATED, Control, Device
from ...runtime.driven_clock import FROM_START
from ...runtime.operator import Act
from ...runtime.requests import Reset
from ...runtime.run import Run
from .recorded_settings import driven_s, first_settings, settings_of
from .state import RehearsalState
from .system import RigidSystem

_SAME_S = 1e-9  # two times that differ by less are the same

RigidOperator = Callable[[RigidSystem, RehearsalState], Act]  # an ``Operator`` that never finishes


class ScriptedOperator:
    """Drives along the path at full force; in inspection draws the view onto the target, then swings around it."""

    def __init__(self, drive: int = 1, swing_period_steps: int = 4000):
        self._direction, self._period = drive, swing_period_steps
        self._swung = 0

    def __call__(self, system: RigidSystem, state: RehearsalState) -> Act:
        if state.mode != "inspect":
            return Act(Command(np.zeros(3), drive=self._direction))
        if state.phase == "inspect_approach":
            return Act(Command(np.zeros(3), drive=1))
        angle = 2 * np.pi * self._swung / self._period
        self._swung += 1
        across, upwards = state.tool.tip.rotation[:, 0], state.tool.tip.rotation[:, 2]
        force = 0.5 * state.settings.force_cap_n * (np.cos(angle) * across + np.sin(angle) * upwards)
        return Act(Command(force, twist=int(np.sign(np.sin(2 * angle)))))


class PushingOperator:
    """Full force into bone, the direction changing: towards the nearest bone, at random, or forwards and sideways."""

    def __init__(self, seed: int = 0, episode_steps: int = 150):
        self._random = np.random.default_rng(seed)
        self._episode, self._count = episode_steps, 0
        self._kind, self._push = 0, np.zeros(3)

    def __call__(self, system: RigidSystem, state: RehearsalState) -> Act:
        fresh = self._count % self._episode == 0
        self._count += 1
        if fresh:
            # The first two episodes make contact; from then on the direction changes.
            self._kind = int(self._random.integers(4)) if self._count > 2 * self._episode else 0
            self._push = _unit(self._random.normal(size=3))
        if self._kind == 0:
            direction = to_nearest_bone(system, state)
        elif self._kind == 1:
            direction = self._push
        else:
            ahead = state.tool.tip.rotation[:, 1] if state.nearest is None else state.nearest.tangent
            direction = _unit(ahead + (0.3 if self._kind == 2 else -0.3) * self._push)
        twist = int(self._random.integers(-1, 2)) if fresh else 0
        return Act(Command(state.settings.force_cap_n * direction, twist=twist))


class TeleoperatedOperator:
    """Another operator at a device: what it would do with its hand, it does with a master or a rate device.

    A master is moved as fast as that force would move a free tool, so that its spring comes to pull with it.
    """

    def __init__(self, hand: RigidOperator, control: Control):
        self._hand, self._device = hand, control.device

    def __call__(self, system: RigidSystem, state: RehearsalState) -> Act:
        act = self._hand(system, state)
        command, settings = act.command, state.settings
        wanted = command.force + command.drive * settings.force_cap_n * _towards(system, state)
        force = np.array(saturate(triple(wanted), settings.force_cap_n))
        if self._device == "rate":
            return Act(Command(force, twist=command.twist, rate=True), act.requests)
        increment = settings.gain_mm_per_s_per_n * settings.dt_s / settings.master_scale * force
        return Act(Command(np.zeros(3), twist=command.twist, master=Master(increment)), act.requests)


class RecordedOperator:
    """The hand of a recorded run, by its time: what it did from the run's last return to the start on.

    A step takes the command of its begin, and of a master what it moved within the step, evenly over each recorded
    period; at the rate of the recording these are the recorded commands. Before the begin and after the end the hand is
    at rest. Requests of the run, such as another task, are not repeated (Li 2007, section V.E).

    duration_s: of the recording. control: what the hand led, as in the run's manifest.

    Raises:
        InputError: the run has no samples, no mode of a hand, a spec that it does not hold or events that lost steps
            leave without a place, or its mode was changed on the way.
    """

    def __init__(self, run: Run):
        starts = [event.at for event in run.events if isinstance(event.content, Reset) and event.at < len(run.ticks)]
        first = max(starts, default=0)
        if first >= len(run.ticks):
            raise InputError("the run has no samples, so no hand to repeat")
        if run.mode not in MODES:
            raise InputError(f"a run {'of mixed modes' if run.mode else 'without a mode'} has no hand to repeat")
        device: Device = "rate" if run.manifest.get("device") == "rate" else "position"
        self.control = Control(run.mode, device)
        self._commands = [run.command(index) for index in range(first, len(run.ticks))]
        self._period = np.array([one.dt_s for one in settings_of(run, first_settings(run))[first:]])
        self._end = driven_s(self._period)
        self.duration_s, self._now = float(self._end[-1]), FROM_START
        self._step, self._dt_s = 0, 0.0

    def __call__(self, system: RigidSystem, state: RehearsalState) -> Act:
        if state.settings.dt_s != self._dt_s:
            self._now = self._now.changed(self._step, self._dt_s or state.settings.dt_s, state.settings.dt_s)
            self._dt_s = state.settings.dt_s
        begin, end = (self._now.read(self._step + more, self._dt_s) for more in (0, 1))
        self._step += 1
        here = int(np.searchsorted(self._end, begin + _SAME_S))
        if here >= len(self._commands):
            return Act(Command(np.zeros(3)))
        command = self._commands[here]
        if command.master is None:
            return Act(command)
        return Act(replace(command, master=self._led(here, begin, end)))

    def _led(self, here: int, begin: float, end: float) -> Master:
        """What the master moved within a step from ``begin`` to ``end`` in s: of a recorded period that lies in it in
        part, that part."""
        there = int(np.searchsorted(self._end, end - _SAME_S)) + 1
        parts = list[tuple[float, Master]]()
        for index in range(here, min(max(there, here + 1), len(self._commands))):
            master, until, period = self._commands[index].master, float(self._end[index]), float(self._period[index])
            if master is not None:
                inside = min(end, until) - max(begin, until - period)
                parts.append((1.0 if inside >= period - _SAME_S else max(inside, 0.0) / period, master))
        if len(parts) == 1 and parts[0][0] == 1.0:
            return parts[0][1]
        led = [share * master.increment for share, master in parts if master.clutch]
        return Master(np.sum(led, axis=0) if led else np.zeros(3), clutch=bool(led))


def behind_device(hand: RigidOperator, control: Control) -> RigidOperator:
    """The operator itself with a hand on the robot, or at the device of a teleoperated drive."""
    return TeleoperatedOperator(hand, control) if control.mode == TELEOPERATED else hand


def _towards(system: RigidSystem, state: RehearsalState) -> Array:
    """Unit direction (3,) of ``Command.drive``: along the path, or of the view towards its target; 0 where neither."""
    if state.mode == "path" and state.nearest is not None:
        return np.asarray(state.nearest.tangent, dtype=float)
    if state.phase != "inspect_approach":
        return np.zeros(3)
    centre = view_point(state.tool, system.scene.tool, state.settings.view_distance_mm)
    way: Array = system.scene.targets[state.target] - centre
    return _unit(way) if way.any() else way


def to_nearest_bone(system: RigidSystem, state: RehearsalState) -> Array:
    """Return the unit direction (3,) from the tool to the nearest bone, in the patient frame."""
    direction: Array = -system.scene.tree.closest(state.tool.segments).normal
    return direction


def _unit(vector: Array) -> Array:
    return vector / float(np.linalg.norm(vector))
