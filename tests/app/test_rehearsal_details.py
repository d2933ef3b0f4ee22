"""What the page's Details say of the control loop (HAZ-10)."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from app.session.rehearsal_view import details_section
from vfix_engine.simulation.snapshot import Timing


@pytest.mark.parametrize(
    ("timing", "words"),
    [
        (Timing(real_time=True), "Held"),
        (Timing(), "Taken while somebody drives"),
        (
            Timing(without_why="the system does not allow one to this user"),
            "None: the system does not allow one to this user",
        ),
    ],
)
def test_the_priority_is_told_in_words(timing: Timing, words: str) -> None:
    snapshot = cast(Any, SimpleNamespace(timing=timing, rows=20, steps=3))
    assert details_section(snapshot)["priority"] == words


def test_lateness_is_told_as_median_and_99_percent() -> None:
    timing = Timing(1000.0, 90.0, 200.0, lateness_us_p50=0.14, lateness_us_p99=20.26, overruns=7)
    details = details_section(cast(Any, SimpleNamespace(timing=timing, rows=20, steps=3)))
    assert (details["lateness_us_p50"], details["lateness_us_p99"], details["overruns"]) == (0.1, 20.3, 7)
    assert details_section(None) == {}
