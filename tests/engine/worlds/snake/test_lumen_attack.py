"""The attack of `vfix bench lumen --attack`, short: no link gets beyond its bound, and judges would see one that did.

HAZ-01, HAZ-02, HAZ-05, HAZ-06, HAZ-13 for the snake: still and moving lumens, both controls, parts that lie; every
configuration measured again by the paper's printed steps, a share of the ways fifty times finer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lumen_shapes import straight

from benchmarks.attack.command import summary
from benchmarks.attack.snake.episodes import SnakeCampaign
from benchmarks.attack.snake.lies import LIES
from benchmarks.attack.snake.operators import ATTACKS
from benchmarks.attack.snake.watch import Motion, SnakeTally, Watch
from vfix_engine.pathway.limits.limits import Configuration, LinksAt, MotionVerdict
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import Command
from vfix_engine.worlds.snake.offline.script import ScriptSystem
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.constants import SnakeCertificate, start_of
from vfix_engine.worlds.snake.stepping.state import SnakeState

SCENES = (
    "helix", "narrow", "lobes", "hairpin", "breathing bend", "squeezing helix", "squeezing embedded colon, 30 links",
)  # fmt: skip
STEPS, SEED = 100, 20261124


@pytest.fixture(scope="module")
def total() -> dict[str, Any]:
    return summary(SnakeCampaign, [SnakeCampaign(name, SEED, STEPS, longest=30).run() for name in SCENES])


def test_no_accepted_motion_breaks_what_is_promised(total: dict[str, Any]) -> None:
    assert total["failures"] == []
    assert total["correct"]
    assert total["steps"] == STEPS * len(SCENES)
    for count in ("violations", "nan", "replay_hits", "limit_violations", "disagreements", "exceptions"):
        assert total[count] == 0, count
    assert total["deepest_mm"] == 0.0
    assert total["way_mm"] <= 0.05


def test_the_attack_is_one(total: dict[str, Any]) -> None:
    """It presses against the bounds, is held, goes in and out, and is judged all the time."""
    assert total["remeasured"] == total["steps"]
    assert total["least_room_mm"] < 0.01
    for count, least in (("held", 30), ("moved", 250), ("inserted", 30), ("replayed", 8), ("refused_commands", 3)):
        assert total[count] > least, count
    assert total["replayed_insertions"] > 0
    assert total["replayed_in_moving_tissue"] > 0
    used = total["used"]
    assert {"control: parameterised", "control: qp", "control: view"} <= set(used)
    assert len(set(used) & set(ATTACKS)) >= 8
    assert {f"lie: {name}" for name in LIES} & set(used)
    assert set(vars(SnakeTally())) <= set(total)


def test_the_same_seed_makes_the_same_motions() -> None:
    """HAZ-13."""
    hashes = [SnakeCampaign("helix", seed, 25, longest=10, replays=0.0).run()["hash"] for seed in (3, 3, 4)]
    assert hashes[0] == hashes[1] != hashes[2]


def replaced(broken: Callable[..., MotionVerdict]) -> Callable[[ScriptSystem], None]:
    """A sabotage that puts another certificate in the place of both of the drive's."""

    def sabotage(system: ScriptSystem) -> None:
        for name in ("limits", "distal_limits"):
            honest: SnakeCertificate = getattr(system.constants, name)
            other: Any = type("Broken", (), {"certify": lambda _, *motion, of=honest: broken(of, *motion)})()
            system.constants = replace(system.constants, **{name: other})
        LIES["control"](system, np.random.default_rng(1))

    return sabotage


def lax(honest: SnakeCertificate, state: LinksAt, motion: Configuration) -> MotionVerdict:
    """Keeps 0.2 mm less than the bounds."""
    assert state.bound is not None
    return honest.certify(state._replace(bound=state.bound + 0.2, known=None), motion)


def told_too_little(honest: SnakeCertificate, state: LinksAt, motion: Configuration) -> MotionVerdict:
    """Tells a depth that is 0.01 mm less than it is."""
    verdict = honest.certify(state._replace(known=None), motion)
    deviation = verdict.deviation
    return verdict._replace(deviation=deviation._replace(depth=np.maximum(deviation.depth - 0.01, 0.0)))


@pytest.mark.parametrize(("broken", "seen"), [(lax, "violations"), (told_too_little, "disagreements")])
def test_a_broken_certificate_is_found_out(broken: Callable[..., MotionVerdict], seen: str) -> None:
    found = SnakeCampaign("helix", 1, 60, replaced(broken), ("into the wall",), replays=0.0).run()
    assert found[seen] > 0
    assert not summary(SnakeCampaign, [found])["correct"]


def test_a_way_through_the_wall_is_found_out() -> None:
    """Both ends are within the bounds; between them the base swings round, outside of the tube."""
    settings = DriveSettings(vertices_per_link=30, bound_mm=20.0, tip_bound_mm=20.0)
    start = start_of(SnakeModel(5), straight(260.0, contours=14), settings, tip_s=160.0, plans_here=True)
    tally, state, q = SnakeTally(), start.state, np.zeros(10)
    watch, base = Watch(tally, ScriptSystem(start), "", 0.0, 0), state.base
    cosine, sine = np.cos(2.98), np.sin(2.98)
    turn = np.array([[cosine, 0.0, sine, 0.0], [0.0, 1.0, 0.0, 0.0], [-sine, 0.0, cosine, 0.0], [0.0, 0.0, 0.0, 1.0]])
    end = base @ turn
    end[:3, 3] = base[:3, 3] + 150.0 * base[:3, 2]
    back = np.tile([0.0, 0.03], 5)
    windows = np.tile([0, len(state.packed.rows)], (5, 1))
    motion = Motion(0, state.packed, windows, np.ones(5, dtype=bool), Configuration(base, q), Configuration(end, back))
    watch._replay([motion], [(q, base, q, base)], False)
    assert (tally.replayed, tally.replay_hits) == (1, 0)
    watch._replay([motion], [(q, base, back, end)], False)
    assert (tally.replayed, tally.replay_hits, tally.violations) == (2, 1, 1)
    assert tally.failures[0]["kind"] == "way"


def test_a_motion_that_nobody_judged_is_found_out() -> None:
    def sabotage(system: ScriptSystem) -> None:
        part: Any = system
        honest = part.step

        def drifting(before: SnakeState, command: Command) -> SnakeState:
            state: SnakeState = honest(before, command)
            q = state.q.copy()
            q[-1] *= 0.9999
            return state._replace(pose=state.pose._replace(q=q))

        part.step = drifting

    found = SnakeCampaign("helix", 2, 60, sabotage, ("pushing",)).run()
    assert found["violations"] > 0
    assert {"moved without a verdict"} == {failure["kind"] for failure in found["failures"]} - {"disagreement"}
