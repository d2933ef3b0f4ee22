"""What really happens, in a real browser: stages are switched on, two tips come, and the robot compensates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def test_errors_are_switched_on_and_the_bend_is_compensated(open_page: Open, rest: Rest) -> None:
    station = open_page().ready()
    station.open_plan(rest.copy_of_sample("True"))
    page = station.page
    station.start()
    group = page.locator("#truth")
    expect(group).to_contain_text("All off")
    assert station.state("truth")["true"] is None

    def truth() -> Any:
        return station.state("truth")

    page.check('[data-stage="registration"]')
    station.wait_for("a registration that is off", lambda: (truth()["difference_mm"] or 0.0) > 0.1)
    page.fill('[data-size="registration"]', "0.8")
    page.press('[data-size="registration"]', "Enter")
    station.wait_for("a larger error", lambda: truth()["stages"][0]["value"] == 0.8)
    station.wait_for("its tip", lambda: truth()["difference_mm"] > 0.4)
    expect(group).to_contain_text("off,")
    page.check('[data-stage="head"]')
    page.check("#head-followed")
    station.wait_for("a head that is followed", lambda: truth()["followed"])
    page.uncheck('[data-stage="head"]')

    page.check('[data-stage="compliance"]')
    page.fill('[data-size="compliance"]', "0.1")
    page.press('[data-size="compliance"]', "Enter")
    station.wait_for("the bend", lambda: truth()["stages"][3]["value"] == 0.1)
    page.check("#compensate")
    station.wait_for("a robot that compensates", lambda: truth()["compensated_mm_per_n"] == 0.1)
    station.wait_for("its margin", lambda: station.rehearsal()["margin_mm"] > 0.75)
    page.evaluate("document.activeElement.blur()")
    station.drive_until("ArrowUp", "some way", lambda: station.rehearsal()["progress_mm"] > 3.0)
    now = truth()
    page.keyboard.up("ArrowUp")
    station.rehearsal_after(1000)
    # What is compensated is believed, so that both tips are as far apart as once nothing pushes.
    assert now["difference_mm"] == pytest.approx(truth()["difference_mm"], abs=0.1)
    assert np.linalg.norm(np.subtract(now["true"], now["believed"])) == pytest.approx(now["difference_mm"], abs=2e-3)
    station.see_scene()
    page.locator("#truth").scroll_into_view_if_needed()
    station.picture("truth")
    page.uncheck("#compensate")
    station.wait_for("a robot that does not", lambda: truth()["compensated_mm_per_n"] == 0)
    for stage in ("registration", "compliance"):
        page.uncheck(f'[data-stage="{stage}"]')
    station.wait_for("one tip", lambda: truth()["difference_mm"] is None)
