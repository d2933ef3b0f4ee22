"""The Rehearse step in a real browser: the handle, the lease, a lost hand, inspection."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Playwright
from workstation import NO_ANTIALIASING, TOKEN, VIEWPORT, Onlooker, Planner, Rest, Workstation, launch

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

PULL = (-10.0, -28.0)  # [px] up and a little out: along the first part of the sample's path
TIP_ERROR_MM = 0.05
STILL_S = 1.5  # fifteen times as long as a force lasts without heartbeats
LOSSES = {
    "frame blurred": "document.getElementById('scene').contentWindow.dispatchEvent(new Event('blur'))",
    "window blurred": "document.hasFocus = () => false; window.dispatchEvent(new Event('blur'))",
    "page hidden": "window.dispatchEvent(new Event('pagehide'))",
}


def test_the_handle_is_dragged_and_the_tip_stays_on_the_path(open_page: Open, rest: Rest) -> None:
    """Start, drag, hold still for two seconds (HAZ-11: a still hand keeps pushing), let go, drive by key, reset."""
    station = open_page().ready()
    station.open_plan(rest.copy_of_sample("Driven"))
    station.start()
    assert station.rehearsal()["mine"] is True
    station.grab(PULL)
    station.wait_for("force", lambda: station.rehearsal()["force_n"] > 0.3)
    station.pull_until("progress", lambda: station.rehearsal()["progress_mm"] > 1.0)

    held_since = time.monotonic()

    def held() -> bool:
        """Without a move of the pointer; a busy machine may lose the hand, which then takes hold anew."""
        nonlocal held_since
        now = station.rehearsal()
        assert now["tip_error_mm"] < TIP_ERROR_MM
        assert now["clearance_mm"] >= now["margin_mm"] - 1e-3
        if now["force_n"] < 0.3:
            held_since = time.monotonic()
            station.hold_on()
        return time.monotonic() - held_since > STILL_S

    station.wait_for("a hand that is held still and goes on pushing", held)
    station.picture("rehearse")
    station.page.mouse.up()
    station.wait_for("no force", lambda: station.rehearsal()["force_n"] == 0)

    driven = station.rehearsal()["progress_mm"]
    station.drive_until("ArrowUp", "the key to drive", lambda: station.rehearsal()["progress_mm"] > driven + 3.0)
    assert station.rehearsal()["tip_error_mm"] < TIP_ERROR_MM
    station.page.keyboard.up("ArrowUp")
    station.page.click(".details > button")
    assert station.page.locator("#details-sheet").is_visible()
    assert station.state("details")["steps"] > 100
    station.page.click("#reset")
    station.wait_for("the entry", lambda: station.rehearsal()["progress_mm"] < 0.1)
    assert station.errors == []


AGES = """
(seconds) => new Promise((resolve) => {
  const ages = [];
  let shown = null;
  const end = performance.now() + 1000 * seconds;
  const look = () => {
    const taken = vfix.state.rehearsal?.taken_ms ?? null;
    // how old a figure has become when the next one takes its place
    if (shown !== null && taken !== null && taken !== shown) ages.push(Date.now() - shown);
    shown = taken;
    if (performance.now() < end) requestAnimationFrame(look);
    else resolve(ages.sort((a, b) => a - b));
  };
  requestAnimationFrame(look);
})
"""


def test_the_figures_on_the_page_say_when_they_were_taken(open_page: Open, rest: Rest) -> None:
    """While the robot moves new ones replace them; how old they became is printed, since a busy machine draws late."""
    station = open_page().ready()
    station.open_plan(rest.copy_of_sample("Young figures"))
    station.start()
    station.drive_until("ArrowUp", "motion", lambda: station.rehearsal()["progress_mm"] > 1.0)
    ages = station.page.evaluate(AGES, 3.0)
    station.page.keyboard.up("ArrowUp")
    print(f"replaced after {ages[len(ages) // 2]} ms (median), {ages[int(0.95 * (len(ages) - 1))]} ms (95 %)")
    assert len(ages) > 10
    assert ages[0] > 0  # taken before they are shown, by one clock


def test_one_window_holds_the_handle_and_the_other_watches(open_page: Open, rest: Rest) -> None:
    """HAZ-12: a watcher cannot move the robot, but may pause it; the handle goes over when its holder lets go."""
    plan_id = rest.copy_of_sample("Watched")
    driver, watcher = open_page().ready(), open_page().ready()
    for station in (driver, watcher):
        station.open_plan(plan_id)
    driver.start()
    watcher.page.click("[data-step=rehearse]")
    watcher.wait_for("the other's robot", lambda: watcher.rehearsal()["state"] == "running")
    assert watcher.rehearsal()["mine"] is False
    watcher.wait_for("its words", lambda: "holds the handle" in watcher.page.locator("#panel").inner_text())
    assert watcher.page.locator("#lease").is_disabled()
    watcher.page.click("#start")
    driver.wait_for("the watcher's pause", lambda: driver.rehearsal()["state"] == "ready")  # it had not moved yet
    watcher.wait_for("the same", lambda: watcher.rehearsal()["state"] == "ready")
    watcher.wait_for("a button that only the holder may press", lambda: watcher.page.locator("#start").is_disabled())
    driver.page.click("#start")
    watcher.wait_for("the robot to run", lambda: watcher.rehearsal()["state"] == "running")
    assert watcher.page.locator("[aria-label^='Safety margin']").is_disabled()
    watcher.page.keyboard.down("ArrowUp")
    watcher.page.wait_for_timeout(600)
    watcher.page.keyboard.up("ArrowUp")
    assert watcher.rehearsal()["progress_mm"] < 0.1, "a watcher's key moved the robot"

    driver.page.click("#lease")
    watcher.wait_for("the handle to be free", lambda: watcher.rehearsal()["can_take"])
    watcher.page.click("#lease")
    watcher.wait_for("the handle", lambda: watcher.rehearsal()["mine"])
    driver.wait_for("the loss", lambda: not driver.rehearsal()["mine"])
    seen = "motion, seen by the one who watches now"
    watcher.drive_until("ArrowUp", seen, lambda: driver.rehearsal()["progress_mm"] > 1.0)
    watcher.page.keyboard.up("ArrowUp")


def test_the_tool_stands_still_when_the_page_freezes_in_the_middle_of_a_drag(
    playwright: Playwright, planner: Planner, artefacts: Path, rest: Rest
) -> None:
    """HAZ-11: the page's processes are stopped, their sockets stay open; the tool stands within 200 ms."""
    browser = launch(playwright)
    try:
        context = browser.new_context(viewport=VIEWPORT)
        context.add_init_script(NO_ANTIALIASING)
        page = context.new_page()
        page.set_default_timeout(60_000)
        page.goto(f"{planner.base}/?token={TOKEN}")
        station = Workstation(page, artefacts).ready()
        plan_id = rest.copy_of_sample("Frozen")
        station.open_plan(plan_id)
        station.start()
        station.grab((PULL[0] * 4, PULL[1] * 4))  # far, so that the pull lasts
        station.pull_until("motion", lambda: station.rehearsal()["progress_mm"] > 1.0)
        processes = browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
        renderers = [process["id"] for process in processes if process["type"] == "renderer"]
        with Onlooker(planner.base, TOKEN, plan_id) as onlooker:
            onlooker.wait_for_motion(station.hold_on)
            frozen_at = time.monotonic()
            for pid in renderers:
                os.kill(pid, signal.SIGSTOP)
            time.sleep(1.2)
            for pid in renderers:
                os.kill(pid, signal.SIGKILL)
            moved_until = onlooker.last_motion()
        assert moved_until - frozen_at < 0.2 + onlooker.INTERVAL_S
    finally:
        browser.close()


@pytest.mark.parametrize("how", ["frame blurred", "window blurred", "page hidden"])
def test_a_key_whose_release_is_never_heard_lets_go(open_page: Open, rest: Rest, how: str) -> None:
    """HAZ-11: the key is down in the scene when another window takes the focus; its release goes there."""
    station = open_page().ready()
    station.open_plan(rest.copy_of_sample("Switched away"))
    station.start()
    station.page.evaluate("document.getElementById('scene').contentWindow.focus()")
    station.drive_until("w", "motion", lambda: station.rehearsal()["progress_mm"] > 1.0)
    station.page.evaluate(LOSSES[how])
    station.page.wait_for_timeout(600)
    stood_at = station.rehearsal()["tip"]
    station.page.wait_for_timeout(800)
    assert station.rehearsal()["tip"] == stood_at
    assert not station.rehearsal()["path_done"]
    station.page.keyboard.up("w")
    assert station.errors == []


def test_a_target_is_inspected_at_the_end_of_the_path(open_page: Open, rest: Rest) -> None:
    """Drive to the end, choose Inspect, pull: the view point comes onto the target and stays while the tool swings."""
    station = open_page().ready()
    plan_id = rest.copy_of_sample("Inspected")
    names = [target["label"] for target in rest.plan(plan_id)["targets"]]
    station.open_plan(plan_id)
    station.start()
    quick = {"values": {"gain_mm_per_s_per_n": 5.0}}
    station.page.evaluate("(quick) => vfix.request('rehearsal.settings', quick)", quick)
    gain = station.page.locator("[aria-label^='Admittance gain']")
    station.wait_for("the slider to show it", lambda: gain.input_value() == "5")
    assert rest.plan(plan_id)["settings"]["gain_mm_per_s_per_n"] == 5.0
    station.drive_until("ArrowUp", "the end of the path", lambda: station.rehearsal()["path_done"], patience_s=120.0)
    station.page.keyboard.up("ArrowUp")
    station.page.select_option("[aria-label='Target to inspect']", label=names[names.index("pharyngeal wall")])
    station.wait_for("inspection", lambda: station.rehearsal()["mode"] == "inspect")
    station.grab((6.0, -34.0))
    station.pull_until("the target", lambda: station.rehearsal()["phase"] == "inspect_hold")
    station.picture("inspect")
    began = time.monotonic()
    while time.monotonic() - began < 1.5:
        now = station.rehearsal()
        assert now["target_error_mm"] < 0.05
        station.page.wait_for_timeout(50)
    station.page.mouse.up()

    others = [target for target in rest.plan(plan_id)["targets"] if target["label"] != "pharyngeal wall"]
    rest.client.delete(f"/api/plans/{plan_id}/points/{others[0]['id']}").raise_for_status()
    panel = station.page.locator("#panel")
    station.wait_for("a word of it", lambda: "plan has changed" in panel.inner_text())
    assert [target["label"] for target in station.state("driven")["targets"]] == names, "what is driven is shown"
    station.page.select_option("[aria-label='Target to inspect']", label=others[1]["label"])
    station.wait_for("the target of that name", lambda: station.rehearsal()["target_id"] == others[1]["id"])
    assert station.rehearsal()["mode"] == "inspect"
    station.page.click("#reset")
    station.wait_for("the plan as it is now", lambda: station.rehearsal()["state"] == "ready")
    assert (station.state("driven"), station.rehearsal()["plan_changed"]) == (None, False)
    assert station.errors == []


def test_a_control_process_that_hangs_is_told_and_ended(open_page: Open, planner: Planner, rest: Rest) -> None:
    """Stopped by a signal: the page says so instead of 'running', a moved slider harms nothing, a click ends it."""
    station = open_page().ready()
    station.open_plan(rest.short_plan("Hanging", 3))
    before = set(_control_processes(planner))
    station.start()
    (pid,) = set(_control_processes(planner)) - before
    os.kill(pid, signal.SIGSTOP)
    change = "vfix.request('rehearsal.settings', { values: { force_cap_n: 2 + Math.random() } })"
    station.page.evaluate(f"(async () => {{ for (let n = 0; n < 100; n += 1) await {change}.catch(() => 0); }})()")
    panel = station.page.locator("#panel")
    station.wait_for("a word of it", lambda: "has not answered for" in panel.inner_text())
    assert "force_n" not in station.rehearsal()
    assert station.page.locator("#start").is_disabled()
    assert station.page.locator("#reset").inner_text() == "End the process"
    station.page.click("#reset")
    station.wait_for("the end", lambda: station.rehearsal()["state"] == "absent")
    assert pid not in _control_processes(planner)
    assert station.errors == []


def _control_processes(planner: Planner) -> list[int]:
    children = Path(f"/proc/{planner.process.pid}/task").glob("*/children")
    pids = [int(pid) for path in children for pid in path.read_text().split()]
    return [pid for pid in pids if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
