"""Polyps and labels on the wall of a lumen: put there, moved, renamed, removed, and by a seed."""

from __future__ import annotations

import numpy as np
import pytest
from lumen_cases import RADIUS_MM, route_in, tube, tube_mesh
from rest_client import Client

from app.lumen.marks import seeded_places
from app.services import Services
from vfix_engine.errors import InputError
from vfix_engine.geometry.curve import Curve


def test_marks_come_to_the_wall_and_are_undone(client: Client, phantom_services: Services) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    address = f"/api/v1/routes/{route.id}"
    near = [RADIUS_MM - 4.0, 0.0, 60.0]
    (polyp,) = client.post(f"{address}/marks", json={"kind": "polyp", "at": near}).json()["marks"]
    assert (polyp["id"], polyp["name"]) == ("p1", "Polyp 1")
    np.testing.assert_allclose(polyp["at"], [RADIUS_MM, 0.0, 60.0], atol=0.8)
    far = client.post(f"{address}/marks", json={"kind": "polyp", "at": [0.0, 0.0, 60.0]})
    assert (far.status_code, "15 mm from the wall" in far.text) == (422, True)
    client.post(f"{address}/marks", json={"kind": "label", "at": near, "name": "Liver"})
    moved = client.request("PUT", f"{address}/marks/p1/place", json={"to": [0.0, RADIUS_MM, 90.0]}).json()["marks"]
    np.testing.assert_allclose(moved[0]["at"], [0.0, RADIUS_MM, 90.0], atol=0.8)
    named = client.request("PUT", f"{address}/marks/l1/name", json={"name": "Spleen"}).json()["marks"]
    assert [mark["name"] for mark in named] == ["Polyp 1", "Spleen"]
    assert client.request("PUT", f"{address}/marks/l1/name", json={"name": "a\u202eb"}).status_code == 422
    left = client.request("DELETE", f"{address}/marks/p1").json()["marks"]
    assert [mark["id"] for mark in left] == ["l1"]
    unknown = client.request("DELETE", f"{address}/marks/p1")
    assert (unknown.status_code, "it has: l1" in unknown.text) == (422, True)
    assert len(client.post(f"{address}/undo").json()["marks"]) == 2
    paths, documents = phantom_services.lumen_routes.paths, phantom_services.lumen_routes.documents
    assert paths.key(documents.get(route.id)) == paths.key(route)  # the pathway is the same


def test_ten_polyps_by_seed_lie_on_the_wall_one_in_each_tenth(client: Client, phantom_services: Services) -> None:
    route = route_in(phantom_services, tube(phantom_services))
    address = f"/api/v1/routes/{route.id}"
    near = [RADIUS_MM, 0.0, 60.0]
    client.post(f"{address}/marks", json={"kind": "label", "at": near})
    client.post(f"{address}/marks", json={"kind": "polyp", "at": near})
    marks = client.post(f"{address}/marks/polyps", json={"seed": 5}).json()["marks"]
    assert [mark["id"] for mark in marks] == ["l1", *(f"p{number}" for number in range(1, 11))]
    places = np.array([mark["at"] for mark in marks[1:]])
    np.testing.assert_allclose(np.hypot(places[:, 0], places[:, 1]), RADIUS_MM, atol=0.8)
    line = phantom_services.lumen_routes.paths.fit(route).centreline.curve
    tenths = [int(10.0 * line.closest(place) / line.length) for place in places]
    assert tenths == list(range(10))
    again = client.post(f"{address}/marks/polyps", json={"seed": 5}).json()["marks"]
    assert again == marks
    other = client.post(f"{address}/marks/polyps", json={"seed": 6}).json()["marks"]
    assert other[1]["at"] != marks[1]["at"]


def test_a_way_outside_the_lumen_has_no_polyps_by_seed() -> None:
    outside = Curve.through(np.array([[300.0, 0.0, 0.0], [300.0, 0.0, 100.0]]))
    with pytest.raises(InputError, match="no wall is seen between 0 and 10 mm"):
        seeded_places(tube_mesh(), outside, 10, 1)
