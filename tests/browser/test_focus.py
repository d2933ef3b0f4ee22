"""A press that has begun is not taken away by what the planner says meanwhile."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
FOCUSED = "document.activeElement.id"


def test_a_key_that_is_down_outlives_every_redraw_of_the_plan(open_page: Open, rest: Rest) -> None:
    """Between the press and the release of Space the tool, the verdict and the plan's name change."""
    station = open_page().ready()
    plan_id = rest.copy_of_sample("Pressed")
    station.open_plan(plan_id)
    page = station.page
    station.open_step("tool")
    page.focus("#upload-robot")
    opened = station.watch_chooser("#urdf-file")
    page.keyboard.down("Space")
    page.evaluate("vfix.request('plan.tool', { name: 'straight_pointer' })")
    station.wait_for("the tool", lambda: station.state("plan")["tool"]["name"] == "straight_pointer")
    page.evaluate("(plan_id) => vfix.request('plan.rename', { plan_id, name: 'Renamed' })", plan_id)
    expect(page.locator("#where-plan")).to_contain_text("Renamed")
    station.wait_for("the verdict", lambda: (station.state("corridor") or {}).get("state") == "current", DRIVEN_S)
    station.drawn()
    assert page.evaluate(FOCUSED) == "upload-robot"
    assert opened.count() == 0, "it is pressed once it is let go of"
    page.keyboard.up("Space")
    expect(opened).to_have_count(1)
    assert station.errors == []


def test_a_list_keeps_its_choices_through_a_redraw(open_page: Open, rest: Rest) -> None:
    """Choices that are made anew close a list that is open, and forget what was typed in it."""
    station = open_page().ready()
    station.open_plan(rest.copy_of_sample("Lists"))
    page = station.page
    lists = ("#plan-robot", "#plan-tool")
    station.open_step("tool")
    expect(page.locator("#plan-tool option").nth(1)).to_be_attached()
    before = [page.evaluate_handle(f"document.querySelector('{name} option')") for name in lists]
    page.focus("#plan-tool")
    page.evaluate("vfix.request('plan.tool', { name: 'bent_30', shaft_radius_mm: 1.2 })")
    expect(page.locator("#plan-tool option:checked")).to_contain_text("changed")
    expect(page.locator("#plan-tool")).to_have_value("bent_30")
    assert [page.evaluate("(option) => option.isConnected", option) for option in before] == [True, True]
    assert page.evaluate(FOCUSED) == "plan-tool"
    assert station.errors == []
