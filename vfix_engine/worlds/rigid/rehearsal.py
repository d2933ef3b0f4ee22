"""The rigid tool for scripts: a mode by name, and a snapshot after every step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...control import Controller, ControlSettings, StepReport
from ...control.qp import DUAL
from ...control.tasks import PathPoint
from ...proximity.proximity import Proximity
from ...runtime.command import Command, Master
from ...virtual_fixtures import Zone
from .scene import Scene
from .snapshot import RigidSnapshot, lazy_snapshot, snapshot_of
from .state import LastStep, RehearsalState
from .system import MODES, ON_PATH_MM, RigidSystem

__all__ = ["MODES", "ON_PATH_MM", "Command", "Master", "PathPoint", "Rehearsal", "RehearsalState"]


class Rehearsal:
    """The rigid tool for scripts: ``RigidSystem`` with a mode by name and a snapshot after every step."""

    def __init__(self, scene: Scene, settings: ControlSettings, solver: str = DUAL):
        self.system, self.settings, self.solver = RigidSystem(scene, settings, solver), settings, solver

    @property
    def scene(self) -> Scene:
        return self.system.scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        self.system.scene = scene

    @property
    def controller(self) -> Controller:
        return self.system.controller

    @controller.setter
    def controller(self, controller: Controller) -> None:
        self.system.controller = controller

    def with_anatomy(self, tree: Proximity, zones: tuple[Zone, ...] | None = None) -> Rehearsal:
        """The same rehearsal with moved anatomy; states continue from the tool's pose (HAZ-04).

        Args:
            zones: the moved ones, where they move with the anatomy, such as patches of it; None: unchanged.
        """
        scene = replace(self.scene, tree=tree, zones=self.scene.zones if zones is None else zones)
        return Rehearsal(scene, self.settings, self.solver)

    def start(self, mode: str = "path") -> RehearsalState:
        """The state at the entry; see ``RigidSystem.start``."""
        return self.system.start(mode)

    def with_mode(self, state: RehearsalState, mode: str, target: int = 0) -> RehearsalState:
        """The same pose and speed in another mode; see ``RigidSystem.with_mode``."""
        return self.system.with_mode(state, mode, target)

    def step(self, state: RehearsalState, command: Command) -> tuple[RehearsalState, RigidSnapshot]:
        """One control period; the snapshot is made when one of its fields is read. See ``RigidSystem.step``."""
        if state.settings is not self.settings:  # of another rehearsal: the settings of this one apply
            state = replace(state, settings=self.settings)
        after = self.system.step(state, command)
        return after, lazy_snapshot(self.scene, after)

    def snapshot(
        self,
        state: RehearsalState,
        report: StepReport | None = None,
        force: Array | None = None,
        torque: Array | None = None,
        end: str = "",
    ) -> RigidSnapshot:
        """The snapshot of a state alone, or with the step that led to it (``report``)."""
        if report is None:
            return snapshot_of(self.scene, state, None)
        push, turn = (np.zeros(3) if one is None else one for one in (force, torque))
        return snapshot_of(self.scene, state, LastStep(report, push, turn, end, False))
