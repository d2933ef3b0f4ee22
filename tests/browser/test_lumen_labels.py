"""A person does a small study II: turns the camera to a label by the mouse, and follows its arrow with the tool on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
HALF_FIELD = np.tan(np.radians(35.0))
MM_PER_WIDTH = 0.03 * 480  # that a drag over the whole picture moves the camera
DRAGS = 60  # to come to an arrow's end


def test_a_label_is_traced_by_the_mouse(open_page: Open, rest: Rest) -> None:
    station = open_page(sample=False, viewport={"width": 1280, "height": 900}).ready()
    page = station.page
    page.click("[data-step=patient]")
    page.locator("#cases .row-main", has_text="Body cavity").click()
    station.wait_for("the cavity", lambda: (station.state("case") or {}).get("id") == "cavity-phantom")
    expect(page.locator("#hint")).not_to_contain_text("Preparing", timeout=1000.0 * DRIVEN_S)
    page.click("[data-step=drive]")
    station.wait_for("the robot", lambda: station.rehearsal()["state"] == "ready", DRIVEN_S)
    expect(page.locator("[data-task=polyps]")).to_have_count(0)
    page.evaluate("(one) => vfix.request('drive.task', one)", {"task": "labels", "seed": 1, "count": 1})
    station.wait_for("the task", lambda: _labels(station) and station.rehearsal()["state"] == "ready", DRIVEN_S)
    expect(page.locator("[data-task=labels]")).to_have_attribute("aria-pressed", "true")
    page.click("#start")
    station.wait_for("the drive", lambda: station.rehearsal()["state"] == "running")
    station.wait_for("the picture", lambda: page.evaluate("Boolean(vfix.endoscope.renderer?.tissue)"), DRIVEN_S)
    expect(page.locator("#aim-marker")).to_be_visible()
    expect(page.locator("#snake-facts")).to_contain_text("Fixed, 5 links")
    station.picture("labels-start")

    label = _labels(station)["labels"][0]
    _aim(station, label, -10.0)
    expect(page.locator("#aim-marker")).to_have_attribute("data-on", "label")
    station.picture("labels-aimed")
    page.keyboard.down("x")
    for along in (-7.0, -4.0, -1.0):
        _aim(station, label, along, held="x")
    station.drive_until("x", "the cut", lambda: _labels(station)["labels"][0]["end_mm"] > -4.0)
    station.picture("labels-cutting")
    page.keyboard.up("x")
    left = _left(station)
    _aim(station, label, 4.0)
    assert _labels(station)["labels"][0]["end_mm"] == left  # nothing is cut while the button is not held
    _aim(station, label, left)
    page.keyboard.down("x")
    for along in (2.0, 4.0, 6.0, 8.0, 11.0):
        _aim(station, label, along, done=True, held="x")
    page.keyboard.up("x")
    expect(page.locator("#end-card")).to_contain_text("Labels traced", timeout=1000.0 * DRIVEN_S)
    station.picture("labels-card")
    (run,) = rest.runs("cavity-phantom")
    score = rest.client.get(f"/api/v1/runs/{run['id']}/score").raise_for_status().json()["task"]
    rows = {row["name"]: row["value"] for row in score["rows"]}
    assert (score["completed"], rows["Labels traced"]) == (True, 1.0)
    page.click("#run-replay")
    expect(page.locator(".review-plots .u-over").first).to_be_visible(timeout=1000.0 * DRIVEN_S)
    station.picture("labels-review")
    assert station.errors == []


def _labels(station: Workstation) -> Any:
    return (station.state("drive_task") or {}).get("labels")


def _left(station: Workstation) -> float:
    """Where what is left of the label ends, once the last of what was cut is told."""
    left = [0.0, 1.0]
    while left[-1] != left[-2]:
        station.page.wait_for_timeout(3000)
        left.append(float(_labels(station)["labels"][0]["end_mm"]))
    return left[-1]


def _aim(station: Workstation, label: Any, along_mm: float, done: bool = False, held: str | None = None) -> None:
    """Drag a place of the arrow into the middle of the picture, in small drags, until it is there.

    held: a key that is held meanwhile, and repeats.
    """
    page = station.page
    centre, along = np.array(label["centre"]), np.array(label["along"])
    place = centre + along_mm * along
    for _ in range(DRAGS):
        if done and (_labels(station) or {"completed": True})["completed"]:
            return
        if held:
            page.keyboard.down(held)
        x, y, far = _seen(page, place)
        if np.hypot(x, y) * far < 0.6:
            return
        way = np.array([x, y])
        _drag(page, -way * min(1.0, 6.0 / (np.hypot(x, y) * far + 1e-9)) * far)
    assert done, f"the camera did not come to {along_mm:g} mm of the arrow: it is {x * far:.1f}, {y * far:.1f} mm off"


def _seen(page: Page, place: np.ndarray[Any, Any]) -> tuple[float, float, float]:
    """A place as the camera sees it: to the right and down as shares of its distance, and that distance in mm."""
    pose = page.evaluate("vfix.endoscope.pose")
    ahead, up = (np.array(pose[name]) / np.linalg.norm(pose[name]) for name in ("shaft", "side"))
    up = up - (up @ ahead) * ahead
    up /= np.linalg.norm(up)
    off = place - np.array(pose["tip"])
    far = float(off @ ahead)
    if far <= 1.0:  # behind: to the side on which it is
        return float(np.sign(off @ np.cross(ahead, up))) * 0.5, -float(np.sign(off @ up)) * 0.5, 40.0
    return float(off @ np.cross(ahead, up)) / far, -float(off @ up) / far, far


def _drag(page: Page, way_mm: np.ndarray[Any, Any]) -> None:
    """Drag by a way of the camera in its image plane."""
    box = page.locator(".scope-picture").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0
    right, down = way_mm / MM_PER_WIDTH * box["width"]
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 5):
        page.mouse.move(x + right * step / 4, y + down * step / 4)
        page.wait_for_timeout(15)
    page.wait_for_timeout(80)
    page.mouse.up()
