"""What a newcomer is told: the keys, the first steps, and which step of a plan is next."""

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
    station.wait_for("a plan", lambda: station.state("plan"))
    station.drawn()
    expect(page.locator("#first-task"), "Plan has steps of its own").to_be_hidden()
    page.click("[data-step=patient]")
    expect(page.locator("#first-task")).to_be_visible()
    expect(steps).to_have_count(3)
    expect(current).to_contain_text("turn the head")
    station.settle()
    box = page.locator("#scene").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 200, box["y"] + 300)
    page.mouse.down()
    page.mouse.move(box["x"] + 240, box["y"] + 300)
    page.mouse.up()
    expect(current).to_contain_text("Choose a point")
    page.click("[data-step=plan]")
    page.locator("#points-table tbody tr").nth(3).click()
    page.click("[data-step=rehearse]")
    expect(current).to_contain_text("Rehearse")
    page.click("#first-task-hide")
    page.reload()
    station.ready()
    station.drawn()
    assert not page.locator("#first-task").is_visible()
    page.keyboard.press("?")
    expect(page.locator("#keys-filter"), "at its top").to_be_focused()
    page.keyboard.type("chosen arrows")
    expect(page.locator("#dialog .keys dt")).to_have_text(["M"])
    page.keyboard.press("Enter")  # nothing to choose
    expect(page.locator("#dialog[open]")).to_be_visible()
    page.locator("#keys-filter").fill("")
    page.click("#first-task-again")
    expect(page.locator("#first-task")).to_be_visible()
    expect(page.locator("#first-task li.done")).to_have_count(0)
    expect(page.locator("#first-task-hide")).to_be_focused()
    assert station.errors == []


def test_an_empty_plan_is_led_from_its_entry_to_its_path(open_page: Open, rest: Rest) -> None:
    """One step is open, the next one as soon as there is what it needs; what somebody opens stays, also in another
    window."""
    station, other = open_page().ready(), open_page().ready()
    plan_id = rest.empty_plan("Led")
    page, is_open = station.page, station.page.locator(".steps-numbered .step[open]")

    def opened(name: str) -> None:
        expect(is_open).to_have_count(1)
        expect(is_open).to_have_attribute("data-step-name", name)

    for one in (station, other):
        one.open_plan(plan_id)
        expect(one.page.locator("[data-step-name=entry]")).to_have_attribute("open", "")
    places = [point["position"] for point in rest.sample()["points"]]
    page.evaluate("(position) => vfix.request('pick.slice', { position })", places[3])
    station.wait_for("the entry", lambda: len(station.state("plan")["points"]) == 1)
    opened("targets")
    expect(page.locator("[data-kind=target]")).to_have_attribute("aria-pressed", "true")
    expect(page.locator("[data-step-name=entry] .step-line")).to_have_text("Choose a side", use_inner_text=True)
    expect(other.page.locator("[data-step-name=entry] .step-line")).to_have_text("Choose a side")
    expect(other.page.locator("[data-step-name=entry]")).to_have_attribute("open", "")
    expect(other.page.locator("[data-step-name=targets] .step-next")).to_have_count(1)
    station.open_step("tool")
    page.click("[data-kind=target]")  # a click adds nothing there, unless somebody says so
    page.evaluate("(position) => vfix.request('pick.slice', { position })", places[-1])
    station.wait_for("the target", lambda: station.state("plan")["targets"])
    expect(page.locator("[data-step-name=path] .step-next")).to_have_count(1)
    opened("tool")
    page.evaluate("document.getElementById('panel').scrollTop = 400")
    station.open_plan(rest.short_plan("Two points", 2))
    opened("path")
    station.wait_for("the panel from its top", lambda: page.evaluate("document.getElementById('panel').scrollTop") == 0)
    assert [*station.errors, *other.errors] == []


def test_suggest_is_five_tab_stops_from_the_panel(open_page: Open) -> None:
    """And every step is reached by arrow keys from the one that is open."""
    station = open_page().ready()
    page = station.page
    expect(page.locator("#suggest")).to_be_enabled()
    page.focus("#panel")
    stops = []
    while "suggest" not in stops:
        assert len(stops) < 5, stops
        page.keyboard.press("Tab")
        stops.append(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
    page.locator("[data-step-name=path] > summary").focus()
    page.keyboard.press("End")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    expect(page.locator("[data-step-name=check]")).to_have_attribute("open", "")
    expect(page.locator("[data-step-name=check] > summary")).to_be_focused()
    expect(page.locator(".steps-numbered .step[open]")).to_have_count(1)
    assert station.errors == []
