"""The attack of `vfix bench certify`, short: nothing gets past the certificate, and the judges would see it if it did.

HAZ-01, HAZ-02, HAZ-03, HAZ-04, HAZ-05, HAZ-06: ten thousand adversarial steps over the 35 scenes that need no data
from outside and 400 in the real head, each accepted pose measured again by brute force, a share of them by coal, and
the way between two poses fifty times finer near anatomy.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from benchmarks.attack.command import summary
from benchmarks.attack.rigid.arenas import BUILDERS
from benchmarks.attack.rigid.episodes import CHOSEN, RigidCampaign
from vfix_engine.control import Controller, qp
from vfix_engine.virtual_fixtures import StepState

PHANTOM, REAL_HEAD = "phantom", "real head"
STEPS, HEAD_STEPS = 290, 400  # of each scene
SEED = 20261121
EVERY_CHANNEL = "hand: every channel"
ONE_CHANNEL = tuple(name for name in CHOSEN if name != EVERY_CHANNEL)  # what each does alone is measured without it
HEAD_SEED = 2  # of the real head: a run that leans on bone, in a space that is wide for most seeds


@pytest.fixture(scope="module")
def attacked() -> list[dict[str, Any]]:
    """What the attack found in every scene but the real head."""
    names = [name for name in BUILDERS if name != REAL_HEAD]
    sizes = [HEAD_STEPS if name == PHANTOM else STEPS for name in names]
    return [
        RigidCampaign(*one, assaults=ONE_CHANNEL).run() for one in zip(names, [SEED] * len(names), sizes, strict=True)
    ]


def assert_promises_kept(total: dict[str, Any]) -> None:
    """No failure, no scene left out, nothing deeper than rounding."""
    assert total["failures"] == []
    assert total["missing"] == {}
    for count in ("violations", "nan", "replay_hits", "limit_violations", "disagreements", "exceptions"):
        assert total[count] == 0, count
    assert total["deepest_mm"] <= 1e-9
    assert total["correct"]
    judged, past = total["limits_judged"], total["steps"] - total["limits_judged"] - total["exceptions"]
    assert total["limits_judged_share"] == judged / total["steps"]
    assert total["limits_judged_share"] > 0.5
    assert total["emergency_share"] == total["emergencies"] / judged
    assert total["beyond_limits"] <= past  # past the program the certificate is asked alone, and knows none


def test_no_accepted_motion_breaks_what_is_promised(attacked: list[dict[str, Any]]) -> None:
    total = summary(RigidCampaign, attacked)
    assert_promises_kept(total)
    assert total["beyond_limits"] > 0
    assert (total["scenes"], total["steps"]) == (35, 34 * STEPS + HEAD_STEPS)  # 10,260: the figure that safety.md tells


def test_no_accepted_motion_in_the_real_head_breaks_what_is_promised(trial_data: object) -> None:
    total = summary(RigidCampaign, [RigidCampaign(REAL_HEAD, HEAD_SEED, HEAD_STEPS, assaults=ONE_CHANNEL).run()])
    assert_promises_kept(total)
    assert (total["steps"], total["scenes"]) == (HEAD_STEPS, 1)
    assert total["moved"] > 200
    assert total["replayed"] > 0


@pytest.mark.parametrize("scene", ["wall", "soup", "lattice", "cavern"])
def test_every_channel_at_once_breaks_nothing(scene: str) -> None:
    """HAZ-01, HAZ-05, HAZ-11: grip, keys, master and rate device, unplugged and back, modes changed within a step."""
    total = summary(RigidCampaign, [RigidCampaign(scene, SEED, 600, assaults=(EVERY_CHANNEL,)).run()])
    assert_promises_kept(total)
    assert total["moved"] > 100
    assert set(total["used"]) >= {EVERY_CHANNEL}


def test_the_attack_is_one(attacked: list[dict[str, Any]]) -> None:
    """It presses against the margin, is held, is replayed, measured again by coal, and reaches every ingress."""
    total = summary(RigidCampaign, attacked)
    assert total["least_room_mm"] < 0.013
    assert total["held"] > 500
    assert total["moved"] > 5_000
    assert total["replayed"] > 1_000
    assert total["remeasured"] >= 0.09 * total["steps"]
    assert total["inside_starts"] > 0
    used = total["used"]
    assert len([name for name in used if name.startswith("hand")]) >= 10
    assert {"past the program", "rows", "lying solver", "mode: free", "mode: path", "mode: inspect"} <= set(used)


def test_the_same_seed_makes_the_same_motions() -> None:
    """HAZ-13."""
    hashes = {RigidCampaign("soup", 3, 400, with_coal=False).run()["hash"] for _ in range(3)}
    assert len(hashes) == 1
    assert hashes != {RigidCampaign("soup", 4, 400, with_coal=False).run()["hash"]}


Certify = Callable[[StepState, np.ndarray], StepState | None]


def with_certificate(replace: Callable[[Controller, Certify], Certify]) -> Callable[[Controller], None]:
    """A sabotage that puts another certificate in the place of the controller's own."""

    def sabotage(controller: Controller) -> None:
        context: Any = controller.context
        context.certify = replace(controller, context.certify)
        controller.solver = qp.DAQP  # the step by 'dual' asks the certificate's kernel itself

    return sabotage


def _predicted(controller: Controller, state: StepState, step: np.ndarray) -> StepState | None:
    if not np.isfinite(step).all() or np.abs(step).max() > 1e6:
        return None
    return controller.context.measure(state.q + step, step / controller.settings.dt_s)


def no_sweep(controller: Controller, honest: Certify) -> Certify:
    """Judges the pose where the motion ends and not the way to it."""

    def certify(state: StepState, step: np.ndarray) -> StepState | None:
        after = _predicted(controller, state, step)
        floor = np.minimum(state.distance[0], controller.settings.margin_mm)
        return after if after is not None and (after.distance[0] >= floor).all() else None

    return certify


def less_margin(controller: Controller, honest: Certify) -> Certify:
    """Keeps 0.05 mm less than the margin, on the way as well."""
    lax: Any = Controller(
        controller.robot,
        controller.tool,
        controller.tree,
        controller.settings.clamped(margin_mm=controller.settings.margin_mm - 0.05),
    )

    def certify(state: StepState, step: np.ndarray) -> StepState | None:
        there = lax.context.measure(state.q, state.velocity)
        after = lax.context.certify(there, step) if np.isfinite(step).all() else None
        return None if after is None else controller.context.measure(after.q, after.velocity)

    return certify


def told_too_far(controller: Controller, honest: Certify) -> Certify:
    """Tells 0.01 mm more distance than there is."""

    def certify(state: StepState, step: np.ndarray) -> StepState | None:
        after = honest(state, step)
        if after is not None:
            object.__setattr__(after, "distance", after.distance + 0.01)
        return after

    return certify


def no_speed(controller: Controller, honest: Certify) -> Certify:
    """Makes every motion three times as long."""
    return lambda state, step: honest(state, 3.0 * step)


@pytest.mark.parametrize(
    ("broken", "scene", "assault", "what"),
    [
        (no_sweep, "thin plates", "past the program", "replay_hits"),
        (no_sweep, "lattice", "past the program", "replay_hits"),
        (less_margin, "wall", "past the program", "violations"),
        (less_margin, "cavern", "past the program", "violations"),
        (told_too_far, "wall", "hand: jumps", "disagreements"),
        (no_speed, "nothing near", "hand: saturated", "limit_violations"),
    ],
)
def test_a_broken_certificate_is_found_out(
    broken: Callable[[Controller, Certify], Certify], scene: str, assault: str, what: str
) -> None:
    found = RigidCampaign(scene, 1, 800, sabotage=with_certificate(broken), assaults=(assault,)).run()
    assert found[what] > 0
    assert found["failures"]
    assert not summary(RigidCampaign, [found])["correct"]
