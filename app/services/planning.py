"""What the tool makes of a plan: where it is clear of bone, and how it would really pass along the path."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.services.cache import Cache
from app.services.cases import CaseService
from app.services.errors import PlannerEnds
from app.services.exchange_parts import CurveSample
from app.services.instruments import Instruments, plan_tool
from app.services.placing import stored_placing
from app.services.plan_model import DEFAULT_TOOL, Plan, Position, check_position
from app.services.plans import PlanService
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.geometry.fit import Inside, nearest_place
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.proximity import ProximityTree
from vfix_engine.geometry.side import SurfaceSide
from vfix_engine.imaging.soft_tissue import Surroundings, TissuePassed, surroundings, tissue_passed
from vfix_engine.imaging.surface import BONE_HU
from vfix_engine.robots import Tool
from vfix_engine.simulation import preparation
from vfix_engine.simulation.dry_run import DryRun, dry_run
from vfix_engine.simulation.placing import place_robot
from vfix_engine.simulation.scene import Scene

Array = NDArray[np.float64]

Tell = Callable[[str, float], None]

SPACING_MM = 0.5  # between samples of the spline
_MOVED_MM = 0.01  # a shorter move is not worth a word


def _tell_nobody(stage: str, fraction: float) -> None:
    """Report nothing."""


@dataclass(frozen=True)
class SnapResult:
    """Where a path point is put, how far that is from where it was wanted, and why it moved; '' where it did not.

    lies_in: what the CT shows at that place; only bone decides where it is.
    """

    position: Position
    moved_mm: float
    reason: str
    lies_in: Surroundings = "not_known"


@dataclass(frozen=True, eq=False)
class PlanEvaluation:
    """A plan as the controller would drive it; lengths in mm, positions in LPS.

    s (n,), positions (n, 3): samples of the spline. clearance (n,): bone clearance of the whole tool when its tip is
    there, NaN where it did not get. soft_tissue: what the tool passes besides.
    base (4, 4) transform_base_to_patient and q_start: the placing that was driven.
    completed, reason: whether the end was reached, and what held the tool where it was not.
    """

    s: Array
    positions: Array
    clearance: Array
    completed: bool
    reason: str
    base: Array
    q_start: Array
    degree: int
    length_mm: float
    reached_mm: float
    run: DryRun
    soft_tissue: TissuePassed

    @property
    def min_clearance_mm(self) -> float:
        """Least bone clearance of the whole tool."""
        return float(self.run.clearance.min())

    @property
    def tightest_mm(self) -> float:
        """Where the tip is along the path in the pose of the least bone clearance."""
        return float(self.run.s[self.run.clearance.argmin()])

    def samples(self) -> tuple[CurveSample, ...]:
        """The samples for an export."""
        rows = zip(self.s.tolist(), self.positions.tolist(), self.clearance.tolist(), strict=True)
        return tuple(CurveSample(s, (p[0], p[1], p[2]), None if np.isnan(c) else c) for s, p, c in rows)


class Planning:
    """Runs the engine for plans in the caller's thread; answers are kept per content of the plan and head."""

    def __init__(self, cases: CaseService, plans: PlanService, instruments: Instruments) -> None:
        self._cases, self._plans, self._instruments = cases, plans, instruments
        self._evaluations: Cache[str, PlanEvaluation] = Cache(32)
        self._sides: Cache[str, SurfaceSide] = Cache(4)
        self._ended = threading.Event()

    def end(self) -> None:
        """End the runs that go on, and begin no other one: whoever waits for one gets PlannerEnds."""
        self._ended.set()

    def _go_on(self) -> None:
        if self._ended.is_set():
            raise PlannerEnds

    def snap(
        self, case_id: str, point: Sequence[float], *, tool: Tool | None = None, margin_mm: float | None = None
    ) -> SnapResult:
        """The nearest place clear of bone: outside of it, with room for the shaft and the margin all around.

        Without a CT the surface's normals tell the outside of bone. Soft tissue does not move a point; what it lies in
        is told. Raises PlanError when there is no such place near.
        """
        wanted = check_position(point)
        preparation.wait(self._go_on)
        margin = ControlSettings().margin_mm if margin_mm is None else margin_mm
        room = float((tool or Tool.load(DEFAULT_TOOL)).radius.max()) + margin
        tree = self._cases.tree(case_id)
        place = check_position(nearest_place(tree, wanted, room, inside_bone=self._inside_bone(case_id, tree)).tolist())
        moved = float(np.linalg.norm(np.subtract(place, wanted)))
        reason = f"moved {moved:.1f} mm, clear of bone" if moved > _MOVED_MM else ""
        return SnapResult(place, moved, reason, surroundings(self._cases.volume(case_id), place))

    def fit_point(self, plan_id: str, position: Sequence[float]) -> SnapResult:
        """`snap` with the tool and the margin of a plan."""
        plan = self._plans.get(plan_id)
        settings = ControlSettings.from_dict(dict(plan.settings))
        return self.snap(plan.case_id, position, tool=plan_tool(plan), margin_mm=settings.margin_mm)

    def evaluate(self, plan: Plan, progress: Tell = _tell_nobody) -> PlanEvaluation:
        """Spline, bone clearance of the whole tool along it, the soft tissue that it passes, and the placing.

        progress: gets the stage in words and the fraction of the whole before each step of the run; what it raises
            ends the run.
        Raises PlanError for fewer than two points, and StartRefused when the tool does not fit at the entry.
        """
        return self._evaluations.get(self.content_key(plan), lambda: self._evaluate(plan, progress))

    def content_key(self, plan: Plan) -> str:
        """Equal for plans that are driven alike."""
        case_hash = self._cases.get(plan.case_id).content_hash
        points = [point.position for point in plan.points]
        tool = [plan.tool, dict(plan.tool_shape)]
        return json.dumps([plan.case_id, case_hash, tool, dict(plan.robot), dict(plan.settings), points])

    def is_evaluated(self, plan: Plan) -> bool:
        """Whether the answer for a plan is there already."""
        return self._evaluations.has(self.content_key(plan))

    def curve(self, plan: Plan) -> tuple[tuple[CurveSample, ...], str]:
        """Samples of a plan's path for an export, and a remark where there are no clearances."""
        if len(plan.points) < 2:
            return (), ""
        try:
            evaluation = self.evaluate(plan)
        except VfixError as error:
            path = _path(plan)
            s = _stations(path)
            places = path.position(s).tolist()
            samples = zip(s.tolist(), places, strict=True)
            return tuple(CurveSample(at, (p[0], p[1], p[2]), None) for at, p in samples), f"No clearances: {error}"
        held = f"The tool gets {evaluation.reached_mm:.1f} of {evaluation.length_mm:.1f} mm: {evaluation.reason}."
        return evaluation.samples(), "" if evaluation.completed else held

    def _inside_bone(self, case_id: str, tree: ProximityTree) -> Inside:
        """What tells bone from air: the CT, or without one the side of the surface."""
        volume = self._cases.volume(case_id)
        if volume is not None:
            return lambda places: volume.sample(places) >= BONE_HU
        side = self._sides.get(tree.mesh.content_hash, lambda: SurfaceSide(tree))
        return lambda places: ~side.outside(places)

    def _evaluate(self, plan: Plan, progress: Tell) -> PlanEvaluation:
        def go_on(stage: str, fraction: float) -> Callable[[], None]:
            def act() -> None:
                self._go_on()
                progress(stage, fraction)

            return act

        path = _path(plan)
        preparation.wait(go_on("Preparing the engine", 0.0))
        settings = ControlSettings.from_dict(dict(plan.settings))
        robot, tool = self._instruments.robot(plan.robot), plan_tool(plan)
        go_on("Building the tree of the surface", 0.1)()
        tree, names = self._cases.tree(plan.case_id), self._cases.get(plan.case_id).structure_names()
        stored = stored_placing(plan.robot)
        if stored is None:
            act = go_on("Placing the robot and driving the path", 0.2)
            placing = place_robot(tree, robot, tool, path, settings, go_on=act, structure_names=names)
            base, q_start, run = placing.base, placing.q_start, placing.run
        else:
            base, q_start = stored
            scene = Scene(tree, robot, tool, base, q_start, path, structure_names=names)
            run = dry_run(scene, settings, go_on("Driving the path", 0.2))
        go_on("Measuring the soft tissue", 0.95)()
        s = _stations(path)
        return PlanEvaluation(
            s=s,
            positions=path.position(s),
            clearance=_clearance_at(s, run),
            completed=run.completed,
            reason=run.reason,
            base=base,
            q_start=q_start,
            degree=path.degree,
            length_mm=path.length,
            reached_mm=run.reached_mm,
            run=run,
            soft_tissue=tissue_passed(self._cases.volume(plan.case_id), run.stations()),
        )


def _path(plan: Plan) -> SplinePath:
    if len(plan.points) < 2:
        raise PlanError("a path needs at least two points.")
    return SplinePath(np.array([point.position for point in plan.points], dtype=np.float64))


def _stations(path: SplinePath) -> Array:
    return np.linspace(0.0, path.length, max(2, int(np.ceil(path.length / SPACING_MM)) + 1))


def _clearance_at(s: Array, run: DryRun) -> Array:
    """Least bone clearance (n,) of the driven poses around each sample; NaN beyond the end of the run.

    The least of a neighbourhood, not an interpolation: a narrow place between two samples must be seen.
    """
    half = 0.5 * (s[1] - s[0])
    clearance = np.full(len(s), np.nan)
    for index, at in enumerate(s):
        near = np.abs(run.s - at) <= half
        if near.any():
            clearance[index] = run.clearance[near].min()
    known = ~np.isnan(clearance)
    between = ~known & (s <= run.s.max())
    clearance[between] = np.interp(s[between], s[known], clearance[known])
    return clearance
