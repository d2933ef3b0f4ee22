"""Errors of the application: missing items, conflicting changes, limits, and cancelled work."""

from typing import Any

from vfix_engine.errors import InputError, PlanError, VfixError


class NotFound(InputError):
    """No case, document, point, run or job has this name."""


class TooLarge(InputError):
    """A file or a text is larger than what is accepted."""


class PointsUnclear(PlanError):
    """A file of one list of points does not say whether they are a path or targets."""

    missing = ("points_as",)


class AnswerUnusable(InputError):
    """An import that was repeated with an answer failed; the file is kept, and the question can be answered again.

    missing, series: as in the error that asked the question.
    """

    def __init__(self, message: str, missing: tuple[str, ...], series: tuple[dict[str, Any], ...] = ()) -> None:
        super().__init__(message)
        self.missing, self.series = missing, series


class DocumentConflict(InputError):
    """The document was changed by another client since it was read."""


class DocumentLocked(InputError):
    """The document is locked."""


class PlanConflict(PlanError, DocumentConflict):
    """The plan was changed by another client since it was read."""


class PlanLocked(PlanError, DocumentLocked):
    """The plan is locked."""


class OtherCase(PlanError):
    """The plan was made for another head, and this was not confirmed."""


class JobCancelled(VfixError):
    """The job was cancelled."""

    def __init__(self) -> None:
        super().__init__("The work was cancelled.")


class TooMany(VfixError):
    """Too many requests for the same heavy work; try again later."""


class PlannerEnds(VfixError):
    """The planner is shutting down and does not finish long work."""

    def __init__(self) -> None:
        super().__init__("The planner ends and takes no further work.")
