"""Protected structures, bone to be removed and paths on the page, with mouse and keyboard."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect
from workstation import Rest, Workstation

OpenPage = Callable[..., Workstation]


@pytest.fixture
def station(open_page: OpenPage, rest: Rest) -> Workstation:
    """A plan of two points, so that nothing long is driven."""
    page = open_page().ready()
    page.open_plan(rest.short_plan("Regions", 2))
    page.open_step("protect")
    page.slices_stand()
    return page


def items(station: Workstation) -> list[Any]:
    return list(station.state("regions")["items"])


def click_slice(station: Workstation, along: float = 0.0) -> None:
    """Beside the points of the path, which a press would grab; along: further towards the back."""
    box = station.page.locator(".slice-stage[data-axis=axial]").bounding_box()
    assert box is not None
    station.page.mouse.click(box["x"] + box["width"] * 0.5 + 24, box["y"] + box["height"] * (0.4 + along))


def test_a_structure_is_drawn_named_softened_and_undone(station: Workstation) -> None:
    page = station.page
    page.select_option("#protect-kind", "sphere")
    page.fill("#protect-size", "4")
    page.click("#protect-draw")
    station.wait_for("drawing", lambda: station.state("regions")["drawing"])
    click_slice(station)
    station.wait_for("the sphere", lambda: len(items(station)) == 1)
    assert items(station)[0]["sizes_mm"] == [4]
    assert len(station.state("plan")["points"]) == 2
    page.wait_for_selector("#protect-name:visible")
    page.fill("#protect-name", "Optic nerve")
    page.keyboard.press("Tab")
    station.wait_for("its name", lambda: items(station)[0]["name"] == "Optic nerve")
    page.select_option("#protect-soft", "soft")
    page.wait_for_selector("#protect-depth:visible")
    page.fill("#protect-depth", "1.5")
    page.keyboard.press("Enter")
    station.wait_for("its depth", lambda: items(station)[0]["max_depth_mm"] == 1.5)
    page.press("#protect-name", "End")
    page.keyboard.press("Delete")  # of text, in a field within the row
    page.locator("#protect-list").scroll_into_view_if_needed()
    station.picture("protect")
    page.fill("#protect-margin", "50")
    page.keyboard.press("Tab")
    page.wait_for_selector("text=0 to 20 can be used. 1 is kept; Escape shows it again.")
    expect(page.locator("#protect-margin")).to_have_attribute("aria-invalid", "true")
    page.press("#protect-margin", "Escape")
    expect(page.locator("#protect-margin")).to_have_value("1")
    expect(page.locator("#protect-margin")).not_to_have_attribute("aria-invalid", "true")
    station.page.locator("#undo").click()
    station.wait_for("the undone depth", lambda: items(station)[0]["max_depth_mm"] is None)
    page.focus("#protect-list .row-main")
    page.keyboard.press("Delete")
    station.wait_for("no structure", lambda: not items(station))
    assert station.errors == []


def test_a_place_is_shown_in_tenths_and_an_axis_that_is_not_typed_stays(station: Workstation) -> None:
    """Three more digits were cut off by the field."""
    page = station.page
    page.click("#protect-draw")
    station.wait_for("drawing", lambda: station.state("regions")["drawing"])
    click_slice(station)
    station.wait_for("the sphere", lambda: len(items(station)) == 1)
    before = items(station)[0]["place"]
    page.wait_for_selector("#protect-place:visible")
    shown = re.fullmatch(r"([LR]) ([\d.]+) ([PA]) ([\d.]+) ([SI]) ([\d.]+) mm", page.input_value("#protect-place"))
    assert shown is not None
    signs = [1.0 if letter in "LPS" else -1.0 for letter in shown.groups()[::2]]
    assert [sign * float(text) for sign, text in zip(signs, shown.groups()[1::2], strict=True)] == pytest.approx(
        before, abs=0.051
    )
    assert all(len(text.partition(".")[2]) == 1 for text in shown.groups()[1::2])
    page.fill("#protect-place", "somewhere")
    page.keyboard.press("Tab")
    expect(page.locator("#protect-place")).to_have_attribute("aria-invalid", "true")
    page.fill("#protect-place", " ".join([*shown.groups()[:4], "S 3.5"]))
    page.keyboard.press("Tab")
    station.wait_for("the new height", lambda: items(station)[0]["place"][2] == 3.5)
    assert items(station)[0]["place"][:2] == before[:2]
    assert station.errors == []


def test_a_chain_ends_with_enter_and_escape_takes_it_back(station: Workstation) -> None:
    page = station.page
    page.select_option("#protect-kind", "capsules")
    for key, found in (("Escape", 0), ("Enter", 1)):
        page.click("#protect-draw")
        station.wait_for("drawing", lambda: station.state("regions")["drawing"])
        for n in range(2):
            click_slice(station, 0.2 * n)
            station.wait_for(f"place {n}", lambda n=n: len(station.state("regions")["drawing"]["places"]) == n + 1)  # type: ignore[misc]
        expect(page.locator("[data-axis=axial] .drawing")).to_have_count(2)
        page.keyboard.press(key)
        station.wait_for("the end", lambda: station.state("regions")["drawing"] is None)
        station.wait_for(key, lambda found=found: len(items(station)) == found)  # type: ignore[misc]
    assert len(items(station)[0]["shape"]["points"]) == 2
    station.open_step("bone")
    page.select_option("#remove-kind", "sphere")
    page.click("#remove-draw")
    station.wait_for("drawing", lambda: station.state("regions")["drawing"])
    point = station.state("plan")["points"][1]["position"]  # a click on a point belongs to what is drawn
    page.evaluate("([x, y, z]) => vfix.slices.crosshair.move([x, y, z])", point)
    page.locator(".slice-stage[data-axis=axial]").click(position=station.place_in_slice("axial", point))
    station.wait_for("bone", lambda: [one["purpose"] for one in items(station)] == ["spare", "remove"])
    counted = re.compile(r"removed in all\.$|^No bone is removed\.$")
    expect(page.locator("#remove-total")).to_have_text(counted, use_inner_text=True)
    expect(page.locator("#remove-list")).to_have_text(re.compile("bone|removes nothing"), use_inner_text=True)
    station.page.click("#lock")
    station.wait_for("the lock", lambda: station.state("plan")["locked"])
    expect(page.locator("#protect-draw")).to_be_disabled()
    assert station.errors == []


def test_paths_and_notes(station: Workstation) -> None:
    page = station.page
    station.open_step("path")
    page.click("#new-path")
    station.wait_for("a path", lambda: len(station.state("paths")["items"]) == 2)
    assert station.state("plan")["points"] == []
    page.click("#plans")
    for current, offered in (("true", 0), ("false", 1)):  # a plan has its own targets already
        row = page.locator(f"#plan-list .row[aria-current={current}]").first
        expect(row.locator("[data-tool=take-targets]:visible")).to_have_count(offered)
    page.keyboard.press("Escape")
    station.open_step("path")  # a new path begins at its entry
    page.click("#paths .row-main >> nth=0")
    station.wait_for("the first path", lambda: len(station.state("plan")["points"]) == 2)
    station.open_step("entry")
    page.select_option("#entry-side", "left")
    station.wait_for("its side", lambda: station.state("paths")["items"][0]["entry_side"] == "left")
    station.open_step("notes")
    page.fill("#plan-notes", "Septum deviates to the right.")
    page.keyboard.press("Tab")
    station.wait_for("the notes", lambda: station.state("paths")["notes"] == "Septum deviates to the right.")
    assert station.errors == []


def test_a_version_is_saved_compared_and_gone_back_to_and_what_is_unfolded_stays_so(station: Workstation) -> None:
    page = station.page
    station.open_step("versions")
    page.click("#save-version")
    page.fill("dialog[open] input", "Before")
    page.keyboard.press("Enter")
    station.wait_for("the version", lambda: [one["name"] for one in station.state("versions")["items"]] == ["Before"])
    station.open_step("path")
    page.click("#new-path")
    station.wait_for("a path", lambda: len(station.state("paths")["items"]) == 2)
    page.click("#versions .row-main")
    page.wait_for_selector("#version-changes li:has-text('Path ‘Path 2’ is new.')")
    page.click("#go-back")
    station.wait_for("the plan as it was", lambda: len(station.state("paths")["items"]) == 1)
    page.click("#undo")
    station.wait_for("what was undone", lambda: len(station.state("paths")["items"]) == 2)
    kept = "localStorage.getItem('vfix-fold-versions')"
    station.wait_for("the browser's memory", lambda: page.evaluate(kept) == "open")
    station.open_step("tool")
    page.reload()
    station.ready()
    page.wait_for_selector("#versions:visible")
    expect(page.locator("[data-step-name=tool]"), "a step is not remembered").not_to_have_attribute("open", "")
    assert station.errors == []
