"""Evaluation of plans: snapping points clear of bone, and dry runs of the tool along the path."""

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
from app.imaging.openings import OpeningsOfHead
from app.kit.cache import Cache
from app.kit.errors import NotFound, PlannerEnds
from app.kit.values import Position, check_position
from app.planning.bone_removal import BoneRemoval, PlanBone
from app.planning.distance_fields import DistanceFields
from app.planning.drive import Drive
from app.planning.midplane import midplane_of
from app.planning.piercing import pierced_along
from app.planning.placement import StoredPlacement, placed_robot
from app.planning.plan_evaluation import PlanEvaluation, samples_of
from app.planning.protected_structures import check_enforceable, engine_zones, with_surface_errors, within_margin
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions, standing
from app.planning.remote_centre import path_of
from app.planning.shaft import shaft_of
from app.planning.verdict import Profile, profile_of, verdict_of
from app.planning.verdict_words import Stated
from app.plans.curve import CurveSample
from app.plans.instruments import Instruments, plan_tool, shaped_tool
from app.plans.model import DEFAULT_TOOL, Plan, drive_parts
from app.plans.paths import Midplane
from app.plans.zones import PlanZone, check_zone
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

_MOVED_MM = 0.01  # a shorter move is not reported


@dataclass(frozen=True)
class SnapResult:
    """A snapped path point.

    position: where it is put, LPS mm. moved_mm: distance from the requested position. reason: why it moved, '' if it
    did not. lies_in: what the CT shows at that place; only bone decides the position.
    """

    position: Position
    moved_mm: float
    reason: str
    lies_in: TissueKind = "not_known"


class Planning:
    """Runs the engine for plans in the caller's thread; results are cached by the content of plan and head."""

    def __init__(
        self,
        cases: CaseService,
        instruments: Instruments,
        distance_fields: DistanceFields | None = None,
        registered: Callable[[Plan], DrivenRegistration | None] = no_registration,
        openings: Callable[[Case], OpeningsOfHead | None] = lambda case: None,
    ) -> None:
        """registered: the registration that a plan refers to. openings: those of a head, once they are known."""
        self._cases, self._instruments, self._registered, self._openings = cases, instruments, registered, openings
        self._distance_fields = distance_fields or DistanceFields(cases)
        self._evaluations: Cache[str, PlanEvaluation] = Cache(32)
        self._cones: Cache[str, Mapping[str, InspectionCone]] = Cache(32)
        self._bone_removal = BoneRemoval(cases)
        self._zones: Cache[str, ZoneSet] = Cache(16)
        self._ended = threading.Event()

    def end(self) -> None:
        """Cancel the current runs and refuse new ones: each raises PlannerEnds."""
        self._ended.set()

    def _go_on(self) -> None:
        if self._ended.is_set():
            raise PlannerEnds

    def snap(self, case: Case, point: Iterable[float], plan: Plan | None = None) -> SnapResult:
        """Return the nearest place outside bone, at least the shaft's radius plus the safety margin away from it.

        plan: its tool and margin apply; the default ones if None.
        Without a CT the surface normals decide which side is outside. Soft tissue does not move a point; the result
        states what it lies in. The plan's hard protected structures move a point as bone does, each by its own margin.
        Raises PlanError if there is no such place nearby.
        """
        wanted = check_position(point)
        preparation.wait(self._go_on)
        tool = shaped_tool(DEFAULT_TOOL) if plan is None else plan_tool(plan.content)
        settings = settings_in_case({} if plan is None else plan.content.settings, case.uncertainty)
        radius = float(tool.radius.max())
        clearance = radius + settings.kept_mm
        bone = self._bone_removal.bone(case, plan)
        tree, volume, inside = bone.tree, bone.volume, bone.inside
        zones = () if plan is None else self.zones(plan).zones
        taken: InsideTest = (lambda at: inside(at) | within_margin(zones, at, radius)) if zones else inside
        found = nearest_free_point(tree, wanted, clearance, inside_bone=taken)
        place = check_position(found.tolist())
        moved = float(np.linalg.norm(np.subtract(place, wanted)))
        away = "bone and protected structures" if zones else "bone"
        reason = f"moved {moved:.1f} mm, clear of {away}" if moved > _MOVED_MM else ""
        return SnapResult(place, moved, reason, surroundings(volume, place))

    def evaluate(
        self,
        plan: Plan,
        progress: ProgressCallback = no_progress,
        options: RehearsalOptions = NO_OPTIONS,
        through: Through = AS_STORED,
    ) -> PlanEvaluation:
        """Evaluate a plan by a dry run: spline, bone clearance of the whole tool, soft tissue passed, and placement.

        progress: called with the stage in words and the fraction done before each step of the run; an exception that
            it raises ends the run.
        options: of the rehearsal; their fixtures act in the dry run as in the drive.
        through: the registration if it was read before, so that several results are based on the same one.
        Raises PlanError for fewer than two points, and StartRefused if the tool does not fit at the entry.
        """
        registered = self._read(plan, through)  # read once: the result is cached under the registration it used
        key = self._content_key(plan, options, registered_key(registered))
        found = self._evaluations.get(key, lambda: self._evaluate(plan, progress, options, registered))
        return found.with_remarks(plan, self.midplane(plan))

    def midplane(self, plan: Plan) -> Midplane:
        """Between the left and the right half of a plan's head, as far as that is known by now."""
        case = self._cases.shown(plan.case_id)
        return midplane_of(case, self._openings(case))

    def bone(self, plan: Plan) -> PlanBone:
        """Return the bone of the plan's case after the plan's bone removal. Raises PlanError if none is left."""
        return self._bone_removal.bone(self._cases.get(plan.case_id), plan)

    def zones(self, plan: Plan) -> ZoneSet:
        """Return the protected structures of a plan as zones of the engine.

        Raises PlanError, which names the structure that cannot be protected.
        """
        if not plan.content.zones:
            return ZoneSet()
        case = self._cases.get(plan.case_id)
        geometry = [(item.id, item.geometry) for item in case.structures]
        key = json.dumps([case.id, geometry, [vars(zone) for zone in plan.content.zones]])
        surface = partial(self._cases.structure_mesh, case.id)
        return self._zones.get(
            key,
            lambda: engine_zones(
                with_surface_errors(plan.content.zones, case.structure_errors()), surface, case.anatomy.id
            ),
        )

    def check_zone(self, plan: Plan, zone: PlanZone) -> None:
        """Raise PlanError if no drive could protect a structure, as far as a quick check finds out."""
        case = self._cases.get(plan.case_id)
        if isinstance(structure := zone.shape.get("structure"), str):
            try:
                case.structure(structure)
            except NotFound as error:
                raise PlanError(str(error)) from error
        check_enforceable(check_zone(zone), partial(self._cases.structure_mesh, case.id), case.anatomy.id)

    def registration(self, plan: Plan) -> DrivenRegistration | None:
        """Return the registration that a plan refers to; None if image and patient share a frame.

        Raises PlanError if that registration cannot be used.
        """
        return None if plan.content.registration is None else self._registered(plan)

    def registration_key(self, plan: Plan) -> str:
        """Return a key that is equal for plans whose registrations give the same evaluation; '' without one."""
        try:
            return registered_key(self.registration(plan))
        except PlanError as error:
            return str(error)

    def _read(self, plan: Plan, through: Through) -> DrivenRegistration | None:
        return self.registration(plan) if isinstance(through, AsStored) else through

    def content_key(self, plan: Plan, options: RehearsalOptions = NO_OPTIONS, through: Through = AS_STORED) -> str:
        """Return a key that is equal for plans with the same dry run."""
        key = self.registration_key(plan) if isinstance(through, AsStored) else registered_key(through)
        return self._content_key(plan, options, key)

    def _content_key(self, plan: Plan, options: RehearsalOptions, registered: str) -> str:
        case_hash = self._cases.get(plan.case_id).content_hash
        # The remote centre refers to a path point by id, so the ids matter only then.
        on, ids = asdict(options.in_force), [point.id for point in plan.content.points] if options.centre.point else []
        return json.dumps([plan.case_id, case_hash, *drive_parts(plan.content), on, ids, registered])

    def is_evaluated(self, plan: Plan, options: RehearsalOptions = NO_OPTIONS, through: Through = AS_STORED) -> bool:
        """Whether the evaluation of a plan is cached."""
        return self._evaluations.has(self.content_key(plan, options, through))

    def cones(
        self, plan: Plan, options: RehearsalOptions = NO_OPTIONS, through: Through = AS_STORED
    ) -> Mapping[str, InspectionCone]:
        """Return, by the id of each target, the directions from which the tool can inspect it.

        The search starts from the pose of the dry run whose tip is nearest to the target. Raises as `evaluate`.
        """
        targets = [(target.id, target.position) for target in plan.content.targets]
        registered = self._read(plan, through)
        key = json.dumps([self.content_key(plan, options, registered), targets])
        return self._cones.get(key, lambda: self._all_cones(plan, options, registered))

    def _all_cones(
        self, plan: Plan, options: RehearsalOptions, registered: DrivenRegistration | None
    ) -> Mapping[str, InspectionCone]:
        evaluation, tool = self.evaluate(plan, options=options, through=registered), plan_tool(plan.content)
        case = self._cases.get(plan.case_id)
        tree, kept = (
            self._bone_removal.bone(case, plan).tree,
            settings_in_case(plan.content.settings, case.uncertainty).kept_mm,
        )
        placed = self._instruments.robot(plan.content.robot).placed(evaluation.base, tool)
        found = {}
        for target in plan.content.targets:
            row = int(np.linalg.norm(evaluation.run.tip - target.position, axis=1).argmin())
            rotation = placed.tip(evaluation.run.q[row]).rotation
            found[target.id] = inspection_cone(tree, tool, target.position, kept, rotation)
        return found

    def curve(self, plan: Plan) -> tuple[tuple[CurveSample, ...], str]:
        """Return samples of a plan's path for an export, and a remark on missing clearances or an incomplete run."""
        if len(plan.content.points) < 2:
            return (), ""
        try:
            evaluation = self.evaluate(plan)
        except VfixError as error:
            return samples_of(path_of(plan)), f"No clearances: {error}"
        removed = f"{evaluation.removed_mm3:.0f} mm³ of bone are removed first." if evaluation.removed_mm3 else ""
        held = f"The tool gets {evaluation.reached_mm:.1f} of {evaluation.length_mm:.1f} mm: {evaluation.reason}."
        return evaluation.samples(), " ".join(filter(None, ["" if evaluation.completed else held, removed]))

    def placed_robot(self, plan: Plan) -> dict[str, Any]:
        """Return the plan's robot with the placement of its dry run, to be kept with the plan.

        Raises as `evaluate`, and PlanError if a registration to the base already defines where the robot stands.
        """
        found = self.evaluate(plan)
        registered = None if found.registered is None else found.registered.image
        return placed_robot(plan.content.robot, found.base, found.q_start, registered)

    def preview(
        self,
        plan: Plan,
        placement: StoredPlacement,
        progress: ProgressCallback = no_progress,
        options: RehearsalOptions = NO_OPTIONS,
    ) -> PlanEvaluation:
        """Evaluate a plan that is not stored yet, in coarser steps and with the robot's base unchanged.

        placement: of the robot for the stored path. The robot is not placed again, and the result is not cached.
        Raises as `evaluate`, and StartRefused if the robot does not reach the entry from where it stands.
        """
        found = self._evaluate(plan, progress, options, self.registration(plan), placement)
        return found.with_remarks(plan, self.midplane(plan))

    def _evaluate(
        self,
        plan: Plan,
        progress: ProgressCallback,
        options: RehearsalOptions,
        registered: DrivenRegistration | None,
        kept: StoredPlacement | None = None,
    ) -> PlanEvaluation:
        """Run the evaluation. kept: placement of the stored path for a preview, None for a full evaluation."""

        def report_progress(stage: str, fraction: float) -> None:
            self._go_on()
            progress(stage, fraction)

        path = path_of(plan)
        preparation.wait(lambda: report_progress("Preparing the engine", preparation.progress()))
        case = self._cases.get(plan.case_id)
        settings = settings_in_case(plan.content.settings, case.uncertainty)
        robot, tool = self._instruments.robot(plan.content.robot), plan_tool(plan.content)
        report_progress("Building the tree of the surface", 0.0)
        bone = self._bone_removal.bone(case, plan)
        tree, names, volume = bone.tree, case.structure_names(), bone.volume

        def tissue() -> DistanceField | None:
            return self._distance_fields.of_plan(plan, lambda stage, fraction: report_progress(stage, 0.0)).tissue

        stands, zones = standing(options, plan, volume, tissue), self.zones(plan)
        drive = Drive(
            tree, robot, tool, path, zones.zones, (*zones.soft_zones, *stands.fixtures), names, shaft_of(plan, path)
        )
        placement = drive.run(
            plan.content.robot, settings, report_progress, None if registered is None else registered.image, kept
        )
        run = placement.run
        report_progress("Measuring the soft tissue", 0.95)
        profile, passed = (
            self._profile(plan, run, zones, registered, report_progress),
            tissue_passed(volume, run.stations()),
        )
        stated, pierced = Stated(stands.words, bone.removed_mm3), pierced_along(self.ways(plan), run, report_progress)
        verdict = verdict_of(run, profile, tool, tree, case, settings.kept_mm, passed.complete, pierced, stated)
        return PlanEvaluation(
            path=path,
            run=run,
            base=placement.base,
            q_start=placement.q_start,
            soft_tissue=passed,
            standing=stands,
            profile=profile,
            verdict=verdict,
            tool_radius=tool.radius,
            zones=zones,
            removed_mm3=bone.removed_mm3,
            registered=registered,
        )

    def ways(self, plan: Plan, progress: ProgressCallback = no_progress) -> Ways | None:
        """Return the search for airways around tissue in a plan's head; None if no CT shows the path."""
        case = self._cases.get(plan.case_id)
        try:
            tissue = self._distance_fields.of_plan(plan, progress).tissue
        except InputError:
            return None
        return (
            None if tissue is None else Ways(tissue, self._distance_fields.air(case), plan.content.points[0].position)
        )

    def _profile(
        self, plan: Plan, run: DryRun, zones: ZoneSet, registered: DrivenRegistration | None, progress: ProgressCallback
    ) -> Profile:
        """Return clearances and soft tissue along a dry run; no tissue if the scan shows no place of the plan."""
        try:
            tissue = self._distance_fields.of_plan(plan, lambda stage, fraction: progress(stage, 0.95)).tissue
        except InputError:
            tissue = None
        off_mm = None if registered is None else registered.off_mm
        return profile_of(run, plan_tool(plan.content), path_of(plan), tissue, zones, off_mm)


def registered_key(registered: DrivenRegistration | None) -> str:
    """Return a key that is equal for registrations with the same evaluation; '' without one."""
    return "" if registered is None else repr(registered.key)
