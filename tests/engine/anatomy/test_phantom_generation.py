"""The generator makes the same head again, whole or in part."""

from __future__ import annotations

import numpy as np
import pytest

from head_phantom.files import HU_STEP, packed
from head_phantom.generate import generate
from vfix_engine.anatomy.phantom import load_nose_ct
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import Volume

AROUND_THE_OSTIUM = ((2.0, 24.0, 14.0), (24.0, 38.0, 26.0))


def crop(whole: Volume, part: Volume) -> np.ndarray:
    first = np.rint(whole.lps_to_index(part.origin)).astype(int)
    k, j, i = part.hu.shape
    return whole.hu[first[2] : first[2] + k, first[1] : first[1] + j, first[0] : first[0] + i]


def test_a_part_of_the_shipped_ct_comes_out_again() -> None:
    """Bit by bit where it was made; another processor may round a last digit otherwise and move a value by a step."""
    again = packed(generate(0.5, AROUND_THE_OSTIUM))
    shipped = crop(load_nose_ct(noise=False), again)
    differs = shipped != again.hu
    assert np.abs(shipped.astype(int) - again.hu).max() <= HU_STEP
    assert differs.mean() < 0.01


def test_twice_is_the_same_to_the_bit() -> None:
    first, second = (generate(1.0, AROUND_THE_OSTIUM) for _ in range(2))
    np.testing.assert_array_equal(first.hu, second.hu)


def test_a_part_has_the_voxels_of_the_whole() -> None:
    whole = generate(2.0, ((-30.0, -20.0, -30.0), (30.0, 60.0, 50.0)))
    part = generate(2.0, ((-9.0, 0.0, -3.0), (21.0, 41.0, 30.0)))
    np.testing.assert_array_equal(part.hu, crop(whole, part))


@pytest.mark.parametrize(
    ("spacing", "box"),
    [(0.1, None), (9.0, None), (float("nan"), None), (1.0, ((500.0, 0.0, 0.0), (600.0, 1.0, 1.0)))],
)
def test_what_cannot_be_made_is_refused(spacing: float, box: tuple | None) -> None:
    with pytest.raises(ImageError, match=r"phantom|box"):
        generate(spacing, box)
