"""Edits of a registration's content: functions that return the content after it, and how one is stored."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from app.documents.documents import Documents
from app.kit.errors import NotFound
from app.kit.names import as_seen, check_label
from app.kit.values import Position, check_position, new_id
from app.registration.calibration import simulated_transform
from app.registration.document import (
    MAX_PAIRS,
    FiducialPair,
    MeasuredFrom,
    RegistrationContent,
    StoredRegistration,
)
from app.registration.fit_report import refitted
from app.registration.found_beads import BeadSearchRecord, FoundBead, bead_label, marked
from app.registration.simulated_touch import simulated_touch
from vfix_engine.errors import InputError

_SAME_BEAD_MM = 1.0  # a bead that is found again


@dataclass(frozen=True)
class MeasuredPoint:
    """A point as it was measured at the patient, in mm; its label may be empty."""

    label: str
    position: Position


def edit(
    documents: Documents[RegistrationContent],
    registration_id: str,
    change: Callable[[RegistrationContent], RegistrationContent],
    *,
    expected_revision: int | None = None,
) -> StoredRegistration:
    """Store what a change makes of the content, with the pairs fitted anew; arguments as of `DocumentEditor.edit`."""
    editor = documents.editor(registration_id)
    return editor.edit(lambda content: refitted(change(content)), expected_revision=expected_revision)


# -- pairs


def found_pair(content: RegistrationContent, pair_id: str) -> FiducialPair:
    """The pair of that id. Raises NotFound."""
    for pair in content.pairs:
        if pair.id == pair_id:
            return pair
    raise NotFound(f"there is no pair {pair_id!r:.80} in this registration.")


def with_new_pair(
    content: RegistrationContent, in_image: Position | None, measured: Position | None, label: str | None = None
) -> RegistrationContent:
    """The content with one pair more, of which either place may be missing. label: None for F and a number."""
    name = _next_label(content) if label is None else check_label(label, "label")
    return _with_pair(content, FiducialPair(name, in_image, measured, new_id("pair")))


def with_changed_pair(content: RegistrationContent, pair_id: str, changes: Mapping[str, Any]) -> RegistrationContent:
    """The content with other fields of a pair; another place is a typed one, and no bead's. Raises NotFound."""
    before = found_pair(content, pair_id)
    implied: dict[str, Any] = {}
    if changes.get("measured", before.measured) != before.measured:
        implied["measured_from"] = "typed"
    if changes.get("in_image", before.in_image) != before.in_image:
        implied["bead"] = ""
    after = replace(before, **changes, **implied)
    return replace(content, pairs=tuple(after if pair is before else pair for pair in content.pairs))


def without_pair(content: RegistrationContent, pair_id: str) -> RegistrationContent:
    """The content without a pair, whose bead can be confirmed again. Raises NotFound."""
    gone = found_pair(content, pair_id)
    return replace(content, pairs=tuple(pair for pair in content.pairs if pair is not gone))


# -- measured points


def with_place(
    content: RegistrationContent, pair_id: str, position: Position, measured_from: MeasuredFrom
) -> RegistrationContent:
    """The content with a pair that was measured there, and by that. Raises NotFound and InputError."""
    before = found_pair(content, pair_id)
    after = replace(before, measured=check_position(position), measured_from=measured_from)
    return replace(content, pairs=tuple(after if pair is before else pair for pair in content.pairs))


def with_touched(
    content: RegistrationContent, case_id: str, pair_ids: Sequence[str], noise_mm: float, seed: int | None = None
) -> RegistrationContent:
    """The content with pairs that a simulated pointer has measured.

    noise_mm: rms length of its error; seed: of the errors, None for others each time.
    Raises NotFound, and InputError for a pair without a place in the image.
    """
    matrix = simulated_transform(content, case_id)
    for pair_id in pair_ids:
        pair = found_pair(content, pair_id)
        if pair.in_image is None:
            raise InputError("this point has no place in the image yet; the simulated pointer cannot touch it.")
        own = None if seed is None else [seed, content.pairs.index(pair)]
        place = simulated_touch(case_id, pair.in_image, noise_mm, own, tracker_to_base=matrix)
        content = with_place(content, pair_id, place, "simulated")
    return content


def with_measured(
    content: RegistrationContent, points: Sequence[MeasuredPoint], measured_from: MeasuredFrom = "file"
) -> RegistrationContent:
    """The content with points that were measured together instead of all that were measured before.

    They go to the pairs of the same labels where each label is that of exactly one pair, else to the pairs in their
    order; more points than pairs become pairs without a place in the image. Raises InputError for none.
    """
    if not points:
        raise InputError("there are no measured points.")
    content = without_measured(content)
    rows = _by_label(content.pairs, points)
    pairs, spare = list(content.pairs), list(points) if rows is None else []
    for index, pair in enumerate(pairs):
        point = spare.pop(0) if rows is None and spare else (rows or {}).get(index)
        if point is not None:
            pairs[index] = replace(pair, measured=point.position, measured_from=measured_from)
    content = replace(content, pairs=tuple(pairs))
    for point in spare:
        pair = FiducialPair(point.label or _next_label(content), None, point.position, new_id("pair"))
        content = _with_pair(content, replace(pair, measured_from=measured_from))
    return content


def without_measured(content: RegistrationContent) -> RegistrationContent:
    """The content without measured points; pairs that have nothing else go with them."""
    kept = [replace(pair, measured=None, measured_from="typed") for pair in content.pairs if pair.in_image]
    return replace(content, pairs=tuple(kept))


def reordered(content: RegistrationContent, measured_of: Mapping[str, str]) -> RegistrationContent:
    """The content with measured points given to other pairs.

    measured_of: by a pair's id, the id of the pair whose point it gets. A point that no pair gets becomes a pair
    without a place in the image. Raises NotFound, and InputError where one point is given to two pairs.
    """
    if len(set(measured_of.values())) < len(measured_of):
        raise InputError("an order gives each measured point to one pair only.")
    gets = {key: found_pair(content, source) for key, source in measured_of.items()}
    for key, source in gets.items():
        if found_pair(content, key).in_image is None or source.measured is None:
            raise InputError("an order gives measured points to pairs in the image.")
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


# -- beads


def with_beads(
    content: RegistrationContent, beads: Sequence[FoundBead], search: BeadSearchRecord
) -> RegistrationContent:
    """The content with what a search found instead of what was found before.

    Pairs stay, and a bead that was rejected stays so.
    """
    rejected = [bead.position for bead in content.beads if bead.rejected]
    kept = tuple(replace(bead, rejected=_near(bead.position, rejected) is not None) for bead in beads)
    return replace(content, beads=kept, search=search, pairs=tuple(_of_bead(pair, kept) for pair in content.pairs))


def judged(content: RegistrationContent, bead_id: str, confirmed: bool | None) -> RegistrationContent:
    """The content with a found bead confirmed, which makes a pair of it, rejected, or neither. Raises NotFound."""
    bead = next((bead for bead in content.beads if bead.id == bead_id), None)
    if bead is None:
        raise NotFound(f"there is no bead {bead_id!r:.80} in this registration.")
    content = replace(content, beads=marked(content.beads, bead_id, confirmed is False))
    has_pair = any(pair.bead == bead_id for pair in content.pairs)
    if confirmed and not has_pair:
        label, taken = bead_label(bead), {pair.label for pair in content.pairs}
        label = _next_label(content) if label in taken and not bead.name else label
        return _with_pair(content, FiducialPair(label, bead.position, None, new_id("pair"), bead=bead_id))
    if not confirmed and has_pair:
        return replace(content, pairs=tuple(pair for pair in content.pairs if pair.bead != bead_id))
    return content


def with_every_bead(content: RegistrationContent) -> RegistrationContent:
    """The content with every found bead confirmed that is not rejected."""
    known = {pair.bead for pair in content.pairs}
    for bead in content.beads:
        if not bead.rejected and bead.id not in known:
            content = judged(content, bead.id, True)
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
