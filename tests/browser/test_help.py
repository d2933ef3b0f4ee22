"""What a newcomer is told: the keys, the first steps, and what to do with an empty plan."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def test_the_first_task_ticks_itself_off_once_and_is_called_back(open_page: Open) -> None:
    station = open_page(viewport={"width": 1280, "height": 800}).ready()
    page = station.page
    steps = page.locator("#first-task li")
    current = page.locator("#first-task li[aria-current]")
    assert steps.count() == 3
    assert "Turn the head" in current.inner_text()
    station.wait_for("a plan", lambda: station.state("plan"))
    page.wait_for_timeout(500)
    box = page.locator("#scene").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 200, box["y"] + 300)
    page.mouse.down()
    page.mouse.move(box["x"] + 240, box["y"] + 300)
    page.mouse.up()
    station.wait_for("the first tick", lambda: "Choose a point" in current.inner_text())
    page.locator("table.points tbody tr").nth(3).click()
    station.wait_for("the second tick", lambda: "Rehearse" in current.inner_text())
    page.click("#first-task-hide")
    page.reload()
    station.ready()
    assert not page.locator("#first-task").is_visible()
    page.keyboard.press("?")
    station.wait_for("the keys", lambda: page.locator("#dialog[open]").is_visible())
    page.click("#first-task-again")
    station.wait_for("the first task", lambda: page.locator("#first-task").is_visible())
    assert page.locator("#first-task li.done").count() == 0
    assert page.evaluate("document.activeElement.id") == "first-task-hide"
    assert station.errors == []


def test_an_empty_plan_shows_three_steps(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    station.open_plan(rest.empty_plan("Three steps"))
    page, steps = station.page, station.page.locator("#empty-plan")
    station.wait_for("the steps", steps.is_visible)
    assert steps.locator("li").count() == 3
    assert "goes in" in steps.locator("li[aria-current]").inner_text()
    in_air = rest.sample()["points"][3]["position"]
    page.evaluate("(position) => vfix.request('pick.slice', { position })", in_air)
    station.wait_for("the next step", lambda: "further in" in steps.locator("li[aria-current]").inner_text())
    station.open_plan(rest.short_plan("Two points", 2))
    station.wait_for("no steps", lambda: not steps.is_visible())
    assert station.errors == []
