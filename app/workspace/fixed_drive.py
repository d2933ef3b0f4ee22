"""What a trial of a study fixes of the drive of its plan or route."""

from __future__ import annotations

from dataclasses import dataclass

FIXED = "a trial of the study fixes how it is driven; finish, skip or cancel it in Study."


@dataclass(frozen=True)
class FixedDrive:
    """document_id: of the plan or route. how: it is driven, as the tab that does has it: a ``PlanDrive``, or
    ``LumenDriveOptions``.
    """

    document_id: str
    how: object
