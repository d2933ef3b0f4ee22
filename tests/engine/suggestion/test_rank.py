"""Alternatives are ordered by the figures that are told of them."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from vfix_engine.anatomy.piercing import Piercing, TissueRun
from vfix_engine.suggestion.room import Passage
from vfix_engine.suggestion.suggest import Alternative

MARGIN_MM = 0.3


def alternative(
    bone: float, tissue: float | None, depth: float | None, *, reached: float = 80.0, completed: bool = True
) -> Alternative:
    run: Any = SimpleNamespace(clearance=np.array([bone, 3.0]), completed=completed, reached_mm=reached)
    none = np.zeros((0, 3))
    return Alternative(none, none, None, np.eye(4), np.zeros(7), run, Passage(tissue, depth, 9.0))


def test_shortest_in_tissue_then_least_deep_then_widest_of_bone() -> None:
    wanted = [
        alternative(0.8, 13.2, 2.61),
        alternative(2.0, 14.4, 2.6),  # as long as the next one as it is told, and less deep
        alternative(1.5, 13.6, 2.7),
        alternative(0.9, 14.0, 2.7),  # as the one before, with less bone clearance
        alternative(5.0, 20.0, 1.0),
        alternative(0.35, 2.0, 0.1),  # tight
        alternative(9.0, 0.0, 0.0, reached=60.0, completed=False),
        alternative(9.0, 0.0, 0.0, reached=40.0, completed=False),
    ]
    assert sorted((wanted[n] for n in (5, 2, 7, 0, 3, 6, 1, 4)), key=lambda one: one.rank(MARGIN_MM)) == wanted


def test_one_that_pierces_comes_last() -> None:
    """However good its figures are: also behind one that does not arrive (HAZ-36)."""
    place = (0.0, 0.0, 0.0)
    run = TissueRun(9.0, 5.0, place, place, "room", "body")
    nothing = np.zeros(0)
    found = Piercing(nothing.astype(np.intp), nothing, nothing, run, 0, True)
    pierces = replace(alternative(9.0, 0.0, 0.0), piercing=found)
    short = alternative(0.35, 20.0, 4.0, reached=40.0, completed=False)
    assert pierces.pierces
    assert sorted([pierces, short], key=lambda one: one.rank(MARGIN_MM)) == [short, pierces]
    given = replace(pierces, piercing=replace(found, worst=replace(run, gives_mm=9.5)))
    assert not given.pierces


def test_without_a_ct_bone_decides() -> None:
    wide, narrow = alternative(2.0, None, None), alternative(1.0, None, None)
    assert sorted([narrow, wide], key=lambda one: one.rank(MARGIN_MM)) == [wide, narrow]
