"""Keys that are held on a slow machine: the page is throttled by six, and software draws the scene (HAZ-11)."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest
from held_key import HeldKey
from onlooker import Onlooker
from workstation import TOKEN, Planner, Rest, Workstation

pytestmark = pytest.mark.browser

HELD_S = 4.0
QUIET_S = 0.6  # six times as long as a force lasts
SLOW_GAIN = {"values": {"gain_mm_per_s_per_n": 1.0}}  # the path is longer than what is driven here

# Once this has returned, the page hears nothing for a second; then it notes the moment, in seconds since 1970.
HANG = """() => setTimeout(() => {
  const end = performance.now() + 1200;
  while (performance.now() < end);
  window.hungUntil = Date.now() / 1000;
})"""


def test_a_held_key_drives_a_slow_page_and_a_late_one_moves_nothing(
    open_page: Callable[..., Workstation], planner: Planner, rest: Rest
) -> None:
    """A slice has the focus, whose crosshair the key moves otherwise."""
    station = open_page().ready()
    plan_id = rest.copy_of_sample("Held key")
    station.open_plan(plan_id)
    station.start()
    page, key = station.page, HeldKey(station.page)
    page.evaluate("(gain) => vfix.request('rehearsal.settings', gain)", SLOW_GAIN)
    page.focus(".slice-stage[data-axis=axial]")
    with Onlooker(planner.base, TOKEN, plan_id) as onlooker:

        def driven_mm() -> float:
            before = onlooker.progress_mm
            key.hold_for(HELD_S)
            onlooker.wait_until(time.time() + QUIET_S)
            return onlooker.progress_mm - before

        idle = driven_mm()
        page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": 6})
        slow = driven_mm()
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
