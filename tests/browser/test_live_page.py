"""What is told while a hand drags: verdict and plot live, greyed while they are old, cones on targets, the shaft."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
OpenPage = Callable[..., Workstation]
WIDE = {"width": 1440, "height": 900}
DRIVEN_S = 240.0


def opened(open_page: OpenPage, plan_id: str) -> Workstation:
    """The plan is open, driven dry, and seen from near."""
    station = open_page(viewport=WIDE).ready()
    station.open_plan(plan_id)
    station.wait_for("the dry run", lambda: station.state("corridor")["state"] == "current", DRIVEN_S)
    station.page.select_option("#cut", "left")
    station.look_from("nose")
    return station


def take(station: Workstation, position: list[float], by: tuple[int, int]) -> None:
    """Drag what is drawn at a place by some pixels; the button stays down."""
    x, y = station.place(position)
    station.page.mouse.move(x, y)
    station.page.wait_for_timeout(300)
    station.page.mouse.down()
    for part in (0.4, 0.7, 1.0):
        station.page.mouse.move(x + part * by[0], y + part * by[1])
        station.page.wait_for_timeout(120)


def test_a_dragged_point_is_judged_live_and_placed_again_on_release(open_page: OpenPage, rest: Rest) -> None:
    plan_id = rest.copy_of_sample("Live")
    station = opened(open_page, plan_id)
    page, before = station.page, rest.plan(plan_id)
    stored = station.state("corridor")["verdict"]
    # The verdict is in sight above the list of points, however long that is.
    verdict_box, table_box = page.locator("#verdict").bounding_box(), page.locator("table.points").first.bounding_box()
    assert verdict_box is not None
    assert table_box is not None
    assert verdict_box["y"] < table_box["y"]
    take(station, before["points"][4]["position"], (4, -18))
    stale, said = page.locator("#verdict.stale"), page.locator("#verdict-state")
    station.wait_for(
        "the live verdict", lambda: station.state("corridor")["state"] == "drag" and not stale.count(), DRIVEN_S
    )
    live = station.state("corridor")
    assert live["verdict"] != stored
    station.wait_for("its words", lambda: said.inner_text().startswith("Provisional, while you drag: the robot"))
    assert rest.plan(plan_id)["revision"] == before["revision"], "nothing live is stored"
    station.picture("live-drag")
    page.mouse.up()
    station.wait_for("one edit", lambda: rest.plan(plan_id)["revision"] == before["revision"] + 1)
    station.wait_for("the new placing", lambda: said.inner_text() == "Placed and driven dry.", DRIVEN_S)
    assert station.state("corridor")["state"] == "current"
    assert station.state("corridor")["verdict"] != live["verdict"]
    assert not stale.count()
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
    page.locator(f"tr[data-item='{target['target']}']").click()
    station.wait_for("the words", lambda: page.locator("#cone-words").is_visible())
    assert page.locator("#cone-words").inner_text() == target["words"]
    assert f"{target['cone_deg']:.0f}°" in target["words"]
    page.locator("#cone-words").scroll_into_view_if_needed()
    station.settle()
    station.picture("live-cone")
    page.locator("table.points").first.locator("tbody tr").nth(1).click()
    station.wait_for("no cone of a point", lambda: not page.locator("#cone-words").is_visible())
    assert station.errors == []


def test_the_shaft_is_turned_by_its_ball(open_page: OpenPage, rest: Rest) -> None:
    plan_id = rest.copy_of_sample("Turned")
    point = rest.plan(plan_id)["points"][2]
    body = {"direction": [0.0, -0.95, -0.31]}
    rest.client.put(f"/api/plans/{plan_id}/points/{point['id']}/shaft", json=body).raise_for_status()
    station = opened(open_page, plan_id)
    page, before = station.page, rest.plan(plan_id)
    page.locator(f"tr[data-item='{point['id']}']").click()
    station.wait_for("the shaft", lambda: station.state("shaft")["words"].startswith("The shaft leaves"))
    station.settle()
    ball = [p + 30.0 * d for p, d in zip(point["position"], before["points"][2]["direction"], strict=True)]
    take(station, ball, (0, 30))
    station.wait_for("the live verdict", lambda: station.state("corridor")["state"] == "drag", DRIVEN_S)
    assert rest.plan(plan_id)["revision"] == before["revision"]
    station.picture("live-shaft")
    page.mouse.up()
    station.wait_for("one edit", lambda: rest.plan(plan_id)["revision"] == before["revision"] + 1)
    turned = rest.plan(plan_id)["points"][2]["direction"]
    assert turned != before["points"][2]["direction"]
    page.keyboard.press("Control+z")
    station.wait_for("undo", lambda: rest.plan(plan_id)["points"] == before["points"])
    assert station.errors == []
