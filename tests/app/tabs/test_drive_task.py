"""Study I in the Drive tab: what the page shows of a task is what its run is worth, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from lumen_cases import TUBE_MM, route_in, tube, tube_mesh
from lumen_driving import INSERT, Driving, stored
from session_doubles import send

from app.drives import commands as drives
from app.drives.shared_drives import SharedDrives
from app.lumen.document import StoredRoute
from app.lumen.marks import RouteMark
from app.lumen.tasks import TaskChoice
from app.messages.client import Client
from app.services import Services
from vfix_engine.errors import ControlError, InputError
from vfix_engine.runtime.run import Run
from vfix_engine.study.polyps.series import polyp_series, task_of
from vfix_engine.study.polyps.sight import LumenSight

HOLD_S = 0.5
STOP = drives.Push(type="drive", direction=0)
MARKS = (  # on the wall at the end of the tube: looked at without a bend
    RouteMark("p1", "polyp", "Polyp 1", (0.0, 0.0, TUBE_MM)),
    RouteMark("p2", "polyp", "Polyp 2", (1.0, 0.0, TUBE_MM)),
    RouteMark("l1", "label", "Label 1", (15.0, 0.0, 100.0)),
)


@pytest.fixture
def route(phantom_services: Services) -> StoredRoute:
    return route_in(phantom_services, tube(phantom_services), links=10, length_mm=14.0, radius_mm=4.0, marks=MARKS)


@pytest.fixture
def shared() -> Iterator[SharedDrives[Any, Any]]:
    made: SharedDrives[Any, Any] = SharedDrives()
    yield made
    made.close()


def test_polyps_of_the_route_are_viewed_held_and_cleared_as_the_run_says(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client, other = Driving(phantom_services, shared), Driving(phantom_services, shared, Client("tab-two-0", "holds"))
    client.open(route)
    other.open(route)
    section = client.shown()["drive_task"]
    assert (section["task"], section["marks"], section["now"]) == (None, 2, None)
    send(client.tab, "drive.task", task="polyps", places="route", hold_s=HOLD_S)
    send(client.tab, "rehearsal.start")
    now = client.until(lambda shown: shown["rehearsal"]["state"] == "running")["drive_task"]["now"]
    assert (now["of"], now["cleared"], now["hold_s"], len(now["polyps"])) == (2, 0, HOLD_S, 2)
    assert {polyp["colour"] for polyp in now["polyps"]} == {0.0}
    assert np.allclose(now["polyps"][0]["at"], [0.0, 0.0, TUBE_MM - 2.0], atol=1e-3)
    assert "drive.polyps" in {layer.name for layer in client.tab.layers()}
    with pytest.raises(ControlError, match="holds the handle"):
        send(other.tab, "drive.task", task=None)

    far = client.until(lambda shown: shown["drive_task"]["now"]["seen"], INSERT)["drive_task"]["now"]
    assert 22.0 < far["seen"]["distance_mm"] <= TUBE_MM  # in the picture, and too far to be viewed
    assert far["seen"]["angle_deg"] < 35.0
    seen = client.until(lambda shown: shown["drive_task"]["now"]["viewed"], INSERT)["drive_task"]["now"]
    assert seen["seen"] is None
    assert max(polyp["colour"] for polyp in seen["polyps"]) > 0.0
    client.tab.handle_now(STOP)
    client.until(lambda shown: shown["drive_task"]["now"]["cleared"] == 2)
    cleared = client.shown()["drive_task"]["now"]["polyps"]
    assert [polyp["cleared"] for polyp in cleared] == [True, True]
    assert [polyp["at"] for polyp in cleared] == [polyp["at"] for polyp in now["polyps"]]
    assert not any(polyp["cleared"] for polyp in now["polyps"])
    assert other.shown()["drive_task"]["now"] == client.shown()["drive_task"]["now"]
    client.until(lambda shown: shown["drive_task"]["now"]["completed"], INSERT)
    watch = client.tab.now.prepared.task  # type: ignore[union-attr]
    assert watch is not None
    assert watch.trouble == ""
    send(client.tab, "rehearsal.end")

    (run,) = stored(phantom_services, route)
    with phantom_services.runs.laid_out(run.id) as place:
        read = Run.read(place)
    task, first = task_of(read)
    assert (task, first) == (watch.task, 0)
    assert polyp_series(read, LumenSight(tube_mesh(), task)).progress == watch.progress
    score = phantom_services.run_scores.of(run.id)["task"]
    rows = {row["name"]: row["value"] for row in score["rows"]}
    assert (score["title"], score["completed"], len(rows), rows["Polyps missed"]) == ("Polyps", True, 12, 0.0)
    assert rows["Completed in"] == watch.progress.reached_t  # type: ignore[union-attr]
    cleared = [viewing.cleared_t for viewing in watch.progress.viewings]  # type: ignore[union-attr]
    assert score["items"] == [
        {"name": f"Polyp {n}", "done_s": t, "share": 0.0 if t is None else 1.0} for n, t in enumerate(cleared, start=1)
    ]
    assert phantom_services.run_scores.task(run.id).at(1e4).progress == watch.progress  # type: ignore[union-attr]


def test_a_reset_ends_the_task_and_its_run(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    send(client.tab, "drive.task", task="polyps", places="route")
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["snake"] and shown["snake"]["depth_mm"] > 2.0, INSERT)
    send(client.tab, "rehearsal.reset")
    shown = client.until(lambda shown: shown["rehearsal"]["state"] == "ready")
    assert (shown["drive_task"]["task"], shown["drive_task"]["now"], shown["snake"]["depth_mm"]) == (None, None, 0.0)
    (run,) = stored(phantom_services, route)
    score = phantom_services.run_scores.of(run.id)["task"]
    assert not score["completed"]
    assert score["rows"][0]["value"] is None


def test_polyps_are_drawn_where_the_robot_can_view_them(phantom_services: Services) -> None:
    route = route_in(phantom_services, tube(phantom_services), links=5, length_mm=14.0, radius_mm=4.0)
    tasks = phantom_services.lumen_routes.tasks
    with pytest.raises(InputError, match="has no polyps"):
        tasks.polyps(route, TaskChoice(places="route"))
    one, same, other = (tasks.polyps(route, TaskChoice(seed=seed, count=2)) for seed in (1, 1, 2))
    assert one == same
    assert one != other
    assert len(one.polyps) == 2
    assert one.hold_s == 7.0
    assert one.viewable_share is not None
    assert one.viewable_share > 0.0
