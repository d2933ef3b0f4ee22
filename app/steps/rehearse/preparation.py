"""From a plan to a scene that a control process can run."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.services import Services
from app.steps.plan.edited_plan import curve_points, plan_items
from app.steps.rehearse.shared_drive import Prepared
from vfix_engine.control import ControlSettings
from vfix_engine.geometry.path import SplinePath
from vfix_engine.simulation.realtime import SceneSpec


def plan_key(plan: Any) -> Any:
    """What a rehearsal depends on: another key, another placing."""
    return (
        plan.id,
        plan.case_hash,
        plan.tool,
        repr(plan.settings),
        repr(plan.robot),
        tuple(tuple(point.position) for point in plan.points),
        tuple((target.id, tuple(target.position)) for target in plan.targets),
    )


def prepare(services: Services, plan: Any) -> Prepared:
    """Scene and settings of a plan; a plan without a robot placing gets one.

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
        robot=plan.robot["name"],
        tool=plan.tool,
        base=placing.base,
        q_start=placing.q_start,
        path_points=points,
        targets=targets,
        target_names=tuple(target.label for target in plan.targets),
    )
    return Prepared(spec, settings, tuple(plan_items(plan)), curve_points(SplinePath(points)))
