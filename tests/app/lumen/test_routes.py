"""Routes through a lumen: the shipped colon, what is stored of a route, what is computed of it, over REST too."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from lumen_cases import END, ENTRY, RADIUS_MM, route_in, tube, winding_line, winding_mesh
from rest_client import Client

from app.cases.kinds import KINDS
from app.cases.model import COLON_PHANTOM, HARD_COLON, HEAD_PHANTOM
from app.cases.service import CaseService
from app.lumen.document import ROUTE, Route
from app.lumen.paths import tissue_of
from app.lumen.shipped_lumens import LUMENS, SAMPLE_ROUTE, ensure_lumen_phantoms, shipped_hash
from app.operations.operation import Context
from app.services import Services
from app.tabs.patient.hints import patient_hint
from app.tabs.registry import specs
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import InputError


def test_the_colon_that_travels_along_is_a_closed_lumen_with_a_route_from_end_to_end(
    phantom_services: Services,
) -> None:
    services = phantom_services
    case = services.cases.get(COLON_PHANTOM)
    assert (case.kind, case.anatomy.has_inside, case.frame.name, case.has_volume) == ("lumen", True, "LPS", False)
    mesh = services.cases.case_surface(case.id)
    assert len(mesh.faces) == case.surfaces[0].triangles > 10_000
    route = services.lumen_routes.documents.get(SAMPLE_ROUTE).content
    assert [mark.name for mark in (case.landmarks[0], case.landmarks[-1])] == ["Anus", "Caecum"]
    assert (route.entry, route.end) == (case.landmarks[0].position, case.landmarks[-1].position)


def test_a_hard_colon_travels_along_too_with_a_route(phantom_services: Services) -> None:
    services = phantom_services
    case, usual = services.cases.get(HARD_COLON), services.cases.get(COLON_PHANTOM)
    assert (case.name, case.kind, case.anatomy.has_inside) == ("Hard colon", "lumen", True)
    (route,) = services.lumen_routes.documents.titles(case.id)
    content = services.lumen_routes.documents.get(route.id).content
    assert (content.entry, content.end) == (case.landmarks[0].position, case.landmarks[-1].position)
    meshes = [services.cases.case_surface(one.id) for one in (case, usual)]
    assert not np.allclose(*(mesh.vertices for mesh in meshes))
    assert shipped_hash(LUMENS[0]) != shipped_hash(LUMENS[1])


def test_what_was_done_to_the_colon_stays_and_another_one_of_the_engine_takes_its_place(
    phantom_services: Services,
) -> None:
    services = phantom_services
    cases, routes = services.cases, services.lumen_routes
    cases.rename(COLON_PHANTOM, "Mine")
    routes.documents.delete(SAMPLE_ROUTE)
    case = cases.get(COLON_PHANTOM)
    with services.store.writing() as session:
        from app.store.models import CaseRow

        row = session.get(CaseRow, case.id)
        assert row is not None
        row.content_hash = "0" * 64
    ensure_lumen_phantoms(services.store, cases, routes)
    assert (cases.get(case.id).name, cases.get(case.id).content_hash) == ("Mine", shipped_hash())
    assert routes.documents.get(SAMPLE_ROUTE).deleted_at is not None


def test_every_kind_of_case_has_a_tab_beside_patient() -> None:
    for kind in KINDS:
        assert [spec.name for spec in specs() if kind in spec.kinds], kind


def test_the_patient_tab_names_what_is_open_and_where_to_go() -> None:
    assert patient_hint(KINDS["head"], False) == "Drag to turn the head. Then go to Plan."
    assert patient_hint(KINDS["lumen"], False) == "Drag to turn the lumen. Then go to Route."
    for kind in KINDS.values():
        assert kind.then in [spec.label for spec in specs()]
    unknown = SurfaceUncertainty(0.0, 0.0).words(KINDS["lumen"].anatomy)
    assert unknown.startswith("how far the wall may lie off its surface is not known")


def test_a_route_is_edited_over_rest_and_its_pathway_is_a_job(client: Client, phantom_services: Services) -> None:
    case = tube(phantom_services)
    made = client.post(f"/api/v1/cases/{case.id}/routes", json={"name": "First"})
    assert (made.status_code, made.json()["entry"]) == (201, None)
    address = f"/api/v1/routes/{made.json()['id']}"
    assert client.post(f"{address}/path").status_code == 422  # it has no ends yet
    for name, at in (("entry", ENTRY), ("end", END)):
        assert client.request("PUT", f"{address}/{name}", json={"at": at}).status_code == 200
    robot = {"links": 3, "length_mm": 20.0, "radius_mm": 5.0}
    assert client.request("PUT", f"{address}/robot", json=robot).json()["links"] == 3
    thicker = {**robot, "radius_mm": 25.0}  # than it is long
    assert client.request("PUT", f"{address}/robot", json=thicker).status_code == 422
    assert client.get(f"{address}/path").status_code == 404
    _ended(client, client.post(f"{address}/path").json()["id"])
    path = client.get(f"{address}/path").json()
    assert 130.0 < path["length_mm"] < 150.0
    assert (path["links"], round(path["reach_mm"]), path["limit"]) == (3, 60, "links")
    assert len(path["s_mm"]) == len(path["radius_mm"]) == len(path["wall_mm"]) > 20
    np.testing.assert_allclose(path["radius_mm"], RADIUS_MM, atol=1.0)
    assert client.post(f"{address}/swap").json()["entry"] == list(END)
    assert client.post(f"{address}/undo").json()["entry"] == list(ENTRY)
    assert client.get(f"{address}/path").status_code == 200  # as it was before


def _ended(client: Client, job: str) -> Any:
    while (now := client.get(f"/api/v1/jobs/{job}").json())["state"] in ("queued", "running"):
        time.sleep(0.05)
    assert now["error"] is None, now
    return now


def test_a_head_has_no_route_and_no_wall_of_a_lumen(client: Client) -> None:
    answer = client.post(f"/api/v1/cases/{HEAD_PHANTOM}/routes", json={})
    assert (answer.status_code, "open a lumen" in answer.json()["error"]["message"]) == (422, True)
    assert client.post(f"/api/v1/cases/{HEAD_PHANTOM}/endoscope").status_code == 422


def test_what_is_computed_depends_on_the_route_alone_and_not_on_its_name(phantom_services: Services) -> None:
    services = phantom_services
    paths, case = services.lumen_routes.paths, tube(services)
    route = route_in(services, case)
    first = paths.wait(route)
    renamed = services.lumen_routes.documents.rename(route.id, "Other")
    assert paths.known(renamed) is first
    thicker = route_in(services, case, radius_mm=7.0)
    assert paths.known(thicker) is None
    breathing = paths.wait(route_in(services, case, breathing_mm=5.0))
    assert first.tissue is None
    assert breathing.tissue is not None
    assert [len(ring) for ring in first.rings()] == [25] * len(first.rings())
    assert len(first.rings()) >= 8


@pytest.mark.parametrize("breathing_mm", [0.0, 5.0])
def test_all_lengths_of_a_route_are_along_the_way_of_its_robot(
    client: Client, phantom_services: Services, breathing_mm: float
) -> None:
    """In a winding tube the centreline, the way and the line of the pathway's centres have three lengths."""
    services, line = phantom_services, winding_line()
    ends = {"entry": tuple(line[8].tolist()), "end": tuple(line[-9].tolist())}
    route = route_in(services, tube(services, winding_mesh()), links=None, breathing_mm=breathing_mm, **ends)
    path = services.lumen_routes.paths.wait(route)
    told = client.get(f"/api/v1/routes/{route.id}/path").json()
    lumen = path.lumen
    way = lumen.curve if breathing_mm == 0.0 else lumen.pathway.moved(None).curve()
    contours = told["contours"]
    lengths = [told["length_mm"], told["s_mm"][-1], contours[-1]["at_mm"], told["reach_mm"]]
    np.testing.assert_allclose(lengths, way.length, atol=0.02)
    assert told["limit"] == "end"
    assert told["centreline_mm"] == pytest.approx(lumen.centreline.curve.length)
    assert told["centreline_mm"] > told["length_mm"] + 3.0
    found = [way.closest(one["centre"]) for one in contours]
    np.testing.assert_allclose([one["at_mm"] for one in contours], found, atol=0.6)
    assert way.position(told["least_at_mm"]) == pytest.approx(path.reach.narrowest.at_lps, abs=1.0)
    # The tube is as wide everywhere but before its closed ends.
    np.testing.assert_allclose(np.array(told["wall_mm"])[3:-3], RADIUS_MM, atol=1.5)
    assert client.post(f"/api/v1/routes/{route.id}/contours", json={"at_mm": way.length + 5.0}).status_code == 422


def test_a_robot_that_is_wider_than_the_lumen_is_told_how_far_it_comes(phantom_services: Services) -> None:
    path = phantom_services.lumen_routes.paths.wait(
        route_in(phantom_services, tube(phantom_services), radius_mm=16.0, length_mm=40.0)
    )
    assert (path.reach.depth_mm, path.reach.limit) == (0.0, "narrow")
    assert path.reach.offers[0].depth_mm > 100.0
    with pytest.raises(InputError, match="narrower than the robot"):
        path.reach.narrowest.refuse(path.snake)


def test_an_endoscope_sees_the_wall_from_inside(client: Client, phantom_services: Services) -> None:
    from app.imaging.endoscope_file import HEADER

    case = tube(phantom_services)
    address = f"/api/v1/cases/{case.id}/endoscope"
    assert client.get(address).status_code == 404
    _ended(client, client.post(address).json()["id"])
    answer = client.get(address)
    count = int(np.frombuffer(answer.content, HEADER, 1)[0]["counts"][1])
    places = np.frombuffer(answer.content, "<f4", 3 * count, HEADER.itemsize).reshape(-1, 3)
    normals = np.frombuffer(answer.content, "i1", 4 * count, HEADER.itemsize + 12 * count).reshape(-1, 4)[:, :3]
    side = (np.abs(places[:, 2] - 80.0) < 50.0) & (np.hypot(places[:, 0], places[:, 1]) > 10.0)
    assert ((normals[side, :2] * places[side, :2]).sum(axis=1) < 0.0).all()  # to the axis
    assert client.get(address, headers={"If-None-Match": answer.headers["ETag"]}).status_code == 304


def test_a_new_route_goes_from_the_first_landmark_to_the_last(phantom_services: Services) -> None:
    from app.lumen.operations import SPEC, CreateRoute

    context: Context[Route, Any] = SPEC.context(phantom_services)
    made = CreateRoute().create(context, COLON_PHANTOM)
    marks = _landmarks(phantom_services.cases)
    assert (made.name, made.content.entry, made.content.end) == (
        "Route 2",
        marks[0],
        marks[-1],
    )
    assert CreateRoute().create(context, COLON_PHANTOM).name == "Route 3"


def _landmarks(cases: CaseService) -> list[tuple[float, float, float]]:
    return [mark.position for mark in cases.get(COLON_PHANTOM).landmarks]


def test_a_lumen_breathes_and_narrows_as_its_route_says(client: Client, phantom_services: Services) -> None:
    """The period stays where none is given; a route of before, without one, breathes as it did."""
    services = phantom_services
    route = route_in(services, tube(services))
    address = f"/api/v1/routes/{route.id}"
    client.request("PUT", f"{address}/breathing", json={"breathing_mm": 5.0, "period_s": 3.0})
    answer = client.request("PUT", f"{address}/breathing", json={"breathing_mm": 6.0}).json()
    assert (answer["breathing_mm"], answer["breathing_period_s"]) == (6.0, 3.0)
    answer = client.request("PUT", f"{address}/peristalsis", json={"share": 0.2, "period_s": 5.0}).json()
    assert (answer["peristalsis"], answer["peristalsis_period_s"]) == (0.2, 5.0)
    for wrong in ({"share": 1.0}, {"share": 0.2, "period_s": 0.0}):
        assert client.request("PUT", f"{address}/peristalsis", json=wrong).status_code == 422
    still, both = tissue_of(Route()), tissue_of(services.lumen_routes.documents.get(route.id).content)
    assert still is None
    assert both is not None
    s = np.array([0.0, 60.0, 1000.0])
    moved, narrowed = both(s, 1.5)  # half a breath
    np.testing.assert_allclose(moved[-1], [0.0, 0.0, 6.0 * (1.0 - np.exp(-5.0))], atol=1e-9)
    assert narrowed.min() >= 0.8 - 1e-12
    np.testing.assert_allclose(both(s, 15.0)[1], both(s, 0.0)[1], atol=1e-9)  # whole breaths and waves later


def test_a_route_stored_before_there_was_peristalsis_breathes_as_it_did() -> None:
    before = {"entry": None, "end": None, "links": 3, "length_mm": 28.0, "radius_mm": 6.0, "bound_mm": None}
    (_, upgrade) = ROUTE.upgrades["vfix-route/1"]
    route = ROUTE.read(upgrade({**before, "breathing_mm": 8.0}))
    assert (route.breathing_mm, route.breathing_period_s, route.peristalsis) == (8.0, 4.0, 0.0)
