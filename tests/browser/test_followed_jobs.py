"""Long jobs on the page: each is followed after a reload and in a second window, and waits for its turn in sight."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
ENTRY, TARGET = [7.5, -14.0, -6.0], [3.0, 65.0, -3.5]
IN_BONE = [13.0, 61.0, -5.0]  # in the box of distance fields that is measured for TARGET
WIDE = {"width": 1440, "height": 900}
# Every text that a button has had.
TEXTS = """(button) => {
  window.texts = [button.textContent];
  const changes = { childList: true, subtree: true, characterData: true };
  new MutationObserver(() => window.texts.push(button.textContent)).observe(button, changes);
}"""


# The row of a search is there before the answer that names it.
LATE_ANSWERS = """() => {
  const fetched = window.fetch;
  window.fetch = async (...request) => {
    const answer = await fetched(...request);
    await new Promise((done) => setTimeout(done, request[1]?.method === "POST" ? 3000 : 0));
    return answer;
  };
}"""


def plan_with_two_targets(rest: Rest) -> str:
    plan = rest.copy_of_sample("Two targets")
    rest.client.patch(f"/api/v1/plans/{plan}", json={"tool": {"name": "straight_pointer"}}).raise_for_status()
    for target in rest.plan(plan)["targets"]:
        rest.client.delete(f"/api/v1/plans/{plan}/points/{target['id']}").raise_for_status()
    for label, position in (("Sinus", TARGET), ("Bone", IN_BONE)):
        wish = {"label": label, "position": position}
        rest.client.post(f"/api/v1/plans/{plan}/targets", json=wish).raise_for_status()
    return plan


def searches_of_others(rest: Rest) -> list[str]:
    """Ids of searches in other plans of the head, behind which the test's own ones wait however fast they are."""
    wishes = ({"target": [3.0, 65.0 - number, -3.5]} for number in range(4))
    path = f"/api/v1/plans/{rest.copy_of_sample('Of others')}/suggestions"
    return [rest.client.post(path, json=wish).raise_for_status().json()["id"] for wish in wishes]


def jobs(station: Workstation, kind: str) -> list[Any]:
    return [job for job in station.state("jobs")["items"] if job["kind"] == kind]


def test_a_second_search_waits_in_sight_and_both_are_answered_also_after_a_reload(open_page: Open, rest: Rest) -> None:
    station = open_page(viewport=WIDE).ready()
    page = station.page
    before = searches_of_others(rest)
    station.open_plan(plan_with_two_targets(rest))
    station.open_step("path")
    group = page.locator("[data-step-name=path]")
    target, rows = group.locator("select").first, group.locator(".jobs:visible > .job")
    target.select_option(label="Sinus")
    page.evaluate(LATE_ANSWERS)
    page.click("#suggest")
    expect(rows).to_have_count(1)
    expect(page.locator("#suggest")).to_have_attribute("aria-disabled", "true")  # towards this target
    target.select_option(label="Bone")
    expect(page.locator("#suggest")).to_have_attribute("aria-disabled", "false")
    page.click("#suggest")
    expect(rows).to_have_count(2)
    expect(rows.nth(1).locator(".words")).to_have_text("Bone: waiting for its turn")
    station.picture("searches-queue")

    page.reload()
    station.ready()
    station.open_step("path")
    expect(rows).to_have_count(2)
    expect(rows.nth(0).locator(".words")).to_have_text(re.compile("^Sinus: "))
    other = open_page(viewport=WIDE).ready()
    other.open_plan(station.state("plan")["id"])
    other.open_step("path")
    expect(other.page.locator("[data-step-name=path] .jobs:visible > .job")).not_to_have_count(0)

    for job in before:
        rest.client.delete(f"/api/v1/jobs/{job}")
    for window in (station, other):
        answers = window.page.locator("#answers button")
        window.wait_for("both answers", lambda answers=answers: answers.count() == 2, DRIVEN_S)  # type: ignore[misc]
        expect(answers.nth(1)).to_have_text("Bone: no way")
        expect(answers.nth(0)).to_have_text(re.compile(r"^Sinus: \d ways?$"))
    expect(page.locator("#alternatives")).to_be_visible()  # the first answer stays until somebody asks for the other
    page.locator("#answers button").nth(1).click()
    expect(page.locator("#no-way")).to_be_visible()
    page.locator("#answers button").nth(0).click()
    expect(page.locator("#alternatives")).to_be_visible()
    station.picture("searches-answered")
    assert station.errors == []


def test_a_table_of_tools_is_followed_after_a_reload(open_page: Open, rest: Rest) -> None:
    station = open_page(viewport=WIDE).ready()
    page = station.page
    plan = rest.copy_of_sample("Tools after a reload")
    station.open_plan(plan)
    wish = {"entry": ENTRY, "target": TARGET}
    search = rest.client.post(f"/api/v1/plans/{plan}/suggestions", json=wish).raise_for_status().json()["id"]
    station.open_step("tool")
    page.click("#which-tool")
    station.wait_for("the table behind the search", lambda: jobs(station, "tools"))
    page.reload()
    station.ready()
    station.open_step("tool")
    row = page.locator("[data-step-name=tool] .jobs > .job")
    expect(row).to_have_count(1)
    expect(page.locator("#which-tool")).to_have_attribute("aria-disabled", "true")
    rest.client.delete(f"/api/v1/jobs/{search}").raise_for_status()
    station.wait_for("the table", lambda: page.locator("#tool-table tbody tr").count() > 5, DRIVEN_S)
    expect(page.locator("#tools-words")).to_have_text("Click a tool to choose it.", use_inner_text=True)
    expect(row).to_have_count(0)
    assert station.errors == []


def test_beads_and_a_refinement_that_another_window_asks_for_are_followed(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    page = station.page
    station.open_plan(rest.copy_of_sample("Followed"))
    page.click("[data-step=register]")
    page.click("#begin-registration")
    key = station.wait_for("the registration", lambda: station.state("registration"))["id"]
    find = page.locator("#find-beads")
    expect(find).to_have_text("Find beads")
    find.evaluate(TEXTS)
    rest.client.post(f"/api/v1/registrations/{key}/beads", json={}).raise_for_status()
    station.wait_for("the beads", lambda: len(station.state("registration")["beads"]) == 5, DRIVEN_S)
    expect(find).to_have_text("Find again")
    assert "Looking …" in page.evaluate("texts")

    page.click("#confirm-beads")
    page.click("#touch-all")
    station.wait_for("the fit", lambda: station.state("registration")["fit"]["state"] == "fitted")
    station.open_step("refine")
    page.locator("#surface-state").evaluate(
        """() => {
          window.rows = [];
          const list = document.querySelector("[data-step-name=refine] .jobs");
          new MutationObserver(() => window.rows.push(list.children.length)).observe(list, { childList: true });
        }"""
    )
    rest.client.post(f"/api/v1/registrations/{key}/surface/touch", json={}).raise_for_status()
    expect(page.locator("#surface-state")).to_contain_text("60 points on Bone, simulated")
    station.wait_for("the row that goes", lambda: page.evaluate("rows.at(-1)") == 0)
    assert 1 in page.evaluate("rows")
    expect(page.locator("#refine-surface")).to_be_enabled()
    assert station.errors == []
    rest.client.delete(f"/api/v1/registrations/{key}").raise_for_status()
