"""The status while the planner warms up, and steps that may fail."""

import threading

import pytest

from app.gateway.warm_up import WarmUp, WarmUpStep
from app.kit.errors import PlannerEnds


def test_words_tell_how_far_it_is() -> None:
    seen: list[str] = []
    shares = [0.25]

    def work() -> None:
        seen.append(warm_up.status.text)
        shares.append(0.5)
        seen.append(warm_up.status.text)

    warm_up = WarmUp((WarmUpStep(lambda: f"Preparing: {100 * shares[-1]:.0f} %", work),))
    assert (warm_up.status.text, warm_up.status.ready) == ("Getting ready", False)
    warm_up.start()
    assert warm_up.wait(60)
    assert seen == ["Preparing: 25 %", "Preparing: 50 %"]
    assert (warm_up.status.text, warm_up.status.ready) == ("", True)


def test_a_step_that_is_not_needed_is_not_taken() -> None:
    taken: list[str] = []
    warm_up = WarmUp(
        (
            WarmUpStep("one", lambda: taken.append("one"), needed=lambda: False),
            WarmUpStep("two", lambda: taken.append("two")),
        )
    )
    warm_up.start()
    assert warm_up.wait(60)
    assert taken == ["two"]


def test_what_nobody_waits_for_goes_on_beside_the_rest() -> None:
    begun, go_on, ended = threading.Event(), threading.Event(), threading.Event()

    def work() -> None:
        begun.set()
        go_on.wait(60)
        raise OSError("no room")  # for the log alone

    beside = (WarmUpStep("two", work), WarmUpStep("three", ended.set))
    warm_up = WarmUp((WarmUpStep("one", lambda: begun.wait(60)),), beside)
    warm_up.start()
    assert warm_up.wait(60)
    assert (warm_up.status.text, warm_up.status.ready) == ("", True)
    go_on.set()
    assert ended.wait(60)
    assert warm_up.status.failed == ""


def test_only_what_can_be_spared_may_fail() -> None:
    def fail() -> None:
        raise OSError("no room")

    optional = WarmUp((WarmUpStep("one", fail, optional=True), WarmUpStep("two", lambda: None)))
    optional.start()
    assert optional.wait(60)
    assert optional.status.ready
    broken = WarmUp((WarmUpStep("one", fail), WarmUpStep("two", lambda: None)))
    broken.start()
    assert broken.wait(60)
    assert not broken.status.ready
    assert broken.status.failed == "Getting ready failed: no room"
    assert broken.status.text == ""


def test_the_end_of_the_planner_is_no_failure(caplog: pytest.LogCaptureFixture) -> None:
    begun: list[str] = []

    def end() -> None:
        raise PlannerEnds

    for optional in (False, True):
        steps = (WarmUpStep("one", end, optional=optional), WarmUpStep("two", lambda: begun.append("two")))
        beside = (WarmUpStep("beside", end), WarmUpStep("after it", lambda: begun.append("after it")))
        warm_up = WarmUp(steps, beside, ends=(PlannerEnds,))
        warm_up.start()
        assert warm_up.wait(60)
        assert (warm_up.status.ready, warm_up.status.failed, begun) == (False, "", [])
    assert caplog.text == ""
