"""The open registration as the page's sections have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from app.messages.sections import Position
from app.registration.document import FiducialPair, RegistrationContent, StoredRegistration
from app.registration.fit_report import FitReport
from app.registration.found_beads import FoundBead, bead_label
from app.registration.point_order import OrderAnswer
from app.registration.target_errors import ErrorTable, ExpectedError
from app.registration.touched_surface import TouchedSurface
from app.tabs.register.calibration_view import calibration_view
from app.tabs.register.sections import (
    BeadEntry,
    BeadState,
    ErrorRow,
    ErrorsView,
    FiducialMark,
    FitView,
    MarkState,
    OrderMove,
    OrdersView,
    PairEntry,
    RegistrationSection,
    TouchedView,
)


def registration_view(
    document: StoredRegistration,
    report: FitReport,
    table: ErrorTable,
    orders: OrderAnswer | None,
    selected: str | None,
    has_volume: bool,
    anatomy: str,
) -> RegistrationSection:
    """The section of the open registration. anatomy: name of the structure that its case is driven in."""
    content, search = document.content, document.content.search
    return {
        "id": document.id,
        "revision": document.revision,
        "name": document.name,
        "locked": document.locked,
        "deleted": document.deleted_at is not None,
        "can_undo": document.can_undo,
        "can_redo": document.can_redo,
        "made_from": content.made_from,
        "has_volume": has_volume,
        "selected": selected,
        "beads": [_bead(bead, content) for bead in content.beads],
        "search": None
        if search is None
        else {
            "diameter_mm": search.diameter_mm,
            "threshold_hu": search.threshold_hu,
            "cautions": list(search.cautions),
            "left_out": search.left_out,
        },
        "pairs": [_pair(pair, report) for pair in content.pairs],
        "fit": _fit(report),
        "fle_stated_mm": content.fle_mm,
        "errors": _errors(table),
        "orders": None if orders is None else _orders(orders, content),
        "anatomy": anatomy,
        "touched": _touched(content.surface),
        "calibration": calibration_view(content),
    }


def marks_of(content: RegistrationContent, report: FitReport, selected: str | None) -> list[FiducialMark]:
    """Marks of the pairs' places in the image, and of the beads that are no pairs.

    report: of the content; where a pair has a residual, what was measured of it is brought into the image.
    """
    pairs: list[FiducialMark] = [
        {
            **_mark(pair.id, pair.label, pair.in_image, "confirmed" if pair.enabled else "left_out", selected),
            "measured": _in_image(pair.measured, content) if pair.id in report.residuals_mm and pair.measured else None,
        }
        for pair in content.pairs
        if pair.in_image
    ]
    confirmed = {pair.bead for pair in content.pairs}
    beads = [
        _mark(bead.id, bead_label(bead), bead.position, bead_state(bead, content), selected)
        for bead in content.beads
        if bead.id not in confirmed
    ]
    return pairs + beads


def bead_state(bead: FoundBead, content: RegistrationContent) -> BeadState:
    """Whether somebody has said that it is a bead, or none."""
    if any(pair.bead == bead.id for pair in content.pairs):
        return "confirmed"
    return "rejected" if bead.rejected else "found"


def _in_image(measured: tuple[float, float, float], content: RegistrationContent) -> Position:
    """Where a measured point is in the image, by the inverse of the transform."""
    matrix = np.reshape(content.transform, (4, 4))
    place = matrix[:3, :3].T @ (np.array(measured) - matrix[:3, 3])
    return _place((float(place[0]), float(place[1]), float(place[2])))


def _mark(
    item_id: str, label: str, position: tuple[float, float, float], state: MarkState, selected: str | None
) -> FiducialMark:
    return {
        "id": item_id,
        "label": label,
        "position": _place(position),
        "measured": None,
        "state": state,
        "selected": item_id == selected,
    }


def _place(position: tuple[float, float, float]) -> Position:
    return [round(value, 3) for value in position]


def _maybe(position: tuple[float, float, float] | None) -> Position | None:
    return None if position is None else _place(position)


def _bead(bead: FoundBead, content: RegistrationContent) -> BeadEntry:
    labels = [pair.label for pair in content.pairs if pair.bead == bead.id]
    return {
        "id": bead.id,
        "name": (labels and labels[0]) or bead_label(bead),
        "position": _place(bead.position),
        "diameter_mm": round(bead.diameter_mm, 2),
        "state": bead_state(bead, content),
    }


def _pair(pair: FiducialPair, report: FitReport) -> PairEntry:
    residual = report.residuals_mm.get(pair.id)
    return {
        "id": pair.id,
        "label": pair.label,
        "in_image": _maybe(pair.in_image),
        "measured": _maybe(pair.measured),
        "enabled": pair.enabled,
        "weight": pair.weight,
        "measured_from": pair.measured_from,
        "bead": pair.bead,
        "residual_mm": None if residual is None else round(residual, 4),
    }


def _fit(report: FitReport) -> FitView:
    wrong = report.wrong
    return {
        "state": report.state,
        "words": report.words,
        "used": report.used,
        "fre_mm": report.fre_mm,
        "mean_residual_mm": report.mean_residual_mm,
        "wrong": None
        if wrong is None
        else {"pair": wrong.pair, "label": wrong.label, "certainty": wrong.certainty, "words": wrong.words},
        "fle_mm": report.fle_mm,
        "fle_source": report.fle_source,
        "simulated": report.simulated,
        "cautions": list(report.cautions),
    }


def _errors(table: ErrorTable) -> ErrorsView:
    rows = [_row(target.label, target.error, None) for target in table.targets]
    if table.path is not None:
        rows.append(_row("", table.path.worst, table.path.worst_mm))
    return {"rows": rows, "words": table.words}


def _row(label: str, error: ExpectedError, s_mm: float | None) -> ErrorRow:
    return {
        "label": label,
        "rms_mm": error.rms_mm,
        "within_95_mm": error.within_95_mm,
        "position": _place(error.position),
        "s_mm": s_mm,
    }


def _orders(answer: OrderAnswer, content: RegistrationContent) -> OrdersView:
    return {
        "candidates": [
            {"moves": _moves(one.measured_of, content.pairs), "fre_mm": one.fre_mm} for one in answer.candidates
        ],
        "ambiguous": answer.ambiguous,
        "unchanged": answer.unchanged,
        "words": answer.words,
    }


def _moves(measured_of: Mapping[str, str], pairs: Sequence[FiducialPair]) -> list[OrderMove]:
    known = {pair.id: pair for pair in pairs}
    return [
        {"label": pair.label, "measured_at": source.label, "measured": _place(source.measured), "stays": source is pair}
        for pair in pairs
        if pair.id in measured_of and (source := known[measured_of[pair.id]]).measured is not None
    ]


def _touched(surface: TouchedSurface | None) -> TouchedView | None:
    if surface is None:
        return None
    done = surface.refinement
    return {
        "structure": surface.structure,
        "count": len(surface.points),
        "measured_from": surface.measured_from,
        "refinement": None
        if done is None
        else {
            "residual_mm": done.residual_mm,
            "kept": done.kept,
            "moved_mm": done.moved_mm,
            "stability": done.stability,
        },
    }
