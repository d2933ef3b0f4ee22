"""The engine in ten lines: a surface, a robot, a tool and a task, driven by a force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...control import ControlSettings
from ...control.qp import DUAL
from ...errors import ControlError, InputError
from ...geometry.checks import out_of_range
from ...geometry.mesh import TriangleMesh
from ...geometry.path import SplinePath
from ...proximity.proximity import Proximity, ProximityTree
from ...robots import RobotModel, Tool
from ...validate import several
from ...virtual_fixtures import Fixture, Zone
from .command_values import finite_array
from .placing import Placing, place_robot
from .rehearsal import Command, Rehearsal, RehearsalState
from .scene import Scene
from .snapshot import RigidSnapshot
from .teleoperation import Master


class Simulation:
    """A robot with a tool in one anatomy, stepped by the caller.

    It stores the state of a ``Rehearsal``: every ``step`` is one control period.

    Args:
        mesh: the anatomy in the patient frame LPS, mm; or its index (``ProximityTree``).
        path: control points (n, 3) in mm, or a path; None for free motion or a target only.
        targets: points (m, 3) in mm that can be inspected.
        robot, tool: a shipped name, a file, or the object itself.
        base: transform_base_to_patient (4, 4); without it the robot is placed so that it gets furthest along the path.
        q_start: joints (n,) at the start; the robot's home without it.
        settings: of the controller; ``changes`` are single ones by name, e.g. ``margin_mm=0.5``.
        zones, fixtures: further constraints and guidance of the tool.
        solver: of the quadratic program: 'dual', 'daqp', or any that qpsolvers finds installed, such as 'osqp'.

    Raises:
        InputError: an invalid argument; the message says which.
        StartRefused: the tool would start outside a joint's range or inside the margin.
    """

    def __init__(
        self,
        mesh: TriangleMesh | Proximity,
        *,
        path: SplinePath | ArrayLike | None = None,
        targets: ArrayLike | None = None,
        robot: RobotModel | str | Path = "steady_hand",
        tool: Tool | str | Path = "bent_30",
        base: ArrayLike | None = None,
        q_start: ArrayLike | None = None,
        settings: ControlSettings | None = None,
        zones: Sequence[Zone] = (),
        fixtures: Sequence[Fixture] = (),
        solver: str = DUAL,
        **changes: float,
    ):
        settings = ControlSettings.from_dict((settings or ControlSettings()).to_dict() | changes)
        tree = _indexed(mesh)
        zones, fixtures = several("zones", zones), several("fixtures", fixtures)
        robot = robot if isinstance(robot, RobotModel) else RobotModel.load(robot)
        tool = tool if isinstance(tool, Tool) else Tool.load(tool)
        path = path if path is None or isinstance(path, SplinePath) else SplinePath(path)
        self._placing: Placing | None = None
        if base is None:
            if path is None:
                raise InputError("the robot has no base placement: give a base (4, 4), or a path by which it is placed")
            self._placing = place_robot(tree, robot, tool, path, settings, zones, fixtures)
            base, q_start = self._placing.base, self._placing.q_start if q_start is None else q_start
        points = np.zeros((0, 3)) if targets is None else finite_array(targets, (-1, 3), "targets")
        if far := out_of_range(points):
            raise InputError(f"target {far[0] + 1} {far[1]}")
        scene = Scene(
            tree,
            robot,
            tool,
            finite_array(base, (4, 4), "the base"),
            robot.home if q_start is None else finite_array(q_start, robot.home.shape, "q_start"),
            path,
            points,
            tuple(f"target {i + 1}" for i in range(len(points))),
            zones,
            fixtures,
        )
        self.rehearsal = Rehearsal(scene, settings, solver)
        self._state = self.rehearsal.start("free" if path is None else "path")
        self._now = self.rehearsal.snapshot(self._state)

    @property
    def state(self) -> RehearsalState:
        """The state after the last step; it is immutable, so a stored one can be restored (``restore``)."""
        return self._state

    @property
    def placing(self) -> Placing | None:
        """The robot's placement for the path, and how far it gets along the path from there (``run``); None with a
        base.

        ``placing.run.reason`` says in words what stops it before the end, such as too few joints; '' at the end.
        """
        return self._placing

    @property
    def now(self) -> RigidSnapshot:
        """The snapshot after the last step: pose, clearance, active constraints, and others."""
        return self._now

    @property
    def q(self) -> Array:
        """Joints (n,) in mm and rad, in the order of ``RobotModel.joints``."""
        return self._state.tool.q

    @property
    def clearance_mm(self) -> float:
        """Smallest distance of the whole tool's surface to the anatomy, exact up to the boundary threshold."""
        return self._state.tool.clearance

    @property
    def active(self) -> tuple[str, ...]:
        """In words, the constraints that acted on the last step, strongest first."""
        return self._now.active

    def step(
        self,
        force: ArrayLike = (0.0, 0.0, 0.0),
        *,
        drive: int = 0,
        twist: int = 0,
        master: ArrayLike | None = None,
    ) -> RigidSnapshot:
        """One control period under the hand's force (3,) in N at the grip.

        Args:
            drive: −1, 0 or +1: full force along the path, or towards the target; twist: about the shaft.
            master: motion (3,) in mm of a remote master in this period; it replaces force and drive.

        Raises:
            ControlError: a drive or twist other than these three.
            InputError: a force or motion that is not three finite numbers.
        """
        for name, key in (("drive", drive), ("twist", twist)):
            if not isinstance(key, (int, float, np.number)) or key not in (-1, 0, 1):
                raise ControlError(f"the {name} must be -1, 0 or 1")
        motion = None if master is None else Master(finite_array(master, (3,), "the master's motion"))
        command = Command(finite_array(force, (3,), "the force"), drive, twist, motion)
        self._state, self._now = self.rehearsal.step(self._state, command)
        return self._now

    def task(self, mode: str, target: int = 0) -> None:
        """Change the mode: 'path', 'inspect' a target by its number, or 'free'.

        Raises:
            ControlError: there is no such mode, path or target.
        """
        self.restore(self.rehearsal.with_mode(self._state, mode, target))

    def move_anatomy(self, mesh: TriangleMesh | Proximity, zones: Sequence[Zone] | None = None) -> None:
        """Replace the anatomy by its moved surface; the tool keeps its pose.

        Args:
            mesh: the moved anatomy.
            zones: all moved no-fly zones; None: unchanged.
        """
        tree = _indexed(mesh)
        self.rehearsal = self.rehearsal.with_anatomy(tree, None if zones is None else tuple(zones))
        self.restore(self._state)

    def reset(self) -> None:
        """Back to the start, at rest.

        Raises:
            StartRefused: the moved anatomy is too near to it.
        """
        self.restore(self.rehearsal.start("free" if self.rehearsal.scene.path is None else "path"))

    def restore(self, state: RehearsalState) -> None:
        """Continue from a state of this simulation, with the present anatomy."""
        tool = self.rehearsal.controller.measure(state.tool.q, state.tool.velocity)
        self._state = replace(state, tool=tool)
        self._now = self.rehearsal.snapshot(self._state)


def _indexed(mesh: Any) -> Proximity:
    """The index of an anatomy. InputError for a mesh of another library, or a file name."""
    if isinstance(mesh, TriangleMesh):
        return ProximityTree(mesh)
    if not hasattr(mesh, "candidates"):
        raise InputError(
            f"the anatomy is a {type(mesh).__name__}; it must be a TriangleMesh, such as of read_mesh(file), or "
            "TriangleMesh(vertices, faces) with vertices in LPS mm"
        )
    tree: Proximity = mesh
    return tree
