"""Edits of one registration: each an edit of its document, after which the pairs are fitted anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from app.documents import Document, DocumentEditor
from app.kit.errors import NotFound
from app.kit.names import as_seen, check_label
from app.kit.values import Position, check_position, new_id
from app.registration.calibration import simulated_transform
from app.registration.document import (
    MAX_PAIRS,
    FiducialPair,
    MeasuredFrom,
    RegistrationContent,
    check_fle,
    check_pair,
)
from app.registration.fit_report import refitted
from app.registration.found_beads import BeadSearchRecord, FoundBead, bead_label, marked
from app.registration.simulated_touch import simulated_touch
from app.registration.touched_surface import unrefined
from vfix_engine.errors import InputError
from vfix_engine.frames import ImageRegistration

StoredRegistration = Document[RegistrationContent]

PAIR_FIELDS = ("label", "in_image", "measured", "enabled", "weight")
_SAME_BEAD_MM = 1.0  # a bead that is found again


@dataclass(frozen=True)
class MeasuredPoint:
    """A point as it was measured at the patient, in mm; its label may be empty."""

    label: str
    position: Position


class RegistrationEditor:
    """The only interface for changes of a registration; may be called from any thread.

    Each edit is one of the registration's document and returns what it made, or the id of what it added.
    `expected_revision` is the revision the caller saw, as of `DocumentEditor`.
    """

    def __init__(self, registration_id: str, document: DocumentEditor[RegistrationContent]) -> None:
        self.id, self._document = registration_id, document

    @property
    def document(self) -> StoredRegistration:
        """The registration as stored now."""
        return self._document.document

    # -- pairs

    def added_pair(
        self,
        in_image: Sequence[float] | None = None,
        measured: Sequence[float] | None = None,
        label: str | None = None,
        *,
        expected_revision: int | None = None,
    ) -> tuple[str, StoredRegistration]:
        """Add a pair, of which either place may be missing; returns its id too."""
        places = [None if place is None else check_position(place) for place in (in_image, measured)]
        pair_id = new_id("pair")

        def change(content: RegistrationContent) -> RegistrationContent:
            name = _next_label(content) if label is None else check_label(label, "label")
            return _with_pair(content, FiducialPair(name, places[0], places[1], pair_id))

        return pair_id, self._edit(change, expected_revision)

    def change_pair(
        self, pair_id: str, fields: Mapping[str, Any], *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Change fields of a pair: label, in_image, measured, enabled, weight; None takes a place away.

        Raises NotFound, and InputError for an unknown field or a value that cannot be.
        """
        if unknown := sorted(set(fields) - set(PAIR_FIELDS)):
            raise InputError(f"a pair has no {unknown[0]!r:.40}; it has {', '.join(PAIR_FIELDS)}.")
        changes = dict(fields)
        for name in ("in_image", "measured"):
            if changes.get(name) is not None:
                changes[name] = check_position(changes[name])

        def changed(pair: FiducialPair) -> FiducialPair:
            if changes.get("measured", pair.measured) != pair.measured:
                changes["measured_from"] = "typed"
            if changes.get("in_image", pair.in_image) != pair.in_image:
                changes["bead"] = ""
            return check_pair(replace(pair, **changes))

        return self._change_pair(pair_id, changed, expected_revision)

    def delete_pair(self, pair_id: str, *, expected_revision: int | None = None) -> StoredRegistration:
        """Take a pair away; the bead of it can be confirmed again."""

        def change(content: RegistrationContent) -> RegistrationContent:
            gone = found_pair(content, pair_id)
            return replace(content, pairs=tuple(pair for pair in content.pairs if pair is not gone))

        return self._edit(change, expected_revision)

    def touch(
        self,
        pair_ids: Sequence[str],
        noise_mm: float,
        seed: int | None = None,
        *,
        expected_revision: int | None = None,
    ) -> StoredRegistration:
        """Measure pairs with a simulated pointer, as one edit.

        noise_mm: rms length of its error; seed: of the errors, None for others each time.
        Raises InputError for a pair without a place in the image.
        """

        def change(content: RegistrationContent) -> RegistrationContent:
            touched = {pair_id: _touched(content, case_id, pair_id, noise_mm, seed) for pair_id in pair_ids}
            return replace(content, pairs=tuple(touched.get(pair.id, pair) for pair in content.pairs))

        if not pair_ids:
            raise InputError("there is no point to touch yet: confirm beads, or add points at the crosshair.")
        case_id = self.document.case_id
        return self._edit(change, expected_revision)

    def set_measured(
        self,
        points: Sequence[MeasuredPoint],
        measured_from: MeasuredFrom = "file",
        *,
        expected_revision: int | None = None,
    ) -> StoredRegistration:
        """Points that were measured together replace all that were measured before.

        They go to the pairs of the same labels where each label is that of exactly one pair, else to the pairs in their
        order; more points than pairs become pairs without a place in the image.
        """
        if not points:
            raise InputError("there are no measured points.")

        def change(content: RegistrationContent) -> RegistrationContent:
            return with_measured(content, points, measured_from)

        return self._edit(change, expected_revision)

    def clear_measured(self, *, expected_revision: int | None = None) -> StoredRegistration:
        """Forget every measured point; pairs that have nothing else go with it."""

        def change(content: RegistrationContent) -> RegistrationContent:
            kept = [replace(pair, measured=None, measured_from="typed") for pair in content.pairs if pair.in_image]
            return replace(content, pairs=tuple(kept))

        return self._edit(change, expected_revision)

    def reorder(self, measured_of: Mapping[str, str], *, expected_revision: int | None = None) -> StoredRegistration:
        """Give pairs other measured points. measured_of: by a pair's id, the id of the pair whose point it gets.

        A point that no pair gets becomes a pair without a place in the image.
        Raises NotFound, and InputError where one point is given to two pairs.
        """

        def change(content: RegistrationContent) -> RegistrationContent:
            return reordered(content, measured_of)

        return self._edit(change, expected_revision)

    # -- beads

    def keep_beads(
        self, beads: Sequence[FoundBead], search: BeadSearchRecord, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """What a search found replaces what was found before; pairs stay, and a bead that was rejected stays so."""

        def change(content: RegistrationContent) -> RegistrationContent:
            rejected = [bead.position for bead in content.beads if bead.rejected]
            kept = tuple(replace(bead, rejected=_near(bead.position, rejected) is not None) for bead in beads)
            pairs = tuple(_of_bead(pair, kept) for pair in content.pairs)
            return replace(content, beads=kept, search=search, pairs=pairs)

        return self._edit(change, expected_revision)

    def judge_bead(
        self, bead_id: str, *, confirmed: bool | None, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Confirm a found bead, which makes a pair of it; reject it, which takes the pair away; None: neither."""
        pair_id = new_id("pair")

        def change(content: RegistrationContent) -> RegistrationContent:
            return judged(content, bead_id, confirmed, pair_id)

        return self._edit(change, expected_revision)

    def confirm_all(self, *, expected_revision: int | None = None) -> StoredRegistration:
        """Confirm every found bead that is not rejected, as one edit."""

        def change(content: RegistrationContent) -> RegistrationContent:
            known = {pair.bead for pair in content.pairs}
            for bead in content.beads:
                if not bead.rejected and bead.id not in known:
                    content = judged(content, bead.id, True, new_id("pair"))
            return content

        return self._edit(change, expected_revision)

    # -- the registration as a whole

    def set_fle(self, fle_mm: float | None, *, expected_revision: int | None = None) -> StoredRegistration:
        """State the localisation error of one fiducial, rms length in mm; None estimates it from the fit."""
        checked = check_fle(fle_mm)
        return self._edit(lambda content: replace(content, fle_mm=checked), expected_revision)

    def use_given(self, given: ImageRegistration, *, expected_revision: int | None = None) -> StoredRegistration:
        """Take over a transform from elsewhere; the pairs judge it from then on."""
        transform = tuple(float(value) for value in given.transform.ravel())
        return self._edit(
            lambda content: replace(
                content,
                to=given.to,
                transform=transform,
                made_from="given",
                surface=unrefined(content.surface),
                said=None,
            ),
            expected_revision,
        )

    def fit_pairs(self, *, expected_revision: int | None = None) -> StoredRegistration:
        """Make the transform of the pairs again, after one from elsewhere was taken over or it was refined."""
        return self._edit(
            lambda content: replace(content, made_from="none", surface=unrefined(content.surface)), expected_revision
        )

    def changed(
        self, change: Callable[[RegistrationContent], RegistrationContent], *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Make another content of the present one, as one edit."""
        return self._edit(change, expected_revision)

    def become(self, content: RegistrationContent, *, expected_revision: int | None = None) -> StoredRegistration:
        """Take over another content as one edit."""
        return self._edit(lambda _: content, expected_revision)

    def set_locked(self, locked: bool, *, expected_revision: int | None = None) -> StoredRegistration:
        """Lock the registration against edits, or unlock it; not a step of the history."""
        return self._document.set_locked(locked, expected_revision=expected_revision)

    def undo(self, *, expected_revision: int | None = None) -> StoredRegistration:
        """Go back to the state before the newest edit. Raises InputError when there is none."""
        return self._document.undo(expected_revision=expected_revision)

    def redo(self, *, expected_revision: int | None = None) -> StoredRegistration:
        """Take an undo back. Raises InputError when there is none to take back."""
        return self._document.redo(expected_revision=expected_revision)

    def _change_pair(
        self, pair_id: str, change: Callable[[FiducialPair], FiducialPair], expected_revision: int | None
    ) -> StoredRegistration:
        def changed(content: RegistrationContent) -> RegistrationContent:
            before = found_pair(content, pair_id)
            return replace(content, pairs=tuple(change(p) if p is before else p for p in content.pairs))

        return self._edit(changed, expected_revision)

    def _edit(
        self, change: Callable[[RegistrationContent], RegistrationContent], expected_revision: int | None
    ) -> StoredRegistration:
        return self._document.edit(lambda content: refitted(change(content)), expected_revision=expected_revision)


def _touched(
    content: RegistrationContent, case_id: str, pair_id: str, noise_mm: float, seed: int | None
) -> FiducialPair:
    pair = found_pair(content, pair_id)
    if pair.in_image is None:
        raise InputError("this point has no place in the image yet; the simulated pointer cannot touch it.")
    own = None if seed is None else [seed, content.pairs.index(pair)]
    matrix = simulated_transform(content, case_id)
    measured = simulated_touch(case_id, pair.in_image, noise_mm, own, tracker_to_base=matrix)
    return replace(pair, measured=check_position(measured), measured_from="simulated")


def found_pair(content: RegistrationContent, pair_id: str) -> FiducialPair:
    """The pair of that id. Raises NotFound."""
    for pair in content.pairs:
        if pair.id == pair_id:
            return pair
    raise NotFound(f"there is no pair {pair_id!r:.80} in this registration.")


def with_place(
    content: RegistrationContent, pair_id: str, position: Position, measured_from: MeasuredFrom
) -> RegistrationContent:
    """The content with a pair that was measured there, and by that. Raises NotFound and InputError."""
    before, place = found_pair(content, pair_id), check_position(position)
    after = check_pair(replace(before, measured=place, measured_from=measured_from))
    return replace(content, pairs=tuple(after if pair is before else pair for pair in content.pairs))


def judged(content: RegistrationContent, bead_id: str, confirmed: bool | None, pair_id: str) -> RegistrationContent:
    """The content with a found bead confirmed, rejected or neither; pair_id: of a new pair. Raises NotFound."""
    bead = next((bead for bead in content.beads if bead.id == bead_id), None)
    if bead is None:
        raise NotFound(f"there is no bead {bead_id!r:.80} in this registration.")
    content = replace(content, beads=marked(content.beads, bead_id, confirmed is False))
    has_pair = any(pair.bead == bead_id for pair in content.pairs)
    if confirmed and not has_pair:
        label, taken = bead_label(bead), {pair.label for pair in content.pairs}
        label = _next_label(content) if label in taken and not bead.name else label
        return _with_pair(content, FiducialPair(label, bead.position, None, pair_id, bead=bead_id))
    if not confirmed and has_pair:
        return replace(content, pairs=tuple(pair for pair in content.pairs if pair.bead != bead_id))
    return content


def with_measured(
    content: RegistrationContent, points: Sequence[MeasuredPoint], measured_from: MeasuredFrom
) -> RegistrationContent:
    """The content with these measured points instead of all that were measured before."""
    cleared = [replace(pair, measured=None, measured_from="typed") for pair in content.pairs if pair.in_image]
    rows = _by_label(cleared, points)
    spare = list(points) if rows is None else []
    for index, pair in enumerate(cleared):
        point = spare.pop(0) if rows is None and spare else (rows or {}).get(index)
        if point is not None:
            cleared[index] = replace(pair, measured=point.position, measured_from=measured_from)
    content = replace(content, pairs=tuple(cleared))
    for point in spare:
        pair = FiducialPair(point.label or _next_label(content), None, point.position, new_id("pair"))
        content = _with_pair(content, replace(pair, measured_from=measured_from))
    return content


def reordered(content: RegistrationContent, measured_of: Mapping[str, str]) -> RegistrationContent:
    """The content with measured points given to other pairs, see `RegistrationEditor.reorder`."""
    if len(set(measured_of.values())) < len(measured_of):
        raise InputError("an order gives each measured point to one pair only.")
    gets = {key: found_pair(content, source) for key, source in measured_of.items()}
    for key, source in gets.items():
        if found_pair(content, key).in_image is None or source.measured is None:
            raise InputError("an order gives measured points to pairs that are seen in the image.")
    given, pairs, left = set(measured_of.values()), list[FiducialPair](), list[FiducialPair]()
    for pair in content.pairs:
        if pair.id in gets:
            source = gets[pair.id]
            pairs.append(replace(pair, measured=source.measured, measured_from=source.measured_from))
            if pair.measured is not None and pair.id not in given:
                left.append(pair)
        elif pair.id not in given:
            pairs.append(pair)
        elif pair.in_image is not None:
            pairs.append(replace(pair, measured=None, measured_from="typed"))
    content = replace(content, pairs=tuple(pairs))
    for pair in left:
        alone = FiducialPair(_next_label(content), None, pair.measured, new_id("pair"))
        content = _with_pair(content, replace(alone, measured_from=pair.measured_from))
    return content


def _by_label(pairs: Sequence[FiducialPair], points: Sequence[MeasuredPoint]) -> dict[int, MeasuredPoint] | None:
    """The points by the index of the pair of their label; None where the labels do not name the pairs."""
    labels = [as_seen(pair.label) for pair in pairs]
    named = [as_seen(point.label) for point in points]
    if len(set(named)) < len(named) or any(label == "" or labels.count(label) != 1 for label in named):
        return None
    return {labels.index(name): point for name, point in zip(named, points, strict=True)}


def _with_pair(content: RegistrationContent, pair: FiducialPair) -> RegistrationContent:
    if len(content.pairs) >= MAX_PAIRS:
        raise InputError(f"a registration has {MAX_PAIRS} pairs at most; delete some first.")
    return replace(content, pairs=(*content.pairs, pair))


def _next_label(content: RegistrationContent) -> str:
    taken = {pair.label for pair in content.pairs}
    return next(name for n in range(1, len(content.pairs) + 2) if (name := f"F{n}") not in taken)


def _of_bead(pair: FiducialPair, beads: Sequence[FoundBead]) -> FiducialPair:
    """The pair, which belongs to the bead that was found where its place in the image is."""
    near = None if pair.in_image is None else _near(pair.in_image, [bead.position for bead in beads])
    return replace(pair, bead="" if near is None else beads[near].id)


def _near(place: Position, others: Sequence[Position]) -> int | None:
    squares = [sum((a - b) ** 2 for a, b in zip(place, other, strict=True)) for other in others]
    index = min(range(len(squares)), key=squares.__getitem__, default=None)
    return index if index is not None and squares[index] <= _SAME_BEAD_MM**2 else None
