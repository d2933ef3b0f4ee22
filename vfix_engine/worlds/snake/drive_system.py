"""A scripted drive as a system: what ``drive_lumen`` does with its drive is recorded as a run and driven again.

Here a step takes as long as the operator's order says and finds for itself what the control process has planned, so
nothing is adopted. ``Command.axes`` are mm/s: of the camera to the right and down, and of the insertion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from ...arrays import Array
from ...errors import ControlError
from ...runtime.command import BUTTON_STRAIGHTEN, COMMAND_SIZE, Command, command_to_row, no_command
from ...runtime.driver import Log
from ...runtime.requests import Request
from ...runtime.snapshot import Snapshot
from ...runtime.system import Background, Column, Grip
from .drive_state import Command as DriveCommand
from .lumen import Lumen
from .row import OUTCOMES, SnakeRow
from .settings import SnakeSettings
from .snake_drive import SnakeDrive
from .spec import LumenContours, SnakeSystemSpec


@dataclass(frozen=True)
class SetPeriod(Request):
    """Steps take so many s from now on."""

    dt: float


@dataclass(frozen=True)
class BendTowards(Request):
    """Every step from now on has this goal of the distal links (2L',) rad; None: none."""

    bend: tuple[float, ...] | None


@dataclass(frozen=True)
class PlanAnew(Request):
    """As ``SnakeDrive.plan_anew``."""

    waypoint_mm: float


@dataclass(frozen=True)
class GetReady(Request):
    """As ``SnakeDrive.ready_to_look``."""


class DriveRecorder:
    """Observes a drive and writes its run to a log; made before the drive's first step."""

    def __init__(self, drive: SnakeDrive, log: Log) -> None:
        self._drive, self._log = drive, log
        self._row = SnakeRow(drive.snake, drive.settings.manipulated)
        self._line = np.zeros(COMMAND_SIZE + len(self._row.layout))
        self._dt = drive.settings.step_s
        self._bend: tuple[float, ...] | None = None

    def stepped(self, command: DriveCommand, dt: float) -> None:
        """One tick, and before it what is different about it."""
        if dt != self._dt:
            self._dt = dt
            self._log.event("request", SetPeriod(dt))
        if command.bend != self._bend:
            self._bend = command.bend
            self._log.event("request", BendTowards(command.bend))
        axes = (*command.camera_mm_per_s, command.insert_mm_per_s)
        buttons = BUTTON_STRAIGHTEN if command.straighten else 0
        command_to_row(replace(no_command(), axes=axes, buttons=buttons), self._line)
        self._row.write(self._drive, 0.0, self._line[COMMAND_SIZE:])
        self._log.tick(self._line)

    def planned_anew(self, waypoint_mm: float) -> None:
        """Between two ticks."""
        self._log.event("request", PlanAnew(waypoint_mm))

    def made_ready(self) -> None:
        """Between two ticks."""
        self._log.event("request", GetReady())


@dataclass(frozen=True, eq=False)
class DriveSpec(SnakeSystemSpec):
    """A scripted drive of a snake: ``drive`` has all of its settings, the others are not used."""

    @classmethod
    def of(cls, drive: SnakeDrive, lumen: Lumen) -> Self:
        """Of a drive that is at its start in a lumen."""
        contours = LumenContours.of(lumen)
        return cls(contours, drive.snake, drive=drive.settings, tissue=drive.pathway.motion, tip_s=drive.tip_s)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Of the rows of its runs."""
        return SnakeRow(self.snake, self.drive.manipulated).layout

    @property
    def world(self) -> str:
        """'snake drive'."""
        return "snake drive"

    @property
    def snapshot_type(self) -> type[Snapshot]:
        """``Snapshot``."""
        return Snapshot

    @property
    def has_worker(self) -> bool:
        """False."""
        return False

    def build(self) -> DriveSystem:  # type: ignore[override]
        """The drive at its start. Raises as ``SnakeSystemSpec.build``."""
        pathway, curve, slack = self._parts()
        given = None if pathway.motion is not None else curve
        return DriveSystem(SnakeDrive(self.snake, pathway, self.drive, given, slack, self.tip_s))


@dataclass(frozen=True, eq=False)
class DriveMoment:
    """The drive, which is copied before it steps, how long its steps take in s, and the bend that they go towards."""

    steps: int
    drive: SnakeDrive
    dt: float
    bend: tuple[float, ...] | None = None


class DriveSystem:
    """Implements ``runtime.System``; made by ``DriveSpec.build``."""

    def __init__(self, first: SnakeDrive) -> None:
        self._first, self._row = first, SnakeRow(first.snake, first.settings.manipulated)

    @property
    def row_layout(self) -> tuple[Column, ...]:
        """Names and units of the numbers that ``row`` writes."""
        return self._row.layout

    def prepare(self) -> None:
        """Nothing: no step of it has to be in time."""

    def start(self) -> DriveMoment:
        """The state at the start, at rest."""
        return DriveMoment(0, self._first.copy(), self._first.settings.step_s)

    def step(self, state: DriveMoment, command: Command) -> DriveMoment:
        """One step of the drive."""
        drive, (x, y, insert) = state.drive.copy(), command.axes
        drive.step(DriveCommand(insert, (x, y), bool(command.buttons & BUTTON_STRAIGHTEN), state.bend), state.dt)
        return replace(state, steps=state.steps + 1, drive=drive)

    def apply(self, state: DriveMoment, request: Request) -> DriveMoment:
        """The state after what ``DriveRecorder`` writes. Raises ControlError for other requests."""
        if isinstance(request, SetPeriod):
            return replace(state, dt=request.dt)
        if isinstance(request, BendTowards):
            return replace(state, bend=None if request.bend is None else tuple(request.bend))
        drive = state.drive.copy()
        if isinstance(request, PlanAnew):
            drive.plan_anew(request.waypoint_mm)
        elif isinstance(request, GetReady):
            drive.ready_to_look()
        else:
            raise ControlError(f"a scripted drive does not know the request {type(request).__name__}")
        return replace(state, drive=drive)

    def settings(self, state: DriveMoment) -> SnakeSettings:
        """Those of its settings that a driven snake has."""
        fixed = state.drive.settings
        return SnakeSettings(
            state.dt, fixed.insertion_mm_per_s, bound_mm=fixed.bound_mm, tip_bound_mm=fixed.tip_bound_mm
        )

    def period_s(self, state: DriveMoment) -> float:
        """How long the next step takes in s."""
        return state.dt

    def steps(self, state: DriveMoment) -> int:
        """Steps since the start."""
        return state.steps

    def at_rest(self, state: DriveMoment, running: bool) -> bool:
        """True: it moves by orders only."""
        return True

    def grip(self, state: DriveMoment) -> Grip | None:
        """None."""
        return None

    def row(self, state: DriveMoment, out: Array) -> None:
        """Write the numbers of ``row_layout`` into ``out``."""
        self._row.write(state.drive, 0.0, out)

    def snapshot(self, state: DriveMoment) -> Snapshot:
        """The picture of a state."""
        drive, now = state.drive, state.drive.state
        frames = drive.snake.frames(now.q, now.base)
        radius = np.full((drive.snake.links, 1), drive.snake.radius_mm)
        return Snapshot(
            t=now.t,
            q=now.q,
            capsules=np.hstack([frames[:-1, :3, 3], frames[1:, :3, 3], radius]),
            tip=frames[-1, :3, 3],
            camera=drive.snake.camera(now.q, now.base),
            outcome=OUTCOMES[now.outcome],
            progress_mm=now.tip_s,
            length_mm=drive.length_mm,
            steps=state.steps,
            forces=np.append(now.forces.total, 0.0),
        )

    def background(self, state: DriveMoment) -> Background | None:
        """None."""
        return None

    def adopt(self, state: DriveMoment, result: Any, age_s: float) -> DriveMoment:
        """The state as it is: nothing is asked for."""
        return state
