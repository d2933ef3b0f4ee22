"""`vfix bench page`: the point is dragged in the real page, and what it costs has figures."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser
from workstation import TOKEN, Planner, Rest

from benchmarks.page import drag, open_plan

pytestmark = pytest.mark.browser


def test_a_dragged_point_has_its_publishes_and_their_cost(browser: Browser, planner: Planner, rest: Rest) -> None:
    """On a page that is slowed down; afterwards the point is where it was."""
    plan_id = rest.copy_of_sample("Dragged")
    stored = [point["position"] for point in rest.plan(plan_id)["points"]]
    page = browser.new_page()
    open_plan(page, f"{planner.base}/?token={TOKEN}", plan_id)
    slow = drag(page, 4.0, 1.0)
    assert slow["slowed_by"] == 4.0
    assert all(slow[name] > 0.0 for name in slow), slow
    page.close()
    left = [point["position"] for point in rest.plan(plan_id)["points"]]
    assert left == [pytest.approx(position, abs=0.5) for position in stored]
