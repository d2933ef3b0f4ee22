"""What the page's Details say of the control loop (HAZ-10)."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from app.planning.verdict import IN_SHORT
from app.tabs.rehearse.drive_figures import DriveFigures, DryRunFigures
from app.tabs.rehearse.hints import rehearse_hint
from app.tabs.rehearse.view import details_section, holding_words
from vfix_engine.worlds.rigid.snapshot import Timing


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
            active=(),
        )

    assert words in holding_words(at(60, moved), at(10, 0.0))


def test_what_held_the_tool_is_told_after_the_hand_let_go() -> None:
    def at(force: float, reason: str = "") -> Any:
        pushed = np.array([0.0, force, 0.0])
        return SimpleNamespace(
            steps=60, grip=np.zeros(3), force=pushed, phase="follow", reason=reason, held=False, active=()
        )

    bone = "bone on the shaft, 0.3 mm away"
    assert holding_words(at(0.0), None, bone) == f"Stopped last by {bone}"
    assert holding_words(at(0.0), None, "the end of the path") == "At the end of the path"
    assert holding_words(at(2.0), None, bone) == "Nothing, the tool is free to move"
    assert holding_words(at(2.0, "the wall"), None, bone) == "the wall"
    assert holding_words(at(0.0), None) == "Nothing, the tool is free to move"


def at_rest(steps: int, x: float, clearance: float, **more: Any) -> Any:
    """A straight tool of radius 1 mm along y, at x; bone tissue begins at x = 0."""
    end = np.array([[x, 10.0, 0.0]])
    snapshot = {"reason": "", "held": False, "force": np.zeros(3), "threshold_mm": 5.0, "tip": end[0], **more}
    return SimpleNamespace(
        steps=steps, clearance_mm=clearance, segments_start=np.array([[x, 0.0, 0.0]]), segments_end=end,
        radius=np.array([1.0]), **snapshot,
    )  # fmt: skip


def test_figures_of_a_drive_stand_beside_those_of_its_dry_run() -> None:
    tissue = cast(Any, SimpleNamespace(at=lambda points: points[:, 0]))  # solid where x is negative
    planned = DryRunFigures(True, 90.0, 90.0, "", 1.36, 3.8, tissue)
    so_far = DriveFigures()
    so_far.take(at_rest(0, 9.0, 6.0), planned)
    assert so_far.words == ""
    so_far.take(at_rest(5, 9.0, 6.0), planned)
    assert so_far.words.startswith("Nearest while driven: bone at least 6.00 mm away, 0.0 mm deep")
    so_far.take(at_rest(9, -1.5, 1.2), planned)
    so_far.take(at_rest(12, 4.0, 2.0), planned)
    assert so_far.words == (
        "Nearest while driven: bone 1.20 mm away, 2.5 mm deep in soft tissue. Simulated: 1.36 mm, 3.8 mm deep."
    )
    so_far.take(at_rest(0, 9.0, 6.0), planned)  # at the entry again
    assert so_far.words == ""
    so_far.take(at_rest(3, 9.0, 4.0), DryRunFigures(True, 90.0, 90.0, "", 1.36))
    assert so_far.words == "Nearest while driven: bone 4.00 mm away. Simulated: 1.36 mm."


def test_what_held_the_tool_is_kept_until_it_moves_freely() -> None:
    so_far, push = DriveFigures(), np.array([0.0, 2.0, 0.0])
    for steps, more, words in (
        (1, {"force": push, "reason": "the wall"}, "the wall"),
        (2, {}, "the wall"),
        (3, {"force": -push}, ""),
        (4, {}, ""),
    ):
        so_far.take(at_rest(steps, 9.0, 4.0, **more), None)
        assert so_far.held_last == words


def test_the_hint_says_what_a_start_means_where_the_path_does_not_fit() -> None:
    """The verdict itself is in the card."""
    planned = DryRunFigures(False, 56.2, 90.1, "bone on the shaft, 0.2 mm away", 0.3, verdict=IN_SHORT["held"])
    assert (planned.doubtful, DryRunFigures(True, 90.0, 90.0, "", 1.0).doubtful) == (True, False)
    assert DryRunFigures(True, 90.0, 90.0, "", 1.0, verdict=IN_SHORT["registration"]).doubtful
    hint = rehearse_hint(5, "ready", True, False, "path", "", 1, False, planned.doubtful)
    assert hint == "You can still start; the tool stops before bone, not before skin."
    assert "You can still" not in rehearse_hint(5, "running", True, False, "path", "", 1, False, planned.doubtful)


def test_what_acts_without_slowing_the_tool_is_named() -> None:
    def at(steps: int) -> Any:
        force, grip = np.array([0.0, 1.0, 0.0]), np.array([float(steps), 0.0, 0.0])
        held, active = False, ("soft tissue, 0.4 mm deep", "bone on the shaft, 0.3 mm away")
        return SimpleNamespace(steps=steps, grip=grip, force=force, phase="follow", reason="", held=held, active=active)

    assert holding_words(at(60), at(10)) == "Nothing slows it; acting: soft tissue, 0.4 mm deep"


def test_the_hint_of_a_paused_rehearsal_does_not_speak_of_the_entry() -> None:
    hint = rehearse_hint(5, "paused", True, False, "path", "", 1, False)
    assert "Continue" in hint
    assert "stands at the entry" not in hint
    watched = rehearse_hint(5, "running", False, False, "path", "", 1, False, certified=False)
    assert watched == "You watch a free hand. Pause stops the tool."
    assert "straight to the path" in rehearse_hint(5, "running", True, False, "path", "approach", 1, False)
    assert "You are watching" in rehearse_hint(5, "running", False, False, "path", "", 1, False)
    assert "Nobody holds" in rehearse_hint(5, "paused", False, True, "path", "", 1, False)
    assert "plan has changed" in rehearse_hint(5, "paused", True, False, "path", "", 1, True)


def test_the_hint_of_a_free_hand_asks_for_a_start_where_there_is_none() -> None:
    asked, comes = (
        rehearse_hint(5, state, True, False, "path", "", 1, False, certified=False) for state in ("absent", "starting")
    )
    assert asked.startswith("Press Start")
    assert comes == "The tool is being put at the entry, in your hand."


def test_lateness_is_told_as_median_and_99_percent() -> None:
    timing = Timing(1000.0, 90.0, 200.0, lateness_us_p50=0.14, lateness_us_p99=20.26, overruns=7)
    details = details_section(cast(Any, SimpleNamespace(timing=timing, rows=20, steps=3)))
    assert (details["lateness_us_p50"], details["lateness_us_p99"], details["overruns"]) == (0.1, 20.3, 7)
    assert details_section(None) == {}


@pytest.mark.parametrize(
    ("mode", "phase", "words", "arrows"),
    [
        ("path", "follow", "↑ or W forwards, ↓ or S back", True),
        ("free", "free", "A, D twist", False),
        ("inspect", "inspect_approach", "goes onto the target first", True),
        ("inspect", "inspect_hold", "swing about the target", False),
    ],
)
def test_the_hint_names_the_keys_that_the_motion_heeds(mode: str, phase: str, words: str, arrows: bool) -> None:
    hint = rehearse_hint(5, "running", True, False, mode, phase, 1, False)
    assert words in hint
    assert ("↑" in hint) == arrows
