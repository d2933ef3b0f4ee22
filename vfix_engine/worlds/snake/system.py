"""The snake as a system: a pure step from state and command to state, requests, rows, snapshots and plans."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Array
from ...errors import ControlError, InputError
from ...robots.snake_kernel import snake_frames
from ...runtime.camera_hand import DrivenCamera
from ...runtime.command import BUTTON_STRAIGHTEN, Command, no_command
from ...runtime.requests import Bend, Request, SetSettings, Straighten
from ...runtime.settings import checked_settings
from ...runtime.snapshot import Blocker
from ...runtime.system import Background, Column, Grip, Worker
from ...snake.control.parameterised import ParameterisedControl
from ...validate import whole
from .plans.adoption import adopted, bent_to, refused_link, wanted, with_settings
from .plans.look_progress import Looking
from .plans.messages import PlannerAnswer
from .requests import ChooseJoint, FollowTissue, LookRound
from .row import OUTCOMES, SnakeRow
from .settings import SnakeSettings
from .snapshot import AtHand, SnakeSnapshot
from .stepping.command import SnakeCommand
from .stepping.constants import DriveConstants, Start
from .stepping.distal import can_look, distal_context
from .stepping.manual import JOINTS
from .stepping.motion import tissue_age_s
from .stepping.state import SnakeState
from .stepping.step import step
from .warm_up import small_lumens

STILL_N = 1e-3  # [N] a smaller force counts as none while it decays
REACHED = 1e-9  # [rad] from the requested bend
STRUCTURE = "lumen"  # id of the structure that a link's bound belongs to
_WARM_STEPS = 40


class SnakeSystem:
    """Implements ``runtime.System``; made by ``SnakeSystemSpec.build``.

    Args:
        start: the robot at its start; planner: used by ``prepare`` to warm up the worker's computations.
    """

    def __init__(self, start: Start, planner: Worker) -> None:
        self.constants, self._start, self.planner = start.constants, start.state, planner
        self._row = SnakeRow(start.constants.snake, start.state.settings.manipulated)
        self._frames = np.empty((start.constants.snake.links, 3, 4))

    @property
    def row_layout(self) -> tuple[Column, ...]:
        """Names and units of the numbers that ``row`` writes."""
        return self._row.layout

    def prepare(self) -> None:
        """Steps of every kind, here and in small lumens that need everything; their results are discarded.

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
        if can_look(self.constants, state):
            state = self.apply(state, LookRound())
            for _ in range(_WARM_STEPS):
                state = self._planned(self.step(state, no_command()))
        self.row(state, np.empty(len(self.row_layout)))
        self.snapshot(state)

    def _planned(self, state: SnakeState) -> SnakeState:
        wanted = self.background(state)
        return state if wanted is None else self.adopt(state, self.planner(wanted.inputs), 0.0)

    def start(self) -> SnakeState:
        """The state at the start, at rest; its bounds were checked when it was built."""
        return self._start

    def step(self, state: SnakeState, command: Command) -> SnakeState:
        """One control period; every motion is certified, whatever its source."""
        drive, speeds = self.constants, self.settings(state)
        x, y, insert = (_share(axis) for axis in command.axes)
        straighten = bool(command.buttons & BUTTON_STRAIGHTEN)
        if x or y or insert or straighten:
            state = _undone(state)
        looking, goal = state.looking, state.bend_goal
        if looking is not None:
            straighten, goal = looking.back, looking.goal
        camera = (x * speeds.camera_mm_per_s, y * speeds.camera_mm_per_s)
        straighten = straighten or state.doing == "straighten"
        asked = SnakeCommand(insert * speeds.insertion_mm_per_s, camera, straighten, goal)
        state = step(drive, state, asked, state.period_s)
        if looking is not None:
            after = looking.stepped(drive, state)
            return _undone(state) if after is None else state._replace(looking=after)
        straight = state.doing == "straighten" and state.straight
        if straight or (state.doing == "bend" and bent_to(drive, state, np.array(state.bend_goal)) < REACHED):
            return _undone(state)
        return state

    def apply(self, state: SnakeState, request: Request) -> SnakeState:
        """The state after a request: ``SetSettings``, ``Straighten``, ``Bend``, ``LookRound``, ``FollowTissue`` or
        ``ChooseJoint``.

        Raises:
            ControlError: settings that the pose violates; a look-round before all links that bend are inside; a
                request of another world.
            InputError: a bend of another number of joints, an aim out of its range, or settings of another world or out
                of their ranges.
        """
        if isinstance(request, SetSettings):
            return self._with_settings(state, request.settings)
        if isinstance(request, Straighten):
            return _undone(state)._replace(doing="straighten")
        if isinstance(request, Bend):
            goal, joints = request.goal, self.constants.distal.dof
            if len(goal) != joints or not all(map(math.isfinite, goal)):
                raise InputError(f"a bend is {joints} finite angles in rad, not {goal!r:.80}")
            return _undone(state)._replace(doing="bend", bend_goal=tuple(float(value) for value in goal))
        if isinstance(request, LookRound):
            return self._looking(state, request)
        if isinstance(request, FollowTissue):
            return state._replace(following=bool(request.on))
        if isinstance(request, ChooseJoint):
            return self._chosen(state, request)
        raise ControlError(f"a snake does not know the request {type(request).__name__}")

    def _chosen(self, state: SnakeState, request: ChooseJoint) -> SnakeState:
        """The state with another joint in a manual hand."""
        if state.settings.arm != "manual":
            raise ControlError(f"joints are chosen in the manual arm, not in the arm '{state.settings.arm}'")
        most = self.constants.snake.links if self.constants.fixed_base else JOINTS
        return state._replace(hand_joint=whole("the joint", request.joint, 1, most))

    def _looking(self, state: SnakeState, request: LookRound) -> SnakeState:
        if not (math.isfinite(request.aim_deg) and 1.0 <= request.aim_deg <= 90.0):
            raise InputError(f"a look-round aims at 1 to 90°, not {request.aim_deg!r:.20}")
        if not can_look(self.constants, state):
            raise ControlError("too near the entrance to look round: insert until all links that bend are inside")
        return _undone(state)._replace(doing="look", looking=Looking(math.radians(request.aim_deg)))

    def _with_settings(self, state: SnakeState, settings: Any) -> SnakeState:
        settings = checked_settings(settings, SnakeSettings, "a snake")
        state = with_settings(self.constants, state, settings.of_drive(state.settings))
        return state._replace(adjusted=settings, period_s=settings.step_s)

    def settings(self, state: SnakeState) -> SnakeSettings:
        """The current settings."""
        return state.adjusted

    def period_s(self, state: SnakeState) -> float:
        """The control period in s."""
        return state.period_s

    def steps(self, state: SnakeState) -> int:
        """Control periods since the start."""
        return state.steps

    def at_rest(self, state: SnakeState, running: bool) -> bool:
        """Whether steps without a command would change nothing: no request under way, no force left, no tissue.

        A snake has no velocity between steps: it rests when the clock stops, and so does the tissue.
        """
        if not running or self.constants.moves:
            return not running
        still = not state.doing and state.result.name == "rest" and wanted(self.constants, state) is None
        return still and float(np.abs(state.forces.total).max()) < STILL_N

    def grip(self, state: SnakeState) -> Grip | None:
        """None: a snake is driven by axes, and by a drag and a wheel in its picture."""
        return None

    def camera(self, state: SnakeState) -> DrivenCamera:
        """The camera at the tip."""
        speeds, period_s = self.settings(state), state.period_s
        across, along = speeds.camera_mm_per_s * period_s, speeds.insertion_mm_per_s * period_s
        return DrivenCamera(state.obeyed_mm, across, state.tip_s, along)

    def row(self, state: SnakeState, out: Array) -> None:
        """Write the numbers of ``row_layout`` into ``out``."""
        self._row.write(state, tissue_age_s(self.constants, state), out)

    def snapshot(self, state: SnakeState) -> SnakeSnapshot:
        """The snapshot of a state."""
        drive, pose = self.constants, state.pose
        snake, distal = drive.snake, 2 * drive.first
        frames = snake.frames(pose.q, pose.shape.base)
        camera = frames[-1].copy()
        camera[:3, 3] += snake.camera_offset_mm * camera[:3, 2]
        radius = np.full((snake.links, 1), snake.radius_mm)
        return SnakeSnapshot(
            t=state.t,
            q=pose.q,
            capsules=np.hstack([frames[:-1, :3, 3], frames[1:, :3, 3], radius]),
            tip=frames[-1, :3, 3],
            camera=camera,
            outcome=OUTCOMES[state.result.name],
            progress_mm=state.tip_s,
            length_mm=state.tissue.length_mm,
            steps=state.steps,
            blockers=_blockers(drive, state),
            forces=np.append(state.forces.total, 0.0),
            mode=state.mode,
            doing=state.doing,
            bend=state.control.bent(pose.q[distal:], pose.shape.q[distal:]),
            straight=state.straight,
            can_look=can_look(drive, state),
            links_inside=int(pose.measured.sum()),
            deviations=np.where(pose.measured, pose.deviation.depth, 0.0),
            bounds=np.where(pose.measured, pose.bound, np.inf),
            resistance=state.forces.resistance,
            guidance=state.forces.guidance,
            tissue_age_s=tissue_age_s(drive, state),
            following=state.following,
            looked_deg=np.array(state.looked_deg if state.looking is None else state.looking.turned_deg),
            certified=state.certified,
            control_bends=_control_bends(drive, state),
            arm=state.settings.arm,
            hand_joint=state.hand_joint,
        )

    def at_hand(self, state: SnakeState) -> AtHand:
        """What of a snapshot an operator has before his eyes and in his hand."""
        snake, pose = self.constants.snake, state.pose
        snake_frames(pose.q, pose.shape.base, snake.length_mm, self._frames)
        camera = np.eye(4)
        camera[:3] = self._frames[-1]
        camera[:3, 3] += snake.camera_offset_mm * camera[:3, 2]
        return AtHand(state.t, camera, state.forces.total, state.tip_s)

    def background(self, state: SnakeState) -> Background | None:
        """The next request to the worker, or None."""
        view = None if state.looking is None else state.looking.wanted(self.constants, state)
        inputs = wanted(self.constants, state, view)
        return None if inputs is None else Background(inputs, state.steps)

    def adopt(self, state: SnakeState, result: Any, age_s: float) -> SnakeState:
        """The state with a plan; its outdated parts are ignored."""
        if not isinstance(result, PlannerAnswer):
            raise InputError(f"{type(result).__name__} is no plan for a snake")
        state = adopted(self.constants, state, result, age_s)
        if state.looking is not None and result.view is not None:
            return state._replace(looking=state.looking.taken(result.view, self.constants, state))
        return state


def _share(axis: float) -> float:
    """An axis from −1 to 1; NaN becomes 0."""
    return min(max(float(axis), -1.0), 1.0) if math.isfinite(axis) else 0.0


def _undone(state: SnakeState) -> SnakeState:
    """Without the active request."""
    if not state.doing:
        return state
    looked_deg = state.looked_deg if state.looking is None else state.looking.turned_deg
    return state._replace(doing="", bend_goal=None, looking=None, looked_deg=looked_deg)


def _control_bends(drive: DriveConstants, state: SnakeState) -> Array:
    """(N, L' + 1, 3) mm, joints and tip of the distal links in each control bend of this place."""
    control = state.control
    if not state.settled or not isinstance(control, ParameterisedControl):
        return np.empty((0, drive.distal.links + 1, 3))
    place = distal_context(drive, state)
    distal, links = drive.distal, np.empty((drive.distal.links, 3, 4))
    found = np.empty((len(control.bends), distal.links + 1, 3))
    found[:, 0] = place.base[:3, 3]
    for joints, bend in zip(found, control.bends, strict=True):
        snake_frames(distal.clamp(place.rest + bend.delta), place.base, distal.length_mm, links)
        joints[1:] = links[:, :, 3]
    return found


def _blockers(drive: DriveConstants, state: SnakeState) -> tuple[Blocker, ...]:
    """The reason why the last step was scaled or held."""
    limit, words = state.result.limit, state.result.words or ""
    if limit is None:
        return ()
    link = refused_link(drive, state)
    if limit == "bound" and link is not None:
        distance = float(state.bound[link] - state.deviation.depth[link])
        return (Blocker("bound", STRUCTURE, f"link {link + 1}", distance, state.held_at, words),)
    return (Blocker(limit, STRUCTURE if limit in ("tissue", "end") else "", words=words),)
