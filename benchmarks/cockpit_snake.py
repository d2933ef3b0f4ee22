"""The cockpit of a snake in the colon that travels with vfix: endoscope and scene drawn, recorded, and watched.

Alone and on the page the hand does the same, from the entry: a step costs what the robot does in it. One that is held
at a bound, as a bent tip that is pushed on is, costs half as much again as one that moves.
A watcher is a page without a browser that stays in the tab of the drive, as many as the planner takes, and beyond these
a reader of the robot's poses. The page in the browser watches too, and draws.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.page import await_true
from benchmarks.realtime import BEAT_S
from benchmarks.report import BenchmarkRefused
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
_POSES = f"api/v1/steps/drive/poses?case={CASE}&plan={ROUTE}"
_LOOK_S = 0.5  # a figure of the loop is one of the last half second
# What the hand does, over and over, s: so far in that the links that bend are inside; to a side and back again.
_IN_S, _ASIDE_S = 6.0, 1.0
_START_S = 600.0
_OPENED = """() => {
  const { state } = window.vfix ?? {};
  return Boolean(state?.case?.id === "colon-phantom" && !state.case.loading && state.step?.name === "drive");
}"""
_RUNS = "() => vfix.state.rehearsal?.state === 'running'"
_READY = "() => ['ready', 'paused'].includes(vfix.state.rehearsal?.state)"
_DRAWN = "() => document.querySelector('#endoscope[data-ready=true]') !== null"
_NAMES = ("step_us", "step_us_p99", "lateness_us_p99")
_TOLD = (*_NAMES, "overruns", "steps")


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
    """Drive a process from the entry for a while that nothing watches, and return the figures of its loop."""
    process.reset()
    found, began = list[tuple[float, ...]](), time.monotonic()
    process.run()
    while time.monotonic() < began + seconds:
        until = time.monotonic() + _LOOK_S
        while time.monotonic() < until:
            process.axes(*_axes(time.monotonic() - began))
            time.sleep(BEAT_S)
        now = process.snapshot()
        if now is not None:
            t = now.timing
            found.append((t.step_us, t.step_us_p99, t.lateness_us_p99, t.overruns, now.steps, now.progress_mm))
    process.release()
    process.pause()
    return _figures(found)


def begin(page: Page, address: str) -> None:
    """Open the colon in Drive, with endoscope and scene, place the robot at the entry, and let its handle go."""
    opened = json.dumps(json.dumps({"case": CASE, "plan": None, "step": "drive"}))
    page.add_init_script(f'sessionStorage.setItem("vfix-open", {opened});')
    page.goto(address)
    await_true(page, _OPENED)
    _ask(page, "start")  # which places the robot
    await_true(page, _RUNS)
    _ask(page, "pause")
    await_true(page, _READY)
    await_true(page, _DRAWN)
    _ask(page, "let_go")


def _ask(page: Page, what: str) -> None:
    page.evaluate("(what) => vfix.request(`rehearsal.${what}`, {})", what)


class PageHand:
    """Drives the robot that the page shows by messages, as fast as ``alone`` does; so the hand is not the page's.

    A page whose pictures take a processor tells its keys too late for the robot, which stands then and costs nothing.
    shown: sections of the state, the newest of each. Closed as its socket is.
    """

    def __init__(self, socket: Any) -> None:
        self._socket, self.shown = socket, dict[str, Any]()
        threading.Thread(target=self._listen, daemon=True).start()

    def drive(self, seconds: float) -> Figures:
        """Drive from the entry for a while, back to it, and return the figures of the loop."""
        self._tell("rehearsal.take")
        self._tell("rehearsal.start")
        self._await(lambda shown: shown["rehearsal"]["state"] == "running")
        found, began = list[tuple[float, ...]](), time.monotonic()
        while time.monotonic() < began + seconds:
            until = time.monotonic() + _LOOK_S
            while time.monotonic() < until:
                x, y, insert = _axes(time.monotonic() - began)
                self._tell("axes", camera_x=x, camera_y=y, insert=insert)
                time.sleep(BEAT_S)
            details = self.shown["details"]
            found.append((*(details[name] for name in _TOLD), self.shown["snake"]["depth_mm"]))
        self._tell("axes")
        self._tell("rehearsal.pause")
        self._await(lambda shown: shown["rehearsal"]["state"] == "paused")
        self._tell("rehearsal.reset")
        self._await(lambda shown: shown["rehearsal"]["state"] == "ready" and shown["snake"]["depth_mm"] == 0.0)
        return _figures(found)

    def _tell(self, kind: str, **fields: float) -> None:
        self._socket.send(json.dumps({"type": kind, **fields}))

    def _await(self, what: Callable[[dict[str, Any]], bool]) -> None:
        deadline = time.monotonic() + _START_S
        while not what(self.shown):
            if time.monotonic() > deadline:
                raise BenchmarkRefused(f"the page's robot does not answer: {self.shown['rehearsal']}")
            time.sleep(BEAT_S)

    def _listen(self) -> None:
        """Read until the connection ends."""
        with suppress(_closed()):
            for message in self._socket:
                told = json.loads(message)
                if told["type"] == "state":
                    self.shown = self.shown | told["sections"]


def _axes(elapsed_s: float) -> tuple[float, float, float]:
    """Return the hand's axes: in, to the right, and back to the left."""
    at = elapsed_s % (_IN_S + 2.0 * _ASIDE_S)
    return (0.0, 0.0, 1.0) if at < _IN_S else (1.0 if at < _IN_S + _ASIDE_S else -1.0, 0.0, 0.0)


def _figures(found: list[tuple[float, ...]]) -> Figures:
    """Return the medians of half seconds, the worst 99th percentile of a step, the share of late ticks, and the depth
    to which the tip came. A half second without a step of the hand, which a late hand leaves, has no figures.

    Raises BenchmarkRefused where none has.
    """
    rows = np.array(found[1:], dtype=np.float64)  # the first figure has ticks of before
    driven = rows[rows[:, 0] > 0.0]
    if not len(driven):
        raise BenchmarkRefused("the hand moved the robot in no half second; is the machine busy with other work?")
    told = {name: float(np.median(driven[:, at])) for at, name in enumerate(_NAMES)}
    ticks = rows[-1, 4] - rows[0, 4]
    late = (rows[-1, 3] - rows[0, 3]) / ticks if ticks > 0.0 else 0.0
    most = {"step_us_p99_most": float(driven[:, 1].max()), "overruns_share": float(late)}
    return told | most | {"depth_mm": float(rows[:, 5].max())}


@contextmanager
def watchers(address: str, count: int) -> Iterator[PageHand]:
    """Watch the drive of the sample route by so many connections, and yield the hand that drives it."""
    from app.messages.version import VERSION
    from app.session.client_sessions import MAX_PAGES

    pages = min(count, MAX_PAGES - 2)
    with ExitStack() as stack:

        def opened(path: str, role: str) -> Any:
            socket = stack.enter_context(_connected(address, path))
            if role:
                socket.send(json.dumps({"type": "hello", "version": VERSION, "role": role}))
            return socket

        for number in range(count):
            page = number < pages
            path = f"session?tab=watcher-{number}&case={CASE}&step=drive" if page else _POSES
            threading.Thread(target=_read, args=(opened(path, "watches" if page else ""),), daemon=True).start()
        yield PageHand(opened(f"session?tab=hand-of-all&case={CASE}&step=drive", "holds"))


def _connected(address: str, path: str) -> Any:
    from websockets.sync.client import connect

    base, _, query = address.replace("http", "ws", 1).partition("?")
    headers = {"Authorization": f"Bearer {query.removeprefix('token=')}"}
    return connect(f"{base}{path}", additional_headers=headers, max_size=None, open_timeout=_START_S)


def _read(socket: Any) -> None:
    """Read until the connection ends."""
    with suppress(_closed()):
        for _ in socket:
            pass


def _closed() -> type[Exception]:
    from websockets.exceptions import ConnectionClosed  # a benchmark without watchers needs none

    return ConnectionClosed
