"""The Rehearse tab in a real browser: the handle, the lease, a page that freezes, inspection."""

from __future__ import annotations

import json
import os
import re
import signal
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from onlooker import Onlooker
from page_scripts import NO_ANTIALIASING
from playwright.sync_api import Page, Playwright, expect
from workstation import DRIVEN_S, PATIENCE_MS, ROOT, TOKEN, VIEWPORT, Planner, Rest, Workstation, launch

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

PULL = (-10.0, -28.0)  # [px] up and a little out: along the first part of the sample's path
TIP_ERROR_MM = 0.05
STILL_S = 1.5  # fifteen times as long as a force lasts without heartbeats


def test_the_soft_tissue_told_is_that_of_the_verdict(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    station.open_plan(rest.copy_of_sample("Told"))
    station.start()
    station.wait_for("the verdict", lambda: station.state("corridor")["state"] == "current", DRIVEN_S)
    verdict = "".join(part["words"] for part in station.state("corridor")["verdict"]["parts"])
    (along,) = re.findall(r"soft tissue along (\d+) mm", verdict)
    told = station.page.locator("p.words:not(.verdict-words)", has_text="Presses soft tissue")
    expect(told).to_be_visible()
    expect(told).to_contain_text(f"along {along} mm")


def test_the_handle_is_dragged_and_the_tip_stays_on_the_path(open_page: Open, rest: Rest) -> None:
    """Start, drag, hold still for two seconds (HAZ-11: a still hand keeps pushing), let go, drive by key, reset."""
    station = open_page().ready()
    station.open_plan(rest.copy_of_sample("Driven"))
    station.start()
    assert station.rehearsal()["mine"] is True
    station.grab(PULL)
    station.pull_until("force", lambda: station.rehearsal()["force_n"] > 0.3)
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
    station.page.keyboard.press("Control+k")
    expect(station.page.locator("#palette")).to_be_focused()
    station.page.keyboard.type("Figures of the control loop")
    station.page.keyboard.press("Enter")
    expect(station.page.locator("#details-sheet dd").last).to_have_text("5")
    assert station.state("details")["steps"] > 100
    station.page.keyboard.press("Escape")
    expect(station.page.locator("#details-sheet")).to_be_hidden()
    station.page.click("#reset")
    station.wait_for("the entry", lambda: station.rehearsal()["progress_mm"] < 0.1)
    assert station.errors == []


# What the planner said last, noted before the page gets it.
NEWEST = """
window.Worker = class extends Worker {
  constructor(...options) {
    super(...options);
    this.addEventListener("message", ({ data }) => {
      window.newest = JSON.parse(data.text ?? "{}").sections?.rehearsal ?? window.newest;
    });
  }
};
"""

# Whenever the figure on the page is written: what it shows, and the newest that has come. An observer is called right
# after the code that wrote it, so that no message comes between the two. For each frame in which a hand drives: when it
# is drawn, and when its figures were taken; null for the others. It lasts until enough is measured, on a busy machine
# longer than it is asked for.
SHOWN = """
([seconds, most]) => {
  const shown = [], frames = [], figure = document.querySelector("#panel .progress").previousElementSibling;
  const observer = new MutationObserver(() => shown.push({
    figure: Number(figure.textContent.split(" ")[0]),
    newest: Number(newest.progress_mm.toFixed(1)),
  }));
  observer.observe(figure, { childList: true, characterData: true, subtree: true });
  const end = performance.now() + 1000 * seconds, last = performance.now() + 1000 * most;
  const driven = () => frames.filter((frame, n) => n && frame && frames[n - 1]).length;
  const enough = () => new Set(shown.map((each) => each.figure)).size > 10 && driven() > 10;
  const goesOn = () => performance.now() < end || (performance.now() < last && !enough());
  const look = () => {
    frames.push(newest.force_n > 0 ? [performance.timeOrigin + performance.now(), newest.taken_ms] : null);
    if (goesOn()) requestAnimationFrame(look);
    else window.measured = [shown, frames];
  };
  requestAnimationFrame(look);
}
"""


@pytest.mark.parametrize("scene", ["whole", "small"])
def test_the_page_shows_the_newest_figures_that_have_come(open_page: Open, rest: Rest, scene: str) -> None:
    """HAZ-31: never an older one. How old they are is printed, since software paints the whole scene slowly."""
    station = open_page(script=NEWEST).see_scene()
    station.open_plan(rest.copy_of_sample(f"Young figures, {scene} scene"))
    station.start()
    if scene == "small":
        style = "; width: 160px !important; height: 120px !important; flex: none"
        station.page.evaluate("(style) => { document.getElementById('scene').style.cssText += style; }", style)
    station.drive_until("ArrowUp", "motion", lambda: station.rehearsal()["progress_mm"] > 1.0)
    station.page.evaluate(SHOWN, [4.0, 60.0])
    station.drive_until("ArrowUp", "the measurement", lambda: station.page.evaluate("Boolean(window.measured)"))
    station.page.keyboard.up("ArrowUp")
    shown, frames = station.page.evaluate("measured")
    figures = [each["figure"] for each in shown]
    assert figures == [each["newest"] for each in shown]
    assert len(set(figures)) > 10, "it moves"
    pairs = [(before, after) for before, after in pairwise(frames) if before and after]
    drawn = [now - taken for (now, taken), _ in pairs]
    replaced = [now - taken for (_, taken), (now, _) in pairs]
    rate = 1e3 / np.median([after[0] - before[0] for before, after in pairs])
    print(f"{scene} scene, {rate:.0f} frames/s: {_shares(drawn)} old when drawn, {_shares(replaced)} at the next frame")
    assert min(drawn) > 0  # taken before they are shown, by one clock
    assert station.errors == []


def _shares(ages: list[float]) -> str:
    return f"{np.median(ages):.0f} ms (median) and {np.quantile(ages, 0.95):.0f} ms (95 %)"


def test_one_window_holds_the_handle_and_the_other_watches(open_page: Open, rest: Rest) -> None:
    """HAZ-12: a watcher cannot move the robot, but may pause it; the handle goes over when its holder lets go."""
    plan_id = rest.copy_of_sample("Watched")
    driver, watcher = open_page().ready(), open_page().ready()
    for station in (driver, watcher):
        station.open_plan(plan_id)
    assigned(driver, plan_id)
    driver.start()
    watcher.page.click("[data-step=rehearse]")
    watcher.wait_for("the other's robot", lambda: watcher.rehearsal()["state"] == "running")
    assert watcher.rehearsal()["mine"] is False
    expect(watcher.page.locator("#panel")).to_contain_text("holds the handle", use_inner_text=True)
    expect(watcher.page.locator("#lease")).to_be_disabled()
    watcher.page.click("#start")
    driver.wait_for("the watcher's pause", lambda: driver.rehearsal()["state"] == "ready")  # it had not moved yet
    watcher.wait_for("the same", lambda: watcher.rehearsal()["state"] == "ready")
    expect(watcher.page.locator("#start"), "only the holder may press it").to_be_disabled()
    driver.page.click("#start")
    watcher.wait_for("the robot to run", lambda: watcher.rehearsal()["state"] == "running")
    expect(watcher.page.locator("[aria-label^='Safety margin']")).to_be_disabled()
    watcher.page.keyboard.down("ArrowUp")
    watcher.rehearsal_after(600)
    watcher.page.keyboard.up("ArrowUp")
    assert watcher.rehearsal_after(100)["progress_mm"] < 0.1, "a watcher's key moved the robot"

    driver.page.click("#lease")
    watcher.wait_for("the handle to be free", lambda: watcher.rehearsal()["can_take"])
    watcher.page.click("#lease")
    watcher.wait_for("the handle", lambda: watcher.rehearsal()["mine"])
    driver.wait_for("the loss", lambda: not driver.rehearsal()["mine"])
    seen = "motion, seen by the one who watches now"
    watcher.drive_until("ArrowUp", seen, lambda: driver.rehearsal()["progress_mm"] > 1.0)
    watcher.page.keyboard.up("ArrowUp")
    commented_while_watched(driver, watcher, rest)


def assigned(trainee: Workstation, plan_id: str) -> None:
    """The file of an assignment is opened: what it asks for is listed, and 3, 2, 1 before Start is called off."""
    page = trainee.page
    page.click("[data-step=rehearse]")
    criteria = {"max_time_s": 300, "max_contacts": 0, "completed": True}
    file = {"schema": "vfix-assignment/1", "name": "Once", "plan": {"id": plan_id}, "mode": "hands-on"}
    data = json.dumps({**file, "criteria": criteria, "countdown": True}).encode()
    page.set_input_files("#assignment-file", {"name": "wrong.json", "mimeType": "application/json", "buffer": b"{}"})
    expect(page.locator("#alerts")).to_contain_text("This is no assignment")
    page.get_by_role("button", name="Dismiss").click()
    page.set_input_files("#assignment-file", {"name": "once.json", "mimeType": "application/json", "buffer": data})
    expect(page.locator("#assignment-words")).to_have_text("Once: 0 of 1 passed")
    expect(page.locator("#assignment .criteria")).to_contain_text("≤ 300 s")
    expect(page.locator("#start")).to_be_enabled()
    page.click("#start")
    expect(page.locator(".countdown")).to_be_visible()
    assert trainee.rehearsal()["state"] == "ready", "placed before it counts"
    trainee.picture("countdown")
    page.keyboard.press("Escape")
    expect(page.locator(".countdown")).to_be_hidden()
    assert trainee.rehearsal()["state"] != "running"


def commented_while_watched(instructor: Workstation, trainee: Workstation, rest: Rest) -> None:
    """Who watches comments on the drive; the other reads it, and it is at its time in Review."""
    page, text = instructor.page, "Slower <b>past</b> the artery"
    page.fill("#drive-comment", text)
    page.keyboard.press("Enter")
    expect(trainee.page.locator("#drive-comments li")).to_contain_text(text)
    expect(trainee.page.locator("#notes")).to_contain_text(f"Comment: {text}")
    expect(page.locator("#notes")).not_to_contain_text("Comment:")
    expect(page.locator("#start")).to_have_text("Pause")
    instructor.picture("instructor")
    trainee.picture("trainee")
    page.click("#start")
    trainee.wait_for("the instructor's pause", lambda: trainee.rehearsal()["state"] == "paused")
    trainee.page.click("#finish-run")
    expect(page.locator("#end-card .assignment-verdict")).to_have_text("Not passed")
    expect(page.locator("#end-card .criteria")).to_contain_text("✓ 0, ≤ 0")
    instructor.picture("end-card-assignment")
    page.click("#run-replay")
    mark = page.locator(".timeline-comments button")
    expect(mark).to_have_attribute("title", text)
    (said,) = rest.client.get(f"/api/v1/runs/{_reviewed(page)}/comments").json()
    mark.click()
    expect(page.locator(".timeline-time")).to_contain_text(f"{said['t_s']:.1f} / ")
    page.fill("#run-comment", "Well held")
    page.keyboard.press("Enter")
    row = page.locator("#run-comments li").filter(has_text="Well held")
    row.get_by_label("Change comment").click()
    page.fill("#dialog input", "Held well")
    page.keyboard.press("Enter")
    expect(page.locator("#run-comments li")).to_have_count(2)
    expect(mark).to_have_count(2)
    instructor.picture("commented")
    page.locator("#run-comments li").filter(has_text="Held well").get_by_label("Delete comment").click()
    expect(mark).to_have_count(1)
    page.click("#show-results")
    expect(page.locator("table.results tbody tr")).to_have_count(1)
    instructor.picture("results")
    page.click("#show-plots")
    assert [one["text"] for one in rest.client.get(f"/api/v1/runs/{_reviewed(page)}").json()["comments"]] == [text]


def _reviewed(page: Page) -> str:
    """Id of the run that is open in Review."""
    return str(page.get_attribute("li[data-run][aria-current=true]", "data-run"))


def test_the_tool_stands_still_when_the_page_freezes_in_the_middle_of_a_drag(
    playwright: Playwright, planner: Planner, artefacts: Path, rest: Rest
) -> None:
    """HAZ-11: the page's processes are stopped, their sockets stay open; the tool stands within 200 ms."""
    browser = launch(playwright)
    try:
        context = browser.new_context(viewport=VIEWPORT)
        context.add_init_script(NO_ANTIALIASING)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
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
            for pid in renderers:
                os.kill(pid, signal.SIGSTOP)
            frozen_at = time.time()
            onlooker.wait_until(frozen_at + 1.2)
            for pid in renderers:
                os.kill(pid, signal.SIGKILL)
            moved_until = onlooker.last_motion()
        assert moved_until - frozen_at < 0.2 + onlooker.INTERVAL_S
    finally:
        browser.close()


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
    expect(gain).to_have_value("5")
    assert rest.plan(plan_id)["settings"]["gain_mm_per_s_per_n"] == 5.0
    twist = station.page.get_by_role("button", name="Twist ↻")
    expect(twist, "along the path the controller heeds no twist").to_be_disabled()
    station.drive_until("ArrowUp", "the end of the path", lambda: station.rehearsal()["path_done"], DRIVEN_S)
    station.page.keyboard.up("ArrowUp")
    station.slice_menu()
    expect(station.page.locator("#follow-tip")).to_be_checked()
    off = "Math.max(...vfix.state.slices.cross.map((at, axis) => Math.abs(at - vfix.state.rehearsal.tip[axis])))"
    station.wait_for("the slices at the tip", lambda: station.page.evaluate(off) < 1.0)
    station.page.uncheck("#follow-tip")
    station.page.select_option("[aria-label='Target to inspect']", label=names[names.index("pharyngeal wall")])
    station.wait_for("inspection", lambda: station.rehearsal()["mode"] == "inspect")
    along = station.page.get_by_text("mm along the path")
    expect(along, "a place on a path that is not followed any more").to_be_hidden()
    expect(twist, "nor does it heed one before the view point is on the target").to_be_disabled()
    station.grab((6.0, -34.0))
    station.pull_until("the target", lambda: station.rehearsal()["phase"] == "inspect_hold")
    station.picture("inspect")
    expect(twist).to_be_enabled()
    began = time.monotonic()
    while time.monotonic() - began < 1.5:
        now = station.rehearsal()
        assert now["target_error_mm"] < 0.05
        station.page.wait_for_timeout(50)
    station.page.mouse.up()

    others = [target for target in rest.plan(plan_id)["targets"] if target["label"] != "pharyngeal wall"]
    rest.client.delete(f"/api/v1/plans/{plan_id}/points/{others[0]['id']}").raise_for_status()
    expect(station.page.locator("#panel")).to_contain_text("plan has changed", use_inner_text=True)
    assert [target["label"] for target in station.state("driven")["targets"]] == names, "what is driven is shown"
    station.page.select_option("[aria-label='Target to inspect']", label=others[1]["label"])
    station.wait_for("the target of that name", lambda: station.rehearsal()["target_id"] == others[1]["id"])
    assert station.rehearsal()["mode"] == "inspect"
    station.page.click("#reset")
    now = lambda: (station.rehearsal()["state"], station.state("driven"), station.rehearsal()["plan_changed"])  # noqa: E731
    station.wait_for("the plan as it is now", lambda: now() == ("ready", None, False))
    assert station.errors == []


def test_robot_tool_and_remote_centre_are_chosen_with_keys_on_a_small_screen(
    open_page: Open, rest: Rest, tmp_path: Path
) -> None:
    """A URDF that cannot reach names its joint; undo brings robot and tool back; the page says what holds the tool."""
    station = open_page(viewport={"width": 1024, "height": 700}).ready()
    plan_id = rest.copy_of_sample("By keys")
    station.open_plan(plan_id)
    page, own = station.page, tmp_path / "short.urdf"
    own.write_text(short_arm(), encoding="utf-8")
    station.tab_to("[data-step-name=path] > summary")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    station.tab_to("#plan-tool")
    page.keyboard.press("S")  # the one whose name begins so
    station.wait_for("the tool", lambda: station.state("plan")["tool"]["name"] == "straight_pointer")
    station.tab_to("#upload-robot")
    station.choose_file("Space", "#urdf-file", own)
    station.wait_for("the robot", lambda: station.state("plan")["robot"]["name"] == "short")
    expect(page.locator("#tool-frame")).to_be_visible()
    expect(page.locator("#tool-frame")).to_have_value("tool_frame")
    within = "document.documentElement.scrollWidth <= innerWidth"
    station.wait_for("nothing beside the page", lambda: page.evaluate(within))
    limit = "joint 2 (shoulder_pitch) at its limit"
    expect(page.locator("#verdict-words")).to_contain_text(limit, timeout=1000.0 * DRIVEN_S)
    station.tab_to("#plan-tool", back=True)  # a list that has the focus leaves undo to the plan
    page.keyboard.press("Control+z")
    station.wait_for("the robot before", lambda: station.state("plan")["robot"]["name"] == "steady_hand")
    page.keyboard.press("Control+z")
    station.wait_for("the tool before", lambda: station.state("plan")["tool"]["name"] == "bent_30")
    assert len(rest.plan(plan_id)["points"]) == len(rest.sample()["points"])
    page.keyboard.press("Control+Shift+Z")
    station.wait_for("the tool again", lambda: station.state("plan")["tool"]["name"] == "straight_pointer")

    station.tab_to("[data-step=rehearse]", back=True)
    assert page.evaluate("document.getElementById('panel').scrollTop = 300"), "there is something to scroll"
    page.keyboard.press("Enter")
    station.wait_for("the panel from its top", lambda: page.evaluate("document.getElementById('panel').scrollTop") == 0)
    expect(page.locator("[data-option=remote_centre]")).to_be_enabled()
    station.tab_to("[data-option=remote_centre]")
    page.keyboard.press("Space")
    station.wait_for("its place", lambda: (station.state("options")["centre"] or {}).get("at_mm"))
    expect(page.locator("#centre-mm")).to_have_value("7")
    expect(page.locator("#centre-place")).to_have_value("entry")
    centre = "Simulated with the remote centre at 7.0 mm"
    expect(page.locator("#verdict-words")).to_contain_text(centre, timeout=1000.0 * DRIVEN_S)
    expect(page.locator("#start")).to_be_enabled()
    station.tab_to("#start", back=True)
    page.keyboard.press("Enter")
    station.wait_for("the robot", lambda: station.rehearsal()["state"] == "running")
    page.evaluate("vfix.request('rehearsal.settings', { values: { gain_mm_per_s_per_n: 1.0 } })")  # slow enough to read
    held = page.locator("#statusbar")
    station.drive_until("ArrowUp", "the centre to hold", lambda: "the remote centre" in held.inner_text())
    page.keyboard.up("ArrowUp")
    station.picture("remote-centre")
    assert station.rehearsal()["tip_error_mm"] < TIP_ERROR_MM
    assert station.errors == []


def short_arm() -> str:
    """The plain arm with a shoulder and an elbow that hardly move."""
    text = (ROOT / "assets" / "robots" / "arm_6.urdf").read_text(encoding="utf-8")
    for name in ("elbow_pitch", "shoulder_pitch"):
        limit = rf'(<joint name="{name}".*?<limit lower=")[^"]*(" upper=")[^"]*'
        text = re.sub(limit, r"\g<1>0.5\g<2>0.53", text, flags=re.DOTALL)
    return text


def test_a_control_process_that_hangs_is_told_and_ended(open_page: Open, planner: Planner, rest: Rest) -> None:
    """Stopped by a signal: the page says so instead of 'running', a moved slider harms nothing, a click ends it."""
    station = open_page().ready()
    station.open_plan(rest.short_plan("Hanging", 3))
    before = set(_control_processes(planner))
    station.start()
    new = lambda: set(_control_processes(planner)) - before  # noqa: E731
    station.wait_for("one control process more", lambda: len(new()) == 1)
    (pid,) = new()
    os.kill(pid, signal.SIGSTOP)
    change = "vfix.request('rehearsal.settings', { values: { force_cap_n: 2 + Math.random() } })"
    station.page.evaluate(f"(async () => {{ for (let n = 0; n < 100; n += 1) await {change}.catch(() => 0); }})()")
    expect(station.page.locator("#panel")).to_contain_text("has not answered for", use_inner_text=True)
    assert "force_n" not in station.rehearsal()
    expect(station.page.locator("#start")).to_be_disabled()
    expect(station.page.locator("#reset")).to_have_text("End process")
    station.page.click("#reset")
    station.wait_for("the end", lambda: station.rehearsal()["state"] == "absent")
    station.wait_for("no process", lambda: pid not in _control_processes(planner))
    assert station.errors == []


def _control_processes(planner: Planner) -> list[int]:
    children = Path(f"/proc/{planner.process.pid}/task").glob("*/children")
    return [int(pid) for path in children for pid in _read(path).split() if b"spawn_main" in _read_command(pid)]


def _read_command(pid: bytes) -> bytes:
    return _read(Path(f"/proc/{pid.decode()}/cmdline"))


def _read(path: Path) -> bytes:
    """A file of a thread or process, empty once that has ended."""
    try:
        return path.read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return b""


def test_one_click_changes_who_leads_the_tool_and_a_free_hand_is_told_in_colour(open_page: Open, rest: Rest) -> None:
    """At once among hands-on and teleoperated; to freehand the run ends, and the next begins at the entry (HAZ-41)."""
    station = open_page().ready()
    plan = rest.copy_of_sample("Three ways")
    station.open_plan(plan)
    station.start()
    page = station.page
    station.drive_until("ArrowUp", "the key to drive", lambda: station.rehearsal()["progress_mm"] > 1.0)
    page.keyboard.up("ArrowUp")
    page.click("[data-control=teleoperated]")
    station.wait_for("the mode", lambda: station.rehearsal()["control"]["mode"] == "teleoperated")
    assert (station.rehearsal()["state"], station.rehearsal()["progress_mm"] > 1.0) == ("running", True)
    before = station.rehearsal()["progress_mm"]
    station.grab(PULL)
    station.pull_until("the sphere as a master", lambda: station.rehearsal()["progress_mm"] > before + 1.0)
    page.mouse.up()
    station.picture("rehearse-teleoperated")
    page.click("[data-kind=rate]")
    station.wait_for("the device", lambda: station.rehearsal()["control"]["device"] == "rate")
    before = station.rehearsal()["progress_mm"]
    station.grab(PULL)
    station.pull_until("the sphere held aside", lambda: station.rehearsal()["progress_mm"] > before + 1.0)
    page.mouse.up()
    before = station.rehearsal()["progress_mm"]
    station.drive_until("ArrowUp", "the key at a device", lambda: station.rehearsal()["progress_mm"] > before + 1.0)
    page.keyboard.up("ArrowUp")
    assert station.rehearsal()["control"]["device"] == "rate", "it stays chosen with the mouse and with keys"

    page.fill("#approach-mm", "12")
    page.press("#approach-mm", "Tab")
    expect(page.locator("#approach-point")).to_have_value("")
    page.click("#approach-go")
    station.wait_for("the approach", lambda: station.rehearsal()["phase"] == "approach")
    page.select_option("#approach-point", index=1)
    expect(page.locator("#approach-mm")).to_have_value("10.7")
    page.click("#approach-go")
    arrived = lambda: station.rehearsal()["phase"] == "follow" and station.rehearsal()["progress_mm"] > 10.5  # noqa: E731
    station.drive_until("ArrowUp", "its place on the path", arrived)
    page.keyboard.up("ArrowUp")

    page.click("[data-control=freehand]")
    station.wait_for("the entry, in a free hand", lambda: station.rehearsal()["state"] == "ready", DRIVEN_S)
    expect(page.locator("#uncertified")).to_have_text("Without the certificate: nothing keeps the tool off bone.")
    expect(page.locator(".reading.alarm")).to_contain_text("without the certificate")
    expect(page.locator("#approach")).to_contain_text("Nothing leads a free hand")
    assert station.rehearsal()["control"]["certified"] is False
    station.start()
    station.grab(PULL)
    station.pull_until("the tool in the hand", lambda: station.rehearsal()["force_n"] > 0.3)
    page.mouse.up()
    station.drive_until("ArrowUp", "contact", lambda: bool(station.rehearsal()["contacts"]))
    expect(page.locator("#contacts li").first).to_contain_text("in bone")
    station.picture("rehearse-freehand")
    page.keyboard.up("ArrowUp")
    page.click("#finish-run")
    station.wait_for("the runs", lambda: len(rest.client.get(f"/api/v1/runs?plan_id={plan}").json()) == 2)
    assert [run["mode"] for run in rest.client.get(f"/api/v1/runs?plan_id={plan}").json()] == ["freehand", "mixed"]
    assert station.errors == []
