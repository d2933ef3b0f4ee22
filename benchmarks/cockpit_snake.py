"""The cockpit of a snake in the colon that travels with vfix: endoscope and scene drawn, recorded, and watched.

A watcher is a page without a browser that stays in the tab of the drive, as many as the planner takes, and beyond these
a reader of the robot's poses.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.page import await_true
from benchmarks.realtime import BEAT_S
from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.worlds.snake import LumenContours, SnakeSettings, SnakeSystemSpec
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

if TYPE_CHECKING:
    from playwright.sync_api import Page

Figures = dict[str, float]
Process = ControlProcess[SnakeSnapshot]

CASE, ROUTE = "colon-phantom", "colon-phantom-sample"
STEP_S = 0.002  # as the page drives it
_LOOK_S = 0.5  # a figure of the loop is one of the last half second
_TURN_EVERY = 4  # looks in one direction: so far the tip comes that the links that bend are inside
_START_S = 600.0
_OPENED = """() => {
  const { state } = window.vfix ?? {};
  return Boolean(state?.case?.id === "colon-phantom" && !state.case.loading && state.step?.name === "drive");
}"""
_READY = "() => ['ready', 'paused'].includes(vfix.state.rehearsal?.state)"
_RUNS = "() => vfix.state.rehearsal?.state === 'running'"
_DRAWN = "() => document.querySelector('#endoscope[data-ready=true]') !== null"
_PRESS = """() => {
  const start = document.querySelector('#start');
  if (!start || start.disabled) return false;
  start.click();
  return true;
}"""
_NOW = """() => {
  const { details } = vfix.state;
  return [details.step_us, details.step_us_p99, details.lateness_us_p99, details.overruns, details.steps];
}"""
_NAMES = ("step_us", "step_us_p99", "lateness_us_p99")


def spec() -> SnakeSystemSpec:
    """Return the system that the page makes of the colon's sample route."""
    case, drive = colon_case(), DriveSettings(control="view")
    lumen = lumen_between(case.mesh, case.start, case.end, SnakeModel(1), drive)
    return SnakeSystemSpec(LumenContours.of(lumen), lumen.snake(SnakeModel(1), None), SnakeSettings(STEP_S), drive)


@contextmanager
def driven_alone() -> Iterator[Process]:
    """Yield a control process that nothing watches, ready and paused at the entry."""
    process: Process = ControlProcess(spec(), True)
    try:
        process.start()
        process.wait_ready(_START_S)
        yield process
    finally:
        process.close()


def alone(process: Process, seconds: float) -> Figures:
    """Drive a process for a while that nothing watches, and return the figures of its loop."""
    found, end = list[tuple[float, ...]](), time.monotonic() + seconds
    process.run()
    while time.monotonic() < end:
        axes = _axes(len(found))
        until = time.monotonic() + _LOOK_S
        while time.monotonic() < until:
            process.axes(*axes)
            time.sleep(BEAT_S)
        now = process.snapshot()
        if now is not None:
            t = now.timing
            found.append((t.step_us, t.step_us_p99, t.lateness_us_p99, t.overruns, now.steps))
    process.release()
    process.pause()
    return _figures(found)


def begin(page: Page, address: str) -> None:
    """Open the colon in Drive, with endoscope and scene, and place the robot at the entry."""
    opened = json.dumps(json.dumps({"case": CASE, "plan": None, "step": "drive"}))
    page.add_init_script(f'sessionStorage.setItem("vfix-open", {opened});')
    page.goto(address)
    await_true(page, _OPENED)
    await_true(page, _READY)
    await_true(page, _DRAWN)


def on_page(page: Page, seconds: float) -> Figures:
    """Drive on the page for a while by keys that are held, and return the figures of the loop."""
    await_true(page, _PRESS)
    await_true(page, _RUNS)
    found, held, end = list[tuple[float, ...]](), "", time.monotonic() + seconds
    while time.monotonic() < end:
        x, _, insert = _axes(len(found))
        key = "d" if x else "w" if insert > 0 else "s"
        if key != held:
            if held:
                page.keyboard.up(held)
            page.keyboard.down(key)
            held = key
        time.sleep(_LOOK_S)
        found.append(tuple(page.evaluate(_NOW)))
    page.keyboard.up(held)
    await_true(page, _PRESS)
    return _figures(found)


def _axes(look: int) -> tuple[float, float, float]:
    """Return the hand's axes: in three times, to a side, and out again twice."""
    stretch = look // _TURN_EVERY % 6
    return (1.0, 0.0, 0.0) if stretch == 3 else (0.0, 0.0, 1.0 if stretch < 3 else -1.0)


def _figures(found: list[tuple[float, ...]]) -> Figures:
    """Return the medians of half seconds, the worst 99th percentile of a step, and the share of late ticks."""
    rows = np.array(found[1:], dtype=np.float64)  # the first figure has ticks of before
    told = {name: float(np.median(rows[:, at])) for at, name in enumerate(_NAMES)}
    ticks = rows[-1, 4] - rows[0, 4]
    late = (rows[-1, 3] - rows[0, 3]) / ticks if ticks > 0.0 else 0.0
    return told | {"step_us_p99_most": float(rows[:, 1].max()), "overruns_share": float(late)}


@contextmanager
def watchers(address: str, count: int) -> Iterator[None]:
    """Watch the drive of the sample route by so many connections."""
    from websockets.sync.client import connect  # a benchmark without watchers needs none

    from app.messages.version import VERSION
    from app.session.client_sessions import MAX_PAGES

    base, _, query = address.replace("http", "ws", 1).partition("?")
    headers = {"Authorization": f"Bearer {query.removeprefix('token=')}"}
    pages = min(count, MAX_PAGES - 1)
    paths = [f"session?tab=watcher-{number}&case={CASE}&step=drive" for number in range(pages)]
    paths += [f"api/v1/steps/drive/poses?case={CASE}&plan={ROUTE}"] * (count - pages)
    with ExitStack() as stack:
        for path in paths:
            socket = stack.enter_context(connect(f"{base}{path}", additional_headers=headers, max_size=None))
            if path.startswith("session"):
                socket.send(json.dumps({"type": "hello", "version": VERSION, "role": "watches"}))
            threading.Thread(target=_read, args=(socket,), daemon=True).start()
        yield


def _read(socket: Any) -> None:
    """Read until the connection ends."""
    from websockets.exceptions import ConnectionClosed

    with suppress(ConnectionClosed):
        for _ in socket:
            pass
