"""What the services refuse beyond a wrong input: something that is not there, or that changed in between."""

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
    """An import that was repeated with an answer failed; the file is kept, and the question is open again.

    missing, series: those of the question.
    """

    def __init__(self, message: str, missing: tuple[str, ...], series: tuple[dict[str, Any], ...] = ()) -> None:
        super().__init__(message)
        self.missing, self.series = missing, series


class DocumentConflict(InputError):
    """The document was changed by somebody else since it was read."""


class DocumentLocked(InputError):
    """The document is locked."""


class PlanConflict(PlanError, DocumentConflict):
    """The plan was changed by somebody else since it was read."""


class PlanLocked(PlanError, DocumentLocked):
    """The plan is locked."""


class OtherCase(PlanError):
    """The plan was made for another head; whoever knows that says so."""


class JobCancelled(VfixError):
    """Somebody cancelled the job."""

    def __init__(self) -> None:
        super().__init__("The work was cancelled.")


class TooMany(VfixError):
    """So many ask for the same heavy work that one more is turned away; later there is room."""


class PlannerEnds(VfixError):
    """The planner is being ended and finishes nothing that takes long."""

    def __init__(self) -> None:
        super().__init__("The planner ends and takes no further work.")
