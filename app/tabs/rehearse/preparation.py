"""From a plan to a scene that a control process can run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from app.cases.service import Case
from app.cases.settings import settings_in_case
from app.drives.drive_record import HAND
from app.drives.prepared_drive import PreparedDrive
from app.drives.runs import Measure
from app.kit.jobs import Progress
from app.kit.values import Position
from app.planning.evaluation import registered_key
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.planning.run_sideways import measure_sideways
from app.planning.shaft import shaft_of
from app.plans.instruments import plan_tool
from app.plans.model import drive_parts, driven_hash
from app.plans.service import Plan
from app.services import Services
from app.tabs.rehearse.drive_figures import DryRunFigures
from app.tabs.rehearse.refusal import refuse_where_centre_stops, refuse_where_tissue_stops
from app.tabs.rehearse.tool_snapshot import ToolSnapshot
from app.workspace.plan_items import curve_points, plan_items
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import Proximity
from vfix_engine.robots import PlacedRobot
from vfix_engine.runtime.control_mode import FREEHAND, Control
from vfix_engine.virtual_fixtures import RemoteCentre, SoftRegion, SoftZone, Zone
from vfix_engine.worlds.freehand.spec import FreehandSpec, of_free_hand
from vfix_engine.worlds.rigid.presets import PRESETS
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

if TYPE_CHECKING:
    from app.scene.plan import PlanItem


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedRehearsal(PreparedDrive[ToolSnapshot]):
    """The rehearsal of a plan, ready to be handed to a control process.

    robot: placed; None in a free hand. items: points and targets of the plan from which it was made; curve: positions
    (n, 3) along its path, LPS [mm]. options: source of its standing fixtures. planned: figures of its dry run, None
    where it is not known. made_of: the plan's key, with its registration as read for it; None where that was not read.
    protected: the plan's protected structures, the hard ones first. tree: of the bone that is driven in;
    None where it is not measured.
    """

    spec: RigidSpec | FreehandSpec
    settings: ControlSettings
    robot: PlacedRobot | None
    items: tuple[PlanItem, ...] = ()
    curve: npt.NDArray[np.float64] | None = None
    options: RehearsalOptions = NO_OPTIONS
    planned: DryRunFigures | None = None
    made_of: PlanKey | None = None
    protected: tuple[Zone | SoftZone | SoftRegion, ...] = ()
    tree: Proximity | None = None

    def refusal(self, asked: ControlSettings, in_force: ControlSettings, snapshot: ToolSnapshot | None) -> str:
        """A margin that exceeds the tool's clearance at its pose."""
        if snapshot is None or not snapshot.certified:
            return ""
        if not snapshot.clearance_mm < asked.margin_mm > in_force.margin_mm:
            return ""
        return f"the tool is {snapshot.clearance_mm:.2f} mm from bone here. Draw it back first."

    @property
    def free(self) -> bool:
        """Whether the tool is in a free hand."""
        return isinstance(self.spec, FreehandSpec)

    @cached_property
    def path(self) -> SplinePath:
        """The driven path."""
        return SplinePath(np.asarray(self.spec.scene.path_points))

    @property
    def centre(self) -> RemoteCentre | None:
        """The remote centre that holds the tool, or None."""
        return next((one for one in self.spec.scene.fixtures if isinstance(one, RemoteCentre)), None)

    def point_places(self) -> list[tuple[PlanItem, float]]:
        """The points of the driven path with their arc lengths in mm."""
        path, points = self.path, [item for item in self.items if item.kind == "point"]
        return [(item, float(path.closest(np.array(item.position))[0])) for item in points]

    def path_mm(self, point_id: str | None) -> float:
        """Arc length of a path point in mm. Raises PlanError where the driven path does not have it."""
        for item, at in self.point_places():
            if item.id == point_id:
                return at
        raise PlanError("that path point is not part of this rehearsal; ‘Reset to entry’ takes the plan as it is now.")

    def target_index(self, target_id: str | None) -> int:
        """Place of a target in the scene's list; None: the first. Raises PlanError where the scene does not have it."""
        ids = [item.id for item in self.items if item.kind == "target"]
        if not ids:
            raise PlanError("there is no target to inspect; add one in Plan.")
        if target_id is None:
            return 0
        if target_id not in ids:
            raise PlanError("that target is not part of this rehearsal; ‘Reset to entry’ takes the plan as it is now.")
        return ids.index(target_id)


class PlanKey(NamedTuple):
    """The inputs of a rehearsal; another key needs another placement. registered: key of the plan's registration.

    freehand, preset: how it is driven, where that needs another process.
    """

    plan_id: str
    case_hash: str
    parts: str
    targets: tuple[tuple[str, Position], ...]
    registered: str
    freehand: bool = False
    preset: str | None = None


def plan_key(plan: Plan, registered: str = "", control: Control = HAND, preset: str | None = None) -> PlanKey:
    """The key of the present plan."""
    targets = tuple((target.id, target.position) for target in plan.content.targets)
    driven = control.mode == FREEHAND, preset
    return PlanKey(plan.id, plan.case_hash, repr(drive_parts(plan.content)), targets, registered, *driven)


def prepare(
    services: Services,
    plan: Plan,
    options: RehearsalOptions = NO_OPTIONS,
    control: Control = HAND,
    preset: str | None = None,
) -> PreparedRehearsal:
    """Scene and settings of a plan; placement and standing fixtures are those of its dry run with these options.

    The dry run is a job, which can be cancelled, and is shared by all requests for the same.
    In a free hand the tool stands as in the dry run, without a robot and with nothing that holds it.
    preset: a paper's name, see ``PRESETS``.

    Raises VfixError with the reason when the tool does not fit at the entry, or the remote centre or the soft
    tissue stops it on the way.
    """
    case = services.cases.get(plan.case_id)
    settings = settings_in_case(plan.content.settings, case.uncertainty)
    found = services.dry_runs.evaluate(plan, options)  # the same poses whose clearance colours the path
    refuse_where_centre_stops(services, plan, options, found)
    refuse_where_tissue_stops(services, plan, options, found)
    scene, freehand = _scene(services, plan, case, found), control.mode == FREEHAND
    if freehand:
        settings = of_free_hand(settings)
    elif preset is not None:  # the papers have no soft zones
        scene = replace(PRESETS[preset].in_spec(scene), fixtures=found.standing.fixtures)
        settings = PRESETS[preset].in_settings(settings)
    tissue = None if found.profile.tissue is None else services.distance_fields.of_plan(plan).tissue
    measure_by = partial(_sideways, services, plan)
    told = plan.case_id, plan.id, plan.name, measure_by, driven_hash(plan.content)
    recording, unrecorded = services.recordings.attempt(*told)
    return PreparedRehearsal(
        spec=FreehandSpec(scene, settings) if freehand else RigidSpec(scene, settings),
        settings=settings,
        recording=recording,
        unrecorded=unrecorded,
        made_of=plan_key(plan, registered_key(found.registered), control, preset),
        control=control,
        preset=None if freehand else preset,
        robot=None if freehand else scene.robot_model().placed(np.asarray(scene.base)),
        items=tuple(plan_items(plan)),
        curve=curve_points(SplinePath(np.asarray(scene.path_points))),
        options=options,
        protected=(*found.zones.zones, *found.zones.soft_zones),
        tree=services.planning.bone(plan).tree,
        planned=DryRunFigures.of(found, tissue, services.planning.ways(plan)),
    )


def _scene(services: Services, plan: Plan, case: Case, found: PlanEvaluation) -> SceneSpec:
    """The scene of a plan, placed as in its dry run."""
    targets = np.array([target.position for target in plan.content.targets], dtype=np.float64).reshape(-1, 3)
    points = np.array([point.position for point in plan.content.points], dtype=np.float64)
    mesh = services.planning.bone(plan).mesh
    return SceneSpec(
        vertices=np.asarray(mesh.vertices),
        faces=np.asarray(mesh.faces),
        robot=services.instruments.robot(plan.content.robot),
        tool=plan_tool(plan.content),
        base=found.base,
        q_start=found.q_start,
        path_points=points,
        targets=targets,
        target_names=tuple(target.label for target in plan.content.targets),
        zones=found.zones.zones,
        fixtures=(*found.zones.soft_zones, *found.standing.fixtures),
        structure_names=case.structure_names(),
        shaft=shaft_of(plan, SplinePath(points)),
    )


def _sideways(services: Services, plan: Plan, progress: Progress) -> Measure | None:
    """Measures, once the drive has ended, how far air leads round the tissue that the tool passes."""
    progress("Looking for ways round tissue", 0.1)
    return measure_sideways(services.planning.ways(plan))
