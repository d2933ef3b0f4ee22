"""What the Drive tab says of a robot that nothing holds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.drives.view import FREE
from app.tabs.drive.view import free_words


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
