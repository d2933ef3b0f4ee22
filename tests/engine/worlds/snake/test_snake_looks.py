"""The look-round as a request to the snake's system: to each side and back, by plans of a few bends at a time."""

from __future__ import annotations

from dataclasses import replace
from itertools import repeat

import numpy as np
import pytest
from snake_runs import BREATH, SAME_MM, hand, judged, made_spec, rows, run

from vfix_engine.errors import ControlError, InputError
from vfix_engine.pathway.pathway import TissueMotion
from vfix_engine.runtime import Straighten
from vfix_engine.runtime.command import no_command
from vfix_engine.worlds.snake import LookRound, SnakeState, SnakeSystem
from vfix_engine.worlds.snake.requests import SIDES

MOST_STEPS = 30_000


def looked(system: SnakeSystem, state: SnakeState, aim_deg: float) -> list[SnakeState]:
    """Every state until the look-round is over."""
    found = [system.apply(state, LookRound(aim_deg))]
    for now in run(system, found[0], repeat(no_command(), MOST_STEPS)):
        found.append(now)
        if not now.doing:
            return found
    raise AssertionError("the look-round did not end")


@pytest.mark.parametrize(("tissue", "aim", "least"), [(None, 25.0, 20.0), (BREATH, 15.0, 12.0)])
def test_all_sides_are_seen_and_the_tip_is_straight_again(
    tissue: TissueMotion | None, aim: float, least: float
) -> None:
    system = made_spec(tissue).build()
    first = system.start()
    states = looked(system, first, aim)
    seen = system.snapshot(states[-1])
    assert seen.looked_deg.shape == (SIDES,)
    assert seen.looked_deg.min() > least
    assert seen.looked_deg.max() < aim + 6.0  # of a path the first view beyond the aim is the last
    assert (seen.doing, seen.straight) == ("", True)
    assert {one.doing for one in states[:-1]} == {"look"}
    found = judged(system, first, states[1::7])
    assert (found.violations, found.disagreements) == (0, 0)
    if tissue is None:
        again = looked(system, first, aim)
        assert np.array_equal(rows(system, again), rows(system, states))
        assert found.deepest_mm < SAME_MM


def test_a_bent_tip_is_straightened_first_and_a_command_ends_it() -> None:
    system = made_spec().build()
    *_, bent = run(system, system.start(), repeat(hand(0.5, 0.3), 900))
    assert not bent.straight
    asked = system.apply(bent, LookRound(20.0))
    assert not system.at_rest(asked, running=True)
    states = list(run(system, asked, repeat(no_command(), 2500)))
    assert any(one.straight for one in states)
    assert max(states[-1].looking.turned_deg) > 0.0  # type: ignore[union-attr]
    for ended in (system.step(states[-1], hand(0.2)), system.apply(states[-1], Straighten())):
        assert ended.looking is None
        assert ended.looked_deg == states[-1].looking.turned_deg  # type: ignore[union-attr]
    assert system.apply(states[-1], Straighten()).doing == "straighten"


def test_what_cannot_be_looked_at_is_refused() -> None:
    spec = made_spec()
    system = spec.build()
    for aim in (0.5, 91.0, float("nan")):
        with pytest.raises(InputError, match="1 to 90"):
            system.apply(system.start(), LookRound(aim))
    outside = replace(spec, tip_s=40.0).build()
    with pytest.raises(ControlError, match="entrance"):
        outside.apply(outside.start(), LookRound())
