"""Registrations refined on a structure of the case: points touched on it, the refinement as a job, and back."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from app.cases.service import CaseService
from app.documents.documents import Documents
from app.kit.jobs import Job, Jobs, Progress
from app.kit.values import Position, check_position
from app.registration.calibration import simulated_transform
from app.registration.document import RegistrationContent, StoredRegistration
from app.registration.fit_report import FEWEST, fitted, report_of
from app.registration.reachable_surface import reachable_places
from app.registration.simulated_touch import (
    DEFAULT_NOISE_MM,
    check_simulated,
    checked_noise,
    simulated_touches,
)
from app.registration.touched_surface import MAX_TOUCHED, Refinement, TouchedFrom, TouchedSurface
from app.registration.tracked_tip import recorded_tips
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError, VfixError
from vfix_engine.registration import refine_on_surface
from vfix_engine.validate import whole

if TYPE_CHECKING:
    from app.link import TrackerClient

KEEP = 0.75  # share of the touched points that a refinement fits
DEFAULT_COUNT = 60  # points that the simulated pointer touches
APART_MM = 1.0  # between places that the tracked pointer stroked over


class Refining:
    """Refinements of every registration; may be used from any thread."""

    def __init__(
        self,
        documents: Documents[RegistrationContent],
        cases: CaseService,
        jobs: Jobs,
        tracker: TrackerClient | None = None,
    ) -> None:
        self._documents, self._cases, self._jobs, self._tracker = documents, cases, jobs, tracker

    # -- touched points

    def set_touched(
        self,
        registration_id: str,
        points: Sequence[Position],
        measured_from: TouchedFrom,
        structure_id: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> StoredRegistration:
        """Points touched on a structure replace those that were touched before, as one edit.

        points: in the frame that the registration is to, mm. structure_id: by default that which the case is driven in.
        A transform that was refined before stays.
        Raises NotFound, and InputError for no points, too many, or a deleted or locked registration.
        """
        structure = self._structure(self._documents.get(registration_id), structure_id)
        if not 0 < len(points) <= MAX_TOUCHED:
            raise InputError(f"a surface is touched at 1 to {MAX_TOUCHED:,} points, not {len(points)}.")
        touched = TouchedSurface(structure, tuple(check_position(point) for point in points), measured_from)
        editor = self._documents.editor(registration_id)
        return editor.edit(lambda content: replace(content, surface=touched), expected_revision=expected_revision)

    def touch_tracked(
        self,
        registration_id: str,
        seconds: float,
        structure_id: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> StoredRegistration:
        """Take what the tip of the tracked pointer stroked over in the last seconds, one place for every millimetre.

        Raises as `set_touched`, and InputError where the planner listens to no tracker or the pointer was out of sight.
        """
        tips = recorded_tips(self._tracker, self._editable(registration_id).content, seconds)
        kept = [(x, y, z) for x, y, z in _thinned(tips).tolist()]
        return self.set_touched(registration_id, kept, "tracker", structure_id, expected_revision=expected_revision)

    def start_touch(
        self,
        registration_id: str,
        structure_id: str | None = None,
        count: int = DEFAULT_COUNT,
        noise_mm: float = DEFAULT_NOISE_MM,
        seed: int | None = None,
    ) -> Job:
        """Touch a structure with the simulated pointer, as a job; what is touched stands there as one edit.

        The places are such as a straight pointer reaches from outside, on the sides where points of the registration
        are. noise_mm: rms length of its error; seed: of places and errors, None for others each time.
        Raises NotFound, and InputError where the registration's points were measured otherwise.
        """
        document = self._editable(registration_id)
        structure = self._structure(document, structure_id)
        count = whole("the count of points", count, 1, MAX_TOUCHED)
        check_simulated(document.content)
        checked_noise(noise_mm)
        matrix = simulated_transform(document.content, document.case_id)

        def work(progress: Progress) -> str:
            progress("Touching the surface", 0.1)
            own = [None, None] if seed is None else [[seed, 0], [seed, 1]]  # of the places, and of the errors
            places = self._reached(document, structure, count, own[0])
            points = simulated_touches(document.case_id, places, noise_mm, own[1], tracker_to_base=matrix)
            progress("Keeping the points", 0.9)
            kept = [(x, y, z) for x, y, z in points.tolist()]
            return self.set_touched(
                registration_id, kept, "simulated", structure, expected_revision=document.revision
            ).id

        return self._job(work, document, f"touch {structure} {count} {noise_mm} {seed}")

    def _reached(self, document: StoredRegistration, structure: str, count: int, seed: Sequence[int] | None) -> Array:
        tree = self._cases.tree(self._cases.get(document.case_id), structure)
        near = [pair.in_image for pair in document.content.pairs if pair.in_image is not None]
        return reachable_places(tree, near, count, seed)

    # -- the refinement

    def start(self, registration_id: str, keep: float = KEEP) -> Job:
        """Refine a registration as a job, whose result is its id; see `refine`.

        Raises NotFound, and InputError where nothing was touched or there is no transform to begin with.
        """
        document = self._editable(registration_id)
        _touched(document.content)
        begin_of(document.content)

        def work(progress: Progress) -> str:
            progress("Preparing the surface", 0.05)
            self._cases.tree(self._cases.get(document.case_id), _touched(document.content).structure)
            progress("Fitting the touched points", 0.3)
            return self.refine(registration_id, keep, expected_revision=document.revision).id

        return self._job(work, document, f"refine {keep}")

    def refine(
        self, registration_id: str, keep: float = KEEP, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Move the touched points onto the surface, as one edit.

        From the fit of the registration's points where it has one, else from the transform that it has.
        keep: share of the touched points that are fitted, 0.5 to 1.
        Raises NotFound, and InputError where nothing was touched, there is no transform to begin with, or the points
        are too few, too far off, or slide along the surface.
        """
        document = self._editable(registration_id)
        content, surface = document.content, _touched(document.content)
        tree = self._cases.tree(self._cases.get(document.case_id), surface.structure)
        found = refine_on_surface(tree, surface.points, begin_of(content), keep=keep)
        done = Refinement(found.residual_mm, int(found.kept.sum()), found.moved_mm, found.stability)
        transform = tuple(float(value) for value in found.transform.ravel())
        kept = replace(surface, refinement=done)
        refined = replace(content, transform=transform, made_from="surface", surface=kept)
        seen = document.revision if expected_revision is None else expected_revision
        return self._documents.editor(registration_id).edit(lambda _: refined, expected_revision=seen)

    # --

    def _editable(self, registration_id: str) -> StoredRegistration:
        document = self._documents.get(registration_id)
        self._documents.kind.check_editable(document)
        return document

    def _structure(self, document: StoredRegistration, structure_id: str | None) -> str:
        case = self._cases.get(document.case_id)
        return case.anatomy.id if structure_id is None else case.structure(structure_id).id

    def _job(self, work: Callable[[Progress], str], document: StoredRegistration, what: str) -> Job:
        lane, same = f"refinement {document.case_id}", f"{document.id} {document.revision} {what}"
        return self._jobs.submit(
            work,
            kind="refinement",
            lane=lane,
            case_id=document.case_id,
            subject=document.name,
            document_id=document.id,
            same=same,
        )


def _thinned(places: Array) -> Array:
    """Those that are a millimetre at least from the one before: where the pointer rests it says the same again."""
    kept = [places[0]]
    for place in places:
        if np.linalg.norm(place - kept[-1]) >= APART_MM:
            kept.append(place)
    return np.array(kept)


def _touched(content: RegistrationContent) -> TouchedSurface:
    if content.surface is None:
        raise InputError("no points are touched on a surface yet; read a table of them, or touch some.")
    return content.surface


def begin_of(content: RegistrationContent) -> Array:
    """What a refinement starts from (4, 4). Raises InputError where there is nothing, or what does not fit."""
    if content.made_from == "pairs" and report_of(content).state == "misfit":
        raise InputError("these points do not fit; a refinement starts from a registration that is nearly right.")
    if content.made_from in ("pairs", "surface") and len(content.used_pairs) >= FEWEST:
        with contextlib.suppress(VfixError):  # of points that cannot be fitted the refined transform is left
            return np.asarray(fitted(content.used_pairs).transform)
    if content.made_from == "none":
        raise InputError("a refinement starts from a registration that is nearly right: fit three points first.")
    return content.registration.transform
