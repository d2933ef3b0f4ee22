"""The Plan tab in a real browser: clicks, ghosts, drags, undo, slices, lock."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def _points(station: Workstation) -> list[list[float]]:
    return [point["position"] for point in station.state("plan")["points"]]


def test_the_page_opens_on_the_head_with_a_plan_that_fits(open_page: Open, rest: Rest) -> None:
    """First sight: head, newest plan, hint, slices; the words of HAZ-35; nothing is fetched from another host."""
    newest = rest.copy_of_sample("First sight")
    station = open_page(sample=False)
    hosts: set[str] = set()
    station.page.on("request", lambda request: hosts.add(request.url.split("/")[2]))
    station.page.reload()
    station.see_scene()
    assert station.state("plan")["id"] == newest
    station.wait_for("the dry run", lambda: (station.state("corridor") or {}).get("completed") is True, DRIVEN_S)
    expect(station.page.locator("#where-case")).to_have_text(station.state("case")["name"])
    expect(station.page.locator("#notice")).to_be_visible()
    expect(station.page.locator("#notice")).to_contain_text("clinical", use_inner_text=True)
    expect(station.page.locator("#card .card-word")).to_contain_text("Fits", use_inner_text=True)
    corridor = station.state("corridor")
    assert min(corridor["verdict"]["profile"]["curves"][0]["clearance_mm"]) >= corridor["scale"]["margin"]
    verdict = re.compile(r"^Fits\. .* to bone.*Presses soft tissue along", re.DOTALL)
    expect(station.page.locator("#verdict-words")).to_have_text(verdict)
    assert corridor["warning"] == "", "what the surface may be off is added to the margin"
    station.wait_for("the voxels", lambda: station.page.evaluate("vfix.slices.link.ready"))
    shown = "vfix.slices.panes.filter((pane) => pane.stage.clientWidth)"
    drawn = f"{shown}.length >= 3 && {shown}.every((pane) => pane.canvas.width > 1 && !pane.pictures.childElementCount)"
    station.wait_for("the slices", lambda: station.page.evaluate(drawn))
    expect(station.page.locator("#steps button:visible")).to_have_text(
        ["Patient", "Plan", "Register", "Rehearse", "Review"]
    )
    assert len(hosts) == 1, hosts
    assert station.errors == []
    station.picture("plan")


def test_clicks_on_the_skull_and_on_a_slice_make_a_path(open_page: Open, rest: Rest) -> None:
    """A click on bone shows a ghost first; Enter or the button adds it, Esc takes it back. What fits needs no ghost."""
    station = open_page().ready()
    station.open_plan(rest.empty_plan("By clicks"))
    station.look_from("anterior")

    def click_head(place: list[float]) -> None:
        station.page.mouse.click(*station.place(place))
        station.wait_for("a ghost", lambda: station.state("plan")["ghost"])

    click_head([30.0, 0.0, 60.0])
    expect(station.page.locator("#ghost-card")).to_contain_text("of bone", use_inner_text=True)
    assert _points(station) == []
    station.page.keyboard.press("Escape")
    station.wait_for("no ghost", lambda: station.state("plan")["ghost"] is None)
    click_head([30.0, 0.0, 60.0])
    station.page.keyboard.press("Enter")
    station.wait_for("one point", lambda: len(_points(station)) == 1)
    expect(station.page.locator("[data-kind=target]")).to_have_attribute("aria-pressed", "true")
    station.open_step("path")  # where the next click adds a point
    station.wait_for("points", lambda: station.state("plan")["add_mode"] == "point")
    click_head([-30.0, 0.0, 60.0])
    station.page.click("#ghost-add")
    station.wait_for("two points", lambda: len(_points(station)) == 2)
    plan = station.state("plan")
    assert plan["degree"] == 1
    assert plan["length_mm"] > 20.0
    assert len(station.state("curve")["points"]) > 10

    stage = station.page.locator("[data-axis=axial]")
    in_air = rest.sample()["points"][4]["position"]
    station.page.evaluate("(position) => vfix.request('slice.cross', { position })", in_air)
    station.wait_for("the cross", lambda: station.state("slices")["cross"] == pytest.approx(in_air, abs=1e-3))
    at = station.place_in_slice("axial", in_air)
    stage.click(position=at)
    station.wait_for("three points", lambda: len(_points(station)) == 3)
    assert station.state("plan")["ghost"] is None
    assert _points(station)[2] == pytest.approx(in_air, abs=0.6)
    station.page.keyboard.press("Control+z")
    station.wait_for("undo", lambda: len(_points(station)) == 2)
    station.page.keyboard.press("Control+Shift+z")
    station.wait_for("redo", lambda: len(_points(station)) == 3)
    station.page.click("[data-kind=target]")
    stage.click(position={"x": at["x"] + 9, "y": at["y"] - 12})
    station.wait_for("a target", lambda: len(station.state("plan")["targets"]) == 1)
    stored = rest.plan(station.state("plan")["id"])
    assert [p["position"] for p in stored["points"]] == [pytest.approx(p, abs=1e-3) for p in _points(station)]
    assert station.errors == []


def test_points_are_dragged_inserted_deleted_undone_and_locked(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    plan_id = rest.copy_of_sample("Edited")
    station.open_plan(plan_id)
    station.cut_away("left")
    station.look_from("nose")
    before = _points(station)

    def drag(position: list[float], by: tuple[int, int]) -> None:
        station.drag_by(position, by)
        station.page.mouse.up()

    drag(before[4], (4, -18))
    station.wait_for("the drag", lambda: rest.plan(plan_id)["points"][4]["position"] != before[4])
    stored = [pytest.approx(point["position"], abs=1e-3) for point in rest.plan(plan_id)["points"]]
    station.wait_for("the new place", lambda: _points(station) == stored)
    moved = _points(station)
    assert moved[4][2] > before[4][2] + 0.5, "dragged up, so the point must be higher"
    station.picture("dragged")

    station.page.keyboard.press("Control+z")
    station.wait_for("undo", lambda: _points(station) == before)
    station.page.keyboard.press("Control+Shift+z")
    station.wait_for("redo", lambda: len(_points(station)) == len(before) and _points(station) != before)
    station.page.click("#undo")
    station.wait_for("undo", lambda: _points(station) == before)

    station.page.locator("#points-table tbody tr").nth(2).click()
    third = rest.plan(plan_id)["points"][2]["id"]
    station.wait_for("the selection", lambda: station.state("plan")["selected"] == third)
    station.page.click("#insert")
    station.wait_for("one more", lambda: len(_points(station)) == len(before) + 1)
    assert _points(station)[:3] == before[:3]
    assert _points(station)[4:] == before[3:]
    station.page.click("#delete-item")
    station.wait_for("one less", lambda: _points(station) == before)

    station.page.click("#lock")
    station.wait_for("the lock", lambda: station.state("plan")["locked"])
    drag(before[4], (4, -18))
    station.settle()
    assert [p["position"] for p in rest.plan(plan_id)["points"]] == [pytest.approx(p) for p in before]
    assert station.errors == []


# Where parts of the page are; null for one that is not shown.
BOXES = """(parts) => Object.fromEntries(parts.map((part) => {
  const { x, y, width, height } = document.querySelector(part).getBoundingClientRect();
  return [part, width && height ? { x, y, width, height } : null];
}))"""


def test_nothing_overlaps_on_a_small_screen(open_page: Open) -> None:
    """From 1000 px of width up, nothing lies over anything else and nothing is cut off."""
    station = open_page(viewport={"width": 1000, "height": 640}).see_scene()
    station.wait_for("the dry run", lambda: (station.state("corridor") or {}).get("completed") is True, DRIVEN_S)
    expect(station.page.locator("#legend")).to_be_visible()
    station.slices_stand()
    parts = (
        ".brand",
        "#where",
        "#steps",
        "#notice",
        "#hint",
        "#card",
        "#panel",
        ".viewer",
        "#slices",
        ".toasts",
        "#statusbar",
    )
    tools = (".views", "#scale-bar", "#legend")
    found = station.page.evaluate(BOXES, [*parts, *tools])  # all at one moment
    boxes, overlays = ({part: found[part] for part in group} for group in (parts, tools))
    for group in (boxes, overlays):
        names = [name for name, box in group.items() if box]
        for index, first in enumerate(names):
            for second in names[index + 1 :]:
                assert not _overlap(group[first], group[second]), f"{first} lies over {second}"
    for name, box in {**boxes, **overlays}.items():
        assert box is None or (box["x"] >= 0 and box["x"] + box["width"] <= 1000.5), f"{name} is cut off"
    station.picture("small")


def _overlap(a: dict[str, float], b: dict[str, float]) -> bool:
    wide = min(a["x"] + a["width"], b["x"] + b["width"]) - max(a["x"], b["x"])
    high = min(a["y"] + a["height"], b["y"] + b["height"]) - max(a["y"], b["y"])
    return wide > 0.5 and high > 0.5
