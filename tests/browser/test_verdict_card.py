"""HAZ-40: the verdict card: one word, figures with units, the worst first, each of which leads to its place."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def test_the_card_is_at_one_place_on_plan_register_and_rehearse(open_page: Open, rest: Rest) -> None:
    plan = rest.copy_of_sample("Card")
    station = open_page(viewport={"width": 1440, "height": 900}).ready()
    station.open_plan(plan)
    page = station.page
    station.wait_for("the verdict", lambda: (station.state("corridor") or {}).get("state") == "current", DRIVEN_S)
    report = rest.client.get(f"/api/v1/plans/{plan}/report").json()["chosen"]
    card, chips = page.locator("#card"), page.locator("#card .chip")
    expect(page.locator("#card .card-word")).to_contain_text("Fits", use_inner_text=True)
    least = f"bone {report['least_clearance_mm']:.2f} mm"
    expect(chips.first).to_have_text(least, use_inner_text=True)
    station.picture("card-fits")

    # Sentences are behind '?'.
    expect(page.locator("#verdict-words")).to_be_hidden()
    page.click("#verdict-why")
    expect(page.locator("#verdict-words")).to_contain_text(report["words"], use_inner_text=True)
    page.click("#verdict-why")

    chips.first.click()
    station.wait_for("the place", lambda: abs((station.state("corridor")["shown_mm"] or 0) - report["s_mm"]) < 0.3)
    place = "(card) => { const { x, y, width } = card.getBoundingClientRect(); return [x, y, width]; }"
    before = card.evaluate(place)
    for tab in ("register", "rehearse"):
        page.click(f"[data-step={tab}]")
        station.wait_for("the tab", lambda tab=tab: station.state("step")["name"] == tab)  # type: ignore[misc]
        expect(card).to_be_visible()
        assert card.evaluate(place) == before
        expect(page.locator("#card .card-word")).to_have_count(1)
        station.picture(f"card-{tab}")
    page.click("[data-step=patient]")
    expect(card).to_be_hidden()

    # A structure across the path: what stops the tool comes first, in the colour of the verdict, and leads there.
    points = rest.plan(plan)["points"]
    across = {"kind": "sphere", "centre": points[len(points) // 2]["position"], "radius": 3.0}
    rest.client.post(f"/api/v1/plans/{plan}/zones", json={"name": "optic nerve", "shape": across}).raise_for_status()
    page.click("[data-step=plan]")
    station.wait_for("blocked", lambda: (station.state("corridor") or {}).get("level") == "blocked", DRIVEN_S)
    expect(page.locator("#card .card-word")).to_contain_text("Blocked", use_inner_text=True)
    expect(chips.nth(0)).to_contain_text("optic nerve", use_inner_text=True)
    expect(chips.nth(1)).to_contain_text("along path", use_inner_text=True)
    expect(page.locator("#card .chip[data-level=blocked]")).to_have_count(2)
    reached = station.state("corridor")["verdict"]["figures"][1]["value"]
    chips.first.click()
    station.wait_for("the stop", lambda: abs((station.state("corridor")["shown_mm"] or 0) - reached) < 0.3)
    station.picture("card-blocked")
    page.evaluate("document.documentElement.dataset.theme = 'light'")
    assert station.errors == []
