"""A gamepad and a SpaceMouse drive the robot, and it stops once they are at rest, silent or gone (HAZ-11)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

FAKES = (Path(__file__).parent / "fake_devices.js").read_text(encoding="utf-8")
FORWARD = 4.0  # mm that each device drives


def pushes(station: Workstation) -> bool:
    return bool(station.rehearsal()["force_n"] > 0.0)


def stands(station: Workstation) -> None:
    station.wait_for("no force", lambda: station.rehearsal()["force_n"] == 0.0)
    at = station.rehearsal_after(300.0)["progress_mm"]
    assert station.rehearsal_after(300.0)["progress_mm"] == at


def test_a_gamepad_and_a_space_mouse_drive_until_they_are_gone(open_page: Open, rest: Rest) -> None:
    station = open_page(viewport={"width": 1280, "height": 760}, script=FAKES).ready()
    page = station.page
    station.open_plan(rest.copy_of_sample("By devices"))
    page.click("[data-step=rehearse]")
    page.click("[data-device=gamepad]")
    expect(page.locator("#device-words")).to_contain_text("No gamepad")
    page.evaluate("fakes.plugPad()")
    expect(page.locator("#devices .axis")).to_have_count(6)
    page.evaluate("fakes.sticks(0, -1, 0, 0)")
    station.start()
    expect(page.locator("#device-words")).to_contain_text("Let go of it once")
    station.picture("device-gamepad")
    assert station.rehearsal_after(300.0)["force_n"] == 0.0

    def further() -> bool:
        return bool(station.rehearsal()["progress_mm"] > start + FORWARD)

    start = station.rehearsal()["progress_mm"]
    page.evaluate("fakes.sticks(0, 0, 0, 0)")
    expect(page.locator("#device-words")).to_contain_text("Test pad")
    page.evaluate("fakes.sticks(0, -1, 0, 0)")
    station.wait_for("a push of the stick", lambda: pushes(station))
    station.wait_for("motion", further, DRIVEN_S)
    page.evaluate("fakes.unplugPad()")
    stands(station)
    expect(page.locator("#device-words")).to_contain_text("No gamepad")

    page.click("[data-device=space-mouse]")
    page.click("#connect-device")
    expect(page.locator("#device-words")).to_contain_text("SpaceMouse Compact")
    start = station.rehearsal()["progress_mm"]
    page.evaluate("fakes.mouse.hold([0, -350, 0])")
    station.wait_for("a push of the cap", lambda: pushes(station))
    station.wait_for("motion", further, DRIVEN_S)
    station.picture("device-space-mouse")
    page.evaluate("fakes.mouse.silence()")
    stands(station)
    page.evaluate("fakes.mouse.hold([0, -350, 0])")
    station.wait_for("a push again", lambda: pushes(station))
    page.evaluate("fakes.unplugMouse()")
    stands(station)
    expect(page.locator("#device-words")).to_contain_text("was unplugged")
    page.click("#reset")
    assert station.errors == []
