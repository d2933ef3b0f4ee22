"""The evaluation of a plan's path by a dry run, shared by page, REST, command line and exports."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from app.planning.rehearsal_options import Standing
from app.planning.verdict import Profile, Verdict
from app.plans.curve import CurveSample
from app.plans.model import Plan
from app.plans.paths import Midplane
from app.registration.driven import DrivenRegistration
from vfix_engine.anatomy.soft_tissue import TissuePassed
from vfix_engine.arrays import Array
from vfix_engine.frames import placement_of
from vfix_engine.geometry.path import SplinePath
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.rigid.dry_run import DryRun

SPACING_MM = 0.5  # between samples of the spline


@dataclass(frozen=True, eq=False)
class PlanEvaluation:
    """A plan as the controller would drive it; lengths in mm, positions in LPS.

    run: the dry run along the path. soft_tissue: the soft tissue that the tool passes.
    base (4, 4) transform_base_to_image and q_start (n,): the placing that was driven.
    standing: the fixtures of the rehearsal options. zones: the plan's protected structures.
    profile: clearance and soft tissue along the path. verdict: their assessment, with words.
    tool_radius (S,): radii of the tool's segments.
    removed_mm3: volume of the bone that the plan removes first; the run is among the bone that is left.
    registered: the registration that was used, None if image and patient share a frame.
    """

    path: SplinePath
    run: DryRun
    base: Array
    q_start: Array
    soft_tissue: TissuePassed
    standing: Standing
    profile: Profile
    verdict: Verdict
    tool_radius: Array
    zones: ZoneSet
    removed_mm3: float = 0.0
    registered: DrivenRegistration | None = None

    @property
    def completed(self) -> bool:
        """Whether the end of the path was reached."""
        return self.run.completed

    @property
    def reason(self) -> str:
        """What stopped the tool if the end was not reached."""
        return self.run.reason

    @property
    def reached_mm(self) -> float:
        """Arc length that the tip reached."""
        return self.run.reached_mm

    @property
    def length_mm(self) -> float:
        """Length of the path."""
        return self.path.length

    @property
    def degree(self) -> int:
        """Degree of the spline."""
        return self.path.degree

    @cached_property
    def s(self) -> Array:
        """Arc lengths (n,) of the samples of the spline."""
        return stations(self.path)

    @cached_property
    def positions(self) -> Array:
        """Positions (n, 3) of the samples."""
        return self.path.position(self.s)

    @cached_property
    def clearance(self) -> Array:
        """Bone clearance (n,) of the whole tool with its tip at each sample; NaN at samples that it did not reach.

        The least value of a neighbourhood, not an interpolation, so that a narrow place between two samples shows.
        """
        s, run = self.s, self.run
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

    @property
    def min_clearance_mm(self) -> float:
        """Least bone clearance of the whole tool."""
        return float(self.run.clearance.min())

    @property
    def placement(self) -> Array | None:
        """transform_base_to_patient (4, 4), mm; None if the image is registered to the base only."""
        if self.registered is None:
            return self.base
        return None if self.registered.image.to == "base" else placement_of(self.base, self.registered.image)

    @property
    def tightest_mm(self) -> float:
        """Arc length of the tip in the pose of the least bone clearance."""
        return float(self.run.s[self.run.clearance.argmin()])

    def samples(self) -> tuple[CurveSample, ...]:
        """Return the samples for an export."""
        rows = zip(self.s.tolist(), self.positions.tolist(), self.clearance.tolist(), strict=True)
        return tuple(CurveSample(s, (p[0], p[1], p[2]), None if np.isnan(c) else c) for s, p, c in rows)

    def with_remarks(self, plan: Plan, midplane: Midplane) -> PlanEvaluation:
        """Return the evaluation with the plan's remarks in its verdict, on which the dry run does not depend."""
        verdict = self.verdict.with_remarks(plan, midplane)
        return self if verdict is self.verdict else replace(self, verdict=verdict)


def samples_of(path: SplinePath) -> tuple[CurveSample, ...]:
    """Return samples of a path that was not driven, without clearances."""
    s = stations(path)
    rows = zip(s.tolist(), path.position(s).tolist(), strict=True)
    return tuple(CurveSample(at, (p[0], p[1], p[2]), None) for at, p in rows)


def stations(path: SplinePath) -> Array:
    """Return arc lengths (n,) of samples of a path, at most ``SPACING_MM`` apart."""
    return np.linspace(0.0, path.length, max(2, int(np.ceil(path.length / SPACING_MM)) + 1))
