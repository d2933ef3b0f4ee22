"""A whole round of rehearsing, by the words of docs/rehearsal_tutorial.md: three modes, card, review, report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from workstation import Rest, Workstation

from app.cases.model import HEAD_PHANTOM
from pictures import rehearsal
from pictures.named_page import NamedPage

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]


def test_a_first_rehearsal_three_ways(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    station, plan = open_page().ready(), rest.copy_of_sample("Three ways")
    station.open_plan(plan)
    page = NamedPage(station, None)
    rehearsal.begin(page)
    rehearsal.by_a_hand_on_the_robot(page)
    rehearsal.from_a_distance(page)
    rehearsal.in_a_free_hand(page)
    rehearsal.compare(page, tmp_path)
    modes = [run["mode"] for run in rest.runs(HEAD_PHANTOM) if run["plan_id"] == plan]
    assert modes == ["freehand", "teleoperated", "hands-on"]
    (report,) = tmp_path.glob("*.html")
    words = report.read_text()
    assert "without the certificate" in words
    assert "Not for clinical use" in words
    assert station.errors == []
