"""What a newcomer is told: the keys, the first steps, and what to do with an empty plan."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def test_the_first_task_ticks_itself_off_once_and_is_called_back(open_page: Open) -> None:
    station = open_page(viewport={"width": 1280, "height": 800}).ready()
    page = station.page
    steps = page.locator("#first-task li")
    current = page.locator("#first-task li[aria-current]")
    expect(page.locator("#first-task")).to_be_visible()
    expect(steps).to_have_count(3)
    expect(current).to_contain_text("turn the head")
    station.wait_for("a plan", lambda: station.state("plan"))
    station.settle()
    box = page.locator("#scene").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 200, box["y"] + 300)
    page.mouse.down()
    page.mouse.move(box["x"] + 240, box["y"] + 300)
    page.mouse.up()
    expect(current).to_contain_text("Choose a point")
    page.locator("table.points tbody tr").nth(3).click()
    expect(current).to_contain_text("Rehearse")
    page.click("#first-task-hide")
    page.reload()
    station.ready()
    station.drawn()
    assert not page.locator("#first-task").is_visible()
    page.keyboard.press("?")
    expect(page.locator("#dialog[open]")).to_be_visible()
    page.click("#first-task-again")
    expect(page.locator("#first-task")).to_be_visible()
    expect(page.locator("#first-task li.done")).to_have_count(0)
    expect(page.locator("#first-task-hide")).to_be_focused()
    assert station.errors == []


def test_an_empty_plan_shows_three_steps(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    station.open_plan(rest.empty_plan("Three steps"))
    page, steps = station.page, station.page.locator("#empty-plan")
    expect(steps).to_be_visible()
    expect(steps.locator("li")).to_have_count(3)
    expect(steps.locator("li[aria-current]")).to_contain_text("goes in")
    in_air = rest.sample()["points"][3]["position"]
    page.evaluate("(position) => vfix.request('pick.slice', { position })", in_air)
    expect(steps.locator("li[aria-current]")).to_contain_text("further in")
    station.open_plan(rest.short_plan("Two points", 2))
    expect(steps).to_be_hidden()
    assert station.errors == []
