"""From a plan to a scene that a control process can run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from app.cases.settings import settings_in_case
from app.drives.recordings import Recording
from app.kit.values import Position
from app.planning.evaluation import registered_key
from app.planning.rehearsal_options import NO_SWITCHES, Switches
from app.planning.shaft import shaft_of
from app.plans.instruments import plan_tool
from app.plans.model import drive_parts
from app.plans.service import Plan
from app.services import Services
from app.store.errors import StorageError
from app.tabs.rehearse.driven import Planned
from app.tabs.rehearse.refusal import refuse_where_centre_stops, refuse_where_tissue_stops
from app.workspace.plan_items import curve_points, plan_items
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.worlds.rigid.realtime import SceneSpec

if TYPE_CHECKING:
    from app.scene.plan import PlanItem


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene that is ready to be handed to a control process.

    items: points and targets of the plan it was made of; curve: places (n, 3) along its path, LPS [mm].
    recording: what keeps the drive's run; None where nothing is kept.
    switches: what its standing fixtures come from. planned: what its dry run came to, None where it is not known.
    plan_key: of what it was made of, its registration as it was read for it; None where that was not read.
    unrecorded: why the drive's run cannot be kept; '' where it can.
    """

    spec: SceneSpec
    settings: ControlSettings
    items: tuple[PlanItem, ...] = ()
    curve: npt.NDArray[np.float64] | None = None
    recording: Recording | None = None
    switches: Switches = NO_SWITCHES
    planned: Planned | None = None
    plan_key: PlanKey | None = None
    unrecorded: str = ""

    def target_index(self, target_id: str) -> int:
        """Place of a target in the scene's list. Raises PlanError where the scene does not have it."""
        ids = [item.id for item in self.items if item.kind == "target"]
        if target_id not in ids:
            raise PlanError("that target is not part of this rehearsal; ‘Reset to entry’ takes the plan as it is now.")
        return ids.index(target_id)


class PlanKey(NamedTuple):
    """What a rehearsal depends on: another key, another placing. registered: key of the plan's registration."""

    plan_id: str
    case_hash: str
    parts: str
    targets: tuple[tuple[str, Position], ...]
    registered: str


def plan_key(plan: Plan, registered: str = "") -> PlanKey:
    """The key of a plan as it is now."""
    targets = tuple((target.id, target.position) for target in plan.targets)
    return PlanKey(plan.id, plan.case_hash, repr(drive_parts(plan)), targets, registered)


def prepare(services: Services, plan: Plan, switches: Switches = NO_SWITCHES) -> Prepared:
    """Scene and settings of a plan; placing and standing fixtures are those of its dry run with these switches.

    The dry run is a job, which can be cancelled, and the one that others wait for who ask for the same.

    Raises VfixError with the reason when the tool does not fit at the entry, or the remote centre or the soft
    tissue stops it on the way.
    """
    case = services.cases.get(plan.case_id)
    settings = settings_in_case(plan.settings, case.uncertainty)
    found = services.dry_runs.evaluate(plan, switches)  # the very poses whose clearance colours the path
    refuse_where_centre_stops(services, plan, switches, found)
    refuse_where_tissue_stops(services, plan, switches, found)
    targets = np.array([target.position for target in plan.targets], dtype=np.float64).reshape(-1, 3)
    points = np.array([point.position for point in plan.points], dtype=np.float64)
    mesh = services.planning.bone(plan).mesh
    spec = SceneSpec(
        vertices=np.asarray(mesh.vertices),
        faces=np.asarray(mesh.faces),
        robot=services.instruments.robot(plan.robot),
        tool=plan_tool(plan),
        base=found.base,
        q_start=found.q_start,
        path_points=points,
        targets=targets,
        target_names=tuple(target.label for target in plan.targets),
        zones=found.zones.zones,
        fixtures=(*found.zones.soft_zones, *found.standing.fixtures),
        structure_names=case.structure_names(),
        shaft=shaft_of(plan, SplinePath(points)),
    )
    curve = curve_points(SplinePath(points))
    tissue = None if found.profile.tissue is None else services.distance_fields.of_plan(plan).tissue
    items, unrecorded = tuple(plan_items(plan)), ""
    try:
        recording = services.recordings.new(plan)
    except StorageError as error:
        recording, unrecorded = None, str(error)
    key = plan_key(plan, registered_key(found.registered))
    planned = Planned.of(found, tissue, services.planning.ways(plan))
    return Prepared(spec, settings, items, curve, recording, switches, planned, key, unrecorded)
