"""What a simulated person of Kwok 2013 remembers, and where he looks next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vfix_engine.study.endoscopy.endoscopist import Endoscopist
from vfix_engine.study.endoscopy.picture import SeenPolyp
from vfix_engine.study.endoscopy.search import LookAgain, Memory, rules

WHO = Endoscopist()


def memory_of(depth_mm: float, number: int = 4) -> Memory:
    """He noticed one polyp 30 mm ahead of that depth, to the right."""
    memory = Memory(WHO)
    memory.noticed(SeenPolyp(number, np.array([1e-6, 0.0]), 30.0), depth_mm)
    return memory


def next_of(
    memory: Memory, depth_mm: float, cleared: int = 0, time_s: float = 0.0, flexure: bool = False
) -> LookAgain | None:
    return memory.next(depth_mm, cleared, time_s, flexure)


def test_he_goes_back_to_a_polyp_that_he_noticed_and_passed() -> None:
    memory = memory_of(100.0)
    assert next_of(memory, 120.0) is None
    visit = next_of(memory, 131.0)
    assert visit is not None
    assert visit.number == 4
    assert visit.stands == pytest.approx([108.0, 96.0, 118.0, 84.0])
    assert visit.side is not None
    np.testing.assert_allclose(visit.side, [1.0, 0.0])
    memory.gone(4, 110.0)
    assert next_of(memory, 131.0) is None


def test_a_polyp_is_left_for_good_the_second_time() -> None:
    memory = memory_of(100.0)
    assert not memory.leaves(4)
    assert memory.left(4)
    assert next_of(memory, 160.0) is None  # not yet so far behind it
    visit = next_of(memory, 171.0)
    assert visit is not None
    assert visit.stands == pytest.approx([102.0, 120.0, 90.0, 130.0])  # from other places than the first time
    assert not memory.left(4)
    assert memory.leaves(4)
    assert next_of(memory, 180.0) is None


def test_he_looks_round_once_in_a_flexure() -> None:
    memory = Memory(WHO)
    visit = next_of(memory, 50.0, flexure=True)
    assert visit is not None
    assert (visit.number, visit.stands) == (None, [50.0])
    memory.looked(50.0)
    assert next_of(memory, 70.0, flexure=True) is None
    assert next_of(memory, 76.0, flexure=True) is not None


def test_he_looks_over_a_gap_again_where_he_has_not_looked_round() -> None:
    memory = Memory(WHO)
    memory.looked(31.0)
    assert next_of(memory, 89.0) is None
    visit = next_of(memory, 91.0)
    assert visit is not None
    assert visit.stands == pytest.approx([91.0, 61.0, 1.0])
    assert next_of(memory, 100.0) is None  # once


@pytest.mark.parametrize(("cleared", "time_s"), [(10, 0.0), (0, 601.0)])
def test_he_is_content_with_ten_or_after_his_patience(cleared: int, time_s: float) -> None:
    memory = memory_of(100.0)
    assert next_of(memory, 300.0, cleared, time_s, True) is None
    assert next_of(memory, 300.0) is not None


def test_rules_are_told_with_the_sizes_in_force() -> None:
    told = rules(replace(WHO, gap_mm=77.0, whole_s=123.0))
    assert "77 mm" in told["gap"]
    assert "123 s" in told["content"]
