"""What the Drive tab says of a robot that nothing holds, of the link behind the wall, and of polyps in the scene."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.drives.view import FREE
from app.scene import palette
from app.tabs.drive.view import deepest_link, free_words
from app.workspace.task_view import task_layers
from vfix_engine.study.polyps.live import PolypMoment
from vfix_engine.study.polyps.progress import PolypProgress, Viewing
from vfix_engine.worlds.snake.link_depth import DeepestLink


@pytest.mark.parametrize(
    ("deviation_mm", "depth_mm", "words"),
    [
        (1.0, 50.0, FREE),
        (3.95, 50.0, "Link 2 is at its bound"),
        (4.5, 50.0, "Nothing, but link 2 is beyond its bound"),
        (1.0, 99.8, "The end of the way"),
    ],
)
def test_a_robot_at_its_bound_or_at_the_end_is_not_said_to_be_free(
    deviation_mm: float, depth_mm: float, words: str
) -> None:
    now: Any = SimpleNamespace(
        bounds=np.array([np.inf, 4.0, 6.0]),
        deviations=np.array([9.0, deviation_mm, 0.0]),
        progress_mm=depth_mm,
        length_mm=100.0,
    )
    assert free_words(now) == words


@pytest.mark.parametrize(
    ("link", "bound_mm"), [(2, 4.0), (3, 6.0), (1, None), (0, None)]
)  # the first link is out again since it was measured, and 0 is none
def test_the_link_behind_the_wall_comes_with_its_bound(link: int, bound_mm: float | None) -> None:
    now: Any = SimpleNamespace(bounds=np.array([np.inf, 4.0, 6.0]))
    wall: Any = SimpleNamespace(deepest=lambda snapshot: DeepestLink(5.04, link))
    assert deepest_link(wall, now) == {"depth_mm": 5.0, "link": link, "bound_mm": bound_mm}


def test_polyps_in_the_scene_have_their_numbers_and_those_that_are_cleared_a_tick() -> None:
    viewings = tuple(Viewing(cleared_t=7.0 if index == 1 else None) for index in range(3))
    places = np.arange(9.0).reshape(3, 3)
    task: Any = SimpleNamespace(targets=lambda: places)
    (layer,) = task_layers(PolypMoment(task, None, PolypProgress(8.0, viewings)), None)
    assert [shape.name for shape in layer.key] == ["1", "2 ✓", "3"]  # type: ignore[attr-defined]
    assert [shape.colour for shape in layer.key] == [palette.SOUGHT[0], palette.DONE, palette.SOUGHT[0]]  # type: ignore[attr-defined]
    assert [shape.position for shape in layer.key] == [tuple(place) for place in places]  # type: ignore[attr-defined]
