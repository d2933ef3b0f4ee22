"""The table of HTTP statuses of errors."""

from __future__ import annotations

from typing import NamedTuple

from app.kit.errors import DocumentConflict, DocumentLocked, JobCancelled, NotFound, PlannerEnds, TooLarge, TooMany
from app.store.errors import StorageError, StoreBusy, StoreUnusable
from vfix_engine.errors import ControlError, InputError, VfixError


class ErrorStatus(NamedTuple):
    """A status, its description, and the error classes that it is used for."""

    status: int
    words: str
    kinds: tuple[type[VfixError], ...] = ()


# The first line with a kind that fits counts; lines without one are given by the gateway or on a header.
ERROR_STATUSES = (
    ErrorStatus(401, "No token"),
    ErrorStatus(403, "A foreign Host or Origin, or another site or port"),
    ErrorStatus(404, "Not there", (NotFound,)),
    ErrorStatus(409, "Changed or cancelled meanwhile", (DocumentConflict, ControlError, JobCancelled)),
    ErrorStatus(412, "Not the revision of If-Match"),
    ErrorStatus(413, "Too large", (TooLarge,)),
    ErrorStatus(423, "Locked", (DocumentLocked,)),
    ErrorStatus(422, "Refused", (InputError,)),
    ErrorStatus(
        503,
        "The database is held by another program, too many ask at once, or the planner ends",
        (PlannerEnds, StoreBusy, TooMany),
    ),
    ErrorStatus(500, "What is stored is damaged, or an error that nobody expected", (StoreUnusable,)),
    ErrorStatus(507, "The disk does not take it", (StorageError,)),
    ErrorStatus(400, "Refused", (VfixError,)),
)


def status_of(error: VfixError) -> int:
    """The status of an error, unless a condition of the request gives another."""
    return next(line.status for line in ERROR_STATUSES if isinstance(error, line.kinds))
