"""What the tool makes of a plan: where it is clear of bone, and how it would really pass along the path."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from app.cases.service import Case, CaseService
from app.cases.settings import settings_in_case
from app.kit.cache import Cache
from app.kit.errors import PlannerEnds
from app.kit.values import Position, check_position
from app.planning.distance_fields import Fields
from app.planning.drive import Drive
from app.planning.openings import Openings, PlanBone
from app.planning.piercing import pierced_along
from app.planning.placement import StoredPlacing, placed_robot
from app.planning.plan_evaluation import PlanEvaluation, samples_of
from app.planning.rehearsal_options import NO_SWITCHES, Switches, standing
from app.planning.remote_centre import path_of
from app.planning.shaft import shaft_of
from app.planning.verdict import Profile, profile_of, verdict_of
from app.planning.verdict_words import Stated
from app.planning.zone_sets import check_kept, near_zones, with_errors, zone_set
from app.plans.curve import CurveSample
from app.plans.instruments import Instruments, plan_tool, shaped_tool
from app.plans.model import DEFAULT_TOOL, Plan, drive_parts
from app.plans.zones import PlanZone, check_zone, zone_to_json
from app.registration.driven import AS_STORED, AsStored, DrivenRegistration, Through, no_registration
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.anatomy.soft_tissue import TissueKind, surroundings, tissue_passed
from vfix_engine.errors import InputError, PlanError, VfixError
from vfix_engine.progress import ProgressCallback, no_progress
from vfix_engine.proximity.fields.distance_field import DistanceField
from vfix_engine.proximity.fit import InsideTest, nearest_free_point
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.rigid import preparation
from vfix_engine.worlds.rigid.dry_run import DryRun
from vfix_engine.worlds.rigid.inspection_cone import InspectionCone, inspection_cone

_MOVED_MM = 0.01  # a shorter move is not worth a word


@dataclass(frozen=True)
class SnapResult:
    """Where a path point is put, how far that is from where it was wanted, and why it moved; '' where it did not.

    lies_in: what the CT shows at that place; only bone decides where it is.
    """

    position: Position
    moved_mm: float
    reason: str
    lies_in: TissueKind = "not_known"


class Planning:
    """Runs the engine for plans in the caller's thread; answers are kept per content of the plan and head."""

    def __init__(
        self,
        cases: CaseService,
        instruments: Instruments,
        fields: Fields | None = None,
        registered: Callable[[Plan], DrivenRegistration | None] = no_registration,
    ) -> None:
        self._cases, self._instruments, self._registered = cases, instruments, registered
        self._fields = fields or Fields(cases)
        self._evaluations: Cache[str, PlanEvaluation] = Cache(32)
        self._cones: Cache[str, Mapping[str, InspectionCone]] = Cache(32)
        self._openings = Openings(cases)
        self._zones: Cache[str, ZoneSet] = Cache(16)
        self._ended = threading.Event()

    def end(self) -> None:
        """End the runs that go on, and begin no other one: whoever waits for one gets PlannerEnds."""
        self._ended.set()

    def _go_on(self) -> None:
        if self._ended.is_set():
            raise PlannerEnds

    def snap(self, case: Case, point: Iterable[float], plan: Plan | None = None) -> SnapResult:
        """The nearest place clear of bone: outside of it, at least the shaft's radius and the margin away.

        plan: whose tool and margin count; the default ones where none is given.
        Without a CT the surface's normals tell the outside of bone. Soft tissue does not move a point; the result says
        what it lies in. The plan's hard structures to spare move a point as bone does, each by its own margin.
        Raises PlanError when there is no such place near.
        """
        wanted = check_position(point)
        preparation.wait(self._go_on)
        tool = shaped_tool(DEFAULT_TOOL) if plan is None else plan_tool(plan)
        settings = settings_in_case({} if plan is None else plan.settings, case.uncertainty)
        radius = float(tool.radius.max())
        clearance = radius + settings.kept_mm
        bone = self._openings.bone(case, plan)
        tree, volume, inside = bone.tree, bone.volume, bone.inside
        zones = () if plan is None else self.zones(plan).zones
        taken: InsideTest = (lambda at: inside(at) | near_zones(zones, at, radius)) if zones else inside
        found = nearest_free_point(tree, wanted, clearance, inside_bone=taken)
        place = check_position(found.tolist())
        moved = float(np.linalg.norm(np.subtract(place, wanted)))
        away = "bone and of what is to be spared" if zones else "bone"
        reason = f"moved {moved:.1f} mm, clear of {away}" if moved > _MOVED_MM else ""
        return SnapResult(place, moved, reason, surroundings(volume, place))

    def evaluate(
        self,
        plan: Plan,
        progress: ProgressCallback = no_progress,
        switches: Switches = NO_SWITCHES,
        through: Through = AS_STORED,
    ) -> PlanEvaluation:
        """Spline, bone clearance of the whole tool along it, the soft tissue that it passes, and the placing.

        progress: gets the stage in words and the fraction of the whole before each step of the run; what it raises
            ends the run.
        switches: of the rehearsal; what they stand for holds the tool in the run as in the drive.
        through: the registration where it was read already: of several answers that belong together each is of it.
        Raises PlanError for fewer than two points, and StartRefused when the tool does not fit at the entry.
        """
        registered = self._read(plan, through)  # once: the answer is kept under the one that was driven
        key = self._content_key(plan, switches, registered_key(registered))
        found = self._evaluations.get(key, lambda: self._evaluate(plan, progress, switches, registered))
        return found.beside(plan)

    def bone(self, plan: Plan) -> PlanBone:
        """The bone that a plan is driven in: the case's, without what the plan removes. Raises PlanError."""
        return self._openings.bone(self._cases.get(plan.case_id), plan)

    def zones(self, plan: Plan) -> ZoneSet:
        """The structures to spare of a plan, as the engine keeps them.

        Raises PlanError, which names the one that cannot be kept.
        """
        if not plan.zones:
            return ZoneSet()
        case = self._cases.get(plan.case_id)
        geometry = [(item.id, item.geometry) for item in case.structures]
        key = json.dumps([case.id, geometry, [zone_to_json(zone) for zone in plan.zones]])
        surface = partial(self._cases.structure_mesh, case.id)
        return self._zones.get(
            key, lambda: zone_set(with_errors(plan.zones, case.structure_errors()), surface, case.anatomy.id)
        )

    def check_zone(self, plan: Plan, zone: PlanZone) -> None:
        """Raises PlanError for a structure to spare that no drive could keep, as far as that is quickly known."""
        case = self._cases.get(plan.case_id)
        check_kept(check_zone(zone), partial(self._cases.structure_mesh, case.id), case.anatomy.id)

    def registration(self, plan: Plan) -> DrivenRegistration | None:
        """The registration that a plan goes by; None where image and patient are one frame.

        Raises PlanError where the plan refers to one that cannot be used.
        """
        return self._registered(plan)

    def registration_key(self, plan: Plan) -> str:
        """Equal for plans whose registrations are driven and judged alike; '' without one."""
        try:
            registered = self._registered(plan)
        except PlanError as error:
            return str(error)
        return registered_key(registered)

    def _read(self, plan: Plan, through: Through) -> DrivenRegistration | None:
        return self.registration(plan) if isinstance(through, AsStored) else through

    def content_key(self, plan: Plan, switches: Switches = NO_SWITCHES, through: Through = AS_STORED) -> str:
        """Equal for plans that are driven alike."""
        key = self.registration_key(plan) if isinstance(through, AsStored) else registered_key(through)
        return self._content_key(plan, switches, key)

    def _content_key(self, plan: Plan, switches: Switches, registered: str) -> str:
        case_hash = self._cases.get(plan.case_id).content_hash
        # A point that the remote centre is at is known by its id.
        on, ids = asdict(switches.in_force), [point.id for point in plan.points] if switches.centre.point else []
        return json.dumps([plan.case_id, case_hash, *drive_parts(plan), on, ids, registered])

    def is_evaluated(self, plan: Plan, switches: Switches = NO_SWITCHES, through: Through = AS_STORED) -> bool:
        """Whether the answer for a plan is there already."""
        return self._evaluations.has(self.content_key(plan, switches, through))

    def cones(
        self, plan: Plan, switches: Switches = NO_SWITCHES, through: Through = AS_STORED
    ) -> Mapping[str, InspectionCone]:
        """By the id of each target, the directions from which the tool of the path can inspect it.

        The flood begins in the pose of the dry run whose tip is nearest to the target. Raises as `evaluate`.
        """
        targets = [(target.id, target.position) for target in plan.targets]
        registered = self._read(plan, through)
        key = json.dumps([self.content_key(plan, switches, registered), targets])
        return self._cones.get(key, lambda: self._all_cones(plan, switches, registered))

    def _all_cones(
        self, plan: Plan, switches: Switches, registered: DrivenRegistration | None
    ) -> Mapping[str, InspectionCone]:
        evaluation, tool = self.evaluate(plan, switches=switches, through=registered), plan_tool(plan)
        case = self._cases.get(plan.case_id)
        tree, kept = self._openings.bone(case, plan).tree, settings_in_case(plan.settings, case.uncertainty).kept_mm
        placed = self._instruments.robot(plan.robot).placed(evaluation.base, tool)
        found = {}
        for target in plan.targets:
            row = int(np.linalg.norm(evaluation.run.tip - target.position, axis=1).argmin())
            rotation = placed.tip(evaluation.run.q[row]).rotation
            found[target.id] = inspection_cone(tree, tool, target.position, kept, rotation)
        return found

    def curve(self, plan: Plan) -> tuple[tuple[CurveSample, ...], str]:
        """Samples of a plan's path for an export, and a remark where there are no clearances."""
        if len(plan.points) < 2:
            return (), ""
        try:
            evaluation = self.evaluate(plan)
        except VfixError as error:
            return samples_of(path_of(plan)), f"No clearances: {error}"
        removed = f"{evaluation.removed_mm3:.0f} mm³ of bone are removed first." if evaluation.removed_mm3 else ""
        held = f"The tool gets {evaluation.reached_mm:.1f} of {evaluation.length_mm:.1f} mm: {evaluation.reason}."
        return evaluation.samples(), " ".join(filter(None, ["" if evaluation.completed else held, removed]))

    def placed_robot(self, plan: Plan) -> dict[str, Any]:
        """The plan's robot with the placing of its dry run, for `PlanEditor.set_robot`.

        Raises what `evaluate` does, and PlanError where a registration to the base says where the robot stands.
        """
        found = self.evaluate(plan)
        registered = None if found.registered is None else found.registered.image
        return placed_robot(plan.robot, found.base, found.q_start, registered)

    def preview(
        self,
        plan: Plan,
        placing: StoredPlacing,
        progress: ProgressCallback = no_progress,
        switches: Switches = NO_SWITCHES,
    ) -> PlanEvaluation:
        """As `evaluate`, of a plan that is not stored yet, in coarser steps and with the robot's base kept.

        placing: of the robot for the path as it was. It is not placed anew, and nothing is kept of the answer.
        Raises as `evaluate`, and StartRefused where the robot does not reach the entry from where it stands.
        """
        return self._evaluate(plan, progress, switches, self.registration(plan), placing).beside(plan)

    def _evaluate(
        self,
        plan: Plan,
        progress: ProgressCallback,
        switches: Switches,
        registered: DrivenRegistration | None,
        kept: StoredPlacing | None = None,
    ) -> PlanEvaluation:
        """kept: the placing of a preview, None where the answer is to stay."""

        def tell(stage: str, fraction: float) -> None:
            self._go_on()
            progress(stage, fraction)

        path = path_of(plan)
        preparation.wait(lambda: tell("Preparing the engine", 0.0))
        case = self._cases.get(plan.case_id)
        settings = settings_in_case(plan.settings, case.uncertainty)
        robot, tool = self._instruments.robot(plan.robot), plan_tool(plan)
        tell("Building the tree of the surface", 0.0)
        bone = self._openings.bone(case, plan)
        tree, names, volume = bone.tree, case.structure_names(), bone.volume

        def tissue() -> DistanceField | None:
            return self._fields.of_plan(plan, lambda stage, fraction: tell(stage, 0.0)).tissue

        stands, zones = standing(switches, plan, volume, tissue), self.zones(plan)
        drive = Drive(
            tree, robot, tool, path, zones.zones, (*zones.soft_zones, *stands.fixtures), names, shaft_of(plan, path)
        )
        placing = drive.run(plan.robot, settings, tell, None if registered is None else registered.image, kept)
        run = placing.run
        tell("Measuring the soft tissue", 0.95)
        profile, passed = self._profile(plan, run, zones, registered, tell), tissue_passed(volume, run.stations())
        stated, pierced = Stated(stands.words, bone.removed_mm3), pierced_along(self.ways(plan), run, tell)
        verdict = verdict_of(run, profile, tool, tree, case, settings.kept_mm, passed.complete, pierced, stated)
        return PlanEvaluation(
            path=path,
            run=run,
            base=placing.base,
            q_start=placing.q_start,
            soft_tissue=passed,
            standing=stands,
            profile=profile,
            verdict=verdict,
            tool_radius=tool.radius,
            zones=zones,
            removed_mm3=bone.removed_mm3,
            registered=registered,
        )

    def ways(self, plan: Plan, tell: ProgressCallback = no_progress) -> Ways | None:
        """What looks for ways round tissue in a plan's head; None without a CT, or where none shows the path."""
        case = self._cases.get(plan.case_id)
        try:
            tissue = self._fields.of_plan(plan, tell).tissue
        except InputError:
            return None
        return None if tissue is None else Ways(tissue, self._fields.air(case), plan.points[0].position)

    def _profile(
        self, plan: Plan, run: DryRun, zones: ZoneSet, registered: DrivenRegistration | None, tell: ProgressCallback
    ) -> Profile:
        """Bone clearance and soft tissue along a dry run; without tissue where no place of the plan is in the scan."""
        try:
            tissue = self._fields.of_plan(plan, lambda stage, fraction: tell(stage, 0.95)).tissue
        except InputError:
            tissue = None
        off_mm = None if registered is None else registered.off_mm
        return profile_of(run, plan_tool(plan), path_of(plan), tissue, zones, off_mm)


def registered_key(registered: DrivenRegistration | None) -> str:
    """Equal for registrations that are driven and judged alike; '' without one."""
    return "" if registered is None else repr(registered.key)
