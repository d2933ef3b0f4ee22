"""The verdict on the page: a figure of it shows the tool there, the plot has a scrubber that keys move."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser


def test_the_verdict_and_the_plot_show_the_tool_at_its_places(
    open_page: Callable[..., Workstation], rest: Rest
) -> None:
    station = open_page(viewport={"width": 1440, "height": 900}).ready()
    page = station.page
    verdict = station.wait_for("the verdict", lambda: (station.state("corridor") or {}).get("verdict"), DRIVEN_S)
    assert verdict["level"] == "fits"
    pattern = re.compile(r"^Fits\. 1\..* mm to bone.*Presses soft tissue along", re.DOTALL)
    page.click("#verdict-why")
    expect(page.locator("#verdict-words")).to_have_text(pattern, use_inner_text=True)
    words = page.locator("#verdict-words").inner_text()
    # Once on the page, and not in the line below as well.
    expect(page.locator(f"text={words[:40]}")).to_have_count(1)
    expect(page.locator("#verdict")).to_have_attribute("data-level", "fits")

    station.open_step("check")
    place = page.locator("#profile-place")  # it begins where 'Show me' leads
    assert abs(float(place.input_value()) - verdict["show_mm"]) < 0.3
    assert station.state("corridor")["shown_mm"] is None
    page.locator("#verdict-words .place").first.click()
    shown = station.wait_for("the tool", lambda: station.state("corridor")["shown_mm"])
    assert abs(shown - next(part["s_mm"] for part in verdict["parts"] if part["s_mm"] is not None)) < 0.3
    expect(page.locator("#profile-reading")).to_have_text(re.compile("^At "), use_inner_text=True)
    page.locator("#profile").scroll_into_view_if_needed()
    station.picture("clearance")

    page.locator("#profile-place").focus()
    page.keyboard.press("ArrowLeft")
    moved = station.wait_for(
        "the key", lambda: (now := station.state("corridor")["shown_mm"]) is not None and now != shown and now
    )
    assert abs(moved - shown) < 1.0
    page.locator("#profile svg").click()  # in its middle
    station.wait_for("the click", lambda: 30.0 < (station.state("corridor")["shown_mm"] or 0.0) < 60.0)
    page.click("[data-tool=show-me]")
    station.wait_for("the place", lambda: abs((station.state("corridor")["shown_mm"] or 0) - verdict["show_mm"]) < 0.3)
    across = page.locator(".slice[data-view=path] input[type=range]")
    station.wait_for("the view across", lambda: abs(float(across.input_value()) - verdict["show_mm"]) < 0.3)
    station.picture("clearance-show-me")
    page.click("#profile-hide")
    station.wait_for("no tool", lambda: station.state("corridor")["shown_mm"] is None)
    say_the_same(station, rest, station.state("plan")["id"], "fits")

    # A structure across the path has a curve and a margin of its own, and every place says that it blocks.
    blocked = rest.copy_of_sample("Blocked")
    points = rest.plan(blocked)["points"]
    across = {"kind": "sphere", "centre": points[len(points) // 2]["position"], "radius": 3.0}
    wish = {"name": "optic nerve", "shape": across, "margin_mm": 1.2}
    rest.client.post(f"/api/v1/plans/{blocked}/zones", json=wish).raise_for_status()
    station.open_plan(blocked)
    page.locator("[data-kind=target]").click()
    station.wait_for("a blocked path", lambda: (station.state("corridor") or {}).get("level") == "blocked", DRIVEN_S)
    say_the_same(station, rest, blocked, "blocked")
    station.open_step("check")
    curves = [
        (curve["name"], curve["margin_mm"]) for curve in station.state("corridor")["verdict"]["profile"]["curves"]
    ]
    assert curves[1:] == [("optic nerve", 1.2)]
    expect(page.locator("#profile .profile-margin")).to_have_count(2)
    keys = page.locator("#profile .profile-keys li")
    depth = r"depth in tissue \(right\)\s*up to \d+\.\d mm"
    lines = [r"bone\s*margin 0\.38 mm", r"optic nerve\s*margin 1\.20 mm", depth]
    expect(keys).to_have_text([re.compile(line) for line in lines])
    # The chart has the colour of the head, and says where it cuts what is far from bone.
    colour = station.state("regions")["items"][0]["colour"]
    expect(page.locator("#profile .profile-curve")).to_have_attribute("stroke", colour)
    expect(page.locator("#profile .profile-label", has_text="≥")).to_have_count(1)
    expect(page.locator("#profile-help")).to_be_hidden()
    page.click("[aria-label='About the plot']")
    expect(page.locator("#profile-help")).to_contain_text("dashed: their margins")
    page.locator("#profile-help").scroll_into_view_if_needed()
    station.picture("clearance-blocked")
    page.click("#theme")
    station.picture("clearance-light")
    assert not station.errors


def say_the_same(station: Workstation, rest: Rest, plan_id: str, level: str) -> None:
    """HAZ-40: the card and its sentences, REST, and the line above, which says only what to do next."""
    report = rest.client.get(f"/api/v1/plans/{plan_id}/report").json()["chosen"]
    assert report["verdict"] == level
    begins, page = re.compile(rf"^{re.escape(report['short'])}\. "), station.page
    expect(page.locator("#verdict-words")).to_have_text(begins, use_inner_text=True)
    expect(page.locator("#verdict-words .verdict-head")).to_have_text(f"{report['short']}.", use_inner_text=True)
    expect(page.locator("#card .card-word")).to_contain_text(level.capitalize(), use_inner_text=True)
    assert not page.locator("#hint").inner_text().startswith(report["short"])
    expect(page.locator("#statusbar")).to_be_hidden()  # it is of a drive
    look = "(at) => getComputedStyle(document.querySelector(at)).backgroundColor"
    red = page.locator("#legend .legend-unknown", has_text="blocked or pierced").locator(".legend-swatch")
    same = page.evaluate(look, ".card-icon") == red.evaluate("(node) => getComputedStyle(node).backgroundColor")
    assert same == (level == "blocked")
