"""Suggested paths, the table of tools and the shaft's direction on the page, with mouse and keyboard."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

OpenPage = Callable[..., Workstation]

INNER = [8.0, -2.0, -5.0]
IN_BONE = [0.0, 25.0, 60.0]
ENTRY, TARGET = [7.5, -14.0, -6.0], [3.0, 65.0, -3.5]
WIDE = {"width": 1440, "height": 900}


def plan_with_ends(rest: Rest) -> str:
    plan = rest.client.post("/api/v1/cases/head-phantom/plans", json={"name": "Suggest"}).json()
    tool = {"tool": {"name": "straight_pointer"}}  # of which two ways pierce nothing
    rest.client.patch(f"/api/v1/plans/{plan['id']}", json=tool).raise_for_status()
    rest.client.post(f"/api/v1/plans/{plan['id']}/points", json={"position": ENTRY})
    rest.client.post(f"/api/v1/plans/{plan['id']}/targets", json={"position": TARGET})
    return str(plan["id"])


def shaft(station: Workstation) -> Any:
    return station.state("shaft")


def test_a_path_is_suggested_previewed_used_and_undone(open_page: OpenPage, rest: Rest) -> None:
    station = open_page(viewport=WIDE).ready()
    plan_id = plan_with_ends(rest)
    station.open_plan(plan_id)
    page = station.page
    page.locator("#suggest").scroll_into_view_if_needed()
    station.picture("suggest-before")
    page.click("#suggest")
    expect(page.locator(".job [data-tool=cancel]:visible")).to_have_count(1)
    page.reload()
    station.ready()
    expect(page.locator("#suggest")).to_have_attribute("aria-disabled", "true")  # the search goes on, and is followed
    station.wait_for("the alternatives", lambda: page.locator("#alternatives button").count() > 1, DRIVEN_S)
    station.wait_for("the preview", lambda: (shaft(station)["shown"] or "").endswith(" 0"))
    cards = page.locator("#alternatives .alternative")
    figures = cards.first.locator(".way-figure")
    assert [words.split("\n")[0] for words in figures.all_inner_texts()] == ["bone", "in soft tissue", "length"]
    tops = [card.locator(".way-figure").last.bounding_box() for card in cards.all()[:2]]
    assert len({box["y"] for box in tops if box}) == 1  # side by side
    expect(page.locator("#alternatives .way-picture svg")).to_have_count(cards.count())
    page.mouse.move(720, 4)  # the first move of a page that was loaded anew has no length
    cards.nth(1).hover()
    station.wait_for("the other preview", lambda: shaft(station)["shown"].endswith(" 1"))
    cards.nth(1).focus()
    page.keyboard.press("Home")
    station.wait_for("the first preview", lambda: shaft(station)["shown"].endswith(" 0"))
    expect(cards.first).to_be_focused()
    shown = [
        cards.first.locator(".way-verdict").inner_text().strip(),
        *(text.split("\n")[-1] for text in figures.all_inner_texts()),
    ]
    page.mouse.move(720, 4)  # else scrolling brings another way under the pointer, which previews it
    page.locator("#use-suggestion").scroll_into_view_if_needed()
    station.picture("suggest-alternatives")
    page.click("#use-suggestion")
    station.wait_for("the path", lambda: len(station.state("plan")["points"]) > 5)
    station.wait_for("no preview", lambda: shaft(station)["shown"] is None)
    station.wait_for("the dry run", lambda: station.state("corridor")["status"] == "done", DRIVEN_S)
    assert station.state("corridor")["level"] != "blocked"
    chips = [" ".join(words.split()) for words in page.locator("#card .chip").all_inner_texts()]
    assert page.locator("#card .card-word").inner_text().split("\n")[0].startswith(shown[0])
    assert {f"bone {shown[1]}", f"in soft tissue {shown[2]}"} <= set(chips)  # the card says what the way has said
    station.picture("suggest-used")
    standing = page.locator("#suggest-words")
    expect(standing).to_have_text(re.compile(r"^The path follows way 1\."), use_inner_text=True)
    expect(page.locator("#alternatives li[aria-current=true]")).to_have_count(1)
    page.locator("#undo").click()
    station.wait_for("the undone path", lambda: len(station.state("plan")["points"]) == 1)
    expect(standing).to_have_text(re.compile("^Choose a way"), use_inner_text=True)
    expect(page.locator("#alternatives li[aria-current=true]")).to_have_count(0)
    rest.client.post(f"/api/v1/plans/{plan_id}/points", json={"position": INNER}).raise_for_status()
    expect(standing).to_have_text(re.compile("^Plan changed"), use_inner_text=True)
    assert station.errors == []


def test_where_no_way_is_found_the_path_ends_there_or_bone_is_removed(open_page: OpenPage, rest: Rest) -> None:
    station = open_page(viewport=WIDE).ready()
    plan_id = plan_with_ends(rest)
    [target] = rest.client.get(f"/api/v1/plans/{plan_id}").json()["targets"]
    rest.client.patch(f"/api/v1/plans/{plan_id}/points/{target['id']}", json={"position": IN_BONE}).raise_for_status()
    station.open_plan(plan_id)
    page = station.page
    page.click("#suggest")
    station.wait_for("the answer", lambda: page.locator("#no-way").count(), DRIVEN_S)
    words = page.locator("#suggest-words")
    expect(words).to_have_text(f"No way to {target['label']}: the target lies in bone.", use_inner_text=True)
    expect(page.locator("#suggest")).to_be_focused()
    expect(page.locator("[data-step-name=path] .step-line")).to_have_text("No way found")
    expect(page.locator("#no-way")).to_be_in_viewport()
    station.picture("suggest-no-way")
    page.click("#remove-there")
    station.wait_for("the region", lambda: station.state("regions")["items"])
    [region] = station.state("regions")["items"]
    assert region["purpose"] == "remove"
    assert station.state("regions")["selected"] == region["id"]
    expect(words).to_contain_text("Plan changed")
    page.locator("#undo").click()
    station.wait_for("no region", lambda: not station.state("regions")["items"])
    page.click("#end-there")
    station.wait_for("the ways", lambda: page.locator("#alternatives button").count(), DRIVEN_S)
    kept, added = station.state("plan")["targets"]
    assert (kept["label"], kept["position"]) == (target["label"], IN_BONE), "what was aimed at stays"
    assert added["label"] == f"before {target['label']}"
    assert math.dist(added["position"], region["place"]) < region["sizes_mm"][0], "the ball is where the way ends"
    expect(page.locator("[data-step-name=path] select")).to_have_value(added["id"])
    station.picture("suggest-ends-there")
    page.locator("#undo").click()
    station.wait_for("one target again", lambda: len(station.state("plan")["targets"]) == 1)
    assert station.errors == []


def test_tools_are_compared_and_one_is_chosen(open_page: OpenPage, rest: Rest) -> None:
    station = open_page(viewport=WIDE).ready()
    station.open_plan(rest.copy_of_sample("Tools"))
    page = station.page
    station.open_step("tool")
    page.locator("#which-tool").scroll_into_view_if_needed()
    page.click("#which-tool")
    station.wait_for("the table", lambda: page.locator("#tool-table tbody tr").count() > 5, DRIVEN_S)
    page.locator("#tool-table").scroll_into_view_if_needed()
    station.picture("suggest-tools")
    words = page.locator("#tools-words")
    expect(words).to_have_text("Click a tool to choose it.", use_inner_text=True)
    assert page.locator("#tool-table .tool-picture").count() == page.locator("#tool-table tbody tr").count()
    chosen = page.locator("#tool-table tr[aria-selected=true]")
    card = [
        page.locator("#card .card-word").inner_text().split("\n")[0],
        page.locator("#card .chip b").all_inner_texts(),
    ]
    assert chosen.locator(".way-verdict").inner_text().strip() == card[0].split(":")[0].strip()
    assert set(chosen.locator("td").all_inner_texts()[2:]) <= set(card[1])  # the card's figures
    chosen.focus()
    page.keyboard.press("End")
    expect(page.locator("#tool-table tbody tr").last).to_be_focused()
    page.locator("#tool-table tr[data-tool=straight_pointer]").focus()
    page.keyboard.press("Enter")
    station.wait_for("the tool", lambda: station.state("plan")["tool"]["name"] == "straight_pointer")
    expect(page.locator("#tool-table tr[data-tool=straight_pointer][aria-selected=true]")).to_have_count(1)
    page.locator("#undo").click()
    station.wait_for("the undone tool", lambda: station.state("plan")["tool"]["name"] != "straight_pointer")
    point = station.state("plan")["points"][-1]["id"]
    page.evaluate("(id) => vfix.request('item.delete', { item_id: id })", point)
    expect(words).to_have_text(re.compile("^Plan changed"), use_inner_text=True)
    assert station.errors == []


def test_the_shaft_is_aimed_by_a_click_and_left_open_again(open_page: OpenPage, rest: Rest) -> None:
    station = open_page().ready()
    station.open_plan(rest.short_plan("Aim", 2))
    page = station.page
    point = station.state("plan")["points"][1]["id"]
    page.locator(f"tr[data-item='{point}']").click()
    station.wait_for("the point", lambda: shaft(station)["point"] == point)
    assert shaft(station)["words"] == ""
    page.locator("#aim-shaft").scroll_into_view_if_needed()
    page.click("#aim-shaft")
    station.wait_for("aiming", lambda: shaft(station)["aiming"])
    expect(page.locator(".hint")).to_contain_text("passes behind the tip")
    page.keyboard.press("Escape")
    station.wait_for("no aiming", lambda: not shaft(station)["aiming"])
    page.click("#aim-shaft")
    station.wait_for("aiming again", lambda: shaft(station)["aiming"])
    station.slices_stand()
    box = page.locator(".slice-stage[data-axis=axial]").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.5)
    station.wait_for("the direction", lambda: shaft(station)["words"].startswith("The shaft leaves "))
    assert not shaft(station)["aiming"]
    assert len(station.state("plan")["points"]) == 2  # the click aimed, it added nothing
    page.locator("#shaft-roll").fill("30")
    page.keyboard.press("Tab")
    station.wait_for("the roll", lambda: shaft(station)["roll_deg"] == 30)
    station.picture("suggest-shaft")
    page.click("#clear-shaft")
    station.wait_for("an open direction", lambda: shaft(station)["words"] == "")
    page.locator("#undo").click()
    station.wait_for("the direction again", lambda: shaft(station)["roll_deg"] == 30)
    assert station.errors == []
