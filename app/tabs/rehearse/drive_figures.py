"""The figures of a drive so far, beside those of its dry run, in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from app.planning.piercing import short_way
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.verdict import NOSTRIL_MM
from app.tabs.rehearse.tool_snapshot import ToolSnapshot
from vfix_engine.anatomy.piercing import PiercingWatch, Ways
from vfix_engine.proximity.fields.distance_field import DistanceField
from vfix_engine.proximity.fields.tool_depth import tool_depth

FELT_N = 0.05  # a force on the grip that is mentioned


@dataclass(frozen=True, eq=False)
class DryRunFigures:
    """The dry run of the driven plan; lengths in mm.

    reached_mm, reason: how far it gets, and why it stops there, '' at the end. least_mm: bone clearance.
    depth_mm: greatest, in soft tissue; tissue: the distance field (LPS mm) that it is measured in. Both None where it
    is not known. sideways_mm: largest detour of air round tissue, ways: measures it; None where not known.
    verdict: in a few words; '' for a path that fits.
    """

    completed: bool
    reached_mm: float
    length_mm: float
    reason: str
    least_mm: float
    depth_mm: float | None = None
    tissue: DistanceField | None = None
    verdict: str = ""
    sideways_mm: float | None = None
    ways: Ways | None = None

    @classmethod
    def of(cls, found: PlanEvaluation, tissue: DistanceField | None, ways: Ways | None = None) -> Self:
        """tissue: None where the dry run has no soft tissue."""
        depth = None if tissue is None else found.verdict.tissue_depth_mm
        reason = "" if found.completed else found.reason
        least = found.min_clearance_mm
        verdict = "" if found.verdict.level == "fits" else found.verdict.short
        sideways = found.verdict.pierced.sideways_mm
        return cls(
            found.completed, found.reached_mm, found.length_mm, reason, least, depth, tissue, verdict, sideways, ways
        )

    @property
    def doubtful(self) -> bool:
        """Whether it does not reach the end, or does not fit."""
        return not self.completed or bool(self.verdict)


class DriveFigures:
    """The least clearance and the greatest depth of the snapshots that one client has read, and the last active
    constraint.

    Snapshots come several times a second; extremes between two of them are not included.
    """

    def __init__(self) -> None:
        self._planned: DryRunFigures | None = None
        self._clear()

    def _clear(self) -> None:
        self._steps = 0
        self._least: tuple[float, bool] | None = None  # mm, and whether it may be more than that
        self._depth_mm: float | None = None
        self._watch: PiercingWatch | None = None
        self.held_last = ""  # the constraint that stopped the last push, until the tool moves freely again

    def take(self, snapshot: ToolSnapshot | None, planned: DryRunFigures | None) -> None:
        """Read a snapshot of a drive; another robot, or one at its entry again, starts new figures."""
        if planned is not self._planned or snapshot is None or snapshot.steps < self._steps:
            self._planned = planned
            self._clear()
        if snapshot is None or snapshot.steps <= self._steps:
            return
        self._steps = snapshot.steps
        clearance = float(snapshot.clearance_mm)
        if self._least is None or clearance < self._least[0]:
            self._least = clearance, clearance >= snapshot.threshold_mm
        self._measure(snapshot)
        if snapshot.reason or snapshot.held:
            self.held_last = snapshot.reason
        elif float(np.linalg.norm(snapshot.force)) > FELT_N:
            self.held_last = ""

    def _measure(self, snapshot: ToolSnapshot) -> None:
        """Measure the depth of the tool in soft tissue."""
        if self._planned is None or self._planned.tissue is None:
            return
        start, end = snapshot.segments_start[None], snapshot.segments_end[None]
        found = tool_depth(self._planned.tissue, start, end, snapshot.radius, snapshot.tip, NOSTRIL_MM)
        self._depth_mm = max(self._depth_mm or 0.0, float(found.depth[0]))
        if self._watch is None and self._planned.ways is not None:
            self._watch = PiercingWatch(self._planned.ways)
        if self._watch is not None:
            self._watch.add(snapshot.steps, snapshot.segments_start, snapshot.segments_end)

    @property
    def words(self) -> str:
        """Figures of the drive beside those of the dry run; '' before it has begun."""
        if self._least is None:
            return ""
        planned, (least, capped) = self._planned, self._least
        bone = f"bone {'at least ' if capped else ''}{least:.2f} mm away"
        if least < 0.0:  # of a free hand
            bone = f"{-least:.2f} mm in bone"
        tissue = "" if self._depth_mm is None else f", {self._depth_mm:.1f} mm deep in soft tissue"
        driven = f"Nearest while driven: {bone}{tissue}{self._round_words}."
        if planned is None:
            return driven
        depth = "" if planned.depth_mm is None else f", {planned.depth_mm:.1f} mm deep"
        around = "" if planned.sideways_mm is None else f", {short_way(planned.sideways_mm)}"
        return f"{driven} Simulated: {planned.least_mm:.2f} mm{depth}{around}."

    @property
    def _round_words(self) -> str:
        """How far air leads round the tissue that the tool has passed, and whether that was pierced."""
        found = None if self._watch is None else self._watch.found
        if found is None or (found.pierced is None and not found.known):
            return ""
        way = short_way(0.0 if found.worst is None else found.worst.sideways_mm)
        return f", {way}{'' if found.pierced is None else ': tissue is pierced'}"
