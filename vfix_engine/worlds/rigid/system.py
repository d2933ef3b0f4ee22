"""The rigid tool as a system: tasks and phases around the controller; one pure step from state and command to state."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...control import Controller, ControlSettings, HandCommand, StepReport, StepState, Task, build_step, solve_step
from ...control.admittance import saturate
from ...control.qp import DUAL
from ...control.relaxations import take_step
from ...control.tasks import ApproachPath, ApproachTarget, FollowPath, InspectTarget, MoveFreely, PathPoint, view_point
from ...control.tasks.printed_path import PrintedPath
from ...errors import ControlError, InputError
from ...geometry.vectors import length
from ...kernels.triples import Triple, dot, minus, norm, over, plus, times, triple
from ...runtime.command import Command
from ...runtime.control_mode import FREEHAND
from ...runtime.requests import Request, SetControl, SetSettings, SetTask
from ...runtime.settings import checked_settings
from ...runtime.system import Background, Column, Grip
from .command_values import array_of, share_of
from .hand_kernel import torque_about_tip, torque_about_view
from .requests import ApproachPoint
from .row import RowWriter
from .scene import Scene
from .snapshot import RigidSnapshot, snapshot_of, view_axes
from .state import ZEROS, LastStep, RehearsalState
from .teleoperation import advance_leader, consume_motion, spring

FORCE_LIMIT_N = 1e6  # only keeps the arithmetic finite; the force cap is a setting
LEAVE_PATH_MM = 0.5  # a tip further off than this is brought back by an approach
ON_PATH_MM = 0.02  # the approach ends here
END_MM = 0.02  # remaining arc length that counts as arrived
AIM_SHARE = 0.5  # of ε_t, by which a step of inspection follows a hand that bends the robot
ON_TARGET_SHARE = 0.5  # of ε_t, where inspection takes over from its approach
SEARCH_WINDOW_MM = 5.0  # closest point is searched this far along the path, never on another branch
STILL = 1e-9  # joint speed in mm/s and rad/s that counts as rest

MODES = ("path", "inspect", "free")
FREELY = MoveFreely()
GUIDED = ("approach", "inspect_approach")  # phases in which the fixture chooses the direction
NO_PATH = "path following needs a path of at least two points"

_FLOAT = np.dtype(np.float64)
NO_FORCE = (0.0, 0.0, 0.0)


class _Stepped(NamedTuple):
    """The result of one mode for a step."""

    report: StepReport
    phase: str
    nearest: PathPoint | None
    force: Array
    torque: Array = ZEROS
    end: str = ""
    fell_back: bool = False
    deflection: Array = ZEROS


class RigidSystem:
    """A robot with a rigid tool in one scene, as ``runtime.System``. ``solver``: see ``Controller``."""

    def __init__(self, scene: Scene, settings: ControlSettings, solver: str = DUAL):
        self.scene, self.first_settings, self.solver = scene, settings, solver
        self.controller = self._controller(settings)
        self._inspections = tuple(InspectTarget(target) for target in scene.targets)
        self._goals = tuple(triple(target) for target in scene.targets)
        self._approaches = tuple(ApproachTarget(target) for target in scene.targets)
        self._view = view_axes(scene.tool)
        self._row = RowWriter(scene)
        self.row_layout: tuple[Column, ...] = self._row.layout

    def _controller(self, settings: ControlSettings) -> Controller:
        scene = self.scene
        return Controller(
            scene.placed_robot(), scene.tool, scene.tree, settings, self.solver, scene.zones, scene.fixtures
        )

    def _controller_of(self, settings: ControlSettings) -> Controller:
        """The controller for a state's settings; the last one is cached."""
        if settings is not self.controller.settings and settings != self.controller.settings:
            self.controller = self._controller(settings)
        return self.controller

    def prepare(self) -> None:
        """Load every kernel by a few steps of every mode of the scene, whose results are discarded."""
        scene, row = self.scene, np.zeros(len(self.row_layout))
        for mode in ["free"] + ["path"] * (scene.path is not None) + ["inspect"] * bool(len(scene.targets)):
            state = self.start(mode)
            for force in (ZEROS, np.ones(3), -np.ones(3)):
                state = self.step(state, Command(force, drive=1))
            self.row(state, row)
            self.snapshot(state)
            self.controller.warm_up(state.tool)

    def start(self, mode: str = "") -> RehearsalState:
        """The state at the entry; without a mode on the path, or free where there is none.

        Raises:
            StartRefused: the start pose is outside a limit or inside the margin.
            ControlError: the mode needs a path or target that the scene does not have.
        """
        settings, path = self.first_settings, self.scene.path
        tool = self._controller_of(settings).start(self.scene.q_start)
        nearest = None if path is None else PathPoint(*path.closest(tool.tip.position))
        state = RehearsalState(tool, "free", "free", nearest, 0, 0, settings)
        return self.with_mode(state, mode or ("free" if path is None else "path"))

    def apply(self, state: RehearsalState, request: Request) -> RehearsalState:
        """Another task ('path', 'inspect', 'free') or other settings at the same pose and speed.

        Raises:
            ControlError: there is no such task, path or target, or the system has no such request.
            InputError: settings of another world, or out of their ranges.
            StartRefused: the pose violates a limit or margin of the new settings; the old ones stay.
        """
        if isinstance(request, SetTask):
            return self.with_mode(state, request.task, request.target)
        if isinstance(request, ApproachPoint):
            return self.with_chosen(state, request.at_mm)
        if isinstance(request, SetControl):
            if request.control.mode == FREEHAND:
                raise ControlError("a tool on a robot is not in a free hand; end this drive and start another one")
            return replace(state, lag=ZEROS)
        if isinstance(request, SetSettings):
            settings = checked_settings(request.settings, ControlSettings, "the rigid tool")
            kept = self.controller
            try:
                self._controller_of(settings).start(state.tool.q)
            except ControlError:
                self.controller = kept
                raise
            clock = state.clock.changed(state.steps, state.settings.dt_s, settings.dt_s)
            return replace(state, settings=settings, last=None, clock=clock)
        raise ControlError(f"a rigid tool cannot be asked to {type(request).__name__}")

    def with_mode(self, state: RehearsalState, mode: str, target: int = 0) -> RehearsalState:
        """The same pose and speed in another mode; ControlError when the scene has no path or no such target."""
        if mode not in MODES:
            raise ControlError(f"mode '{mode}' is not one of {', '.join(MODES)}")
        state = replace(state, lag=ZEROS, chosen=None, deflection=ZEROS, last=None)
        if mode == "path":
            if self.scene.path is None:
                raise ControlError(NO_PATH)
            nearest = PathPoint(*self.scene.path.closest(state.tool.tip.position))
            off = length(nearest.position - state.tool.tip.position)
            phase = "follow" if off <= LEAVE_PATH_MM else "approach"
            return replace(state, mode=mode, phase=phase, nearest=nearest)
        if mode == "inspect":
            if not 0 <= target < len(self.scene.targets):
                raise ControlError(f"there is no target number {target + 1}; add a target to the plan")
            return replace(state, mode=mode, phase="inspect_approach", target=target)
        return replace(state, mode=mode, phase="free")

    def with_chosen(self, state: RehearsalState, at_mm: float) -> RehearsalState:
        """The same pose and speed, about to approach the path's point at an arc length.

        Raises:
            ControlError: the scene has no path, or none of this length.
        """
        state, path = self.with_mode(state, "path"), self.scene.path
        assert path is not None  # with_mode has refused a scene without one
        if not 0.0 <= at_mm <= path.length:
            raise ControlError(f"the path has no point at {at_mm!r:.40} mm; it is {path.length:.1f} mm long")
        chosen = PathPoint.at(path, at_mm)
        return replace(state, phase="approach", nearest=chosen, chosen=chosen)

    def measure(self, q: Array, velocity: Array, settings: ControlSettings) -> StepState:
        """The tool at joints q (n,) and their velocity (n,), as recorded, unchecked. Raises InputError."""
        return self._controller_of(settings).measure(q, velocity)

    def settings(self, state: RehearsalState) -> ControlSettings:
        return state.settings

    def period_s(self, state: RehearsalState) -> float:
        return state.settings.dt_s

    def steps(self, state: RehearsalState) -> int:
        return state.steps

    def at_rest(self, state: RehearsalState, running: bool) -> bool:
        """The tool is at rest, and the last step, if there was one, had no command."""
        last = state.last
        idle = last is None or last.report.outcome == "idle"
        return idle and not bool(np.abs(state.tool.velocity).max() > STILL)

    def grip(self, state: RehearsalState) -> Grip:
        """The grip on the tool's shaft; by the papers' program a device has the axes of the robot's base (V.F.1)."""
        settings, tip = state.settings, state.tool.tip
        base = self.scene.printed is not None
        axes = self.scene.base[:3, :3] if base else tip.rotation @ self._view
        grip = self._grip(state.tool)
        return Grip(grip, settings.stiffness_n_per_mm, settings.force_cap_n, axes, grip - tip.position)

    def camera(self, state: RehearsalState) -> None:
        """None: an endoscope is moved as any tool is."""

    def row(self, state: RehearsalState, out: Array) -> None:
        self._row.write(state, out)

    def snapshot(self, state: RehearsalState) -> RigidSnapshot:
        """The snapshot of a state, including the step that led there."""
        return snapshot_of(self.scene, state, state.last)

    def background(self, state: RehearsalState) -> Background | None:
        """Nothing takes longer than a step."""
        return None

    def adopt(self, state: RehearsalState, result: object, age_s: float) -> RehearsalState:
        return state

    def step(self, state: RehearsalState, command: Command) -> RehearsalState:
        """One control period.

        Raises:
            InputError: the command's force is not an array of three numbers, or drive or twist is not a number;
                non-finite ones count as 0.
        """
        settings, master = state.settings, command.master
        force, lag = hand_force(command.force, settings.force_cap_n), ZEROS
        drive = share_of(command.drive, "drive")
        twist = share_of(command.twist, "twist")
        turns = self._turns(command, settings) if command.rate else ZEROS
        reach = math.inf
        if master is not None:
            lag = advance_leader(state.lag, master, settings)
            force, drive, reach = triple(spring(lag, settings)), 0.0, length(lag)
        controller = self._controller_of(settings)
        if state.mode == "path":
            done = self._path_step(controller, state, force, drive, reach, master is None and not command.rate)
        elif state.mode == "inspect":
            on_robot = master is None and not command.rate
            done = self._inspect_step(controller, state, force, drive, twist, reach, turns, on_robot)
        else:
            # Li 2007, section V.F: the master moves the tip; on the grip a force turns the tool as well.
            turning = force if master is None and not command.rate else NO_FORCE
            turn = twist * settings.force_cap_n * self.scene.tool.grip_from_bend
            torque = np.array(torque_about_tip(*controller.context.kernel_sizes, state.tool.numbers, turning, turn))
            torque = torque + turns if command.rate else torque
            hand = HandCommand(np.array(force), torque, reach)
            report = controller.step(state.tool, FREELY, hand)
            done = _Stepped(report, state.phase, state.nearest, hand.force, torque)
        if master is not None:
            lag = consume_motion(lag, self._moved(state, done), done.phase in GUIDED)
        return RehearsalState(
            done.report.state,
            state.mode,
            done.phase,
            done.nearest,
            state.target,
            state.steps + 1,
            settings,
            state.emergencies + done.report.emergency,
            lag,
            state.chosen if done.phase == "approach" else None,
            state.fallbacks + done.fell_back,
            done.deflection,
            LastStep(done.report, done.force, done.torque, done.end, master is not None or command.rate),
            state.clock,
        )

    def _turns(self, command: Command, settings: ControlSettings) -> Array:
        """Torque (3,) in N·mm of a rate device's three rotations, each at most that of the force cap at the grip."""
        shares = np.array([share_of(value, "axis") for value in array_of(command.axes, "the axes").tolist()])
        torque: Array = settings.force_cap_n * self.scene.tool.grip_from_bend * shares
        return torque

    def _path_step(
        self, controller: Controller, state: RehearsalState, force: Triple, drive: float, reach: float, on_robot: bool
    ) -> _Stepped:
        """on_robot: the force is a hand's on the handle, whose deflection is compensated where it is known."""
        path, near, settings = self.scene.path, state.nearest, state.settings
        if path is None or near is None:
            raise ControlError(NO_PATH)
        tangent = triple(near.tangent)
        if drive:
            force = plus(force, times(drive * settings.force_cap_n, tangent))
        force = saturate(force, settings.force_cap_n)
        bent = ZEROS
        if on_robot and settings.compliance_mm_per_n:
            # The deflected tip follows the path, so the undeflected one follows it displaced by −C f.
            bent = settings.compliance_mm_per_n * np.array(force)
            if state.chosen is None:
                near = PathPoint(*path.closest(state.tool.position + bent, near.s, SEARCH_WINDOW_MM))
            tangent = triple(near.tangent)
        aim = near if bent is ZEROS else near._replace(position=near.position - bent)
        limit = ON_PATH_MM if state.phase == "approach" else LEAVE_PATH_MM
        off = norm(minus(triple(aim.position), triple(state.tool.position)))
        phase = "follow" if off <= limit else "approach"
        kind, shaft = ApproachPath if phase == "approach" else FollowPath, self.scene.shaft
        task: Task = kind(path, aim, shaft)
        hand = HandCommand(np.array(force), ZEROS, reach)
        report, fell_back = self._followed(controller, state, task, aim, hand)
        if phase == "approach" and state.chosen is not None:
            return _Stepped(report, phase, near, hand.force, deflection=bent)
        arrived = report.state.position if bent is ZEROS else report.state.position + bent
        after = PathPoint(*path.closest(arrived, near.s, SEARCH_WINDOW_MM))
        end = ""
        if phase == "follow":
            if path.length - after.s <= END_MM:
                phase = "done"
                end = "the end of the path" if dot(force, tangent) > 0 else ""
            elif after.s <= END_MM and dot(force, tangent) < 0:
                end = "the entry of the path"
        return _Stepped(report, phase, after, hand.force, end=end, fell_back=fell_back, deflection=bent)

    def _followed(
        self, controller: Controller, state: RehearsalState, task: Task, near: PathPoint, hand: HandCommand
    ) -> tuple[StepReport, bool]:
        """Step along the path; with printed weights by the papers' program, or by the usual one where (14) fails."""
        weights = self.scene.printed
        if weights is None or not isinstance(task, FollowPath):
            return controller.step(state.tool, task, hand), False
        tool = controller.context.remeasured(state.tool)
        problem = build_step(tool, PrintedPath(task.path, near, weights), controller.fixtures, hand)
        if problem.rests or solve_step(problem, self.solver).found:
            return take_step(problem, self.solver), False
        return controller.step(tool, task, hand), True

    def _inspect_step(
        self,
        controller: Controller,
        state: RehearsalState,
        force: Triple,
        drive: float,
        twist: float,
        reach: float,
        turns: Array,
        on_robot: bool,
    ) -> _Stepped:
        """on_robot: as in ``_path_step``."""
        settings, number = state.settings, state.target
        cap, tolerance, push = settings.force_cap_n, settings.target_tolerance_mm, np.array(force)
        turn = twist * cap * self.scene.tool.grip_from_bend
        off, lever, torque = torque_about_view(
            *controller.context.kernel_sizes, state.tool.numbers, force, turn, self._goals[number]
        )
        goal, bent, inspection, approach = (
            self._goals[number],
            ZEROS,
            self._inspections[number],
            self._approaches[number],
        )
        if on_robot and settings.compliance_mm_per_n and self.scene.bent_inspection:
            # The bent robot's point is held on the target, so the unbent one's is held beside it by −C f.
            bent = settings.compliance_mm_per_n * push
            goal = self._aim(state, bent)
            off = norm(minus(triple(view_point(state.tool, self.scene.tool, settings.view_distance_mm)), goal))
            inspection, approach = InspectTarget(np.array(goal)), ApproachTarget(np.array(goal))
        if off <= (tolerance if state.phase == "inspect_hold" else ON_TARGET_SHARE * tolerance):
            about_view = np.array(torque) if turns is ZEROS else np.array(torque) + turns
            hand = HandCommand(push, about_view, reach / lever)
            report = controller.step(state.tool, inspection, hand)
            return _Stepped(report, "inspect_hold", state.nearest, push, hand.torque, deflection=bent)
        pull = push
        if drive > 0:
            centre = view_point(state.tool, self.scene.tool, settings.view_distance_mm)
            towards = minus(goal, triple(centre))
            size = norm(towards)
            towards = over(towards, size) if size > 0.0 else towards
            pull = np.array(saturate(plus(force, times(drive * cap, towards)), cap))
        report = controller.step(state.tool, approach, HandCommand(pull, ZEROS, reach))
        return _Stepped(report, "inspect_approach", state.nearest, push, deflection=bent)

    def _aim(self, state: RehearsalState, bent: Array) -> Triple:
        """Where the unbent robot's virtual point belongs: beside the target by the deflection (3,) in mm.

        On the target it goes there by a share of ε_t a step, so that it never leaves the polyhedron of (22)-(23) that
        moves with it; from farther away than a change of the force explains, the approach brings it back.
        """
        settings = state.settings
        goal = self.scene.targets[state.target] - bent
        centre = view_point(state.tool, self.scene.tool, settings.view_distance_mm)
        away, most = goal - centre, AIM_SHARE * settings.target_tolerance_mm
        far = length(away)
        follows = most < far <= 2.0 * settings.deflection_mm + settings.target_tolerance_mm
        if state.phase == "inspect_hold" and follows:
            return triple(centre + (most / far) * away)
        return triple(goal)

    def _moved(self, state: RehearsalState, done: _Stepped) -> Array:
        """Displacement (3,) in mm of the point that follows a master: tip, virtual point, or on a target the grip."""
        before, after = state.tool, done.report.state
        if done.phase == "inspect_hold":
            return self._grip(after) - self._grip(before)
        if done.phase == "inspect_approach":
            tool, distance = self.scene.tool, state.settings.view_distance_mm
            return view_point(after, tool, distance) - view_point(before, tool, distance)
        moved: Array = after.tip.position - before.tip.position
        return moved

    def _grip(self, tool: StepState) -> Array:
        return self.scene.tool.grip(tool.tip.rotation, tool.tip.position)


def hand_force(given: Array, cap: float) -> Triple:
    """A hand's effective force in N: 0 if non-finite (HAZ-05), no longer than ``cap``.

    Raises:
        InputError: it is not an array of three numbers.
    """
    force = given if type(given) is np.ndarray and given.dtype is _FLOAT else array_of(given, "the force")
    if force.shape != (3,):
        raise InputError(f"the force has the shape {force.shape}; it is three numbers in N, in the patient frame")
    x, y, z = force.tolist()
    largest = max(abs(x), abs(y), abs(z))
    if largest == 0.0 or not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        return NO_FORCE
    if largest > FORCE_LIMIT_N:
        x, y, z = (min(max(value, -FORCE_LIMIT_N), FORCE_LIMIT_N) for value in (x, y, z))
    return saturate((x, y, z), cap)
