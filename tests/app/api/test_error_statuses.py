"""Every error has one HTTP status, from one table."""

import pytest

from app.api.dependencies import ERRORS
from app.api.error_statuses import ERROR_STATUSES, status_of
from app.kit import errors
from app.store.errors import StorageError, StoreBusy, StoreDamaged
from vfix_engine.errors import ControlError, FrameError, InputError, PlanError, StartRefused, VfixError


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (errors.NotFound("x"), 404),
        (errors.TooLarge("x"), 413),
        (errors.PlanConflict("x"), 409),
        (errors.DocumentConflict("x"), 409),
        (errors.PlanLocked("x"), 423),
        (errors.OtherCase("x"), 422),
        (PlanError("x"), 422),
        (FrameError("x"), 422),
        (InputError("x"), 422),
        (StartRefused("x"), 409),
        (ControlError("x"), 409),
        (errors.PlannerEnds(), 503),
        (StoreBusy("x"), 503),
        (StoreDamaged("x"), 500),
        (StorageError("x"), 507),
        (VfixError("x"), 400),
    ],
)
def test_the_first_kind_that_fits_gives_the_status(error: VfixError, status: int) -> None:
    assert status_of(error) == status
    assert status in ERRORS


def test_every_status_is_told_once() -> None:
    assert len({line.status for line in ERROR_STATUSES}) == len(ERROR_STATUSES) == len(ERRORS)
