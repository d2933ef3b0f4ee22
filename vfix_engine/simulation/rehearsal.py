"""A rehearsal: modes and phases around the controller; one pure step from state and command to state and snapshot."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..control import Controller, ControlSettings, HandCommand, StepReport, Task, ToolState
from ..control.admittance import saturate
from ..control.qp import DUAL
from ..control.relaxations import SLOWED_SHARE
from ..control.tasks import ApproachPath, ApproachTarget, FollowPath, InspectTarget, MoveFreely, PathPoint, view_point
from ..errors import ControlError, InputError
from ..fixtures import Zone
from ..geometry.proximity import Proximity
from .numbers import array_of, share_of
from .scene import Scene
from .snapshot import Snapshot
from .teleoperation import Master, followed, led, spring

Array = NDArray[np.float64]

FORCE_LIMIT_N = 1e6  # only keeps the arithmetic finite; the cap is a setting
LEAVE_PATH_MM = 0.5  # a tip further off than this is brought back by an approach
ON_PATH_MM = 0.02  # the approach ends here
END_MM = 0.02  # remaining arc length that counts as arrived
ON_TARGET_SHARE = 0.5  # of ε_t, where inspection takes over from its approach
SEARCH_WINDOW_MM = 5.0  # closest point is searched this far along the path, never on another branch

MODES = ("path", "inspect", "free")
GUIDED = ("approach", "inspect_approach")  # phases in which the fixture chooses the direction


@dataclass(frozen=True)
class Command:
    """What the hand does during one step: force (3,) in N at the grip, drive and twist from -1 to +1 of full force.

    Keys beyond that are clamped, non-finite ones count as 0.

    With a ``master`` the step is teleoperated, in every mode: its motion counts instead of force and drive.
    """

    force: Array
    drive: float = 0
    twist: float = 0
    master: Master | None = None


@dataclass(frozen=True)
class RehearsalState:
    """All that a rehearsal remembers between two steps; ``nearest`` is None where there is no path.

    nearest: to the tip while it follows the path; in other modes where it was when it last did.
    emergencies: steps so far that exceeded an acceleration limit; lag: (3,) in mm that the tool is behind its master.
    """

    tool: ToolState
    mode: str
    phase: str
    nearest: PathPoint | None
    target: int
    steps: int
    emergencies: int = 0
    lag: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def q(self) -> Array:
        """Joints (n,) in mm and rad, in the order of ``RobotModel.joints``; ``tool`` has the rest of the pose."""
        return self.tool.q


class Rehearsal:
    """Drives one scene; ``step`` is a pure function of state and command. ``solver``: see ``Controller``."""

    def __init__(self, scene: Scene, settings: ControlSettings, solver: str = DUAL):
        self.scene, self.settings, self.solver = scene, settings, solver
        robot = scene.placed_robot()
        self.controller = Controller(robot, scene.tool, scene.tree, settings, solver, scene.zones, scene.fixtures)

    def with_anatomy(self, tree: Proximity, zones: tuple[Zone, ...] | None = None) -> Rehearsal:
        """The same rehearsal among anatomy that has moved; its states go on from where the tool is (HAZ-04).

        Args:
            zones: as they are now, where they moved with the anatomy, such as patches of it; None: as they were.
        """
        scene = replace(self.scene, tree=tree, zones=self.scene.zones if zones is None else zones)
        return Rehearsal(scene, self.settings, self.solver)

    def start(self, mode: str = "path") -> RehearsalState:
        """The state at the entry.

        Raises:
            StartRefused: the start pose is outside a limit or inside the margin.
            ControlError: the mode needs a path or target that the scene has not.
        """
        tool = self.controller.start(self.scene.q_start)
        nearest = None if self.scene.path is None else PathPoint(*self.scene.path.closest(tool.tip.position))
        return self.with_mode(RehearsalState(tool, "free", "free", nearest, 0, 0), mode)

    def with_mode(self, state: RehearsalState, mode: str, target: int = 0) -> RehearsalState:
        """The same pose and speed in another mode; ControlError when the scene has no path or no such target."""
        state = replace(state, lag=np.zeros(3))
        if mode not in MODES:
            raise ControlError(f"mode '{mode}' is not one of {', '.join(MODES)}")
        if mode == "path":
            if self.scene.path is None:
                raise ControlError("path following needs a path of at least two points")
            nearest = PathPoint(*self.scene.path.closest(state.tool.tip.position))
            off = float(np.linalg.norm(nearest.position - state.tool.tip.position))
            phase = "follow" if off <= LEAVE_PATH_MM else "approach"
            return replace(state, mode=mode, phase=phase, nearest=nearest)
        if mode == "inspect":
            if not 0 <= target < len(self.scene.targets):
                raise ControlError(f"there is no target number {target + 1}; add a target to the plan")
            return replace(state, mode=mode, phase="inspect_approach", target=target)
        return replace(state, mode=mode, phase="free")

    def step(self, state: RehearsalState, command: Command) -> tuple[RehearsalState, Snapshot]:
        """One control period.

        Raises:
            InputError: the command's force is not an array of three numbers, or drive or twist is no number;
                non-finite ones count as none.
        """
        force = array_of(command.force, "the force")
        if force.shape != (3,):
            raise InputError(f"the force has the shape {force.shape}; it is three numbers in N, in the patient frame")
        if not np.isfinite(force).all():
            force = np.zeros(3)  # HAZ-05
        force = saturate(np.clip(force, -FORCE_LIMIT_N, FORCE_LIMIT_N), self.settings.force_cap_n)
        drive, twist = share_of(command.drive, "drive"), share_of(command.twist, "twist")
        command = replace(command, drive=drive, twist=twist)
        if command.master is None:
            state = replace(state, lag=np.zeros(3))
        else:
            state = replace(state, lag=led(state.lag, command.master, self.settings))
            force, command = spring(state.lag, self.settings), replace(command, drive=0)
        if state.mode == "path":
            return self._path_step(state, command, force)
        if state.mode == "inspect":
            return self._inspect_step(state, command, force)
        # Li 2007, V.F: the master moves the tip; on the grip a force turns the tool as well.
        lever = state.tool.tip.position
        torque = self._torque(state, command, force if command.master is None else np.zeros(3), lever)
        reach = self._reach(state, command)
        report = self.controller.step(state.tool, MoveFreely(), HandCommand(force, torque, reach))
        moved = report.state.tip.position - state.tool.tip.position
        return self._finish(replace(state, tool=report.state), report, command, force, torque, moved)

    def _reach(self, state: RehearsalState, command: Command) -> float:
        """How far the tool is to move at most, in mm: up to its master, if there is one."""
        return np.inf if command.master is None else float(np.linalg.norm(state.lag))

    def _path_step(self, state: RehearsalState, command: Command, force: Array) -> tuple[RehearsalState, Snapshot]:
        path, near = self.scene.path, state.nearest
        if path is None or near is None:
            raise ControlError("path following needs a path of at least two points")
        offset = near.position - state.tool.tip.position
        cap = self.settings.force_cap_n
        force = saturate(force + command.drive * cap * near.tangent, cap)
        reach = self._reach(state, command)
        limit = ON_PATH_MM if state.phase == "approach" else LEAVE_PATH_MM
        phase = "follow" if float(np.linalg.norm(offset)) <= limit else "approach"
        task: Task = ApproachPath(path, near) if phase == "approach" else FollowPath(path, near)
        report = self.controller.step(state.tool, task, HandCommand(force, reach=reach))
        moved = report.state.tip.position - state.tool.tip.position
        state = replace(state, tool=report.state, phase=phase)
        after = self._nearest(state)
        end = ""
        if phase == "follow":
            push = float(force @ near.tangent)
            if path.length - after.s <= END_MM:
                state = replace(state, phase="done")
                end = "the end of the path" if push > 0 else ""
            elif after.s <= END_MM and push < 0:
                end = "the entry of the path"
        return self._finish(replace(state, nearest=after), report, command, force, np.zeros(3), moved, end)

    def _nearest(self, state: RehearsalState) -> PathPoint:
        """The path's point closest to the tip, searched around the last one."""
        if self.scene.path is None or state.nearest is None:
            raise ControlError("path following needs a path of at least two points")
        return PathPoint(*self.scene.path.closest(state.tool.tip.position, state.nearest.s, SEARCH_WINDOW_MM))

    def _inspect_step(self, state: RehearsalState, command: Command, force: Array) -> tuple[RehearsalState, Snapshot]:
        target, tool = self.scene.targets[state.target], self.scene.tool
        centre = view_point(state.tool, tool, self.settings.view_distance_mm)
        off = float(np.linalg.norm(centre - target))
        tolerance = self.settings.target_tolerance_mm
        arrived = off <= (tolerance if state.phase == "inspect_hold" else ON_TARGET_SHARE * tolerance)
        phase = "inspect_hold" if arrived else "inspect_approach"
        torque, reach = np.zeros(3), self._reach(state, command)
        task: Task
        if phase == "inspect_hold":
            torque = self._torque(state, command, force, centre)
            lever = float(np.linalg.norm(self._grip(state.tool) - centre))
            task, hand = InspectTarget(target), HandCommand(force, torque, reach / lever)
        else:
            pull = force
            if command.drive > 0:
                cap = self.settings.force_cap_n
                pull = saturate(force + command.drive * cap * _unit(target - centre), cap)
            task, hand = ApproachTarget(target), HandCommand(pull, reach=reach)
        report = self.controller.step(state.tool, task, hand)
        if phase == "inspect_hold":  # the master holds the grip there, and the virtual point before
            moved = self._grip(report.state) - self._grip(state.tool)
        else:
            moved = view_point(report.state, tool, self.settings.view_distance_mm) - centre
        state = replace(state, tool=report.state, phase=phase)
        return self._finish(state, report, command, force, torque, moved)

    def _grip(self, tool: ToolState) -> Array:
        return self.scene.tool.grip(tool.tip.rotation, tool.tip.position)

    def _torque(self, state: RehearsalState, command: Command, force: Array, centre: Array) -> Array:
        """τ = (grip − centre) × f plus the twist about the shaft, in N·mm."""
        tip, tool = state.tool.tip, self.scene.tool
        lever = self._grip(state.tool) - centre
        twist = command.twist * self.settings.force_cap_n * tool.grip_from_bend * tip.rotation[:, 1]
        torque: Array = np.cross(lever, force) + twist
        return torque

    def _finish(
        self,
        state: RehearsalState,
        report: StepReport,
        command: Command,
        force: Array,
        torque: Array,
        moved: Array,
        end: str = "",
    ) -> tuple[RehearsalState, Snapshot]:
        """Count the step; ``moved`` (3,) is what the tool's led point did, which a master is ahead of no longer."""
        state = replace(state, steps=state.steps + 1, emergencies=state.emergencies + report.emergency)
        if command.master is not None:
            state = replace(state, lag=followed(state.lag, moved, state.phase in GUIDED))
        snapshot = self.snapshot(state, report, force, torque, end)
        if command.master is not None:
            snapshot = replace(snapshot, teleoperated=True, reflection=-spring(state.lag, self.settings))
        return state, snapshot

    def snapshot(
        self,
        state: RehearsalState,
        report: StepReport | None = None,
        force: Array | None = None,
        torque: Array | None = None,
        end: str = "",
    ) -> Snapshot:
        """What a viewer or recorder is told about a state; ``report`` is the step that led to it."""
        tool, scene, settings = state.tool, self.scene, self.settings
        tip = tool.tip.position
        centre = view_point(tool, scene.tool, settings.view_distance_mm)
        error = progress = length = 0.0
        if scene.path is not None and state.nearest is not None:
            # Off the path the tip may have gone anywhere: there no branch is preferred.
            near = state.nearest if state.mode == "path" else PathPoint(*scene.path.closest(tip))
            error, progress, length = float(np.linalg.norm(near.position - tip)), near.s, scene.path.length
        target_error = float("nan")
        if state.mode == "inspect":
            target_error = float(np.linalg.norm(centre - scene.targets[state.target]))
        held = report is not None and report.held
        acting = () if report is None else report.active_constraints()
        less = report is not None and (held or report.share * report.ramp_fraction < SLOWED_SHARE)
        why = acting if less else ()
        return Snapshot(
            t=state.steps * settings.dt_s,
            q=tool.q,
            segments_start=tool.segments.start,
            segments_end=tool.segments.end,
            radius=tool.segments.radius,
            tip=tip,
            grip=scene.tool.grip(tool.tip.rotation, tip),
            virtual_point=centre,
            force=np.zeros(3) if force is None else force,
            torque=np.zeros(3) if torque is None else torque,
            mode=state.mode,
            phase=state.phase,
            held=held,
            slowed=bool(why) and not held,
            reason=end or (why[0].text if why else ""),
            active=tuple(b.text for b in acting),
            blocking_point=next((b.point for b in why if b.point is not None), None),
            tip_error_mm=error,
            clearance_mm=tool.clearance,
            margin_mm=settings.margin_mm,
            threshold_mm=settings.reach_mm,
            progress_mm=progress,
            length_mm=length,
            target_error_mm=target_error,
            rows=0 if report is None else report.rows,
            steps=state.steps,
            emergencies=state.emergencies,
        )


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0 else vector
