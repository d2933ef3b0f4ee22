"""Contours of a route edited by hand: over REST, with undo and lock, and what the pathway says of them."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from lumen_cases import RADIUS_MM, route_in, tube
from rest_client import Client

from app.lumen.document import ROUTE
from app.services import Services
from vfix_engine.errors import InputError


def path_of(client: Client, address: str) -> Any:
    job = client.post(f"{address}/path").json()["id"]
    while (now := client.get(f"/api/v1/jobs/{job}").json())["state"] in ("queued", "running"):
        time.sleep(0.05)
    assert now["error"] is None, now
    return client.get(f"{address}/path").json()


def test_contours_are_resized_added_moved_and_removed_and_the_pathway_follows(
    client: Client, phantom_services: Services
) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    address = f"/api/v1/routes/{route.id}"
    fitted = path_of(client, address)
    assert not any(one["by_hand"] for one in fitted["contours"])
    middle = fitted["contours"][25]

    def edited(name: str, **fields: Any) -> Any:
        answer = client.post(f"{address}/contours{name}", json=fields)
        assert answer.status_code == 200, answer.text
        return answer.json()["contours"]

    (one,) = edited("/resize", at_mm=middle["at_mm"] + 0.3, radii_mm=[6.5])
    assert (one["radii_mm"], one["of_fit"], one["centre"]) == ([6.5], True, None)
    narrow = path_of(client, address)
    assert narrow["least_mm"] == pytest.approx(6.5, abs=0.01)
    assert narrow["contours"][25]["by_hand"]

    between = 0.5 * (fitted["contours"][10]["at_mm"] + fitted["contours"][11]["at_mm"])
    assert len(edited("", at_mm=between, radius_mm=9.0)) == 2
    assert client.post(f"{address}/contours", json={"at_mm": between}).status_code == 422  # there is one now
    x, y, z = middle["centre"]
    to = [x + 8.0, y, z]
    moved = edited("/move", at_mm=middle["at_mm"], to=to)
    assert (len(moved), moved[0]["centre"]) == (2, to)
    aside = path_of(client, address)
    assert len(aside["contours"]) == 51
    assert aside["contours"][26]["centre"] == pytest.approx(to)
    assert aside["length_mm"] > narrow["length_mm"]

    wide = edited("/resize", at_mm=aside["contours"][26]["at_mm"], radii_mm=[RADIUS_MM])
    assert len(wide) == 2
    beyond = path_of(client, address)
    assert beyond["contours"][26]["behind_mm"] > 5.0  # 8 mm aside, as wide as the tube
    assert beyond["behind_wall"] > narrow["behind_wall"]

    assert len(edited("/remove", at_mm=aside["contours"][11]["at_mm"])) == 1  # one that was added
    assert len(edited("/remove", at_mm=fitted["contours"][30]["at_mm"])) == 2  # a fitted one is left out
    assert len(path_of(client, address)["contours"]) == 49
    assert client.request("DELETE", f"{address}/contours").json()["contours"] == []
    assert len(client.post(f"{address}/undo").json()["contours"]) == 2
    for _ in range(7):
        last = client.post(f"{address}/undo")
    assert last.status_code == 422  # nothing more to undo
    assert path_of(client, address)["contours"] == fitted["contours"]


def test_what_cannot_be_is_refused_in_words_and_changes_nothing(client: Client, phantom_services: Services) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    address = f"/api/v1/routes/{route.id}/contours"
    for name, body, words in (
        ("", {"at_mm": 5000.0}, "not on the way"),
        ("", {"at_mm": 50.0, "radius_mm": 0.0}, "0.5 to 150 mm"),
        ("/resize", {"at_mm": 50.0, "radii_mm": [-4.0]}, "0.5 to 150 mm"),
        ("/resize", {"at_mm": 50.0, "radii_mm": []}, "one radius"),
        ("/resize", {"at_mm": 50.0, "radii_mm": [5.0, 6.0]}, "one radius"),
        ("/resize", {"at_mm": "NaN", "radii_mm": [5.0]}, ""),
        ("/move", {"at_mm": 50.0, "to": [500.0, 0.0, 50.0]}, "at most 60 mm"),
        ("/move", {"at_mm": 0.0, "to": [5.0, 0.0, 10.0]}, "another entry or end"),
        ("/remove", {"at_mm": 0.0}, "another entry or end"),
    ):
        answer = client.post(f"{address}{name}", json=body)
        assert answer.status_code == 422, (name, body, answer.text)
        assert words in answer.text, (name, body, answer.text)
    now = phantom_services.lumen_routes.documents.get(route.id)
    assert (now.revision, now.content.contours) == (route.revision, ())
    client.request("PATCH", f"/api/v1/routes/{route.id}", json={"locked": True})
    assert client.post(address, json={"at_mm": 50.0}).status_code == 423


def test_contours_of_another_way_are_left_out_and_come_back_with_it(phantom_services: Services) -> None:
    from app.lumen.contour_operations import ResizeContour
    from app.lumen.operations import SPEC, SetBound

    paths, case = phantom_services.lumen_routes.paths, tube(phantom_services)
    route = route_in(phantom_services, case)
    resized = ResizeContour(at_mm=70.0, radii_mm=(6.0,)).run(SPEC.context(phantom_services), route.id)
    assert paths.fit(resized) is paths.fit(route)  # no ray is cast anew for an edit
    kept = SetBound(bound_mm=3.0).run(SPEC.context(phantom_services), route.id)
    assert paths.fit(kept) is paths.fit(route)
    thick = route_in(phantom_services, case, contours=kept.content.contours, radius_mm=8.0, length_mm=25.0)
    path = paths.wait(thick)
    assert path.edited.of_hand.max() == 0
    assert path.reach.narrowest.radius_mm == pytest.approx(6.0, abs=0.1)


def test_a_contour_that_makes_the_pathway_too_narrow_is_named_with_its_place(phantom_services: Services) -> None:
    from app.lumen.contour_operations import ResizeContour
    from app.lumen.operations import SPEC

    paths, case = phantom_services.lumen_routes.paths, tube(phantom_services)
    edited = ResizeContour(at_mm=70.0, radii_mm=(4.0,)).run(
        SPEC.context(phantom_services), route_in(phantom_services, case).id
    )
    path = paths.wait(edited)
    number = int(np.flatnonzero(path.edited.of_hand >= 0)[0])
    at_mm = float(path.edited.at_mm[number])
    assert at_mm == pytest.approx(70.0, abs=3.0)
    named = f"contour {number + 1} of 50, placed by hand at {at_mm:.0f} mm, makes the pathway narrower than the robot"
    assert path.reach.limit == "narrow"
    assert path.reach.words.startswith(named)
    assert path.reach.narrowest.by_hand is not None
    with pytest.raises(InputError, match="enlarge that contour, move it or remove it"):
        path.reach.narrowest.refuse(path.snake)
    with pytest.raises(InputError, match=named):
        path.reach.narrowest.refuse(path.snake)
    # A robot that is thicker than the tube itself is not the contour's fault.
    content = {"contours": edited.content.contours, "radius_mm": 16.0, "length_mm": 40.0}
    thick = paths.wait(route_in(phantom_services, case, **content))
    assert thick.reach.words.startswith("the pathway is narrower than the robot's 16 mm")


def test_a_robot_held_at_a_contour_by_hand_is_told_of_it(phantom_services: Services) -> None:
    """A narrow way moved aside by 14 mm: no shape of links of 40 mm keeps their bound there."""
    from app.lumen.contour_operations import MoveContour, ResizeContour
    from app.lumen.operations import SPEC

    paths, case = phantom_services.lumen_routes.paths, tube(phantom_services)
    route = route_in(phantom_services, case, length_mm=40.0, links=3, bound_mm=0.1)
    context = SPEC.context(phantom_services)
    for at_mm in range(45, 97, 2):
        ResizeContour(at_mm=float(at_mm), radii_mm=(6.5,)).run(context, route.id)
    path = paths.wait(MoveContour(at_mm=70.0, to=(14.0, 0.0, 80.0)).run(context, route.id))
    assert path.reach.limit in ("bound", "shape")
    assert path.reach.words.endswith("is there")
    assert "placed by hand at" in path.reach.words


def test_a_route_that_was_stored_before_has_no_contours_by_hand() -> None:
    old = {
        "entry": [0.0, 0.0, 10.0], "end": None, "links": None, "length_mm": 28.0, "radius_mm": 6.0, "bound_mm": None,
        "breathing_mm": 0.0,
    }  # fmt: skip
    content = ROUTE.content("vfix-route/1", old, None)
    assert (content.contours, content.marks) == ((), ())
    assert ROUTE.read(ROUTE.write(content)) == content
