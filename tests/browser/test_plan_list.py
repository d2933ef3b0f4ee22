"""The plans of the head: one click from the panel and from the title bar, found by name, and out of the way again."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def test_the_list_is_opened_filtered_and_closed(open_page: Open, rest: Rest) -> None:
    plans = [rest.empty_plan(f"Other plan {number}") for number in range(8)]
    station = open_page(viewport={"width": 1280, "height": 800}).ready()
    page, plan_list = station.page, station.page.locator("#plans-popover")
    page.click("#plans")
    expect(page.locator("#filter-plans")).to_be_focused()
    expect(page.locator("#plan-list li")).to_have_count(9)
    page.keyboard.type("PLAN 5")
    expect(page.locator("#plan-list li")).to_have_count(1)
    station.picture("plans")

    # Escape closes what was opened last: the list, and only then what a click would add.
    page.keyboard.press("Escape")
    expect(plan_list).to_be_hidden()
    expect(page.locator("#plans")).to_be_focused()
    page.evaluate("vfix.request('pick.slice', { position: [60, 40, 40] })")
    expect(page.locator("#ghost-card")).to_be_visible()
    page.click("#plans")
    page.keyboard.press("Escape")
    expect(plan_list).to_be_hidden()
    assert station.state("plan")["ghost"]
    page.keyboard.press("Escape")
    station.wait_for("no ghost", lambda: station.state("plan")["ghost"] is None)

    # From the title bar, in any tab; a plan that is chosen is opened, and the list has gone.
    page.click("[data-step=register]")
    station.wait_for("Register", lambda: station.state("step")["name"] == "register")
    page.click("#where-plan")
    expect(plan_list).to_be_visible()
    page.click("#plan-list .row-main:has-text('Other plan 5')")
    station.wait_for("the plan", lambda: station.state("plan")["id"] == plans[5])
    expect(plan_list).to_be_hidden()
    page.click("#where-plan")
    expect(plan_list).to_be_visible()
    page.click("#where-plan")
    expect(plan_list).to_be_hidden()

    # A question lies above the list, which is there again with the new name.
    page.click("#plans")
    row = page.locator("#plan-list .row[aria-current=true]")
    row.get_by_role("button", name="Rename").click()
    page.fill("#dialog input", "Renamed plan")
    page.keyboard.press("Enter")
    expect(row).to_contain_text("Renamed plan")
    assert station.errors == []
