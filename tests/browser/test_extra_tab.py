"""A step that the planner does not come with: one folder and one line, and it works on the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest
from page_scripts import NO_ANTIALIASING
from playwright.sync_api import Browser, Page, expect
from workstation import DRIVEN_S, PATIENCE_MS, TOKEN, VIEWPORT, Planner, Workstation

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    started = Planner(tmp_path_factory.mktemp("home"), tabs=("extra_tabs.marker",))
    yield started
    started.stop()


def test_a_fourth_step_is_one_folder_and_one_line(browser: Browser, planner: Planner, artefacts: Path) -> None:
    """Its tab, its panel, its command with the answer, its section, its layer, its hint and its own address."""
    context = browser.new_context(viewport=VIEWPORT)
    context.add_init_script(NO_ANTIALIASING)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    station = Workstation(page, artefacts)
    page.goto(f"{planner.base}/?token={TOKEN}")
    station.ready()
    expect(page.locator("#steps button")).to_have_text(["Patient", "Plan", "Register", "Rehearse", "Marker"])
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


def _red_share(page: Page) -> float:
    """How much of the scene's picture is as red as the marker."""
    picture = cv2.imdecode(np.frombuffer(page.locator("#scene").screenshot(), dtype=np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    blue, green, red = (picture[..., channel].astype(int) for channel in range(3))
    return float(np.mean((red > 80) & (red > 2 * green) & (red > 2 * blue)))
