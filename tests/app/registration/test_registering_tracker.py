"""Points measured with a tracked pointer: kept as such, refused where the pointer moves or nobody listens to one."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from edited_registrations import Edited
from registration_poses_cases import paired_poses, table
from rest_client import CASE, opened_client
from session_doubles import HEAD, sections_of, workspace_of

from app.kit.errors import NotFound
from app.link.tracker import Collected
from app.registration.operations import AddPair
from app.registration.service import Registering
from app.services import Services
from app.tabs.register.tab import RegisterTab
from vfix_engine.errors import InputError
from vfix_engine.registration import SimulatedTracker
from vfix_engine.registration.tracker import TIP_MM


class Pointer:
    """Stands for a tracking server's client: the tip rests where the test says."""

    state, words = "fresh", "Stylus is tracked"
    largest_mm = 0.2
    asked_s = 0.0

    def collect(self, seconds: float, point: Any = (0.0, 0.0, 0.0)) -> Collected:
        self.asked_s = seconds
        return Collected(np.array([1.5, -2.5, 3.5]) + point, 0.1, self.largest_mm, 60)

    def poses(self, seconds: float) -> np.ndarray:
        """Swung about its tip, with 0.1 mm of noise at each of its points."""
        self.asked_s = seconds
        return SimulatedTracker(3, sigma_mm=0.1).pivot([0.0, 0.0, 900.0], 80)


@pytest.fixture
def pointer() -> Pointer:
    return Pointer()


@pytest.fixture
def tracked(phantom_services: Services, pointer: Pointer) -> Services:
    own = phantom_services
    registering = Registering(own.registrations, own.cases, own.plans, own.jobs, pointer)  # type: ignore[arg-type]
    services = copy.copy(own)
    services.registering = registering
    return services


def test_a_point_is_measured_with_the_pointer(tracked: Services, pointer: Pointer) -> None:
    client = opened_client(tracked)
    made = client.post(f"{CASE}/registrations", json={"name": "Tracked"}).json()
    path = f"/api/v1/registrations/{made['id']}"
    pair = client.post(f"{path}/pairs", json={"in_image": [8.2, 4.9, 71.8]}).json()["pair"]
    answer = client.post(f"{path}/pairs/{pair}/measure", json={"seconds": 0.5}).json()
    (stored,) = answer["registration"]["pairs"]
    assert (stored["measured"], stored["measured_from"]) == ([1.5, -2.5, 3.5], "tracker")
    assert (answer["spread_mm"], pointer.asked_s) == (0.1, 0.5)
    pointer.largest_mm = 4.0
    moved = client.post(f"{path}/pairs/{pair}/measure", json={})
    assert moved.status_code == 422
    assert "moved by 4.0 mm" in moved.json()["error"]["message"]
    assert client.post(f"{path}/pairs/{pair}/measure", json={"seconds": 60.0}).status_code == 422
    assert client.post(f"{path}/pairs/none/measure", json={}).status_code == 404
    client.delete(path)
    client.close()


def test_without_a_tracker_it_says_how_to_have_one(phantom_services: Services) -> None:
    made = phantom_services.registrations.create(HEAD, "Not tracked")
    pair = AddPair.added(Edited(phantom_services, made.id).do(AddPair(in_image=(0.0, 0.0, 0.0))))
    assert phantom_services.registering.tracker_state is None
    with pytest.raises(InputError, match="--tracker"):
        phantom_services.registering.measure(made.id, pair)
    phantom_services.registrations.delete(made.id)


def test_the_page_is_told_when_the_pointer_goes_out_of_sight(tracked: Services, pointer: Pointer) -> None:
    tab: Any = RegisterTab(workspace_of(tracked))
    tab.active = True
    assert sections_of(tab)["pointer"] == {"state": "fresh", "words": "Stylus is tracked"}
    assert tab.tick()
    assert not tab.tick()
    pointer.state = "stale"
    assert tab.tick()
    assert sections_of(tab)["pointer"]["state"] == "stale"
    tab.active = False
    tab.tick()
    assert not tab.tick()


def test_an_unknown_point_is_not_waited_for(tracked: Services, pointer: Pointer) -> None:
    made = tracked.registrations.create(HEAD, "Tracked")
    with pytest.raises(NotFound):
        tracked.registering.measure(made.id, "pair-none")
    assert pointer.asked_s == 0.0
    tracked.registrations.delete(made.id)


def test_the_tracked_pointer_is_calibrated_and_its_tip_measures(tracked: Services, pointer: Pointer) -> None:
    """A point is that of the tip from then on, and in the robot's base where the registration is to that."""
    client = opened_client(tracked)
    made = client.post(f"{CASE}/registrations", json={"name": "Tip", "to": "base"}).json()
    path = f"/api/v1/registrations/{made['id']}"
    pair = client.post(f"{path}/pairs", json={"in_image": [8.2, 4.9, 71.8]}).json()["pair"]
    assert client.post(f"{path}/pointer/track", json={"seconds": 60.0}).status_code == 422
    found = client.post(f"{path}/pointer/track", json={"seconds": 5.0}).json()["pointer"]
    assert (found["measured_from"], found["poses"], pointer.asked_s) == ("tracker", 80, 5.0)
    np.testing.assert_allclose(found["tip"], TIP_MM, atol=5.0 * found["tip_error_mm"])
    unknown = client.post(f"{path}/pairs/{pair}/measure", json={})
    assert unknown.status_code == 422
    assert "robot and tracker are not calibrated" in unknown.json()["error"]["message"]
    robot, seen = paired_poses()
    tables = {"file": ("t.csv", table(seen, "marker_to_tracker")), "robot": ("r.csv", table(robot, "flange_to_base"))}
    matrix = np.reshape(client.post(f"{path}/robot", files=tables).json()["robot"]["transform"], (4, 4))
    stored = client.post(f"{path}/pairs/{pair}/measure", json={}).json()["registration"]["pairs"][0]
    tip = np.array([1.5, -2.5, 3.5]) + found["tip"]
    np.testing.assert_allclose(stored["measured"], matrix[:3, :3] @ tip + matrix[:3, 3], atol=1e-9)
    assert stored["measured_from"] == "tracker"
    pointer.asked_s = 0.0
    assert client.post(f"{path}/pointer/track", json={"seconds": 5.0}).status_code == 422  # it was measured with
    assert pointer.asked_s == 0.0  # nobody swings it in vain
    client.delete(path)
    client.close()


def test_a_calibration_that_changes_while_a_point_is_measured_is_told(tracked: Services, pointer: Pointer) -> None:
    made = tracked.registrations.create(HEAD, "Changed meanwhile")
    pair = AddPair.added(Edited(tracked, made.id).do(AddPair(in_image=(0.0, 0.0, 0.0))))
    held = pointer.collect

    def collect(seconds: float, point: Any) -> Collected:
        tracked.registering.calibrating.track_pointer(made.id, 5.0)
        return held(seconds, point)

    pointer.collect = collect  # type: ignore[method-assign]
    with pytest.raises(InputError, match="was changed while"):
        tracked.registering.measure(made.id, pair)
    assert tracked.registrations.get(made.id).content.pairs[0].measured is None
    tracked.registrations.delete(made.id)
