"""A step that the planner does not come with: one folder and one line, and it works on the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest
from playwright.sync_api import Browser, Page
from workstation import NO_ANTIALIASING, TOKEN, VIEWPORT, Planner, Workstation

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    started = Planner(tmp_path_factory.mktemp("home"), steps=("extra_steps.marker",))
    yield started
    started.stop()


def test_a_fourth_step_is_one_folder_and_one_line(browser: Browser, planner: Planner, artefacts: Path) -> None:
    """Its tab, its panel, its command with the answer, its section, its layer, its hint and its own address."""
    context = browser.new_context(viewport=VIEWPORT)
    context.add_init_script(NO_ANTIALIASING)
    page = context.new_page()
    page.set_default_timeout(60_000)
    station = Workstation(page, artefacts)
    page.goto(f"{planner.base}/?token={TOKEN}")
    station.ready()
    assert page.locator("#steps button").all_inner_texts() == ["Patient", "Plan", "Register", "Rehearse", "Marker"]
    page.click("[data-step=marker]")
    station.wait_for("the panel", lambda: page.locator("#marker-words").is_visible())
    assert station.state("marker") is None
    assert _red_share(page) < 0.01
    page.click("#lay-marker")
    station.wait_for("the section", lambda: (station.state("marker") or {}).get("laid") == 1)
    station.wait_for("the panel's words", lambda: page.locator("#marker-words").inner_text() == "Laid 1 times.")
    assert station.state("marker")["position"] == station.state("slices")["cross"]
    station.wait_for("the layer", lambda: _red_share(page) > 0.1)
    assert page.evaluate("vfix.request('marker.lay')") == 2
    words = httpx.get(f"{planner.base}/api/steps/marker/words", headers={"Authorization": f"Bearer {TOKEN}"})
    assert words.json() == {"words": "a marker"}
    assert httpx.get(f"{planner.base}/api/steps/marker/words").status_code == 401
    warm = "the hint, once the planner has compiled its kernels"
    station.wait_for(warm, lambda: "marker is laid" in page.locator("#hint").inner_text(), patience_s=300.0)
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
