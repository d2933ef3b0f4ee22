"""A tool in a free hand as a system: one pure step from state and command to state, outside the certificate.

Nothing guides the tool and nothing stops it but bone, which it penetrates. Paths and targets are measured only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...control.tasks import PathPoint
from ...errors import ControlError, StartRefused
from ...runtime.command import Command
from ...runtime.control_mode import FREEHAND
from ...runtime.requests import Request, SetControl, SetSettings, SetTask
from ...runtime.settings import checked_settings
from ...runtime.system import Background, Column, Grip
from ..rigid.command_values import array_of, share_of
from ..rigid.scene import Scene
from ..rigid.snapshot import camera_at, view_axes
from ..rigid.system import LEAVE_PATH_MM, MODES, NO_PATH, SEARCH_WINDOW_MM, hand_force
from .contact import ContactModel
from .motion import CORE_SHARE, ToolPose, moved, pose_of
from .row import row_layout, write_row
from .snapshot import FreehandSnapshot, snapshot_of
from .state import ZEROS, FreehandState

STIFFNESS_N_PER_MM = 10.0  # assumed: mucosa on bone, and what tool and hand yield
END_MM = 0.5  # remaining arc length that counts as arrived: assumed, a free hand does not end exactly
ON_TARGET_MM = 1.0  # the view has come onto the target: assumed


class FreehandSystem:
    """A tool in a free hand in one scene, as ``runtime.System``; the scene's robot gives the pose at the entry alone.

    stiffness_n_per_mm: with which bone answers a penetration.
    """

    def __init__(self, scene: Scene, settings: ControlSettings, stiffness_n_per_mm: float = STIFFNESS_N_PER_MM):
        self.scene, self.first_settings = scene, settings
        self.around = ContactModel(scene.tree, scene.zones, stiffness_n_per_mm)
        self._view = view_axes(scene.tool)
        self.row_layout: tuple[Column, ...] = row_layout(len(scene.tool.radius), len(self.around.structures))

    def prepare(self) -> None:
        """Load every kernel by a few steps, whose results are discarded."""
        state, row = self.start(), np.zeros(len(self.row_layout))
        for force in (ZEROS, np.ones(3)):
            state = self.step(state, Command(force, axes=(0.1, 0.1, 0.0)))
        self.row(state, row)
        self.snapshot(state)

    def start(self, mode: str = "") -> FreehandState:
        """The state at the entry; without a mode on the path, or free where there is none.

        Raises:
            StartRefused: bone is at the tool's axis there. ControlError: no such path or target.
        """
        scene, settings = self.scene, self.first_settings
        tip = scene.placed_robot().tip(scene.q_start)
        pose = pose_of(scene.tool, tip.position, tip.rotation)
        if self.around.push(pose.segments).deepest > CORE_SHARE:
            raise StartRefused("the tool would start inside bone; move the entry")
        distance = self.around.distances(pose.segments, settings.reach_mm)
        inside = distance < 0.0
        nearest = None if scene.path is None else PathPoint(*scene.path.closest(tip.position))
        state = FreehandState(
            *pose, distance, inside.astype(np.intp), np.where(inside, -distance, 0.0), "free", "free", nearest, settings
        )
        return self._with_mode(state, mode or ("free" if scene.path is None else "path"))

    def apply(self, state: FreehandState, request: Request) -> FreehandState:
        """Another task ('path', 'inspect', 'free') or other settings at the same pose.

        Raises:
            ControlError: there is no such task, path or target, or the system has no such request.
            InputError: settings of another world, or out of their ranges.
        """
        if isinstance(request, SetTask):
            return self._with_mode(state, request.task, request.target)
        if isinstance(request, SetSettings):
            settings = checked_settings(request.settings, ControlSettings, "a free tool")
            clock = state.clock.changed(state.steps, state.settings.dt_s, settings.dt_s)
            return replace(state, settings=settings, clock=clock)
        if isinstance(request, SetControl) and request.control.mode == FREEHAND:
            return state
        raise ControlError(f"a free tool cannot be asked to {type(request).__name__}")

    def _with_mode(self, state: FreehandState, mode: str, target: int = 0) -> FreehandState:
        if mode not in MODES:
            raise ControlError(f"mode '{mode}' is not one of {', '.join(MODES)}")
        if mode == "path":
            if self.scene.path is None:
                raise ControlError(NO_PATH)
            nearest = PathPoint(*self.scene.path.closest(state.position))
            off = float(np.linalg.norm(nearest.position - state.position))
            return replace(state, mode=mode, phase="follow" if off <= LEAVE_PATH_MM else "approach", nearest=nearest)
        if mode == "inspect":
            if not 0 <= target < len(self.scene.targets):
                raise ControlError(f"there is no target number {target + 1}; add a target to the plan")
            return replace(state, mode=mode, phase="inspect_approach", target=target)
        return replace(state, mode=mode, phase="free")

    def settings(self, state: FreehandState) -> ControlSettings:
        return state.settings

    def period_s(self, state: FreehandState) -> float:
        return state.settings.dt_s

    def steps(self, state: FreehandState) -> int:
        return state.steps

    def at_rest(self, state: FreehandState, running: bool) -> bool:
        """The tool has no inertia: it rests once the hand lets go and bone no longer pushes it."""
        return state.outcome == "idle"

    def grip(self, state: FreehandState) -> Grip:
        """The grip on the tool's shaft."""
        grip = self.scene.tool.grip(state.rotation, state.position)
        settings = state.settings
        return Grip(
            grip, settings.stiffness_n_per_mm, settings.force_cap_n, state.rotation @ self._view, grip - state.position
        )

    def camera(self, state: FreehandState) -> None:
        """None: an endoscope is moved as any tool is."""

    def row(self, state: FreehandState, out: Array) -> None:
        write_row(state, out)

    def snapshot(self, state: FreehandState) -> FreehandSnapshot:
        return snapshot_of(self.scene, self.around.structures, state)

    def background(self, state: FreehandState) -> Background | None:
        """Nothing takes longer than a step."""
        return None

    def adopt(self, state: FreehandState, result: object, age_s: float) -> FreehandState:
        return state

    def step(self, state: FreehandState, command: Command) -> FreehandState:
        """One control period: the force moves the tool, ``axes`` turn its view to the right and down, ``twist`` turns
        it about its shaft, and ``drive`` pushes it along the shaft. A master drives robots only and counts as none.

        Raises:
            InputError: a force, drive, twist or axis that is not a number; non-finite ones count as 0.
        """
        settings, tool = state.settings, self.scene.tool
        force, torque = self._hand(state, command)
        before, clearance = ToolPose(state.position, state.rotation, state.segments), float(state.distance[0].min())
        pose, push, held = moved(tool, self.around, before, clearance, force, torque, settings)
        distance = self.around.distances(pose.segments, settings.reach_mm)
        inside = distance < 0.0
        still = np.array_equal(pose.position, state.position) and np.array_equal(pose.rotation, state.rotation)
        nearest, phase = self._measured(state, pose)
        return FreehandState(
            *pose,
            distance,
            state.count + (inside & ~(state.distance < 0.0)),
            np.maximum(state.deepest, np.where(inside, -distance, 0.0)),
            state.mode,
            phase,
            nearest,
            settings,
            state.target,
            state.steps + 1,
            "held" if held else "idle" if still and not (force.any() or torque.any()) else "moved",
            force,
            torque,
            push.force.sum(axis=0),
            state.clock,
        )

    def _hand(self, state: FreehandState, command: Command) -> tuple[Array, Array]:
        """Force in N of the hand, at most the force cap, and its torque in N·mm about the tip.

        About each axis the torque is at most that of the force cap at the grip.
        """
        settings, tool, rotation = state.settings, self.scene.tool, state.rotation
        axes = array_of(command.axes, "the axes")
        right, down, inwards = (share_of(value, "axis") for value in axes.tolist())
        along = share_of(command.drive, "drive") + inwards
        cap = settings.force_cap_n
        force = np.array(hand_force(command.force, cap)) + along * cap * rotation[:, 1]
        size = float(np.linalg.norm(force))
        force = force * min(cap / size, 1.0) if size > 0.0 else force
        camera = camera_at(rotation, state.position, tool)
        turn = right * camera[:3, 1] - down * camera[:3, 0] + share_of(command.twist, "twist") * rotation[:, 1]
        return force, cap * tool.grip_from_bend * turn

    def _measured(self, state: FreehandState, pose: ToolPose) -> tuple[PathPoint | None, str]:
        """The nearest point of the path, and the phase, in a new pose."""
        path, near = self.scene.path, state.nearest
        if state.mode == "path" and path is not None and near is not None:
            if state.phase == "approach":
                near = PathPoint(*path.closest(pose.position))
            else:
                near = PathPoint(*path.closest(pose.position, near.s, SEARCH_WINDOW_MM))
            off = float(np.linalg.norm(near.position - pose.position))
            if state.phase == "approach" and off > LEAVE_PATH_MM:
                return near, "approach"
            return near, "done" if path.length - near.s <= END_MM else "follow"
        if state.phase == "inspect_approach":
            view = pose.position + state.settings.view_distance_mm * self.scene.tool.direction(pose.rotation)
            arrived = float(np.linalg.norm(view - self.scene.targets[state.target])) <= ON_TARGET_MM
            return near, "inspect_hold" if arrived else "inspect_approach"
        return near, state.phase
