"""Registrations of cases: their documents and edits, beads found in the CT, the order of points, files, and plans."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from app.cases.model import CaseBead as KnownBead
from app.cases.service import CaseService
from app.documents import Document
from app.documents.documents import Documents
from app.kit.cache import Cache
from app.kit.errors import NotFound
from app.kit.jobs import Job, Jobs, Progress
from app.kit.values import check_position, number
from app.plans.model import Plan
from app.plans.service import PlanService
from app.registration.calibrating import NO_TRACKER, Calibrating
from app.registration.calibration import tracked_through
from app.registration.document import RegistrationContent, StoredRegistration
from app.registration.edits import edit, found_pair, with_beads, with_place
from app.registration.fit_report import FitReport, report_of
from app.registration.found_beads import MAX_BEADS, BeadSearchRecord, FoundBead
from app.registration.point_order import OrderAnswer, order_of
from app.registration.refining import Refining
from app.registration.target_errors import ErrorTable, error_table
from vfix_engine.errors import InputError, PlanError
from vfix_engine.frames import ImageRegistration
from vfix_engine.progress import ProgressCallback, no_progress
from vfix_engine.registration import DetectedBead, find_beads
from vfix_engine.registration.beads import THRESHOLD_HU, check_search

if TYPE_CHECKING:
    from app.link import TrackerClient

MEASURE_S = 1.0  # that the tracked pointer is held on a point
LONGEST_S = 10.0
MOVED_MM = 2.0  # a pointer that rests on a point is nearer to the mean of its poses
_NO_CT = "this case was made of a surface; beads are found in a CT. Type the places in the image instead."
_KNOWN_MM = 1.0  # how near a bead of the case is to the one that was found

UseState = Literal[
    "none", "ready", "unfinished", "misfit", "inconsistent", "deleted", "missing", "other_case", "unreadable"
]


@dataclass(frozen=True)
class TrackerStanding:
    """Whether the tracked pointer is seen, 'fresh', or why not; words: the same in words."""

    state: Literal["connecting", "waiting", "fresh", "stale"]
    words: str


@dataclass(frozen=True)
class PlanRegistration:
    """The registration that a plan refers to.

    state: 'none' where it refers to none, 'ready' where it can be used, else why it cannot. words: the same in a
    sentence. document: where it can be read. doubts: of one that is ready, what to know before it is gone by.
    """

    state: UseState
    words: str
    id: str | None = None
    document: StoredRegistration | None = None
    doubts: tuple[str, ...] = ()

    @property
    def registration(self) -> ImageRegistration | None:
        """What `vfix_engine.frames` composes, where it is ready."""
        ready = self.state == "ready" and self.document is not None
        return self.document.content.registration if ready and self.document is not None else None


@dataclass(frozen=True)
class Measured(Document[RegistrationContent]):
    """A registration after a point was measured; spread_mm: rms distance of the poses from their mean."""

    spread_mm: float = 0.0


class Registering:
    """Registrations of every case; may be used from any thread."""

    def __init__(
        self,
        documents: Documents[RegistrationContent],
        cases: CaseService,
        plans: PlanService,
        jobs: Jobs,
        tracker: TrackerClient | None = None,
    ) -> None:
        self.documents = documents
        self._cases, self._plans, self._jobs = cases, plans, jobs
        self._tracker = tracker
        self.calibrating = Calibrating(documents, tracker)
        self.refining = Refining(documents, cases, jobs, tracker)
        self._reports: Cache[RegistrationContent, FitReport] = Cache(32)

    def report(self, content: RegistrationContent) -> FitReport:
        """How a registration stands."""
        return self._reports.get(content, lambda: report_of(content))

    def errors(self, content: RegistrationContent, plan: Plan | None) -> ErrorTable:
        """The errors to be expected at a plan's targets and along its chosen path."""
        return error_table(content, plan)

    def order(self, content: RegistrationContent) -> OrderAnswer:
        """In which order the measured points fit the places in the image. Raises InputError where there is none."""
        return order_of(content)

    # -- a tracked pointer

    @property
    def tracker_state(self) -> TrackerStanding | None:
        """How the tracked pointer stands; None where the planner listens to none."""
        tracker = self._tracker
        return None if tracker is None else TrackerStanding(tracker.state, tracker.words)

    def measure(
        self, registration_id: str, pair_id: str, seconds: float = MEASURE_S, *, expected_revision: int | None = None
    ) -> Measured:
        """Measure a pair with the tracked pointer over the next seconds.

        The place is that of the pointer's tip where that was calibrated, taken to the robot's base by the robot's
        calibration where the registration is to that.
        Raises NotFound, and InputError where the planner listens to no tracker, the pointer is not tracked or moved, or
        a calibration is missing or simulated.
        """
        if self._tracker is None:
            raise InputError(NO_TRACKER)
        content = self.documents.get(registration_id).content
        found_pair(content, pair_id)
        tip, matrix = tracked_through(content)
        held = self._tracker.collect(min(max(number(seconds, "the time"), 0.1), LONGEST_S), tip)
        if held.largest_mm > MOVED_MM:
            raise InputError(
                f"the pointer moved by {held.largest_mm:.1f} mm while it was measured; hold it still, and touch again."
            )
        x, y, z = (matrix[:3, :3] @ held.position + matrix[:3, 3]).tolist()

        def measured(before: RegistrationContent) -> RegistrationContent:
            if (before.to, before.pointer, before.robot) != (content.to, content.pointer, content.robot):
                raise InputError("the calibration was changed while the point was measured; touch it again.")
            return with_place(before, pair_id, (x, y, z), "tracker")

        document = edit(self.documents, registration_id, measured, expected_revision=expected_revision)
        return Measured(**vars(document), spread_mm=held.spread_mm)

    # -- beads

    def start_beads(
        self, registration_id: str, diameter_mm: float | None = None, threshold_hu: float = THRESHOLD_HU
    ) -> Job:
        """Look for beads in the widest CT of the registration's case as a job, whose result is the registration's id.

        diameter_mm: None finds beads of every size. What is found stands in the registration, as one edit.
        Raises NotFound, and InputError for a case without a CT, a deleted or locked registration, or figures that
        cannot be.
        """
        document = self.documents.get(registration_id)
        self._check(document)
        request = _beads_request(diameter_mm, threshold_hu)

        def work(progress: Progress) -> str:
            progress("Reading the scan", 0.0)
            found, search = self.look_for_beads(document.case_id, *request, progress=progress)
            progress("Keeping what was found", 0.95)
            return self.keep_beads(registration_id, found, search).id

        lane, same = f"beads {document.case_id}", f"beads {registration_id} {request}"
        return self._jobs.submit(
            work,
            kind="beads",
            lane=lane,
            case_id=document.case_id,
            subject=document.name,
            document_id=document.id,
            same=same,
        )

    def look_for_beads(
        self,
        case_id: str,
        diameter_mm: float | None = None,
        threshold_hu: float = THRESHOLD_HU,
        progress: ProgressCallback = no_progress,
    ) -> tuple[tuple[FoundBead, ...], BeadSearchRecord]:
        """The beads in the widest CT of a case, and how they were looked for. Raises NotFound and InputError.

        progress: told of the search; what it raises ends it.
        """
        case = self._cases.get(case_id)
        volume = self._cases.volume(case)
        if volume is None:
            raise InputError(_NO_CT)
        found = find_beads(volume, diameter_mm=diameter_mm, threshold_hu=threshold_hu, progress=progress)
        kept = found.beads[:MAX_BEADS]
        beads = tuple(_found(f"bead-{count}", bead, case.beads) for count, bead in enumerate(kept, 1))
        cautions = tuple(_sentence(text) for text in found.cautions)
        if len(found.beads) > MAX_BEADS:
            cautions = (*cautions, f"{len(found.beads)} were found; the first {MAX_BEADS} are listed.")
        return beads, BeadSearchRecord(diameter_mm, threshold_hu, cautions, len(found.left_out))

    def keep_beads(
        self, registration_id: str, beads: Sequence[FoundBead], search: BeadSearchRecord
    ) -> StoredRegistration:
        """Keep what a search found, as one edit."""
        return edit(self.documents, registration_id, lambda content: with_beads(content, beads, search))

    def _check(self, document: Document[RegistrationContent]) -> None:
        if not self._cases.get(document.case_id).has_volume:
            raise InputError(_NO_CT)
        self.documents.kind.check_editable(document)

    # -- plans

    def check_usable(self, plan: Plan, registration_id: str) -> None:
        """Raise NotFound, and PlanError for a registration of another case, a deleted one or an unfinished one."""
        self.documents.get(registration_id)
        used = self.registration_of(replace(plan, content=replace(plan.content, registration=registration_id)))
        if used.state != "ready":
            name = "" if used.document is None else used.document.name
            raise PlanError(_REFUSED[used.state].replace("{name}", name))

    def registration_of(self, plan: Plan) -> PlanRegistration:
        """The registration that a plan refers to, or why it cannot be used."""
        if plan.content.registration is None:
            return PlanRegistration("none", "No registration: the patient lies as in the image.")
        words: Mapping[UseState, str] = _UNUSABLE
        try:
            document = self.documents.get(plan.content.registration)
        except NotFound:
            return PlanRegistration("missing", words["missing"], plan.content.registration)
        except InputError as error:
            return PlanRegistration(
                "unreadable", f"{words['unreadable']} {_sentence(str(error))}", plan.content.registration
            )
        state: UseState = "ready"
        report = self.report(document.content)
        if document.case_id != plan.case_id:
            state = "other_case"
        elif document.deleted_at is not None:
            state = "deleted"
        elif report.state == "misfit" or report.state == "inconsistent":
            state = report.state
        elif not report.usable:
            state = "unfinished"
        told = words.get(state, "The plan uses the registration ‘{name}’.").replace("{name}", document.name)
        if state in ("misfit", "inconsistent"):
            told = f"{told} {report.words}"
        return PlanRegistration(
            state, told, plan.content.registration, document, report.doubts if state == "ready" else ()
        )


def _beads_request(diameter_mm: float | None, threshold_hu: float) -> tuple[float | None, float]:
    diameter = None if diameter_mm is None else number(diameter_mm, "a bead's diameter")
    threshold = number(threshold_hu, "the threshold")
    check_search(diameter, threshold)
    return diameter, threshold


def _found(bead_id: str, bead: DetectedBead, known: Sequence[KnownBead]) -> FoundBead:
    """A bead as the registration keeps it, with its name where the case knows one there."""
    place = check_position(bead.position_mm.tolist())
    names = [one.name for one in known if math.dist(one.position, place) <= _KNOWN_MM]
    return FoundBead(
        bead_id, place, float(bead.diameter_mm), float(bead.peak_hu), int(bead.voxels), name=names[0] if names else ""
    )


def _sentence(text: str) -> str:
    """A message of the engine, which has no capital and no full stop."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


_UNUSABLE: dict[UseState, str] = {
    "missing": "The plan's registration is missing. Choose another, or none. It was removed for "
    "good, or the plan came in a file, which does not hold it.",
    "unreadable": "The plan's registration cannot be read.",
    "other_case": "Registration ‘{name}’ is of another head. Choose another, or none.",
    "deleted": "Registration ‘{name}’ was deleted. Restore it, or choose another one.",
    "unfinished": "Registration ‘{name}’ has no transform yet: its points are not fitted.",
    "misfit": "Registration ‘{name}’ does not fit. Nothing is driven by it.",
    "inconsistent": "Registration ‘{name}’ contradicts itself. Nothing is driven by it.",
}
_REFUSED: dict[UseState, str] = {
    "other_case": "the registration ‘{name}’ belongs to another head; a plan uses one of its own.",
    "deleted": "the registration ‘{name}’ is deleted; restore it first.",
    "unfinished": "the registration ‘{name}’ has no transform yet; measure its points first.",
    "misfit": "the points of the registration ‘{name}’ do not fit; match their order or measure them again first.",
    "inconsistent": "the registration ‘{name}’ contradicts itself; fit its points anew first.",
    "unreadable": "the registration cannot be read.",
}
