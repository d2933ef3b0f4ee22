"""The dry run of a path, from the stored, registered or previewed placing of the robot, or else the best one found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from app.planning.placement import StoredPlacing, standing_base, stored_placing
from vfix_engine.control import ControlSettings
from vfix_engine.frames import ImageRegistration
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shaft_directions import ShaftDirections
from vfix_engine.progress import ProgressCallback
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.virtual_fixtures import Fixture, Zone
from vfix_engine.worlds.rigid.dry_run import STEP_MM, dry_run
from vfix_engine.worlds.rigid.placing import Placing, place_robot, started_at
from vfix_engine.worlds.rigid.scene import Scene

PREVIEW_STEP_MM = 0.2  # step of the dry run while a point is dragged; the least clearance is within about 0.03 mm


@dataclass(frozen=True, eq=False)
class Drive:
    """Tool, robot and surroundings of a dry run in the image frame; the attributes are those of `Scene`."""

    tree: ProximityTree
    robot: RobotModel
    tool: Tool
    path: SplinePath
    zones: tuple[Zone, ...]
    fixtures: tuple[Fixture, ...]
    structure_names: Mapping[str, str]
    shaft: ShaftDirections | None

    def run(
        self,
        planned: Mapping[str, Any],
        settings: ControlSettings,
        progress: ProgressCallback,
        registration: ImageRegistration | None = None,
        kept: StoredPlacing | None = None,
    ) -> Placing:
        """Drive the tool along the path; return the dry run with the placing that it started from.

        planned: the plan's robot, which may hold a placing. registration: from the image to the patient or to the
        robot's base. kept: the placing of the stored path while a point is dragged; the base stays and the steps are
        coarser.
        Raises StartRefused if the tool does not fit at the entry or the robot does not reach it.
        """
        base = None if registration is None else standing_base(planned, registration)
        stored = stored_placing(planned) if registration is None else None
        if stored is not None:
            return self._from(stored, settings, STEP_MM if kept is None else PREVIEW_STEP_MM, progress)
        if kept is not None:
            q_start = started_at(self.robot.placed(kept.base, self.tool), kept.q_start, self.path, self.shaft)
            return self._from(StoredPlacing(kept.base, q_start), settings, PREVIEW_STEP_MM, progress)
        placing_stage = partial(_report, progress, "Placing the robot and driving the path")
        return place_robot(
            self.tree, self.robot, self.tool, self.path, settings, self.zones, self.fixtures,
            structure_names=self.structure_names, tell=placing_stage, shaft=self.shaft, base=base,
        )  # fmt: skip

    def _from(
        self, placing: StoredPlacing, settings: ControlSettings, step_mm: float, progress: ProgressCallback
    ) -> Placing:
        scene = Scene(
            self.tree, self.robot, self.tool, *placing, self.path, zones=self.zones, fixtures=self.fixtures,
            structure_names=self.structure_names, shaft=self.shaft,
        )  # fmt: skip
        return Placing(
            *placing, dry_run(scene, settings, tell=partial(_report, progress, "Driving the path"), step_mm=step_mm)
        )


def _report(progress: ProgressCallback, stage: str, fraction: float) -> None:
    progress(stage, 0.95 * fraction)
