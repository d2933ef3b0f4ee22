"""Admission queue: in order, few at a time, and refused when it is full."""

import pytest

from app.api.error_statuses import status_of
from app.kit.admission import AdmissionQueue
from app.kit.errors import TooMany


def test_they_work_one_after_another_in_their_order() -> None:
    line = AdmissionQueue("archives", at_once=1, most=3)
    first, second, third = (line.join() for _ in range(3))
    assert [line.is_turn(ticket) for ticket in (first, second, third)] == [True, False, False]
    line.leave(second)  # one that waits may go away
    line.done(first)
    assert line.is_turn(third)
    assert not line.is_turn(first)


def test_whoever_comes_when_it_is_full_is_told_so() -> None:
    line = AdmissionQueue("archives", at_once=2, most=2)
    first, second = line.join(), line.join()
    assert line.is_turn(second)
    line.done(first)  # its file is still being sent
    with pytest.raises(TooMany, match="2 archives are under way") as told:
        line.join()
    assert status_of(told.value) == 503
    line.leave(first)
    assert line.join() not in (first, second)
