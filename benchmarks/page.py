"""The page on a slow machine: what the planner publishes while a path point is dragged, and what it costs.

The middle point of the sample is dragged around a circle in a slice, sixty positions per second, in a real browser:
once at the speed of this machine, and once with the page's thread throttled by the browser, as its developer tools do.
The scene is left out, since without a graphics card its drawing would dominate the measurement.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from app.browsers import find_browser
from app.extras import has_app, need_app
from benchmarks import report
from benchmarks.planner import GIVE_UP_S, planner

if TYPE_CHECKING:
    from playwright.sync_api import CDPSession, Page

SUMMARY = "what the page costs a slow machine while a path point is dragged"
HEAD, SAMPLE = "head-phantom", "head-phantom-sample"
_RADIUS_PX = 24.0  # of the circle
_TURNS_PER_S = 0.5
_EVERY_S = 1.0 / 60.0
_LOOK_MS = 50.0

# Keeps the scene's frame empty, and records what the planner publishes and what blocks the page.
_BEFORE = """
const source = Object.getOwnPropertyDescriptor(HTMLIFrameElement.prototype, "src");
Object.defineProperty(HTMLIFrameElement.prototype, "src", { ...source, set() {} });
window.published = [];
window.Worker = class extends Worker {
  constructor(...words) {
    super(...words);
    this.addEventListener("message", ({ data }) => {
      if (data.kind === "message" && JSON.parse(data.text).type === "state") window.published.push(data.text.length);
    });
  }
};
window.blocked = [];
new PerformanceObserver((list) => { for (const { duration } of list.getEntries()) window.blocked.push(duration); })
  .observe({ type: "longtask" });
"""
_READY = """() => {
  const { state, slices } = window.vfix ?? {};
  return Boolean(state?.case && !state.case.loading && slices.link.ready && state.corridor?.state === "current");
}"""
_GO_TO_POINT = """() => {
  const { points } = vfix.state.plan;
  const { position } = points[Math.floor(points.length / 2)];
  vfix.slices.crosshair.move(position);
  return position;
}"""
# Position of the point in the axial slice, in page coordinates; null until the slice has reached it.
_DRAWN = """(position) => {
  const { port, stage } = vfix.slices.panes[0];
  const at = port?.project(position);
  const box = stage.getBoundingClientRect();
  return at && Math.abs(at.away) < 0.6 ? { x: box.x + at.x, y: box.y + at.y } : null;
}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: how slow a machine, and for how long."""
    parser.add_argument("--slow", type=float, default=6.0, help="how many times slower (default 6)")
    parser.add_argument("--seconds", type=float, default=10.0, help="of each drag (default 10)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return the publishes and their cost for a drag at the speed of this machine, and for one on a slower machine.

    Raises:
        BenchmarkRefused: no browser or Playwright is installed, or a number makes no sense.
        AppMissing: the page and the server are not installed.
    """
    if not has_app():
        raise need_app("vfix bench page")
    if not 1.0 <= args.slow <= 100.0 or not 0.5 <= args.seconds <= 600.0:
        raise report.BenchmarkRefused("--slow is 1 to 100, --seconds 0.5 to 600")
    machine = report.machine().to_dict()
    with fresh_page(1280, 800) as (page, address, version):
        open_plan(page, address, SAMPLE)
        drags = [drag(page, slow, args.seconds) for slow in (1.0, args.slow)]
    return {"machine": machine, "browser": version, "drags": drags}


@contextmanager
def fresh_page(width: int, height: int) -> Iterator[tuple[Page, str, str]]:
    """Yield a page of a browser, the address of a planner with a fresh home, and the browser's version.

    Raises BenchmarkRefused if no browser or Playwright is installed.
    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise report.BenchmarkRefused(
            "this benchmark drives a browser with Playwright, which is not installed: pip install 'vfix[test]'"
        ) from None
    path = find_browser()
    if path is None:
        raise report.BenchmarkRefused("there is no Chrome, Chromium or Edge here; VFIX_BROWSER names one")
    with (
        tempfile.TemporaryDirectory(prefix="vfix-page-") as home,
        planner({"VFIX_HOME": home}) as (address, _),
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
        yield (
            browser.new_page(viewport={"width": width, "height": height}, accept_downloads=True),
            address,
            browser.version,
        )
        browser.close()


def open_plan(page: Page, address: str, plan_id: str) -> None:
    """Open a plan of the shipped head on the page, and wait until it is shown with its verdict."""
    opened = json.dumps(json.dumps({"case": HEAD, "plan": plan_id, "step": "plan"}))
    page.add_init_script(f'sessionStorage.setItem("vfix-open", {opened});{_BEFORE}')
    page.goto(address)
    await_true(page, _READY)


def drag(page: Page, slow: float, seconds: float) -> dict[str, Any]:
    """Drag the middle point on a page that is slowed down by a factor, and return figures of the page.

    Afterwards the point is at its initial position.
    """
    at = await_true(page, _DRAWN, page.evaluate(_GO_TO_POINT))
    page.mouse.move(at["x"], at["y"])
    page.mouse.down()
    tools = page.context.new_cdp_session(page)
    tools.send("Performance.enable")
    tools.send("Emulation.setCPUThrottlingRate", {"rate": slow})
    page.evaluate("() => { published.length = blocked.length = 0; }")
    before, began, moves = _metrics(tools), time.perf_counter(), 0
    while (passed := time.perf_counter() - began) < seconds:
        turn = 2.0 * math.pi * _TURNS_PER_S * passed
        page.mouse.move(at["x"] + _RADIUS_PX * math.sin(turn), at["y"] + _RADIUS_PX * (1.0 - math.cos(turn)))
        moves += 1
        time.sleep(max(0.0, _EVERY_S * moves - (time.perf_counter() - began)))
    spent = {name: value - before[name] for name, value in _metrics(tools).items()}
    published, blocked = page.evaluate("() => [published, blocked]")
    tools.send("Emulation.setCPUThrottlingRate", {"rate": 1})
    tools.detach()
    page.mouse.move(at["x"], at["y"])
    page.mouse.up()
    count, lasted = len(published), spent["Timestamp"]
    per_publish = {
        f"{words}_ms_per_publish": 1000.0 * sum(spent[name] for name in names) / count if count else None
        for words, names in (("scripting", ["ScriptDuration"]), ("layout", ["LayoutDuration", "RecalcStyleDuration"]))
    }
    return {
        "slowed_by": slow,
        "moves_per_s": moves / lasted,
        "publishes_per_s": count / lasted,
        "bytes_per_publish": statistics.median(published) if count else None,
        **per_publish,
        "busy_share": spent["TaskDuration"] / lasted,
        "longest_task_ms": max(blocked, default=0.0),
    }


def _metrics(tools: CDPSession) -> dict[str, float]:
    """Return the seconds of the page's thread since its start, by purpose."""
    return {one["name"]: one["value"] for one in tools.send("Performance.getMetrics")["metrics"]}


def await_true(page: Page, look: str, argument: Any = None) -> Any:
    """Wait until a script returns a true value, and return it; the page's policy forbids `wait_for_function`."""
    end = time.monotonic() + GIVE_UP_S
    while time.monotonic() < end:
        answer = page.evaluate(look, argument)
        if answer:
            return answer
        page.wait_for_timeout(_LOOK_MS)
    raise report.BenchmarkRefused("the page does not show the plan here; see vfix doctor")
