"""The command palette: an operation, a tab, a head, a plan or a place by its name, with the keyboard alone."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def choose(page: Page, typed: str) -> None:
    page.keyboard.press("Control+k")
    expect(page.locator("#palette")).to_be_focused()
    page.keyboard.type(typed)
    expect(page.locator("#palette-list [aria-selected=true]")).to_be_visible()
    page.keyboard.press("Enter")
    expect(page.locator("#dialog[open]")).to_have_count(0)


def test_everything_is_found_by_its_name(open_page: Open, rest: Rest) -> None:
    other = rest.empty_plan("Sphenoid, second look")
    station = open_page().ready()
    page = station.page
    expect(page.locator("#lock")).to_be_enabled()

    choose(page, "set notes")  # needs more words: its field gets the focus, unfolded
    expect(page.locator("#plan-notes")).to_be_focused()
    choose(page, "register")  # from within a field
    station.wait_for("the tab", lambda: station.state("step")["name"] == "register")
    choose(page, "second look")
    station.wait_for("the other plan", lambda: (station.state("plan") or {}).get("id") == other)
    choose(page, "lock plan")  # of a tab that is not shown: it comes, and the plan is locked
    station.wait_for("the lock", lambda: station.state("step")["name"] == "plan" and station.state("plan")["locked"])
    choose(page, "lock plan")
    station.wait_for("it is open again", lambda: not station.state("plan")["locked"])
    choose(page, "R 5 A 10 S 3")
    station.wait_for("the place", lambda: station.state("slices")["cross"] == pytest.approx([-5.0, -10.0, 3.0]))
    choose(page, "layers")
    expect(page.locator("#look")).to_be_visible()
    page.keyboard.press("Escape")
    choose(page, "patient")
    page.locator("#hint").get_by_role("button", name="Go to Plan", exact=True).click()  # the hint's next step
    station.wait_for("the tab", lambda: station.state("step")["name"] == "plan")
    assert station.errors == []


def test_keys_choose_and_escape_leaves(open_page: Open) -> None:
    station = open_page().ready()
    page = station.page
    page.keyboard.press("Control+k")
    rows = page.locator("#palette-list li")
    expect(rows.first).to_have_attribute("aria-selected", "true")
    page.keyboard.press("ArrowUp")  # around the end
    expect(rows.last).to_have_attribute("aria-selected", "true")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    expect(rows.nth(1)).to_have_attribute("aria-selected", "true")
    assert page.locator("#palette").get_attribute("aria-activedescendant") == "palette-1"
    page.keyboard.type("qqqq")
    expect(page.get_by_text("Nothing has that name.")).to_be_visible()
    page.keyboard.press("Enter")  # nothing to do
    expect(page.locator("#dialog[open]")).to_be_visible()
    station.picture("palette")
    page.keyboard.press("Escape")
    expect(page.locator("#dialog[open]")).to_have_count(0)
    page.keyboard.press("Control+k")
    expect(page.locator("#palette")).to_be_focused()
    page.keyboard.type("lay")
    station.picture("palette-layouts")
    assert station.errors == []


def offered(page: Page, typed: str, why: str) -> None:
    """The palette has an entry of that name that says why it cannot be used now, and Enter does nothing."""
    page.keyboard.press("Control+k")
    expect(page.locator("#palette")).to_be_focused()
    page.keyboard.type(typed)
    first = page.locator("#palette-list li").first
    expect(first).to_contain_text(why)
    expect(first).to_have_attribute("aria-disabled", "true")
    page.keyboard.press("Enter")
    expect(page.locator("#dialog[open]")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#dialog[open]")).to_have_count(0)


def test_what_cannot_be_used_says_why_and_does_nothing(open_page: Open, rest: Rest) -> None:
    plan = rest.copy_of_sample("Untouched rows")
    rest.client.post(f"/api/v1/plans/{plan}/versions", json={"name": "As it was"}).raise_for_status()
    station = open_page().ready()
    station.open_plan(plan)
    page = station.page
    expect(page.locator("#versions li")).to_have_count(1)
    station.wait_for("the slices, in which places are", lambda: station.state("slices"))
    before = rest.plan(plan)["revision"]
    offered(page, "delete version", "choose one first")
    offered(page, "R 5 A", "R or L, A or P, S or I, in mm")
    offered(page, "R 900 A 10 S 3", "outside the scan")
    offered(page, "untouched rows", "open now")
    assert rest.plan(plan)["revision"] == before
    assert [version["name"] for version in station.state("versions")["items"]] == ["As it was"]
    assert station.errors == []
