"""What is told while a hand drags: verdict and plot live, greyed while they are old, cones on targets, the shaft."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
OpenPage = Callable[..., Workstation]
WIDE = {"width": 1440, "height": 900}


def opened(open_page: OpenPage, plan_id: str) -> Workstation:
    """The plan is open, driven dry, and seen from near."""
    station = open_page(viewport=WIDE).ready()
    station.open_plan(plan_id)
    station.wait_for("the dry run", lambda: station.state("corridor")["state"] == "current", DRIVEN_S)
    station.cut_away("left")
    station.look_from("nose")
    return station


def test_a_dragged_point_is_judged_live_and_placed_again_on_release(open_page: OpenPage, rest: Rest) -> None:
    plan_id = rest.copy_of_sample("Live")
    station = opened(open_page, plan_id)
    page, before = station.page, rest.plan(plan_id)
    stored = station.state("corridor")["verdict"]
    # The verdict is in sight above the list of points, however long that is.
    expect(page.locator("#verdict")).to_be_visible()
    expect(page.locator("#points-table")).to_be_visible()
    assert page.evaluate("""() => {
      const [verdict, table] = ["#card", "#points-table"].map((part) => document.querySelector(part));
      return verdict.getBoundingClientRect().y < table.getBoundingClientRect().y;
    }""")
    station.drag_by(before["points"][4]["position"], (4, -18))
    stale, said = page.locator("#verdict.stale"), page.locator("#verdict-state")

    def judged() -> Any:
        """The verdict of a place of the hand that is another one than the stored path's."""
        corridor = station.state("corridor")
        return corridor["state"] == "drag" and corridor["verdict"] != stored and not stale.count() and corridor

    live = station.wait_for("the live verdict", judged, DRIVEN_S)
    expect(said).to_have_text("while you drag", use_inner_text=True)
    expect(said).to_have_attribute("title", re.compile("^While you drag: the robot"))
    assert rest.plan(plan_id)["revision"] == before["revision"], "nothing live is stored"
    station.picture("live-drag")
    page.mouse.up()
    station.wait_for("one edit", lambda: rest.plan(plan_id)["revision"] == before["revision"] + 1)
    expect(said).to_have_attribute("title", "Simulated from entry to the end of the path.", timeout=1000.0 * DRIVEN_S)
    corridor = station.state("corridor")
    assert corridor["state"] == "current"
    assert corridor["verdict"] != live["verdict"]
    expect(stale).to_have_count(0)
    page.keyboard.press("Control+z")
    station.wait_for("undo", lambda: rest.plan(plan_id)["points"] == before["points"])
    assert station.errors == []


def test_the_selected_target_tells_from_where_it_is_seen(open_page: OpenPage, rest: Rest) -> None:
    station = opened(open_page, rest.copy_of_sample("Cones"))
    page = station.page
    cones = station.wait_for(
        "the cones", lambda: (now := station.state("cones"))["state"] == "current" and now, DRIVEN_S
    )
    target = cones["items"][0]
    station.open_step("targets")
    page.locator(f"tr[data-item='{target['target']}']").click()
    expect(page.locator("#cone-words")).to_be_visible()
    expect(page.locator("#cone-words")).to_have_text(target["words"])
    assert f"{target['cone_deg']:.0f}°" in target["words"]
    page.locator("#cone-words").scroll_into_view_if_needed()
    station.settle()
    station.picture("live-cone")
    station.open_step("path")
    page.locator("#points-table tbody tr").nth(1).click()
    expect(page.locator("#cone-words")).to_be_hidden()
    assert station.errors == []


def test_the_shaft_is_turned_by_its_ball(open_page: OpenPage, rest: Rest) -> None:
    plan_id = rest.copy_of_sample("Turned")
    point = rest.plan(plan_id)["points"][3]
    body = {"direction": [0.0, -0.95, -0.31]}
    rest.client.put(f"/api/v1/plans/{plan_id}/points/{point['id']}/shaft", json=body).raise_for_status()
    station = opened(open_page, plan_id)
    page, before = station.page, rest.plan(plan_id)
    page.locator(f"tr[data-item='{point['id']}']").click()
    station.wait_for("the shaft", lambda: station.state("shaft")["words"].startswith("The shaft leaves"))
    station.settle()
    ball = [p + 30.0 * d for p, d in zip(point["position"], before["points"][3]["direction"], strict=True)]
    station.drag_by(ball, (0, 30))
    station.wait_for("the live verdict", lambda: station.state("corridor")["state"] == "drag", DRIVEN_S)
    assert rest.plan(plan_id)["revision"] == before["revision"]
    station.picture("live-shaft")
    page.mouse.up()
    station.wait_for("one edit", lambda: rest.plan(plan_id)["revision"] == before["revision"] + 1)
    turned = rest.plan(plan_id)["points"][3]["direction"]
    assert turned != before["points"][3]["direction"]
    page.keyboard.press("Control+z")
    station.wait_for("undo", lambda: rest.plan(plan_id)["points"] == before["points"])
    assert station.errors == []
