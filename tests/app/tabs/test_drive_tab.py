"""The Drive tab: a snake robot in a real control process, its figures, keys, requests, and the run that is stored."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lumen_cases import route_in, tube
from lumen_driving import INSERT, Driving, stored
from session_doubles import send

from app.cases.model import CaseLandmark, to_triple
from app.drives import commands as drives
from app.drives.shared_drives import SharedDrives
from app.lumen.document import StoredRoute
from app.lumen.drive_options import LumenDriveOptions
from app.messages.client import Client
from app.services import Services
from app.tabs.drive import commands as c
from app.tabs.drive import preparation
from app.tabs.drive.keys import KEY_CAMERA_MM_PER_S
from app.tabs.drive.routes import COLUMNS
from app.tabs.drive.view import passed
from vfix_engine.errors import ControlError
from vfix_engine.kernels.preparation import Preparation
from vfix_engine.pathway.limits.link_bounds import BOUND_MM
from vfix_engine.snake.conform.conforming import driven_curve
from vfix_engine.worlds.snake import SnakeSettings


@pytest.fixture
def route(phantom_services: Services) -> StoredRoute:
    return route_in(phantom_services, tube(phantom_services), links=5, length_mm=14.0, radius_mm=4.0)


@pytest.fixture
def shared() -> Iterator[SharedDrives[Any, Any]]:
    made: SharedDrives[Any, Any] = SharedDrives()
    yield made
    made.close()


def test_without_a_route_nothing_can_be_driven(phantom_services: Services, shared: SharedDrives[Any, Any]) -> None:
    client = Driving(phantom_services, shared)
    client.workspace.open_case(tube(phantom_services).id)
    assert client.tab.hint() == "Make a route first, in Route."
    assert client.shown()["scope"]["words"].startswith("No route yet")
    with pytest.raises(ControlError, match="open a case"):
        send(client.tab, "rehearsal.start")


def test_a_robot_is_inserted_by_keys_steered_straightened_and_its_run_isstored(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    send(client.tab, "rehearsal.start")
    running = client.until(lambda shown: shown["rehearsal"]["state"] == "running")
    assert running["snake"]["depth_mm"] == 0.0
    assert running["scope"]["poses"].endswith(f"?case={route.case_id}&plan={route.id}")
    deep = client.until(lambda shown: shown["snake"]["can_look"], drives.Push(type="drive", direction=1))["snake"]
    assert deep["links_inside"] == 5
    assert deep["nearest"]["deviation_mm"] <= deep["nearest"]["bound_mm"]
    client.tab.handle_now(drives.Push(type="drive", direction=0))
    bent = client.until(lambda shown: shown["snake"]["bend"] > 0.1, drives.MoveAxes(type="axes", camera_x=1.0))["snake"]
    client.tab.handle_now(drives.MoveAxes(type="axes"))
    assert not bent["straight"]
    assert {layer.name for layer in client.tab.layers()} == {"drive.pathway", "drive.robot"}
    send(client.tab, "camera.straighten")
    client.until(lambda shown: shown["snake"]["straight"])
    back = drives.Push(type="drive", direction=-1)
    client.until(lambda shown: shown["snake"]["depth_mm"] < deep["depth_mm"] - 5.0, back)
    send(client.tab, "rehearsal.end")
    (run,) = stored(phantom_services, route)
    assert (run.plan_id, run.manifest["world"], run.mode) == (route.id, "snake", None)


def test_keys_and_a_device_are_added_and_none_stops_another(
    phantom_services: Services,
    shared: SharedDrives[Any, Any],
    route: StoredRoute,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    told: list[tuple[float, float, float]] = []
    assert client.tab.drive is not None
    assert client.tab.drive.lease.take(client.tab.client)
    monkeypatch.setattr(client.tab.drive, "axes", lambda hand, x, y, insert, buttons: told.append((x, y, insert)))

    def after(command: drives.Push | drives.MoveAxes | c.TiltCamera) -> tuple[float, float, float]:
        client.tab.handle_now(command)
        return told[-1]

    def device(x: float, y: float, insert: float = 0.0) -> drives.MoveAxes:
        return drives.MoveAxes(type="axes", camera_x=x, camera_y=y, insert=insert)

    key = KEY_CAMERA_MM_PER_S / SnakeSettings().camera_mm_per_s
    assert after(drives.Push(type="drive", direction=1)) == (0.0, 0.0, 1.0)
    assert after(device(0.9, -0.25)) == (0.9, -0.25, 1.0), "a device does not stop what a key inserts"
    assert after(drives.Push(type="twist", direction=1)) == (1.0, -0.25, 1.0), "no more than full speed"
    assert after(c.TiltCamera(type="tilt", direction=1)) == (1.0, -0.25 - key, 1.0)
    assert after(c.TiltCamera(type="tilt", direction=0)) == (1.0, -0.25, 1.0)
    assert after(device(-1.0, 0.0, -0.5)) == pytest.approx((key - 1.0, 0.0, 0.5))
    assert after(drives.Push(type="twist", direction=0)) == (-1.0, 0.0, 0.5)
    assert after(device(0.0, 0.0)) == (0.0, 0.0, 1.0)
    assert after(drives.Push(type="drive", direction=0)) == (0.0, 0.0, 0.0)
    client.tab.handle_now(drives.Push(type="drive", direction=1))
    client.tab.release_now()
    assert after(device(0.0, 1.0)) == (0.0, 1.0, 0.0), "what was let go of is forgotten"


def test_a_wheel_brings_the_tip_to_its_depth_and_no_further(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["snake"], drives.HoldCommand(type="heartbeat"))
    for wanted in (23.0, 8.0):
        wheel = c.InsertTo(type="insert.to", depth_mm=wanted, held=True)
        client.until(lambda shown, to=wanted: abs(shown["snake"]["depth_mm"] - to) < 0.06, wheel)  # shown to 0.1 mm
        for _ in range(20):
            client.tab.handle_now(wheel)
            assert abs(client.shown()["snake"]["depth_mm"] - wanted) < 0.06
    client.tab.handle_now(c.InsertTo(type="insert.to", depth_mm=30.0, held=False))
    for _ in range(20):
        client.tab.handle_now(drives.HoldCommand(type="heartbeat"))
        assert abs(client.shown()["snake"]["depth_mm"] - wanted) < 0.06


def test_a_drag_turns_the_camera_by_its_way_and_its_release_ends_it(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["snake"] and shown["snake"]["can_look"], INSERT)
    client.tab.handle_now(drives.Push(type="drive", direction=0))
    ahead = _ahead(client)
    client.tab.handle_now(c.DragCamera(type="camera.drag", right_mm=0.0, down_mm=0.0, held=True))
    drag = c.DragCamera(type="camera.drag", right_mm=2.0, down_mm=0.0, held=True)
    client.until(lambda shown: float(_ahead(client) @ ahead) < np.cos(np.radians(4.0)), drag)
    client.tab.handle_now(c.DragCamera(type="camera.drag", right_mm=2.0, down_mm=0.0, held=False))
    client.until(lambda shown: client.tab.now.snapshot is not None)
    let_go = _ahead(client)
    for _ in range(20):
        client.tab.handle_now(drives.HoldCommand(type="heartbeat"))
        client.shown()
    assert float(_ahead(client) @ let_go) > np.cos(np.radians(1.0))


def _ahead(client: Driving) -> np.ndarray[Any, Any]:
    """Where the camera looks."""
    client.shown()
    snapshot = client.tab.now.snapshot
    assert snapshot is not None
    return np.array(snapshot.camera[:3, 2])


def test_another_client_watches_and_may_pause_and_no_more(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client, other = Driving(phantom_services, shared), Driving(phantom_services, shared, Client("tab-two-0", "holds"))
    for one in (client, other):
        one.open(route)
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["rehearsal"]["state"] == "running")
    assert other.shown()["rehearsal"]["holder"] == "Another window"
    with pytest.raises(ControlError, match="holds the handle"):
        send(other.tab, "camera.straighten")
    send(other.tab, "rehearsal.pause")
    client.until(lambda shown: shown["rehearsal"]["state"] in ("ready", "paused"))  # the latter where it had moved


def test_a_task_that_cannot_be_made_and_other_bounds_are_refused_and_the_drive_goes_on(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["rehearsal"]["state"] == "running")
    with pytest.raises(ControlError, match="labels are traced in the body cavity"):
        send(client.tab, "drive.task", task="labels")
    with pytest.raises(ControlError, match="the route has no polyps"):
        send(client.tab, "drive.task", task="polyps", places="route")
    with pytest.raises(ControlError, match="Values by link"):
        send(client.tab, "rehearsal.settings", values={"camera_mm_per_s": 20.0, "tip_bound_mm": 50.0})
    assert client.tab.options == LumenDriveOptions()
    send(client.tab, "rehearsal.settings", values={"camera_mm_per_s": 20.0})
    shown = client.until(lambda shown: shown["snake"]["camera_mm_per_s"] == 20.0)
    assert shown["rehearsal"]["state"] == "running"


def test_an_edited_route_is_told_and_taken_by_a_reset(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    client.tab.enter()
    client.until(lambda shown: shown["rehearsal"]["state"] == "ready")
    send_operation(client, "route.breathing", breathing_mm=4.0)
    shown = client.shown()
    assert "Reset" in shown["rehearsal"]["words"]
    assert shown["snake"]["breathing_mm"] == 0.0
    send(client.tab, "rehearsal.reset")
    client.until(lambda shown: shown["snake"] is not None and shown["snake"]["breathing_mm"] == 4.0)


def send_operation(client: Driving, kind: str, **fields: Any) -> None:
    """As the Route tab does it, which is for the same client."""
    from app.tabs.route.tab import RouteTab

    tab = RouteTab(client.workspace)
    tab.refresh()
    send(tab, kind, **fields)


def test_another_arm_ends_the_run_and_stands_at_the_entry_and_each_run_says_its_own(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client, other = Driving(phantom_services, shared), Driving(phantom_services, shared, Client("tab-two-0", "holds"))
    client.open(route)
    assert client.shown()["drive_options"]["arm"] == "certified"
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["snake"] and shown["snake"]["depth_mm"] > 2.0, INSERT)
    other.open(route)
    assert not other.shown()["drive_options"]["open"]
    with pytest.raises(ControlError, match="holds the handle"):
        send(other.tab, "drive.arm", arm="manual")
    send(client.tab, "drive.arm", arm="manual")
    shown = client.until(lambda shown: shown["rehearsal"]["state"] == "ready")
    assert (shown["snake"]["depth_mm"], shown["snake"]["arm"], shown["snake"]["certified"]) == (0.0, "manual", False)
    assert other.shown()["drive_options"]["arm"] == "manual"
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["snake"]["can_look"], INSERT)
    send(client.tab, "drive.joint", joint=2)
    client.until(lambda shown: shown["snake"]["joint"] == 2)
    send(client.tab, "rehearsal.end")
    runs = stored(phantom_services, route, 2)
    arms = sorted((run.manifest["spec"]["drive"]["arm"], run.certified) for run in runs)
    assert arms == [("certified", True), ("manual", False)]


def test_parameters_of_a_paper_show_their_bends_as_ghosts_and_values_of_links_are_the_drives(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    send(client.tab, "drive.preset", preset="kwok2013")
    bounds = [None, None, None, None, 2.5]
    send(client.tab, "drive.links", bounds_mm=bounds, thresholds_mm=[0.5] * 5, springs_n_per_mm=None)
    options = client.shown()["drive_options"]
    assert (options["preset"], options["links"][-1]) == (
        "kwok2013",
        {"bound_mm": 2.5, "threshold_mm": 0.5, "spring_n_per_mm": 0.45},
    )
    send(client.tab, "drive.bends", on=True)
    send(client.tab, "rehearsal.start")
    client.until(lambda shown: shown["snake"] and shown["snake"]["can_look"], INSERT)
    client.tab.handle_now(drives.Push(type="drive", direction=0))
    shown = client.until(lambda shown: (now := client.tab.now.snapshot) and len(now.control_bends) == 4)["snake"]
    assert (shown["steered"], shown["shown"]) == (True, True)
    prepared, snapshot = client.tab.now.prepared, client.tab.now.snapshot
    assert prepared is not None
    assert snapshot is not None
    assert (prepared.preset, prepared.drive.control, prepared.drive.bends) == ("kwok2013", "parameterised", 4)
    assert snapshot.bounds[-1] == 2.5
    assert "drive.bends" in {layer.name for layer in client.tab.layers()}
    send(client.tab, "drive.bends", on=False)
    client.shown()
    assert "drive.bends" not in {layer.name for layer in client.tab.layers()}


def test_the_share_behind_the_wall_stands_beside_certified(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    client.tab.enter()
    shown = client.until(lambda shown: shown["snake"])["snake"]
    path = phantom_services.lumen_routes.paths.wait(route)
    assert path.reach.behind_wall is not None
    assert shown["behind"]["share"] == pytest.approx(path.reach.behind_wall.outside, abs=1e-4)
    assert shown["behind"]["depth_mm"] == pytest.approx(path.reach.behind_wall.depth_mm[-1], abs=1e-2)
    assert shown["behind"]["bound_mm"] == pytest.approx(path.bound_mm(path.settings), abs=1e-2)
    assert 0.0 < shown["behind"]["bound_mm"] <= BOUND_MM
    assert shown["deepest"] == {"depth_mm": 0.0, "link": 0, "bound_mm": None}  # at the entry no link is inside
    assert 0.0 <= shown["behind"]["between_mm"] - path.snake.between_vertices_mm(100) < 0.01


def test_landmarks_on_the_way_have_their_depth_and_others_are_none(
    phantom_services: Services, route: StoredRoute
) -> None:
    path = phantom_services.lumen_routes.paths.wait(route)
    curve = driven_curve(path.lumen.pathway, path.lumen.curve)
    places = [("Far", curve.position(50.0) + 100.0), ("Deep", curve.position(60.0)), ("Low", curve.position(20.0))]
    marks = tuple(CaseLandmark(name, to_triple(place)) for name, place in places)
    case = replace(phantom_services.cases.get(route.case_id), landmarks=marks)
    found = preparation.landmarks_along(case, path)
    assert [name for _, name in found] == ["Low", "Deep"]
    assert [s for s, _ in found] == pytest.approx([20.0, 60.0], abs=0.1)
    prepared = replace(
        preparation.prepare(phantom_services, route, LumenDriveOptions(), lambda *_: None), landmarks=found
    )
    assert [passed(prepared, depth) for depth in (0.0, 21.0, 59.0, 61.0)] == ["", "Low", "Low", "Deep"]
    assert preparation.landmarks_along(case, replace(path, base=np.eye(4))) == ()


def test_kernels_that_are_being_prepared_are_waited_for_in_words(
    phantom_services: Services, route: StoredRoute, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However long that takes: the process is started afterwards."""
    slow = Preparation("none", (), "never", 200)
    slow._idle.clear()
    monkeypatch.setattr(preparation, "SNAKE", slow)
    told: list[tuple[str, float | None]] = []

    def tell(words: str, fraction: float | None = None) -> None:
        told.append((words, fraction))
        if len(told) == 3:
            slow._idle.set()

    prepared = preparation.prepare(phantom_services, route, LumenDriveOptions(), tell)
    assert prepared.drive.arm == "certified"
    assert told[:3] == [("First start: preparing the snake", 0.0)] * 3


def test_a_row_of_poses_has_the_camera_and_the_force_of_guidance(
    phantom_services: Services, shared: SharedDrives[Any, Any], route: StoredRoute
) -> None:
    client = Driving(phantom_services, shared)
    client.open(route)
    client.tab.enter()
    client.until(lambda shown: shown["rehearsal"]["state"] == "ready")
    snapshot = client.tab.now.snapshot
    assert snapshot is not None
    row = dict(zip(COLUMNS.names(snapshot), COLUMNS.row(snapshot), strict=True))
    ahead, up = ([row[f"{name}_{axis}"] for axis in "xyz"] for name in ("shaft", "side"))
    np.testing.assert_allclose(ahead, [0.0, 0.0, 1.0], atol=0.05)  # the tube is along z
    assert abs(np.dot(ahead, up)) < 1e-9
    np.testing.assert_allclose(row["eye_z"] - row["tip_z"], 6.0, atol=0.05)  # the camera is ahead of the tip
    assert (row["guidance_force_x"], row["progress_mm"]) == (0.0, 0.0)
