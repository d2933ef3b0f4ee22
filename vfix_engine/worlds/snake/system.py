"""The snake as a system: a pure step from state and command to state, requests, rows, snapshots and plans."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ...arrays import Array
from ...errors import ControlError, InputError
from ...runtime.command import BUTTON_STRAIGHTEN, Command, no_command
from ...runtime.requests import Bend, Request, SetSettings, Straighten
from ...runtime.snapshot import Blocker
from ...runtime.system import Background, Column, Grip
from .drive_state import Command as DriveCommand
from .look_plan import SIDES
from .looking import Looking
from .planned_drive import PlannedDrive
from .planner import Planner
from .planning import PlannerAnswer
from .requests import FollowTissue, LookRound
from .row import OUTCOMES, SnakeRow
from .settings import SnakeSettings
from .snapshot import SnakeSnapshot
from .warm_up import small_lumens

STILL_N = 1e-3  # [N] a force that is less is none; it only fades
REACHED = 1e-9  # [rad] off the bend that was asked for
STRUCTURE = "lumen"  # id of what a link's bound belongs to
_WARM_STEPS = 40


@dataclass(frozen=True, eq=False)
class SnakeState:
    """All that the next step needs.

    steps: control periods since the start. settings: in force. drive: the robot in its lumen at this moment; it is
    copied before it steps and never written to. doing: the request under way; goal: the bend (2L',) rad that it is for;
    looking: where a look-round is; looked_deg: how far the last one turned the view to each side.
    """

    steps: int
    settings: SnakeSettings
    drive: PlannedDrive
    doing: Literal["", "straighten", "bend", "look"] = ""
    goal: tuple[float, ...] = ()
    looking: Looking | None = None
    looked_deg: tuple[float, ...] = (0.0,) * SIDES


class SnakeSystem:
    """Implements ``runtime.System``; made by ``SnakeSystemSpec.build``.

    Args:
        first: the robot at its start; planner: computes here, when ``prepare`` warms up, what the worker will.
    """

    def __init__(self, first: PlannedDrive, settings: SnakeSettings, planner: Planner) -> None:
        self._first, self._settings, self.planner = first, settings, planner
        self._row = SnakeRow(first.snake, first.settings.manipulated)

    @property
    def row_layout(self) -> tuple[Column, ...]:
        """Names and units of the numbers that ``row`` writes."""
        return self._row.layout

    def prepare(self) -> None:
        """Steps of every kind, here and in small lumens that ask for everything; they lead nowhere.

        Kernels are compiled and loaded, those of the plans too.
        """
        self._try_all()
        for parts in small_lumens():
            SnakeSystem(*parts)._try_all()

    def _try_all(self) -> None:
        state = self.start()
        for axes in ((0.0, 0.0, 1.0), (1.0, 0.5, 0.0), (0.0, 0.0, -1.0)):
            for _ in range(_WARM_STEPS):
                state = self._planned(self.step(state, replace(no_command(), axes=axes)))
            state = self._planned(self.step(state, replace(no_command(), buttons=BUTTON_STRAIGHTEN)))
        if state.drive.can_look:
            state = self.apply(state, LookRound())
            for _ in range(_WARM_STEPS):
                state = self._planned(self.step(state, no_command()))
        self.row(state, np.empty(len(self.row_layout)))
        self.snapshot(state)

    def _planned(self, state: SnakeState) -> SnakeState:
        wanted = self.background(state)
        return state if wanted is None else self.adopt(state, self.planner(wanted.inputs), 0.0)

    def start(self) -> SnakeState:
        """The state at the start, at rest; that it keeps its bounds was seen when it was built."""
        return SnakeState(0, self._settings, self._first.copy())

    def step(self, state: SnakeState, command: Command) -> SnakeState:
        """One control period; every motion is certified, whoever wants it."""
        drive, settings = state.drive.copy(), state.settings
        x, y, insert = (_share(axis) for axis in command.axes)
        straighten = bool(command.buttons & BUTTON_STRAIGHTEN)
        asked = x or y or insert or straighten
        now = _undone(state) if asked else state
        looking, bend = now.looking, now.goal or None
        if looking is not None:
            straighten, bend = looking.back, looking.goal
        speed = settings.camera_mm_per_s
        straighten = straighten or now.doing == "straighten"
        drive.step(DriveCommand(insert * settings.insertion_mm_per_s, (x * speed, y * speed), straighten, bend))
        now = replace(now, steps=state.steps + 1, drive=drive)
        if looking is not None:
            after = looking.stepped(drive)
            return _undone(now) if after is None else replace(now, looking=after)
        done = (now.doing == "straighten" and drive.straight) or (now.doing == "bend" and _reached(drive, now.goal))
        return _undone(now) if done else now

    def apply(self, state: SnakeState, request: Request) -> SnakeState:
        """The state after a request: ``SetSettings``, ``Straighten``, ``Bend``, ``LookRound`` or ``FollowTissue``.

        Raises:
            ControlError: settings that the pose does not keep; a look-round before all links that bend are inside; a
                request of another world.
            InputError: a bend of another number of joints, an aim out of its range, or settings of another world.
        """
        if isinstance(request, SetSettings):
            return self._with_settings(state, request.settings)
        if isinstance(request, Straighten):
            return replace(_undone(state), doing="straighten")
        if isinstance(request, Bend):
            wanted, joints = request.goal, state.drive.distal.dof
            if len(wanted) != joints or not all(map(math.isfinite, wanted)):
                raise InputError(f"a bend is {joints} finite angles in rad, not {wanted!r:.80}")
            return replace(_undone(state), doing="bend", goal=tuple(float(value) for value in wanted))
        if isinstance(request, LookRound):
            return self._looking(state, request)
        if isinstance(request, FollowTissue):
            drive = state.drive.copy()
            drive.following = bool(request.on)
            return replace(state, drive=drive)
        raise ControlError(f"a snake does not know the request {type(request).__name__}")

    def _looking(self, state: SnakeState, request: LookRound) -> SnakeState:
        if not (math.isfinite(request.aim_deg) and 1.0 <= request.aim_deg <= 90.0):
            raise InputError(f"a look-round aims at 1 to 90°, not {request.aim_deg!r:.20}")
        if not state.drive.can_look:
            raise ControlError("too near the entrance to look round: insert until all links that bend are inside")
        return replace(_undone(state), doing="look", looking=Looking(math.radians(request.aim_deg)))

    def _with_settings(self, state: SnakeState, settings: Any) -> SnakeState:
        if not isinstance(settings, SnakeSettings):
            raise InputError(f"settings of a snake are SnakeSettings, not {type(settings).__name__}")
        drive = state.drive.copy()
        drive.set_settings(settings.of_drive(drive.settings))
        return replace(state, settings=settings, drive=drive)

    def settings(self, state: SnakeState) -> SnakeSettings:
        """The settings in force."""
        return state.settings

    def period_s(self, state: SnakeState) -> float:
        """The control period in s."""
        return state.settings.step_s

    def steps(self, state: SnakeState) -> int:
        """Control periods since the start."""
        return state.steps

    def at_rest(self, state: SnakeState, running: bool) -> bool:
        """Whether steps without a command would change nothing: no request under way, no force left, no tissue.

        A snake has no speed to lose: it rests wherever the clock is stopped, and the tissue with it.
        """
        drive = state.drive
        if not running or drive.moves:
            return not running
        still = not state.doing and drive.state.outcome == "rest" and not drive.wants_plan
        return still and float(np.abs(drive.state.forces.total).max()) < STILL_N

    def grip(self, state: SnakeState) -> Grip | None:
        """None: a snake is steered by axes."""
        return None

    def row(self, state: SnakeState, out: Array) -> None:
        """Write the numbers of ``row_layout`` into ``out``."""
        self._row.write(state.drive, state.drive.tissue_age_s, out)

    def snapshot(self, state: SnakeState) -> SnakeSnapshot:
        """The picture of a state."""
        drive = state.drive
        now, snake = drive.state, drive.snake
        frames = snake.frames(now.q, now.base)
        camera = frames[-1].copy()
        camera[:3, 3] += snake.camera_offset_mm * camera[:3, 2]
        radius = np.full((snake.links, 1), snake.radius_mm)
        rest = drive.distal_context().rest
        return SnakeSnapshot(
            t=now.t,
            q=now.q,
            capsules=np.hstack([frames[:-1, :3, 3], frames[1:, :3, 3], radius]),
            tip=frames[-1, :3, 3],
            camera=camera,
            outcome=OUTCOMES[now.outcome],
            progress_mm=now.tip_s,
            length_mm=drive.length_mm,
            steps=state.steps,
            blockers=_blockers(drive),
            forces=np.append(now.forces.total, 0.0),
            mode=now.mode,
            doing=state.doing,
            bend=drive.control.bent(now.q[-len(rest) :], rest),
            straight=drive.straight,
            can_look=drive.can_look,
            links_inside=int(now.measured.sum()),
            deviations=np.where(now.measured, now.deviation.depth, 0.0),
            bounds=np.where(now.measured, drive.bound, np.inf),
            resistance=now.forces.resistance,
            guidance=now.forces.guidance,
            tissue_age_s=drive.tissue_age_s,
            following=drive.following,
            looked_deg=np.array(state.looked_deg if state.looking is None else state.looking.turned_deg),
        )

    def background(self, state: SnakeState) -> Background | None:
        """What the worker is to plan next, or None."""
        wanted = state.drive.wanted(None if state.looking is None else state.looking.wanted(state.drive))
        return None if wanted is None else Background(wanted, state.steps)

    def adopt(self, state: SnakeState, result: Any, age_s: float) -> SnakeState:
        """The state with a plan; what of it no longer fits is left out."""
        if not isinstance(result, PlannerAnswer):
            raise InputError(f"{type(result).__name__} is no plan for a snake")
        drive = state.drive.copy()
        drive.adopt(result, age_s)
        if state.looking is not None and result.view is not None:
            return replace(state, drive=drive, looking=state.looking.taken(result.view, drive))
        return replace(state, drive=drive)


def _share(axis: float) -> float:
    """An axis from −1 to 1; what is no number is 0."""
    return min(max(float(axis), -1.0), 1.0) if math.isfinite(axis) else 0.0


def _undone(state: SnakeState) -> SnakeState:
    """Without the request under way."""
    if not state.doing:
        return state
    looked_deg = state.looked_deg if state.looking is None else state.looking.turned_deg
    return replace(state, doing="", goal=(), looking=None, looked_deg=looked_deg)


def _reached(drive: PlannedDrive, goal: tuple[float, ...]) -> bool:
    return bool(np.abs(drive.bend - goal).max() < REACHED)


def _blockers(drive: PlannedDrive) -> tuple[Blocker, ...]:
    """What shrank or held the last step."""
    now = drive.state
    if now.limit is None:
        return ()
    words = now.held_by or ""
    refused = drive.refused
    if now.limit == "bound" and refused is not None:
        link, name = refused
        distance = float(drive.bound[link] - now.deviation.depth[link])
        return (Blocker("bound", STRUCTURE, name, distance, now.held_at, words),)
    return (Blocker(now.limit, STRUCTURE if now.limit in ("tissue", "end") else "", words=words),)
