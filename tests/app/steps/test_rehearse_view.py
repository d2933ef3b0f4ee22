"""What the page's Details say of the control loop (HAZ-10)."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from app.steps.rehearse.hints import rehearse_hint
from app.steps.rehearse.view import details_section, holding_words
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


@pytest.mark.parametrize(
    ("phase", "force", "moved", "reason", "words"),
    [
        ("follow", 3.7, 0.0, "", "across the path"),
        ("inspect_hold", 3.7, 0.0, "", "along the shaft"),
        ("approach", 3.7, 0.0, "", "does not go in this mode"),
        ("follow", 3.7, 0.5, "", "free to move"),
        ("follow", 0.0, 0.0, "", "free to move"),
        ("follow", 3.7, 0.0, "the wall", "the wall"),
    ],
)
def test_a_tool_that_stands_against_a_force_is_not_free_to_move(
    phase: str, force: float, moved: float, reason: str, words: str
) -> None:
    def at(steps: int, x: float) -> Any:
        return SimpleNamespace(
            steps=steps,
            grip=np.array([x, 0.0, 0.0]),
            force=np.array([0.0, force, 0.0]),
            phase=phase,
            reason=reason,
            held=False,
        )

    assert words in holding_words(at(60, moved), at(10, 0.0))


def test_the_hint_of_a_paused_rehearsal_does_not_speak_of_the_entry() -> None:
    hint = rehearse_hint(5, "paused", True, False, "path", False, 1, False)
    assert "Continue" in hint
    assert "stands at the entry" not in hint
    assert "You are watching" in rehearse_hint(5, "running", False, False, "path", False, 1, False)
    assert "Nobody holds" in rehearse_hint(5, "paused", False, True, "path", False, 1, False)
    assert "plan has changed" in rehearse_hint(5, "paused", True, False, "path", False, 1, True)


def test_lateness_is_told_as_median_and_99_percent() -> None:
    timing = Timing(1000.0, 90.0, 200.0, lateness_us_p50=0.14, lateness_us_p99=20.26, overruns=7)
    details = details_section(cast(Any, SimpleNamespace(timing=timing, rows=20, steps=3)))
    assert (details["lateness_us_p50"], details["lateness_us_p99"], details["overruns"]) == (0.1, 20.3, 7)
    assert details_section(None) == {}
