"""Keys that are held: on a page that is throttled by six, and lost (HAZ-11)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest
from held_key import HeldKey
from onlooker import Onlooker
from workstation import TOKEN, Planner, Rest, Workstation

pytestmark = pytest.mark.browser

HELD_S = 2.0
QUIET_S = 0.6  # six times as long as a force lasts
SLOW_GAIN = {"values": {"gain_mm_per_s_per_n": 1.0}}  # the path is longer than what is driven here

LOSSES = {
    "frame blurred": "document.getElementById('scene').contentWindow.dispatchEvent(new Event('blur'))",
    "window blurred": "document.hasFocus = () => false; window.dispatchEvent(new Event('blur'))",
    "page hidden": "window.dispatchEvent(new Event('pagehide'))",
}

# Once this has returned, the page hears nothing for a second; then it notes the moment, in seconds since 1970.
HANG = """() => setTimeout(() => {
  const end = performance.now() + 1200;
  while (performance.now() < end);
  window.hungUntil = Date.now() / 1000;
})"""


@pytest.fixture(scope="module")
def plan_id(planner: Planner) -> Iterator[str]:
    """For both tests: the plans of a test that has `rest` are deleted after it."""
    rest = Rest(planner.base, TOKEN)
    yield rest.copy_of_sample("Held keys")
    rest.delete_plans()
    rest.client.close()


@pytest.fixture(scope="module")
def driven(open_shared: Callable[..., Workstation], plan_id: str) -> Workstation:
    """A page whose robot runs, for both tests."""
    station = open_shared().ready()
    station.open_plan(plan_id)
    station.start()
    station.page.evaluate("(gain) => vfix.request('rehearsal.settings', gain)", SLOW_GAIN)
    return station


def test_a_held_key_drives_a_slow_page_and_a_late_one_moves_nothing(
    driven: Workstation, planner: Planner, plan_id: str
) -> None:
    """A slice has the focus, whose crosshair the key moves otherwise.

    The scene is not drawn: how much of two cores software takes for it depends on what else they do.
    """
    station = driven
    page, key = station.page, HeldKey(station.page)
    page.focus(".slice-stage[data-axis=axial]")
    with Onlooker(planner.base, TOKEN, plan_id) as onlooker:

        def driven_mm() -> float:
            before = onlooker.progress_mm
            key.hold_for(HELD_S)
            onlooker.wait_until(time.time() + QUIET_S)
            return onlooker.progress_mm - before

        idle = driven_mm()
        page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": 6})
        slow = 0.0
        for _ in range(3):  # what else the machine does meanwhile takes more from one of them than from another
            slow = max(slow, driven_mm())
            if slow > idle / 2:
                break
        print(f"{idle:.2f} mm by the idle page, {slow:.2f} mm by the slow one, in {HELD_S:g} s each")
        assert slow > idle / 2 > 0

        key.down()
        onlooker.wait_for_motion(lambda: key.down(repeat=True))
        page.evaluate(HANG)
        key.repeat_for(0.5)
        key.up()
        hung_until = station.wait_for("the page to answer", lambda: page.evaluate("window.hungUntil ?? null"))
        onlooker.wait_until(hung_until + QUIET_S)
        assert onlooker.last_motion() < hung_until, "a key that had come up while the page hung drove"

        begun = time.time()
        for _ in range(20):
            key.down(repeat=True, age_s=0.5)
        station.drawn()
        onlooker.wait_until(time.time() + QUIET_S)
        assert onlooker.last_motion() < begun, "old repeats drove"
    assert station.errors == []


def test_a_key_whose_release_is_never_heard_lets_go(driven: Workstation) -> None:
    """The key is down in the scene when another window takes the focus; its release goes there."""
    station = driven.see_scene()
    for how, lose in LOSSES.items():
        station.page.evaluate("document.getElementById('scene').contentWindow.focus()")
        begin = station.rehearsal()["progress_mm"]
        station.drive_until("w", f"motion: {how}", lambda end=begin + 0.5: station.rehearsal()["progress_mm"] > end)
        station.page.evaluate(lose)
        stood_at = station.rehearsal_after(600)["tip"]
        assert station.rehearsal_after(800)["tip"] == stood_at, how
        assert not station.rehearsal()["path_done"]
        station.page.keyboard.up("w")
        station.page.evaluate("delete document.hasFocus")
    assert station.errors == []
