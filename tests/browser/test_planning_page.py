"""The Plan step in a real browser: clicks, ghosts, drags, undo, slices, lock."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from workstation import Rest, Workstation

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
    station.ready()
    assert station.state("plan")["id"] == newest
    station.wait_for("the dry run", lambda: (station.state("corridor") or {}).get("completed") is True)
    assert station.page.locator("#where-case").inner_text() == station.state("case")["name"]
    assert station.page.locator("#notice").is_visible()
    assert "clinical" in station.page.locator("#notice").inner_text()
    station.wait_for("the hint", lambda: "clear of bone" in station.page.locator("#hint").inner_text())
    assert station.state("corridor")["min_clearance_mm"] >= station.state("corridor")["scale"]["margin"]
    verdict = station.page.locator("#verdict").inner_text()
    assert verdict.startswith("Fits: bone")
    assert "Presses soft tissue along" in verdict
    assert station.page.locator("#margin-warning").is_hidden(), "what the surface may be off is added to the margin"
    station.wait_for("the voxels", lambda: station.page.evaluate("vfix.slices.link.ready"))
    shown = "vfix.slices.panes.filter((pane) => pane.stage.clientWidth)"
    drawn = f"{shown}.length >= 3 && {shown}.every((pane) => pane.canvas.width > 1 && !pane.pictures.childElementCount)"
    station.wait_for("the slices", lambda: station.page.evaluate(drawn))
    assert [step.inner_text() for step in station.page.locator("#steps button").all()] == [
        "Patient",
        "Plan",
        "Rehearse",
    ]
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

    click_head([4.0, -5.0, 4.0])
    station.wait_for("its words", lambda: "of bone" in station.page.locator("#ghost-card").inner_text())
    assert _points(station) == []
    station.page.keyboard.press("Escape")
    station.wait_for("no ghost", lambda: station.state("plan")["ghost"] is None)
    click_head([4.0, -5.0, 4.0])
    station.page.keyboard.press("Enter")
    station.wait_for("one point", lambda: len(_points(station)) == 1)
    click_head([-30.0, 0.0, 60.0])
    station.page.click("#ghost-add")
    station.wait_for("two points", lambda: len(_points(station)) == 2)
    assert station.state("plan")["degree"] == 1
    assert station.state("plan")["length_mm"] > 20.0
    assert len(station.state("curve")["points"]) > 10

    stage = station.page.locator("[data-axis=axial]")
    in_air = rest.sample()["points"][4]["position"]
    station.page.evaluate("(position) => vfix.request('slice.cross', { position })", in_air)
    station.wait_for("the cross", lambda: station.state("slices")["cross"] == pytest.approx(in_air, abs=1e-3))
    at = station.page.evaluate("(place) => vfix.slices.panes[0].wanted().project(place)", in_air)
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
    station.page.select_option("#cut", "left")
    station.look_from("nose")
    before = _points(station)

    def drag(position: list[float], by: tuple[int, int]) -> None:
        x, y = station.place(position)
        station.page.mouse.move(x, y)
        station.page.wait_for_timeout(300)
        station.page.mouse.down()
        for part in (0.4, 0.7, 1.0):
            station.page.mouse.move(x + part * by[0], y + part * by[1])
            station.page.wait_for_timeout(120)
        station.page.mouse.up()

    drag(before[4], (4, -18))
    station.wait_for("the drag", lambda: rest.plan(plan_id)["points"][4]["position"] != before[4])
    moved = station.wait_for("the new place", lambda: _points(station) if _points(station) != before else None)
    assert moved[4][2] > before[4][2] + 0.5, "dragged up, so the point must be higher"
    station.picture("dragged")

    station.page.keyboard.press("Control+z")
    station.wait_for("undo", lambda: _points(station) == before)
    station.page.keyboard.press("Control+Shift+z")
    station.wait_for("redo", lambda: len(_points(station)) == len(before) and _points(station) != before)
    station.page.click("#undo")
    station.wait_for("undo", lambda: _points(station) == before)

    station.page.locator("table.points tbody tr").nth(2).click()
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


def test_nothing_overlaps_on_a_small_screen(open_page: Open) -> None:
    """From 1000 px of width up, nothing lies over anything else and nothing is cut off."""
    station = open_page(viewport={"width": 1000, "height": 640}).ready()
    parts = [".brand", "#where", "#steps", "#notice", "#hint", "#panel", ".viewer", "#slices", "#statusbar"]
    boxes = {part: station.page.locator(part).bounding_box() for part in parts}
    overlays = {
        part: station.page.locator(part).bounding_box()
        for part in (".views", ".tool-strip.column", "#scale-bar", "#legend")
    }
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
