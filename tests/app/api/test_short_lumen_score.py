"""What lists say of the score of a run in a lumen."""

from __future__ import annotations

from typing import Any

import pytest

from app.api.runs import ShortLumenScore


@pytest.mark.parametrize(
    ("come", "task", "completed"),
    [
        (True, None, True),
        (False, None, False),
        (False, {"title": "Polyps", "completed": True, "rows": []}, True),
        (True, {"title": "Polyps", "completed": False, "rows": []}, False),
    ],
)
def test_a_run_with_a_task_is_completed_once_the_task_is(come: bool, task: Any, completed: bool) -> None:
    same = {"certified": True, "time_s": 1.0, "depth_mm": 9.0, "beyond_bound_mm": 0.0, "held_s": 0.0}
    short = ShortLumenScore.of({**same, "completed": come, "task": task, "nearest_mm": {"mean": 1.0, "max": 2.0}})
    assert (short.completed, short.deviation_mm) == (completed, 2.0)


def test_a_score_of_before_there_were_tasks_has_none() -> None:
    same = {"certified": True, "time_s": 1.0, "depth_mm": 9.0, "beyond_bound_mm": 0.0, "held_s": 0.0}
    assert ShortLumenScore.of({**same, "completed": True, "nearest_mm": None}).completed
