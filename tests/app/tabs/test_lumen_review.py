"""A run of the Drive tab in a lumen that breathes: scored when it is stored, replayed bit by bit, shown in Review."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest
from lumen_cases import route_in, tube
from lumen_driving import PATIENCE_S, Driving
from lumen_driving import stored as stored_runs
from session_doubles import sections_of, send

from app.cases.model import HEAD_PHANTOM
from app.drives import commands as drives
from app.drives.shared_drives import SharedDrives
from app.drives.stored_run import StoredRun
from app.services import Services
from app.tabs.review.tab import ReviewTab
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.registry import SNAKE, spec_of


@pytest.fixture
def shared() -> Iterator[SharedDrives[Any, Any]]:
    made: SharedDrives[Any, Any] = SharedDrives()
    yield made
    made.close()


def test_a_run_of_the_page_is_scored_and_replayed_bit_by_bit(
    phantom_services: Services, shared: SharedDrives[Any, Any]
) -> None:
    SNAKE.prepare()  # a process that compiles a kernel may round its last bits otherwise
    services = phantom_services
    route = route_in(services, tube(services), links=5, length_mm=14.0, radius_mm=4.0, breathing_mm=4.0)
    client = Driving(services, shared)
    client.open(route)
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["rehearsal"]["state"] == "running")
    deep = client.until(lambda shown: shown["snake"]["can_look"], drives.Push(type="drive", direction=1))["snake"]
    client.tab.handle_now(drives.Push(type="drive", direction=0))
    client.until(lambda shown: shown["snake"]["bend"] > 0.1, drives.MoveAxes(type="axes", camera_x=1.0))
    send(client.tab, "rehearsal.end")
    (stored,) = stored_runs(services, route)
    assert (stored.arm, stored.links, stored.mode, stored.certified) == ("certified", 5, None, True)
    score = _scored(services, stored)
    assert score["depth_mm"] >= deep["depth_mm"] - 0.05  # which is rounded
    assert (score["beyond_bound_mm"], score["certified"], score["whole"]) == (0.0, True, True)
    with services.runs.laid_out(stored.id) as place:
        run = Run.read(place)
    task = services.run_scores.task(stored.id)
    assert (task.moments, task.at(0.0)) == ((), None)  # it was of none
    assert any(event.kind == "adopt" for event in run.events)
    again = replay(run, spec_of(run), keep_states=False)
    assert (again.first_difference, again.largest_difference) == (None, 0.0)


def _scored(services: Services, run: StoredRun) -> dict[str, Any]:
    """The score that the job has computed which stored the run."""
    deadline = time.monotonic() + PATIENCE_S
    while (found := services.run_scores.known(run)) is None:
        assert time.monotonic() < deadline, "nobody scores the run"
        time.sleep(0.1)
    return found


def test_review_shows_the_endoscope_of_a_lumen_and_leaves_a_head_to_its_plan(phantom_services: Services) -> None:
    client = Driving(phantom_services, SharedDrives())
    review = ReviewTab(client.workspace)
    client.workspace.open_case(HEAD_PHANTOM)
    review.active = True
    assert sections_of(review)["scope"] is None
    case = tube(phantom_services)
    client.workspace.open_case(case.id)
    assert review.offered
    review.enter()
    scope = sections_of(review)["scope"]
    assert (scope["surface"], scope["key"]) == (f"/api/v1/cases/{case.id}/endoscope", case.content_hash)
    assert (scope["look"], scope["hand"], scope["own"], scope["poses"], scope["words"]) == (
        "colon",
        False,
        True,
        "",
        "",
    )
    review.active = False
    assert sections_of(review)["scope"] is None
