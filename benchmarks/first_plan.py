"""From the page's address to an exported plan, as a newcomer goes: seconds of the page's own time, step by step.

In a real browser on a fresh home: the page is opened, a plan is begun, its entry is a nostril that the page offers,
its target a place that is typed, and the suggested path is used, simulated and exported. What is measured is how long
the page takes to answer each press; a person's reading and moving come on top.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.extras import has_app, need_app
from benchmarks import report
from benchmarks.page import await_true, fresh_page

if TYPE_CHECKING:
    from playwright.sync_api import Page

SUMMARY = "how long the page takes from its address to an exported plan"
GOAL_S, SUGGEST_GOAL_S = 90.0, 10.0
TARGET = "L 3 P 65 I 3.5"  # the nasopharynx of the shipped head
_HEAD = "() => Boolean(vfix?.state?.case && !vfix.state.case.loading && vfix.slices.link.ready)"
_EMPTY = "() => vfix.state.plan?.name === 'First plan' && vfix.state.plan.points.length === 0"
_OFFERED = "() => Boolean(document.querySelector('[data-opening]:not([disabled])'))"
_ENTERED = "() => vfix.state.plan.points.length === 1"
_AIMED = "() => vfix.state.plan.targets.length === 1"
_FOUND = "() => document.querySelectorAll('#alternatives li').length > 0"
_JUDGED = "() => vfix.state.corridor?.state === 'current' && vfix.state.plan.points.length > 2"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the option that shows what happens."""
    parser.add_argument("--pictures", type=Path, default=None, help="folder for a picture after each step")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return the seconds of each step and of all together, and what they should stay below on a quiet machine.

    Raises:
        BenchmarkRefused: no browser or Playwright is installed.
        AppMissing: the page and the server are not installed.
    """
    if not has_app():
        raise need_app("vfix bench first-plan")
    machine = report.machine().to_dict()
    with fresh_page(1440, 900) as (page, address, version):
        steps = first_plan(page, address, args.pictures)
    total = sum(steps.values())
    return {
        "machine": machine,
        "browser": version,
        "steps_s": steps,
        "total_s": total,
        "goal_s": GOAL_S,
        "suggest_goal_s": SUGGEST_GOAL_S,
    }


def first_plan(page: Page, address: str, pictures: Path | None = None) -> dict[str, float]:
    """Go from the page's address to an exported plan, and return the seconds of each step."""
    steps = dict[str, float]()

    def step(name: str, act: Any, until: str) -> None:
        begun = time.perf_counter()
        act()
        await_true(page, until)
        steps[name] = time.perf_counter() - begun
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=pictures / f"{len(steps)}-{name}.png")

    step("open", lambda: page.goto(address), _HEAD)
    step("begin", lambda: _begin(page), _EMPTY)
    step("openings", lambda: None, _OFFERED)
    step("entry", lambda: page.locator("[data-opening]").first.click(), _ENTERED)
    step("target", lambda: _aim(page), _AIMED)
    step("suggest", lambda: _suggest(page), _FOUND)
    step("use", lambda: page.locator("#use-suggestion:visible").first.click(), _JUDGED)
    step("export", lambda: _export(page), "() => true")
    return steps


def _begin(page: Page) -> None:
    page.click("[data-step=plan]")
    page.click("#plans")
    page.click("#new-plan")
    page.locator("dialog[open] input").fill("First plan")
    page.keyboard.press("Enter")


def _aim(page: Page) -> None:
    """Open the step of the targets, go to a place by typing it, and add it there."""
    _open(page, "targets")
    page.keyboard.press("Control+k")
    page.keyboard.type(TARGET)
    page.keyboard.press("Enter")
    page.locator(".slice-stage").first.focus()
    page.keyboard.press("Enter")


def _suggest(page: Page) -> None:
    _open(page, "path")
    page.click("#suggest")


def _export(page: Page) -> None:
    _open(page, "export")
    with page.expect_download() as download:
        page.click("[data-format=json]")
    download.value.path()


def _open(page: Page, name: str) -> None:
    """Open a step of the plan; the page may open it at the same moment, and the click closes it then."""
    step = page.locator(f"[data-step-name={name}]")
    while not step.evaluate("(step) => step.open"):
        step.locator("> summary").click()
        page.wait_for_timeout(100.0)
