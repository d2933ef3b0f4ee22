"""HAZ-40: while a plan is simulated anew, all that is of the path before is dimmed and says 'updating', in full."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Planner, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

# What the page shows of the verdict at one moment. clipped: marks that are cut, or beyond what holds them.
SHOWN = """() => {
  const seen = (selector) => [...document.querySelectorAll(selector)].filter((one) => one.checkVisibility());
  const texts = (selector) => seen(selector).map((one) => one.innerText.trim());
  const has = (selector, name) => document.querySelector(selector)?.classList.contains(name) ?? null;
  const isClipped = (mark) => {
    const range = document.createRange();
    range.selectNodeContents(mark);
    const text = range.getBoundingClientRect();
    for (let box = mark; box && box.id !== "panel"; box = box.parentElement) {
      const { left, right, width } = box.getBoundingClientRect();
      if (width && (text.left < left - 1 || text.right > right + 1)) return true;
    }
    return false;
  };
  const marks = seen(".updating, .step-line, #tools-words").filter((one) => one.innerText.trim() === "updating");
  const level = (one) => getComputedStyle(one).getPropertyValue("--level");
  const card = document.getElementById("verdict");
  return {
    state: vfix.state.corridor.state,
    old: [has("#verdict", "stale"), has("#profile", "stale"), has("#tool-table", "earlier")],
    card: texts("#verdict-state"),
    lines: texts(":is([data-step-name=check], [data-step-name=export]) .step-line"),
    tools: texts("#tools-words"),
    coloured: [...card.querySelectorAll("[data-level]")].filter((one) => level(one) !== level(card)).length,
    marks: marks.length,
    clipped: marks.filter(isClipped).map((mark) => mark.outerHTML),
  };
}"""


@contextmanager
def waiting_for_the_verdict(station: Workstation, rest: Rest, planner: Planner, plan: str) -> Iterator[None]:
    """Move a point, and hold the planner before it has the verdict: by then the page shows what it shows meanwhile."""
    for number in range(1, 30):
        point = rest.plan(plan)["points"][3]
        x, y, z = point["position"]
        before = station.state("plan")["revision"]
        wish = {"position": [x, y, z + 0.01 * number]}
        rest.client.patch(f"/api/v1/plans/{plan}/points/{point['id']}", json=wish).raise_for_status()
        station.wait_for("the edit", lambda before=before: station.state("plan")["revision"] != before)
        os.kill(planner.process.pid, signal.SIGSTOP)
        try:
            station.drawn()
            if station.state("corridor")["state"] == "waits":
                yield
                return
        finally:
            os.kill(planner.process.pid, signal.SIGCONT)
        station.wait_for("the verdict", lambda: station.state("corridor")["state"] == "current", DRIVEN_S)
    raise AssertionError("no verdict was late enough to be seen waiting")


def test_all_figures_of_the_path_before_say_updating_in_full(open_page: Open, rest: Rest, planner: Planner) -> None:
    station = open_page(viewport={"width": 1440, "height": 900}).ready()
    page, plan = station.page, rest.copy_of_sample("Updating")
    station.open_plan(plan)
    current = lambda: (station.state("corridor") or {}).get("state") == "current"  # noqa: E731
    station.wait_for("the verdict", current, DRIVEN_S)
    station.open_step("tool")
    page.click("#which-tool")
    station.wait_for("the table", lambda: page.locator("#tool-table tbody tr").count() > 5, DRIVEN_S)

    def shown() -> Any:
        return page.evaluate(SHOWN)

    with waiting_for_the_verdict(station, rest, planner, plan):
        for width, height in ((1440, 900), (1024, 768)):
            page.set_viewport_size({"width": width, "height": height})
            station.drawn()
            found = shown()
            station.picture(f"updating-{width}")
            assert found["state"] == "waits"
            assert found["old"] == [True, True, True]
            assert (found["card"], found["tools"]) == (["updating"], ["updating"])
            assert found["lines"] == ["updating", "updating"]
            assert found["coloured"] == 0
            assert (found["marks"], found["clipped"]) == (4, [])
        page.locator("[data-step-name=check] > summary").click()
        expect(page.locator("#profile-reading")).to_have_text("updating")
        assert shown()["clipped"] == []
        station.picture("updating-check")

    station.wait_for("the verdict", current, DRIVEN_S)
    station.drawn()
    after = shown()
    assert (after["old"][:2], after["card"], after["marks"]) == ([False, False], [], 0)
    assert station.errors == []
