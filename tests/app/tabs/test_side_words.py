"""Directions and sides of planes in words."""

from __future__ import annotations

import pytest

from app.tabs.plan.side_words import direction_words, half_space_words


@pytest.mark.parametrize(
    ("direction", "words"),
    [
        ((0.0, -1.0, 0.0), "The shaft leaves towards the front (A)."),
        ((0.0, -0.94, -0.342), "The shaft leaves towards the front (A), 20° downwards (I)."),
        (
            (0.5, -0.76604, 0.40404),
            "The shaft leaves towards the front (A), 30° towards the left (L) and 24° upwards (S).",
        ),
    ],
)
def test_a_direction_is_told_by_where_the_shaft_leaves(direction: tuple[float, float, float], words: str) -> None:
    assert direction_words(direction) == words


@pytest.mark.parametrize(
    ("point", "normal", "words"),
    [
        ((0.0, 0.0, 12.0), (0.0, 0.0, -1.0), "Kept free above S 12.0; the tool stays below"),
        ((0.0, 0.0, -3.0), (0.0, 0.0, 2.0), "Kept free below I 3.0; the tool stays above"),
        ((0.0, -10.0, 0.0), (0.0, -1.0, 0.0), "Kept free behind A 10.0; the tool stays in front"),
        ((4.0, 0.0, 0.0), (-1.0, 0.0, 0.0), "Kept free left of L 4.0; the tool stays to the right"),
        ((4.0, 0.0, 0.0), (-0.8, 0.6, 0.0), "Kept free left of L 4.0, tilted; the tool stays to the right"),
    ],
)
def test_a_half_space_tells_which_side_is_kept_free(
    point: tuple[float, float, float], normal: tuple[float, float, float], words: str
) -> None:
    assert half_space_words(point, normal) == words
