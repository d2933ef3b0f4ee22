"""What lists say of the score of a run in a lumen."""

from __future__ import annotations

from typing import Any

import pytest

from app.api.runs import ShortLumenScore

SAME = {"certified": True, "time_s": 1.0, "depth_mm": 9.0, "beyond_bound_mm": 0.0, "held_s": 0.0}


@pytest.mark.parametrize("task", [None, {"title": "Polyps", "completed": True, "rows": []}])
@pytest.mark.parametrize("completed", [True, False])
def test_a_list_says_whether_a_run_is_completed_and_of_which_task_it_is(completed: bool, task: Any) -> None:
    same = {**SAME, "bound_mm": 8.0, "behind_wall": {"share": 0.3, "depth_mm": 3.5, "links_mm": None}}
    short = ShortLumenScore.of({**same, "completed": completed, "task": task, "nearest_mm": {"mean": 1.0, "max": 2.0}})
    assert (short.completed, short.deviation_mm, short.task) == (completed, 2.0, task and task["title"])
    assert (short.bound_mm, short.behind_wall and short.behind_wall.share) == (8.0, 0.3)


def test_a_score_of_before_there_were_tasks_has_none() -> None:
    assert ShortLumenScore.of(
        {**SAME, "bound_mm": 8.0, "behind_wall": None, "completed": True, "nearest_mm": None}
    ).completed
