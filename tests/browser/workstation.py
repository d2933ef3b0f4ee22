"""The page as a person uses it, driven through Playwright: eyes read `window.vfix`, hands use mouse and keys."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from page_scripts import DRAWN, IN_SCENE, LOOK, LOOKS_FROM, OPEN_SCENE, SLICES
from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, Playwright, expect

from app.browsers import find_browser
from app.scene.camera import DIRECTIONS

ROOT = Path(__file__).resolve().parents[2]
TOKEN = "browser-tests-" + "0" * 20
VIEWPORT = {"width": 1000, "height": 640}
FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-gpu",  # the page is composed without WebGL, which in software is slower
    "--enable-unsafe-swiftshader",
)

# Software drawing on two busy cores takes seconds for a frame.
PATIENCE_S = 120.0  # a busy machine is slow; what never comes is still told
PATIENCE_MS = 1000.0 * PATIENCE_S
DRIVEN_S = 400.0  # for a dry run on a busy machine, where fields are measured for the first time

# The planner with one more line in its list of steps.
WITH_TABS = """
import sys
from app import cli
from app.tabs import registry

end = sys.argv.index("--")
registry.TABS += sys.argv[1:end]
sys.exit(cli.main(sys.argv[end + 1 :]))
"""


class Workstation:
    """One open page."""

    def __init__(self, page: Page, artefacts: Path, scene_held: bool = False) -> None:
        """scene_held: its frame stays empty until something of the scene is asked for, see `see_scene`."""
        self.page = page
        self._scene_held = scene_held
        self._artefacts = artefacts
        self.errors: list[str] = []
        self._pointer = (0.0, 0.0)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", self._heard)

    def _heard(self, message: ConsoleMessage) -> None:
        """Errors of the console, but for those that say that the planner is away."""
        if message.type == "error" and not re.match(r"Failed to load resource|WebSocket connection to", message.text):
            self.errors.append(message.text)

    # -- eyes

    def state(self, section: str) -> Any:
        return self.page.evaluate("(name) => window.vfix?.state[name] ?? null", section)

    def wait_for(self, what: str, check: Callable[[], Any], patience_s: float = PATIENCE_S) -> Any:
        """Wait until `check` answers something true; polls from outside, the page forbids eval."""
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            answer = check()
            if answer:
                return answer
            self.page.wait_for_timeout(50)
        self.picture("failed")
        sections = {name: self.state(name) for name in ("step", "scene", "plan", "corridor", "rehearsal")}
        raise AssertionError(f"waited {patience_s:.0f} s for {what}; the page shows {json.dumps(sections)[:3000]}")

    def drawn(self) -> None:
        """Wait until the page shows the state that it has got: it draws once a frame."""
        self.page.evaluate(DRAWN)

    def said(self, words: str) -> bool:
        """Whether a note with these words was shown, also one that has left."""
        return any(words in note for note in self.page.evaluate("said"))

    def ready(self) -> Workstation:
        """The head is open; unless the scene is held, it is drawn."""
        if not self._scene_held:
            return self.see_scene()
        reads = lambda: (self.state("case") or {"loading": "…"})["loading"]  # noqa: E731
        self.wait_for("the head", lambda: not reads(), DRIVEN_S)
        return self

    def see_scene(self) -> Workstation:
        """The scene is drawn and the camera has reported; a test that looks at it beside `place` and the like asks."""
        if self._scene_held:
            self._scene_held = False
            self.page.evaluate(OPEN_SCENE)
        self.wait_for("the scene", lambda: (self.state("scene") or {}).get("ready"), DRIVEN_S)
        self.wait_for("the camera", lambda: (self.state("camera") or {}).get("view_height_mm"))
        return self

    def _with_scene(self) -> None:
        if self._scene_held:
            self.see_scene()

    def picture(self, name: str) -> None:
        self.page.screenshot(path=self._artefacts / f"{name}.png")

    # -- hands

    def place(self, position: list[float]) -> tuple[float, float]:
        """Page coordinates of a place in the head."""
        self._with_scene()
        places = self.page.evaluate("(p) => vfix.request('project', { points: [p] })", position)["places"]
        box = self.page.locator("#scene").bounding_box()
        assert places is not None
        assert box is not None
        return box["x"] + places[0][0] * box["width"], box["y"] + places[0][1] * box["height"]

    def look_from(self, view: str) -> None:
        """Choose a standard view and wait until the camera stands still there."""
        self._with_scene()
        direction = list(DIRECTIONS[view])
        there = self.page.evaluate(LOOKS_FROM, direction)
        self.page.click(f"[data-view={view}]")
        if there is False:
            self.wait_for(f"the view {view!r}", lambda: self.page.evaluate(LOOKS_FROM, direction))
        else:  # the camera comes nearer or goes away, or nobody can tell
            self.page.wait_for_timeout(1000)
        self.settle()

    def settle(self) -> None:
        """Wait until the camera no longer moves, and the planner knows where it is."""
        self._with_scene()
        last: Any = None

        def rests() -> bool:
            nonlocal last
            self.page.wait_for_timeout(200)
            now = self.page.evaluate(LOOK)
            rests = bool(now["same"]) and now == last
            last = now
            return rests

        self.wait_for("the camera to come to rest", rests)

    def open_look(self) -> None:
        """Open the popover with bone, skin, cut and slices."""
        self.page.click("#look-toggle")
        expect(self.page.locator("#look")).to_be_visible()

    def cut_away(self, half: str) -> None:
        self.open_look()
        self.page.select_option("#cut", half)
        self.page.keyboard.press("Escape")
        expect(self.page.locator("#look")).to_be_hidden()

    def slice_menu(self, *also: str) -> None:
        """Open the menu of the slices, and what opens from it: `second-volume` or `slice-keys`."""
        self.page.click("[data-tool=more]")
        expect(self.page.locator("#slice-outlines")).to_be_visible()
        for name in also:
            self.page.click(f"#{name}")

    def slices_stand(self) -> None:
        """Wait until every slice in sight is drawn as it is to be, and none gets another size or place."""
        last: Any = None

        def stand() -> bool:
            nonlocal last
            now = self.page.evaluate(SLICES)
            stand = now is not None and now == last
            last = now
            return stand

        self.wait_for("the slices to stand", stand)

    def place_in_slice(self, axis: str, place: list[float]) -> dict[str, float]:
        """Where in a slice a place of its plane is drawn, in pixels from its corner."""
        drawn = """([axis, place]) => {
          const { port } = vfix.slices.panes.find((pane) => pane.name === axis);
          return port && Math.abs(port.project(place).away) < 1e-3 ? port.project(place) : null;
        }"""
        self.wait_for(f"the {axis} slice", lambda: self.page.evaluate(drawn, [axis, place]))
        self.slices_stand()
        at = self.page.evaluate(drawn, [axis, place])
        return {"x": at["x"], "y": at["y"]}

    def press_at(self, position: list[float]) -> tuple[float, float]:
        """Press on what is drawn small at a place of the head; returns the place on the page. The button stays down."""
        self._with_scene()
        self.wait_for("it in the scene", lambda: self.page.evaluate(IN_SCENE, position))
        x, y = self.place(position)
        self.page.mouse.move(x, y)
        self.page.wait_for_timeout(300)
        self.drawn()
        self.page.mouse.down()
        return x, y

    def drag_by(self, position: list[float], by: tuple[float, float], pause_ms: float = 120.0) -> None:
        """Take what is drawn at a place of the head and drag it by some pixels; the button stays down."""
        x, y = self.press_at(position)
        for part in (0.3, 0.6, 1.0):
            self._pointer = (x + part * by[0], y + part * by[1])
            self.page.mouse.move(*self._pointer)
            self.page.wait_for_timeout(pause_ms)

    def open_step(self, name: str) -> None:
        """Open a step of the Plan panel, or a part below the steps, by its `data-step-name`."""
        step = self.page.locator(f"[data-step-name={name}]")

        def opened() -> bool:
            if not step.evaluate("(step) => step.open"):
                step.locator("> summary").click()
            return bool(step.evaluate("(step) => step.open"))

        # the page opens a step itself, also between the look and the click, which closes it then
        self.wait_for(f"the step {name!r} to be open", opened)

    def open_plan(self, plan_id: str) -> None:
        self.page.evaluate("(id) => vfix.request('plan.open', { plan_id: id })", plan_id)
        self.wait_for("the plan", lambda: (self.state("plan") or {}).get("id") == plan_id)

    def start(self) -> None:
        """Go to Rehearse and start the robot."""
        self.page.click("[data-step=rehearse]")
        self.wait_for("Rehearse", lambda: self.state("step")["name"] == "rehearse")
        self.page.click("#start")
        self.wait_for("the robot", lambda: self.state("rehearsal")["state"] == "running", DRIVEN_S)

    def rehearsal(self) -> Any:
        return self.state("rehearsal")

    def rehearsal_after(self, ms: float) -> Any:
        """Figures of a robot that runs, taken so many milliseconds from now or later."""
        begin = 1000.0 * time.time()
        return self.wait_for(
            "newer figures", lambda: (now := self.rehearsal()) and (now.get("taken_ms") or 0.0) >= begin + ms and now
        )

    def tab_to(self, selector: str, back: bool = False) -> None:
        """Press Tab, or Shift+Tab, until an element has the focus."""
        self.page.locator(selector).first.wait_for(state="attached")  # on a busy machine a panel may come later
        for _ in range(120):
            if self.page.evaluate("(selector) => document.activeElement.matches(selector)", selector):
                return
            self.page.keyboard.press("Shift+Tab" if back else "Tab")
        raise AssertionError(f"{selector} is not reached with Tab")

    def choose_file(self, key: str, chooser: str, file: Path) -> None:
        """Press a key that opens a file chooser, and choose a file in it.

        The click that opens it is waited for, not the chooser: of some 200, a busy Chromium opened one not at all.
        """
        opened = self.watch_chooser(chooser)
        self.page.keyboard.press(key)
        expect(opened).to_have_count(1)
        self.page.set_input_files(chooser, file)

    def watch_chooser(self, chooser: str) -> Locator:
        """What is there once a file chooser is asked for."""
        self.page.on("filechooser", lambda opened: None)  # none of the browser's own opens
        self.page.evaluate(
            "(chooser) => document.querySelector(chooser).addEventListener('click',"
            " (event) => { event.target.dataset.opened = 'yes'; }, { once: true })",
            chooser,
        )
        return self.page.locator(f"{chooser}[data-opened=yes]")

    def grab(self, towards: tuple[float, float]) -> None:
        """Take the grip with the mouse and pull it by some pixels; the button stays down."""
        self.look_from("nose")
        self.drag_by(self.rehearsal()["grip"], towards, 60.0)

    def hold_on(self) -> None:
        """A hand that a busy machine has lost takes hold again by moving, here by a pixel (HAZ-11)."""
        if self.rehearsal()["force_n"] == 0:
            x, y = self._pointer
            self._pointer = (x + 1, y) if int(x) % 2 else (x - 1, y)
            self.page.mouse.move(*self._pointer)

    def drive_until(self, key: str, what: str, check: Callable[[], Any], patience_s: float = PATIENCE_S) -> None:
        """Hold a key until `check` answers something true; it repeats as that of a real keyboard, and stays down."""

        def driven() -> Any:
            self.page.keyboard.down(key)  # again: a repeat, by which a hand that was lost takes hold again (HAZ-11)
            return check()

        self.wait_for(what, driven, patience_s)

    def pull_until(self, what: str, check: Callable[[], Any]) -> None:
        """Hold on to the grip until `check` answers something true."""

        def held() -> Any:
            self.hold_on()
            return check()

        self.wait_for(what, held)


class Rest:
    """The planner's REST face, for preparing plans and looking at them from outside."""

    def __init__(self, base: str, token: str) -> None:
        self.client = httpx.Client(base_url=base, headers={"Authorization": f"Bearer {token}"}, timeout=PATIENCE_S)

    def sample(self) -> Any:
        return self.plan("head-phantom-sample")

    def copy_of_sample(self, name: str) -> str:
        wish = {"name": name, "copy_of": self.sample()["id"]}
        return str(self.client.post("/api/v1/cases/head-phantom/plans", json=wish).raise_for_status().json()["id"])

    def empty_plan(self, name: str) -> str:
        made = self.client.post("/api/v1/cases/head-phantom/plans", json={"name": name}).raise_for_status().json()
        return str(made["id"])

    def short_plan(self, name: str, points: int) -> str:
        """The first points of the sample: a path that is driven in a moment."""
        plan_id = self.empty_plan(name)
        for point in self.sample()["points"][:points]:
            body = {"position": point["position"], "label": point["label"]}
            self.client.post(f"/api/v1/plans/{plan_id}/points", json=body).raise_for_status()
        return plan_id

    def copy_of_head(self) -> str:
        """Import the embedded head once more, as a head of its own: one that may be a patient's."""
        cases = self.client
        archive = cases.get("/api/v1/cases/head-phantom/archive", params={"with_images": True}).raise_for_status()
        sent = cases.post("/api/v1/cases/archive", files={"file": ("head.zip", archive.content)})
        job = sent.raise_for_status().json()["id"]
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            now = cases.get(f"/api/v1/jobs/{job}").raise_for_status().json()
            if now["result"]:
                return str(now["result"])
            assert now["error"] is None, now
            time.sleep(0.1)
        raise AssertionError(f"the head was not imported in {PATIENCE_S:.0f} s")

    def delete_plans(self) -> None:
        """Take all plans but the sample off the list."""
        plans = self.client.get("/api/v1/plans", params={"case_id": "head-phantom"}).raise_for_status().json()
        for plan in plans:
            if plan["id"] != "head-phantom-sample":
                self.client.patch(f"/api/v1/plans/{plan['id']}", json={"locked": False})
                self.client.delete(f"/api/v1/plans/{plan['id']}").raise_for_status()

    def runs(self, case_id: str) -> Any:
        """Recorded drives of a case."""
        return self.client.get("/api/v1/runs", params={"case_id": case_id}).raise_for_status().json()

    def plan(self, plan_id: str) -> Any:
        return self.client.get(f"/api/v1/plans/{plan_id}").raise_for_status().json()


def launch(playwright: Playwright) -> Browser:
    path = find_browser()
    if path is None:
        pytest.fail("There is no Chrome, Chromium or Edge; scripts/test.py installs one, VFIX_BROWSER names one.")
    return playwright.chromium.launch(executable_path=path, args=list(FLAGS))


class Planner:
    """`vfix serve` in a process of its own, which a test may end and start again on the same port."""

    def __init__(self, home: Path, tabs: tuple[str, ...] = ()) -> None:
        """tabs: packages of tabs beside the planner's own, which lie in this folder."""
        self._home, self._tabs = home, tabs
        self._port = 0
        self.start()

    def start(self, token: str = TOKEN) -> None:
        path = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
        environment = os.environ | {"VFIX_HOME": str(self._home), "VFIX_TOKEN": token, "PYTHONPATH": path}
        program = ["-c", WITH_TABS, *self._tabs, "--"] if self._tabs else ["-m", "app.cli"]
        command = [sys.executable, *program, "serve", "--no-browser", "--port", str(self._port)]
        self.process = subprocess.Popen(command, env=environment, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        assert found, f"the planner said {line!r} instead of its address"
        self._port = int(found[1])

    @property
    def base(self) -> str:
        return f"http://127.0.0.1:{self._port}"

    @property
    def home(self) -> Path:
        return self._home

    def stop(self) -> None:
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()
