"""An empty plan begins at a nostril: marked in scene and slices, named in the panel, and chosen by a click."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def test_an_empty_plan_is_entered_at_a_nostril_in_scene_slice_and_panel(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    page = station.page
    station.open_plan(rest.empty_plan("Entered"))
    station.wait_for("the nostrils", lambda: station.state("openings")["state"] == "current")
    expect(page.locator("#openings .job")).to_be_hidden()
    right, left = station.state("openings")["items"]
    buttons, names = page.locator("#openings [data-opening]"), page.locator(".scene-label.opening")
    expect(buttons).to_have_text(["Right nostril", "Left nostril"])

    def entered(opening: Any) -> None:
        """The path begins there and says its side, as one step; what was marked is marked no more."""
        station.wait_for("the entry", lambda: len(station.state("plan")["points"]) == 1)
        assert station.state("plan")["points"][0]["position"] == pytest.approx(opening["position"], abs=0.01)
        assert station.state("paths")["items"][0]["entry_side"] == opening["side"]
        assert station.state("openings") == {"state": "none", "items": [], "marked": False, "words": ""}
        expect(buttons).to_have_count(0)
        expect(names).to_have_count(0)
        page.keyboard.press("Control+z")
        station.wait_for("the empty plan", lambda: not station.state("plan")["points"])
        assert station.state("paths")["items"][0]["entry_side"] == ""
        expect(buttons).to_have_count(2)

    station.look_from("anterior")
    expect(names).to_have_text(["Right nostril", "Left nostril"])
    station.picture("openings")
    page.mouse.click(*station.place(left["position"]))
    entered(left)
    station.look_from("nose")
    station.picture("openings-nose")
    page.evaluate("(position) => vfix.request('slice.cross', { position })", right["position"])
    station.wait_for(
        "the slice", lambda: station.state("slices")["cross"] == pytest.approx(right["position"], abs=1e-3)
    )
    at = station.place_in_slice("axial", right["position"])
    station.picture("openings-slices")
    expect(page.locator("[data-axis=axial] .slice-opening-name")).to_have_text(["Right nostril", "Left nostril"])
    page.locator("[data-axis=axial]").click(position={"x": at["x"] + 2, "y": at["y"] + 3})
    entered(right)
    page.click("[data-kind=target]")
    expect(page.locator(".slice-opening")).to_have_count(0)
    expect(names).to_have_count(0)
    page.click("[data-opening=nostril-left]")
    entered(left)
    assert station.errors == []
