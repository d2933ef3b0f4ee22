"""The scene of a rehearsal: anatomy, robot, tool, path and targets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array
from ...control.tasks.printed_path import PrintedWeights
from ...geometry.path import SplinePath
from ...geometry.shaft_directions import ShaftDirections
from ...proximity.proximity import Proximity
from ...robots import PlacedRobot, RobotModel, Tool
from ...virtual_fixtures import Fixture, Zone


@dataclass(frozen=True)
class Scene:
    """Everything that does not change during a rehearsal; patient frame, mm.

    base: transform_base_to_patient (4, 4); q_start: joints at the entry (n,).
    path: None for free motion only; targets: (m, 3).
    zones: no-fly zones; fixtures: virtual fixtures of every step, for any task (Li 2007, eq. 1-5).
    shaft: planned orientation of the shaft along the path, which the tool keeps as far as bone permits; None: none.
    printed: the tip follows the path by the program of the papers with these weights; None: by the usual one.
    structure_names: name of a structure by its id, for words; by default its id.
    bent_inspection: a robot that compensates its deflection holds the bent view point on a target; False: the unbent
        one, as in runs recorded without this value.
    """

    tree: Proximity
    robot: RobotModel
    tool: Tool
    base: Array
    q_start: Array
    path: SplinePath | None = None
    targets: Array = field(default_factory=lambda: np.zeros((0, 3)))
    target_names: tuple[str, ...] = ()
    zones: tuple[Zone, ...] = ()
    fixtures: tuple[Fixture, ...] = ()
    structure_names: Mapping[str, str] = field(default_factory=dict)
    shaft: ShaftDirections | None = None
    printed: PrintedWeights | None = None
    bent_inspection: bool = True

    def placed_robot(self) -> PlacedRobot:
        """The robot with its base in the patient frame and the tool's tip as its tip."""
        return self.robot.placed(self.base, self.tool)
