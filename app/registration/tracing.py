"""Paths that a pointer has traced at the patient, brought through a registration into a plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from app.cases.service import CaseService
from app.kit.values import Position, check_position
from app.plans.model import Plan
from app.plans.operations.paths import AddTracedPath
from app.plans.service import PlanService
from app.registration.calibration import simulated_transform
from app.registration.document import StoredRegistration
from app.registration.service import Registering
from app.registration.simulated_touch import DEFAULT_NOISE_MM, check_simulated, simulated_touches
from app.registration.tracked_tip import recorded_tips
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError, PlanError
from vfix_engine.frames import inverse
from vfix_engine.geometry.path import SplinePath
from vfix_engine.registration import TracedPath, traced_path

if TYPE_CHECKING:
    from app.link import TrackerClient
    from app.registration.service import PlanRegistration

TracedFrom = Literal["file", "simulated", "tracker"]
NAMED = "Traced path"  # what such a path is called, before its number

_SAMPLE_MM = 0.4  # between samples of the simulated pointer
_AT_REST = 15  # samples while it begins, and while it ends
_FARTHEST_MM = 100.0  # of a traced path from the head; one that is farther away was not traced there


@dataclass(frozen=True)
class Traced:
    """A traced path in a plan; lengths in mm.

    plan: after the edit, which has chosen the new path `path_id`. points: that the path has. residual_mm, largest_mm:
    rms and largest distance of the samples from it; the registration's error comes on top. used: places of the samples
    that were fitted. words: the same in sentences.
    """

    plan: Plan
    path_id: str
    name: str
    points: int
    length_mm: float
    residual_mm: float
    largest_mm: float
    samples: int
    used: int
    traced_from: TracedFrom
    registration: str
    words: str


class Tracing:
    """Traced paths of every plan; may be used from any thread."""

    def __init__(
        self, cases: CaseService, plans: PlanService, registering: Registering, tracker: TrackerClient | None = None
    ) -> None:
        self._cases, self._plans, self._registering, self._tracker = cases, plans, registering, tracker

    def registration(self, plan_id: str, registration_id: str | None = None) -> StoredRegistration:
        """The registration that a path of a plan is brought through: the one that is named, else the plan's.

        Raises NotFound, and PlanError where there is none or it has no transform.
        """
        plan = self._plans.get(plan_id)
        if registration_id is not None:
            self._registering.documents.get(registration_id)
            plan = replace(plan, content=replace(plan.content, registration=registration_id))
        used = self._registering.registration_of(plan)
        if used.state != "ready" or used.document is None:
            raise PlanError(_why_not(used, registration_id is not None))
        return used.document

    def add(
        self,
        plan_id: str,
        samples: Sequence[Position] | Array,
        traced_from: TracedFrom = "file",
        registration_id: str | None = None,
        name: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> Traced:
        """Add a path through the samples of a pointer's tip to a plan, and choose it, as one edit.

        samples: (n, 3) mm, in the order in which they were traced, from outside to inside; in the frame that the
        registration is to. registration_id: by default the plan's. name: by default 'Traced path 1' and so on.
        Raises NotFound, PlanError without a registration that can be used, and InputError for samples that are no path
        or lie far from the head.
        """
        document = self.registration(plan_id, registration_id)
        back = inverse(document.content.registration.transform)
        places = np.asarray(samples, dtype=np.float64).reshape(-1, 3) @ back[:3, :3].T + back[:3, 3]
        found = traced_path(places)
        self._check_near(document.case_id, found.points)
        way = [check_position(point) for point in found.points.tolist()]
        traced = AddTracedPath(places=way, name=name, named=NAMED)
        plan = self._plans.do(plan_id, traced, expected_revision=expected_revision)
        called = plan.content.path.name
        return Traced(
            plan, plan.content.path_id, called, len(found.points), found.length_mm, found.residual_mm, found.largest_mm,
            found.samples, found.used, traced_from, document.name, _words(called, found, document.name, traced_from),
        )  # fmt: skip

    def simulated(
        self,
        plan_id: str,
        noise_mm: float = DEFAULT_NOISE_MM,
        seed: int | None = None,
        registration_id: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> Traced:
        """Trace the chosen path with the simulated pointer, for practice.

        noise_mm: rms length of the error of a sample; seed: of the errors, None for others each time.
        Raises as `add`, and InputError for a path of fewer than two points or a registration of another head.
        """
        document = self.registration(plan_id, registration_id)
        check_simulated(document.content)
        places = [point.position for point in self._plans.get(plan_id).content.points]
        if len(places) < 2:
            raise InputError("the chosen path has fewer than two points; the simulated pointer has nothing to trace.")
        path = SplinePath(np.array(places))
        along = np.linspace(0.0, path.length, max(int(path.length / _SAMPLE_MM), 1) + 1)
        along = np.pad(along, _AT_REST, mode="edge")
        matrix = simulated_transform(document.content, document.case_id)
        samples = simulated_touches(document.case_id, path.position(along), noise_mm, seed, tracker_to_base=matrix)
        return self.add(plan_id, samples, "simulated", document.id, expected_revision=expected_revision)

    def tracked(
        self,
        plan_id: str,
        seconds: float,
        registration_id: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> Traced:
        """Take the way that the tip of the tracked pointer went in the last seconds.

        Raises as `add`, and InputError where the planner listens to no tracker or the pointer was out of sight.
        """
        document = self.registration(plan_id, registration_id)
        tips = recorded_tips(self._tracker, document.content, seconds)
        return self.add(plan_id, tips, "tracker", document.id, expected_revision=expected_revision)

    def _check_near(self, case_id: str, points: Array) -> None:
        case = self._cases.get(case_id)
        volume = self._cases.volume(case)
        low, high = self._cases.case_surface(case_id).bounds if volume is None else volume.bounds
        off = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1).max()
        if off > _FARTHEST_MM:
            raise InputError(
                f"the traced path would lie {off:.0f} mm away from the head; were its samples measured in the "
                "frame of this registration?"
            )


def _why_not(used: PlanRegistration, named: bool) -> str:
    if used.state == "none":
        return (
            "this plan uses no registration; name one, or let the plan use one. Without it "
            "nobody knows where the traced path lies in the image."
        )
    if used.state == "unfinished" and named and used.document is not None:
        return f"the registration ‘{used.document.name}’ has no transform yet; measure its points first."
    return used.words


def _words(name: str, found: TracedPath, registration: str, traced_from: TracedFrom) -> str:
    practice = " It was traced by a simulated pointer: nothing of it is of a real patient."
    return (
        f"‘{name}’ was added and is the chosen path now: {found.length_mm:.1f} mm long, {len(found.points)} points. "
        f"{found.samples:,} samples lie {found.residual_mm:.2f} mm rms from it and {found.largest_mm:.2f} mm at most; "
        f"{found.used} places of them were used. The error of the registration ‘{registration}’ comes on top."
        + (practice if traced_from == "simulated" else "")
    )
