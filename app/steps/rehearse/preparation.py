"""From a plan to a scene that a control process can run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from app.services import Services
from app.services.instruments import plan_tool
from app.services.plans import Plan
from app.services.recordings import Recording
from app.steps.rehearse.options import NO_OPTIONS, Options, fixtures_of
from app.views.plan_items import curve_points, plan_items
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.simulation.realtime import SceneSpec

if TYPE_CHECKING:
    from app.scene.plan import PlanItem


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene that is ready to be handed to a control process.

    items: points and targets of the plan it was made of; curve: places (n, 3) along its path, LPS [mm].
    recording: what keeps the drive's run; None where nothing is kept.
    options: the switches that its standing fixtures come from.
    """

    spec: SceneSpec
    settings: ControlSettings
    items: tuple[PlanItem, ...] = ()
    curve: npt.NDArray[np.float64] | None = None
    recording: Recording | None = None
    options: Options = NO_OPTIONS

    def target_index(self, target_id: str) -> int:
        """Place of a target in the scene's list. Raises PlanError where the scene does not have it."""
        ids = [item.id for item in self.items if item.kind == "target"]
        if target_id not in ids:
            raise PlanError("that target is not part of this rehearsal; ‘Reset to entry’ takes the plan as it is now.")
        return ids.index(target_id)


def plan_key(plan: Plan) -> Any:
    """What a rehearsal depends on: another key, another placing."""
    return (
        plan.id,
        plan.case_hash,
        plan.tool,
        repr(plan.tool_shape),
        repr(plan.settings),
        repr(plan.robot),
        tuple(tuple(point.position) for point in plan.points),
        tuple((target.id, tuple(target.position)) for target in plan.targets),
    )


def prepare(services: Services, plan: Plan, options: Options = NO_OPTIONS) -> Prepared:
    """Scene and settings of a plan; a plan without a robot placing gets one.

    options: the placing is that of the plan's dry run, whatever they are.

    Raises VfixError with the reason when the tool does not fit at the entry.
    """
    settings = ControlSettings.from_dict(dict(plan.settings))
    placing = services.planning.evaluate(plan)  # the very poses whose clearance colours the path
    targets = np.array([target.position for target in plan.targets], dtype=np.float64).reshape(-1, 3)
    points = np.array([point.position for point in plan.points], dtype=np.float64)
    mesh = services.cases.case_surface(plan.case_id)
    spec = SceneSpec(
        vertices=np.asarray(mesh.vertices),
        faces=np.asarray(mesh.faces),
        robot=services.instruments.robot(plan.robot),
        tool=plan_tool(plan),
        base=placing.base,
        q_start=placing.q_start,
        path_points=points,
        targets=targets,
        target_names=tuple(target.label for target in plan.targets),
        fixtures=fixtures_of(options, services, plan),
        structure_names=services.cases.get(plan.case_id).structure_names(),
    )
    curve = curve_points(SplinePath(points))
    return Prepared(spec, settings, tuple(plan_items(plan)), curve, services.recordings.new(plan), options)
