"""What the cockpit costs the control loop: its lateness with endoscope, gauge and recording on, against none.

In turns the shipped head's sample is driven by a process alone, and on the page in a real browser, where the endoscope
is large, the nearness gauge is shown and the drive is recorded. Both are led by the key that drives, back and forth.
With ``--world snake`` it is the robot of the colon that travels with vfix, endoscope and scene are drawn, and so many
others watch.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

from app.extras import has_app, need_app
from benchmarks import cases, cockpit_snake, report
from benchmarks.page import SAMPLE, await_true, fresh_page, open_plan
from benchmarks.realtime import BEAT_S, driven_process
from vfix_engine.control import ControlSettings
from vfix_engine.worlds.rigid.realtime import RehearsalProcess

if TYPE_CHECKING:
    from playwright.sync_api import Page

SUMMARY = "how much later the control loop is with endoscope, gauge and recording on"
GOAL = 1.2  # ratio of the 99th percentiles
RESOLUTION_US = 1.0  # of the loop's clock: a smaller lateness counts as this
_LOOK_S = 0.5  # a figure of the loop is one of the last half second
_STUDENT_95 = {5: 2.776, 6: 2.571, 7: 2.447, 8: 2.365, 9: 2.306, 10: 2.262}  # two-sided, by the number of pairs
_CLICK = """(name) => {
  const button = document.querySelector(name);
  if (!button || button.disabled) return false;
  button.click();
  return true;
}"""
_RUNS = "() => vfix.state.rehearsal?.state === 'running'"
_LARGE = "() => document.querySelector('#endoscope[data-ready=true]') !== null"
_NOW = """() => {
  const { rehearsal, details } = vfix.state;
  return [rehearsal.progress_mm, rehearsal.length_mm, details.lateness_us_p99];
}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: how many pairs, and for how long."""
    parser.add_argument("--pairs", type=int, default=5, help="of drives, 5 to 10 (default 5)")
    parser.add_argument("--seconds", type=float, default=8.0, help="of each drive (default 8)")
    parser.add_argument("--world", choices=("rigid", "snake"), default="rigid", help="what is driven (default rigid)")
    parser.add_argument("--watchers", type=int, default=20, help="who watch a snake on the page (default 20)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return the lateness of each drive and the ratio of both kinds with its 95 % interval.

    It is the lateness at the 99th percentile in µs, the mean of half seconds.

    Raises:
        BenchmarkRefused: no browser or Playwright is installed, or a number makes no sense.
        AppMissing: the page and the server are not installed.
    """
    if not has_app():
        raise need_app("vfix bench cockpit")
    if args.pairs not in _STUDENT_95 or not 2.0 <= args.seconds <= 600.0 or not 0 <= args.watchers <= 30:
        raise report.BenchmarkRefused("--pairs is 5 to 10, --seconds 2 to 600, --watchers 0 to 30")
    if args.world == "snake":
        return _snake(args)
    machine, pairs = report.machine().to_dict(), list[dict[str, float]]()
    with fresh_page(1280, 800) as (page, address, version), _process() as process:
        open_plan(page, address, SAMPLE)
        _begin(page)
        for _ in range(args.pairs):
            pairs.append({"none_us": _alone(process, args.seconds), "all_us": _on_page(page, args.seconds)})
    ratio, low, high = interval([math.log(one["all_us"] / one["none_us"]) for one in pairs])
    return {
        "machine": machine,
        "browser": version,
        "pairs": pairs,
        "ratios": {"lateness_p99": ratio},
        "ratio_95": [low, high],
        "goal": GOAL,
    }


def _snake(args: argparse.Namespace) -> dict[str, Any]:
    """Return the figures of each drive of a snake, alone and on a watched page, and the ratios of their medians."""
    machine, pairs = report.machine().to_dict(), list[dict[str, cockpit_snake.Figures]]()
    with cockpit_snake.driven_alone() as process, fresh_page(1280, 800) as (page, address, version):
        cockpit_snake.begin(page, address)
        with cockpit_snake.watchers(address, args.watchers) as hand:
            for _ in range(args.pairs):
                none = cockpit_snake.alone(process, args.seconds)
                pairs.append({"none": none, "all": hand.drive(args.seconds)})
    medians = {
        kind: {name: statistics.median(one[kind][name] for one in pairs) for name in pairs[0][kind]}
        for kind in ("none", "all")
    }
    ratio, low, high = interval([math.log(one["all"]["step_us_p99"] / one["none"]["step_us_p99"]) for one in pairs])
    return {
        "machine": machine,
        "browser": version,
        "world": "snake",
        "watchers": args.watchers,
        "medians": medians,
        "pairs": pairs,
        "ratios": {"step_p99": ratio},
        "ratio_95": [low, high],
    }


def _process() -> AbstractContextManager[RehearsalProcess]:
    return driven_process(cases.phantom(), ControlSettings())


def _begin(page: Page) -> None:
    """Place the robot at the entry, with the endoscope large; paused, so that it costs nothing meanwhile."""
    page.click("[data-step=rehearse]")
    await_true(page, _CLICK, "#start")
    await_true(page, _RUNS)
    page.click("#endoscope-button")
    await_true(page, _LARGE)
    await_true(page, _CLICK, "#start")


def _alone(process: RehearsalProcess, seconds: float) -> float:
    """Drive a process for a while that nothing watches, and return its lateness."""
    process.run()

    def look(direction: int) -> tuple[float, float, float] | None:
        end = time.monotonic() + _LOOK_S
        while time.monotonic() < end:
            process.drive(direction)
            time.sleep(BEAT_S)
        now = process.snapshot()
        return None if now is None else (now.progress_mm, now.length_mm, now.timing.lateness_us_p99)

    try:
        return _driven(look, seconds)
    finally:
        process.release()
        process.pause()


def _on_page(page: Page, seconds: float) -> float:
    """Drive on the page for a while, by a key that is held, and return the loop's lateness."""
    await_true(page, _CLICK, "#start")
    await_true(page, _RUNS)
    held = ""

    def look(direction: int) -> tuple[float, float, float]:
        nonlocal held
        key = "ArrowUp" if direction > 0 else "ArrowDown"
        if key != held:
            if held:
                page.keyboard.up(held)
            page.keyboard.down(key)
            held = key
        time.sleep(_LOOK_S)
        progress, length, late = page.evaluate(_NOW)
        return progress, length, late

    try:
        return _driven(look, seconds)
    finally:
        page.keyboard.up(held)
        await_true(page, _CLICK, "#start")


def _driven(look: Callable[[int], tuple[float, float, float] | None], seconds: float) -> float:
    """Lead the tool back and forth, and return the mean lateness in µs.

    look: returns progress and length of the path in mm, and the lateness of the last half second at its 99th
    percentile.
    """
    direction, late, end = 1, list[float](), time.monotonic() + seconds
    while time.monotonic() < end:
        now = look(direction)
        if now is None:
            continue
        progress, length, lateness = now
        direction = -1 if progress > length - 1.0 else 1 if progress < 1.0 else direction
        late.append(lateness)
    return max(RESOLUTION_US, statistics.fmean(late[1:]))  # the first figure has ticks of before


def interval(logs: list[float]) -> tuple[float, float, float]:
    """Return the geometric mean of ratios, and its 95 % interval by Student's t, from their logarithms."""
    mean = statistics.fmean(logs)
    half = _STUDENT_95[len(logs)] * statistics.stdev(logs) / math.sqrt(len(logs))
    return math.exp(mean), math.exp(mean - half), math.exp(mean + half)
