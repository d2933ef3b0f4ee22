"""Tabs that the planner does not come with: one folder and one line each, and they work on the page.

One lays a marker; the other drives a world of its own in cases of another kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
import trimesh
from extra_tabs.tube.world import LENGTH_MM, RADIUS_MM, TubeSpec, refused_by
from page_scripts import IN_SCENE, NO_ANTIALIASING
from playwright.sync_api import Browser, Page, expect
from workstation import DRIVEN_S, PATIENCE_MS, TOKEN, VIEWPORT, Planner, Rest, Workstation

from app.cases.model import CaseFrame
from app.cases.service import CaseService
from app.drives.runs import RunService
from app.settings import Settings
from app.store import Store
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    return Settings(home=tmp_path_factory.mktemp("home"), port=0)


@pytest.fixture(scope="module")
def tube(home: Settings) -> str:
    """A case of the kind that the tube is driven in."""
    solid = trimesh.creation.cylinder(RADIUS_MM, segment=[[0.0, 0.0, 0.0], [0.0, 0.0, LENGTH_MM]])
    mesh = TriangleMesh(np.asarray(solid.vertices), np.asarray(solid.faces))
    store = Store(home)
    frame = CaseFrame("LPS", assumed=False)
    case = CaseService(store).create("Tube", frame=frame, surfaces={"lumen": mesh}, kind="lumen")
    store.close()
    return case.id


@pytest.fixture(scope="module")
def planner(home: Settings, tube: str) -> Iterator[Planner]:
    started = Planner(home.home, tabs=("extra_tabs.marker", "extra_tabs.tube"))
    yield started
    started.stop()


def test_a_tab_of_ones_own_is_one_folder_and_one_line(browser: Browser, planner: Planner, artefacts: Path) -> None:
    """Its tab, its panel, its command with the answer, its section, its layer, its hint and its own address."""
    context = browser.new_context(viewport=VIEWPORT)
    context.add_init_script(NO_ANTIALIASING)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    station = Workstation(page, artefacts)
    page.goto(f"{planner.base}/?token={TOKEN}")
    station.ready()
    expect(page.locator("#steps button:visible")).to_have_text(
        [
            "Patient",
            "Plan",
            "Register",
            "Rehearse",
            "Review",
            "Marker",
        ]
    )
    page.click("[data-step=marker]")
    expect(page.locator("#marker-words")).to_be_visible()
    assert station.state("marker") is None
    assert _red_share(page) < 0.01
    page.click("#lay-marker")
    station.wait_for("the section", lambda: (station.state("marker") or {}).get("laid") == 1)
    expect(page.locator("#marker-words")).to_have_text("Laid 1 times.")
    assert page.evaluate("String(vfix.state.marker.position) === String(vfix.state.slices.cross)")
    station.wait_for("the layer", lambda: _red_share(page) > 0.1)
    assert page.evaluate("vfix.request('marker.lay')") == 2
    address, token = f"{planner.base}/api/v1/steps/marker/words", {"Authorization": f"Bearer {TOKEN}"}
    assert httpx.get(address, headers=token, timeout=60).json() == {"words": "a marker"}
    assert httpx.get(address, timeout=60).status_code == 401
    # once the planner has compiled its kernels
    expect(page.locator("#hint")).to_contain_text("marker is laid", timeout=1000.0 * DRIVEN_S)
    page.click("[data-step=plan]")
    station.wait_for("another step", lambda: station.state("step")["name"] == "plan")
    station.picture("marker")
    assert station.errors == []
    context.close()


def test_a_world_of_its_own_is_driven_watched_recorded_and_replayed(
    open_page: Open, rest: Rest, home: Settings, tube: str
) -> None:
    """A point in a tube, by a mouse; its certificate keeps it in, and the page says what stopped it."""
    opened = f"sessionStorage.setItem('vfix-open', JSON.stringify({{ case: '{tube}', step: 'tube' }}));"
    there = f"if (window === top && !sessionStorage.getItem('vfix-open')) {opened}"
    station, watching = (open_page(script=there, sample=False).ready() for _ in range(2))
    expect(station.page.locator("#steps button:visible")).to_have_text(
        ["Patient", "Route", "Drive", "Review", "Marker", "Tube"]
    )
    station.page.click("#tube-start")
    station.wait_for("the point", lambda: station.rehearsal()["state"] == "running")
    watching.wait_for("the drive of the other page", lambda: watching.rehearsal()["state"] == "running")
    expect(watching.page.locator("#tube-words")).to_have_text("Another window holds the handle.")
    expect(watching.page.locator("#tube-lease")).to_be_disabled()
    for refused in ("rehearsal.take", "rehearsal.reset"):
        with pytest.raises(Exception, match="only the window that holds the handle"):
            watching.page.evaluate(f"vfix.request('{refused}')")

    def stopped_by(words: str) -> bool:
        return words in station.page.locator("#statusbar").inner_text()

    before = watching.rehearsal()["tip"]
    _press(station.page, "#tube-pad", 0.95)
    station.wait_for("the wall", lambda: stopped_by("The wall of the tube"))
    station.picture("tube")
    station.page.mouse.up()
    _press(station.page, "#tube-pad", 0.3)
    station.wait_for("a way back", lambda: station.rehearsal()["tip"][0] < 10.0)
    station.page.mouse.up()
    _press(station.page, "#tube-onward")
    station.wait_for("the end", lambda: stopped_by("The end of the tube"))
    station.page.mouse.up()
    tip = station.wait_for("rest", lambda: _resting(station))
    watching.wait_for("the same place", lambda: watching.rehearsal()["tip"] == tip)
    assert before == [0.0, 0.0, LENGTH_MM / 2]
    assert watching.rehearsal()["mine"] is False
    watching.see_scene()
    watching.wait_for("the point in the scene", lambda: watching.page.evaluate(IN_SCENE, tip))
    watching.picture("tube-watched")
    station.page.evaluate("vfix.request('rehearsal.end')")
    (run,) = station.wait_for("the run", lambda: rest.runs(tube))
    assert (run["world"], run["origin"], run["plan_id"]) == ("tube", "page", None)
    _replayed(home, run["id"], tip)
    assert station.errors == watching.errors == []


def _press(page: Page, selector: str, across: float = 0.5) -> None:
    """Press the mouse on an element, at a share of its width; the button stays down."""
    page.locator(selector).scroll_into_view_if_needed()
    box = page.locator(selector).bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + across * box["width"], box["y"] + 0.5 * box["height"])
    page.mouse.down()


def _resting(station: Workstation) -> Any:
    """The place of a point that nothing pushes any more."""
    before = station.rehearsal()["tip"]
    station.page.wait_for_timeout(300)
    now = station.rehearsal()["tip"]
    return now if now == before else None


def _replayed(home: Settings, run_id: str, tip: list[float]) -> None:
    """The stored run comes again bit by bit, never leaves the tube, and ends where the page showed the point."""
    store = Store(home)
    with RunService(store).laid_out(run_id) as folder:
        run = Run.read(folder)
    store.close()
    found = replay(run, TubeSpec.from_parts(run.manifest["spec"], run.arrays))
    assert found.same
    assert {refused_by(place) for place in run.rows} == {""}
    assert {state.held_by for state in found.states} == {"", "the wall of the tube", "the end of the tube"}
    np.testing.assert_allclose(run.rows[-1], tip, atol=1e-4)


def _red_share(page: Page) -> float:
    """How much of the scene's picture is as red as the marker."""
    picture = cv2.imdecode(np.frombuffer(page.locator("#scene").screenshot(), dtype=np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    blue, green, red = (picture[..., channel].astype(int) for channel in range(3))
    return float(np.mean((red > 80) & (red > 2 * green) & (red > 2 * blue)))
