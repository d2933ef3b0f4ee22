"""Tool and robot on the page: margin, base and shape are set and taken back, and explained on request."""

from __future__ import annotations

import re
from collections.abc import Callable

from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation


def test_margin_base_and_shape_are_set_and_taken_back(open_page: Callable[..., Workstation], rest: Rest) -> None:
    station = open_page(viewport={"width": 1440, "height": 900}).ready()
    station.open_plan(rest.short_plan("Tool", 2))
    station.open_step("tool")
    page, plan = station.page, lambda: station.state("plan")
    expect(page.locator("#tool-words")).to_be_hidden()
    page.click("[aria-label='About the tool']")
    expect(page.locator("#tool-words")).to_contain_text("Bent by 30°")

    page.fill("#plan-margin", "0.45")
    page.keyboard.press("Enter")
    station.wait_for("the margin", lambda: plan()["margin_mm"] == 0.45)
    expect(page.locator("#margin-words")).to_have_text("0.53 mm with 0.08 mm of scan error")
    page.click(".toast button:has-text('Undo')")
    station.wait_for("the margin before", lambda: plan()["margin_mm"] == 0.3)
    page.fill("#plan-margin", "9")
    page.keyboard.press("Tab")
    problem = page.locator("#plan-margin-problem")
    expect(problem).to_have_text("0.05 to 3 can be used. 0.3 is kept; Escape shows it again.")
    page.press("#plan-margin", "Escape")

    page.fill("#tool-radius", "1.2")
    page.keyboard.press("Enter")
    station.wait_for("another shape", lambda: plan()["tool"]["changed"])
    page.click("#tool-shipped")
    station.wait_for("the shipped shape", lambda: not plan()["tool"]["changed"])

    base = page.locator("#base-words")
    expect(base).to_have_text("Automatic")
    away = re.compile(r"^\d+ mm from entry$")
    expect(page.locator("#base-place")).to_have_text(away, timeout=1000.0 * DRIVEN_S)
    base.scroll_into_view_if_needed()
    station.picture("tool-step")
    page.click("#keep-base")
    station.wait_for("the base", lambda: plan()["robot"]["is_placed"])
    expect(base).to_have_text("Kept")
    page.click("#free-base")
    station.wait_for("no base", lambda: not plan()["robot"]["is_placed"])
    page.click(".toast button:has-text('Undo') >> nth=-1")
    station.wait_for("the base again", lambda: plan()["robot"]["is_placed"])
    page.click("#theme")
    station.picture("tool-step-kept")
    page.click("#lock")
    for control in ("#plan-margin", "#plan-tool", "#plan-robot", "#upload-robot", "#free-base"):
        expect(page.locator(control)).to_be_disabled()
    assert station.errors == []
