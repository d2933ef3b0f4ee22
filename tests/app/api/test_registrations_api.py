"""Registrations over REST: the whole way from beads to a plan that uses one, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI
from registration_contents import pose
from rest_client import CASE, Client

from app.api import described, router
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.registration.transform_files import tfm_text


@pytest.fixture
def made(client: Client) -> Any:
    answer = client.post(f"{CASE}/registrations", json={"name": "Beads"})
    assert answer.status_code == 201
    yield answer.json()
    client.delete(f"/api/v1/registrations/{answer.json()['id']}")


def test_from_beads_to_a_plan_that_uses_them(client: Client, phantom_services: Services, made: dict[str, Any]) -> None:
    path = f"/api/v1/registrations/{made['id']}"
    assert (made["made_from"], made["schema"], made["fit"]["state"]) == ("none", "vfix-registration/4", "waiting")
    job = client.post(f"{path}/beads", json={"diameter_mm": 4.0}).json()
    assert phantom_services.jobs.wait(job["id"], 120.0).state == "done"
    found = client.get(path).json()
    assert [bead["state"] for bead in found["beads"]] == ["found"] * 5
    assert found["search"]["diameter_mm"] == 4.0
    for bead in found["beads"]:
        found = client.patch(f"{path}/beads/{bead['id']}", json={"confirmed": True}).json()
    assert [bead["state"] for bead in found["beads"]] == ["confirmed"] * 5
    for pair in found["pairs"]:
        touched = client.post(f"{path}/pairs/{pair['id']}/touch", json={"noise_mm": 0.3, "seed": 5})
        assert touched.status_code == 200
    fitted = touched.json()
    assert (fitted["made_from"], fitted["fit"]["state"], fitted["fit"]["simulated"]) == ("pairs", "fitted", True)
    assert 0.0 < fitted["fit"]["mean_residual_mm"] <= fitted["fit"]["fre_mm"] < 1.0
    assert fitted["fit"]["fle_mm"] == pytest.approx(fitted["fit"]["fre_mm"] / np.sqrt(0.6))
    table = client.get(f"{path}/errors", params={"plan_id": SAMPLE_PLAN}).json()
    assert len(table["targets"]) > 0
    for target in table["targets"]:
        assert 0.0 < target["error"]["rms_mm"] < target["error"]["within_95_mm"]
    assert table["path"]["worst"]["within_95_mm"] == max(table["path"]["within_95_mm"])
    plan = client.post(f"{CASE}/plans", json={"name": "Registered", "copy_of": SAMPLE_PLAN}).json()
    assert plan["registration"] is None
    none = client.get(f"/api/v1/plans/{plan['id']}/registration").json()
    assert (none["state"], none["registration"], none["errors"]) == ("none", None, None)
    used = client.request("PUT", f"/api/v1/plans/{plan['id']}/registration", json={"registration": made["id"]})
    assert used.json()["registration"] == made["id"]
    assert used.headers["ETag"] == f'"{used.json()["revision"]}"'
    told = client.get(f"/api/v1/plans/{plan['id']}/registration").json()
    assert (told["state"], told["name"], told["errors"]["targets"]) == ("ready", "Beads", table["targets"])
    client.delete(path)
    gone = client.get(f"/api/v1/plans/{plan['id']}/registration").json()
    assert (gone["state"], gone["registration"]) == ("deleted", made["id"])
    client.post(f"{path}/restore")
    nothing = client.request("PUT", f"/api/v1/plans/{plan['id']}/registration", json={"registration": None}).json()
    assert nothing["registration"] is None
    undone = client.post(f"/api/v1/plans/{plan['id']}/undo").json()
    assert (undone["registration"], undone["told"]) == (made["id"], "Undone: The plan uses no registration any more.")
    assert client.get(f"/api/v1/plans/{plan['id']}").json()["told"] == ""
    back = client.post(f"{path}/undo").json()
    assert back["told"].startswith(f"Undone: Point ‘{back['pairs'][-1]['label']}’: the measured place is given")
    assert client.post(f"{path}/redo").json()["told"] == back["told"].replace("Undone", "Redone")
    assert client.get(path).json()["told"] == ""
    client.delete(f"/api/v1/plans/{plan['id']}")


def test_pairs_are_typed_ordered_and_taken_back(client: Client, made: dict[str, Any]) -> None:
    path, rng = f"/api/v1/registrations/{made['id']}", np.random.default_rng(3)
    places = (rng.uniform(-80.0, 80.0, (5, 3))).tolist()
    ids = []
    for place in places:
        answer = client.post(f"{path}/pairs", json={"in_image": place, "measured": place})
        assert answer.status_code == 201
        ids.append(answer.json()["pair"])
    mixed = [places[i] for i in (2, 0, 1, 4, 3)]
    for pair_id, place in zip(ids, mixed, strict=True):
        wrong = client.patch(f"{path}/pairs/{pair_id}", json={"measured": place}).json()
    assert wrong["fit"]["fre_mm"] > 5.0
    order = client.get(f"{path}/order").json()
    assert (order["ambiguous"], order["unchanged"]) == (False, False)
    right = client.post(f"{path}/order", json={"measured_of": order["candidates"][0]["measured_of"]}).json()
    assert right["fit"]["fre_mm"] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(np.reshape(right["transform"], (4, 4)), np.eye(4), atol=1e-9)
    assert client.get(f"{path}/order").json()["unchanged"] is True
    cleared = client.patch(f"{path}/pairs/{ids[0]}", json={"measured": None, "label": "chin"}).json()
    assert (cleared["pairs"][0]["measured"], cleared["pairs"][0]["label"]) == (None, "chin")
    assert client.post(f"{path}/undo").json()["pairs"][0]["measured"] == places[0]
    assert client.post(f"{path}/redo").json()["pairs"][0]["measured"] is None
    assert len(client.delete(f"{path}/pairs/{ids[0]}").json()["pairs"]) == 4
    stated = client.patch(path, json={"fle": {"mm": 0.5}}).json()
    assert (stated["fle_mm"], stated["fit"]["fle_source"]) == (0.5, "stated")
    assert client.patch(path, json={"fle": {"mm": None}}).json()["fle_mm"] is None
    copy = client.post(f"{CASE}/registrations", json={"name": "Copy", "copy_of": made["id"]}).json()
    assert copy["pairs"] == client.get(path).json()["pairs"]
    assert {one["id"] for one in client.get(f"{CASE}/registrations").json()} >= {copy["id"], made["id"]}
    client.delete(f"/api/v1/registrations/{copy['id']}")


def test_a_table_of_measured_points_comes_in(client: Client, made: dict[str, Any]) -> None:
    path = f"/api/v1/registrations/{made['id']}"
    for label, place in (("a", [0, 0, 0]), ("b", [50, 0, 0]), ("c", [0, 70, 0])):
        client.post(f"{path}/pairs", json={"label": label, "in_image": [float(x) for x in place]})
    table = "# unit=mm\n# frame=patient\nlabel,x,y,z\nc,10,80,5\nb,60,10,5\na,10,10,5\n"
    files = {"file": ("points.csv", table.encode(), "text/csv")}
    answer = client.post(f"{path}/measured", files=files)
    assert answer.status_code == 200
    assert [pair["measured"] for pair in answer.json()["pairs"]] == [[10, 10, 5], [60, 10, 5], [10, 80, 5]]
    assert answer.json()["fit"]["fre_mm"] == pytest.approx(0.0, abs=1e-9)
    assert "Measure a fourth" in answer.json()["fit"]["cautions"][0]
    no_unit = client.post(f"{path}/measured", files={"file": ("p.csv", b"label,x,y,z\na,1,2,3\n", "text/csv")})
    assert no_unit.status_code == 422
    assert no_unit.json()["error"]["details"]["missing"] == ["unit"]


def test_revisions_locks_and_wrong_wishes(client: Client, made: dict[str, Any]) -> None:
    path = f"/api/v1/registrations/{made['id']}"
    shown = client.get(path)
    etag = shown.headers["ETag"]
    assert client.post(f"{path}/pairs", json={"in_image": [0.0, 0.0, 0.0]}, headers={"If-Match": etag}).is_success
    assert client.post(f"{path}/pairs", json={}, headers={"If-Match": etag}).status_code == 412
    stale = client.patch(path, json={"name": "Other", "revision": shown.json()["revision"]})
    assert stale.status_code == 409
    assert client.patch(path, json={"locked": True}).json()["locked"] is True
    assert client.post(f"{path}/pairs", json={}).status_code in (409, 423)
    assert client.delete(path).status_code in (409, 423)
    assert client.post(f"{path}/beads", json={}).status_code in (409, 423)
    client.patch(path, json={"locked": False})
    assert client.patch(path, json={"name": "a", "locked": True}).status_code == 422
    assert client.patch(path, json={"name": "Renamed"}).json()["name"] == "Renamed"
    pair = client.get(path).json()["pairs"][0]["id"]
    for wish in ({"weight": 0.0}, {"in_image": [1e9, 0.0, 0.0]}, {"colour": "red"}, {"enabled": "perhaps"}):
        assert client.patch(f"{path}/pairs/{pair}", json=wish).status_code == 422
    assert client.patch(f"{path}/pairs/none", json={"label": "x"}).status_code == 404
    assert client.post(f"{path}/pairs/{pair}/touch", json={"noise_mm": -1.0}).status_code == 422
    assert client.get(f"{path}/order").status_code == 422
    assert client.get("/api/v1/registrations/none").status_code == 404
    plan = f"/api/v1/plans/{SAMPLE_PLAN}/registration"
    assert client.request("PUT", plan, json={"registration": made["id"]}).status_code == 422
    assert client.request("PUT", plan, json={"registration": "none"}).status_code == 404
    assert client.get(f"/api/v1/plans/{SAMPLE_PLAN}").json()["registration"] is None


def test_a_transform_is_exported_and_imported(client: Client, made: dict[str, Any]) -> None:
    path = f"/api/v1/registrations/{made['id']}"
    assert client.get(f"{path}/export").status_code == 422
    for place in ([0.0, 0.0, 0.0], [50.0, 0.0, 0.0], [0.0, 70.0, 0.0], [0.0, 0.0, 40.0]):
        client.post(f"{path}/pairs", json={"in_image": place, "measured": [place[1] + 3.0, -place[0], place[2]]})
    transform = client.get(path).json()["transform"]
    for form in ("tfm", "json"):
        out = client.get(f"{path}/export", params={"format": form})
        assert f'filename="Beads.{form}"' in out.headers["Content-Disposition"]
        assert out.headers["X-Notice"] == "Not for clinical use"
        files = {"file": (f"Beads.{form}", out.content, "text/plain")}
        came = client.post(f"{CASE}/registrations/import", files=files)
        assert came.status_code == 201
        assert (came.json()["made_from"], came.json()["name"], came.json()["fit"]["state"]) == (
            "given",
            "Beads 2",
            "given",
        )
        np.testing.assert_allclose(came.json()["transform"], transform, atol=1e-9)
        again = client.post(f"{CASE}/registrations/import", files=files).json()
        assert again["name"] == "Beads 3"
        for one in (came.json(), again):
            client.delete(f"/api/v1/registrations/{one['id']}")
    broken = client.post(f"{CASE}/registrations/import", files={"file": ("a.tfm", b"no transform", "text/plain")})
    assert broken.status_code == 422
    assert "ITK" in broken.json()["error"]["message"]


def test_a_transform_says_or_is_told_what_it_is_to(client: Client) -> None:
    def imported(text: str, **fields: str) -> Any:
        files = {"file": ("A.tfm", text.encode(), "text/plain")}
        return client.post(f"{CASE}/registrations/import", files=files, data=fields)

    foreign, turn = tfm_text(pose()), {"to": "base"}
    ours = tfm_text(pose(), ["registration: from the image (LPS, mm) to the robot's base (mm)", "simulated: yes"])
    came = imported(foreign).json()
    assert (came["to"], came["said"]["to"], came["fit"]["simulated"]) == ("patient", None, False)
    assert client.patch(f"/api/v1/registrations/{came['id']}", json=turn).json()["to"] == "base"
    assert imported(foreign, to="base").json()["to"] == "base"
    assert imported(foreign, to="moon").status_code == imported(ours, to="patient").status_code == 422
    made = imported(ours).json()
    assert (made["to"], made["fit"]["simulated"], made["said"]["to"]) == ("base", True, "base")
    assert "file is simulated" in made["fit"]["cautions"][0]
    assert client.patch(f"/api/v1/registrations/{made['id']}", json={"to": "patient"}).status_code == 422
    plan = f"/api/v1/plans/{SAMPLE_PLAN}/registration"
    client.request("PUT", plan, json={"registration": made["id"]})
    assert client.get(plan).json()["doubts"] == made["fit"]["cautions"]
    client.request("PUT", plan, json={"registration": None})
    for one in client.get(f"{CASE}/registrations").json():
        if one["name"].startswith("A"):
            client.delete(f"/api/v1/registrations/{one['id']}")


def touched_beads(client: Client, path: str) -> dict[str, Any]:
    """The beads of the phantom as pairs, touched by the simulated pointer."""
    for bead in load_landmarks().beads:
        pair = client.post(f"{path}/pairs", json={"in_image": bead.centroid.tolist()}).json()["pair"]
        answer = client.post(f"{path}/pairs/{pair}/touch", json={"noise_mm": 0.3, "seed": 5})
    return dict(answer.json())


def test_it_is_refined_on_a_surface(client: Client, phantom_services: Services, made: dict[str, Any]) -> None:
    path, wait = f"/api/v1/registrations/{made['id']}", phantom_services.jobs.wait
    assert client.post(f"{path}/surface/refine", json={}).status_code == 422
    fitted = touched_beads(client, path)
    job = client.post(f"{path}/surface/touch", json={"count": 40, "noise_mm": 0.1, "seed": 1})
    assert (job.status_code, job.json()["kind"]) == (202, "refinement")
    assert wait(job.json()["id"], 120.0).state == "done"
    surface = client.get(path).json()["surface"]
    assert (surface["structure"], len(surface["points"]), surface["refinement"]) == ("bone", 40, None)
    rows = "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in surface["points"])
    files = {"file": ("bone.csv", f"# unit=mm\n# frame=patient\nx,y,z\n{rows}".encode(), "text/csv")}
    read = client.post(f"{path}/surface", files=files, data={"structure": "bone"}).json()["surface"]
    assert (read["points"], read["measured_from"]) == (surface["points"], "file")
    assert client.post(f"{path}/surface", files=files, data={"structure": "liver"}).status_code == 404
    stale = client.post(f"{path}/surface", files=files, headers={"If-Match": '"1"'})
    assert stale.status_code == 412
    client.post(f"{path}/undo")
    job = client.post(f"{path}/surface/refine", json={"keep": 0.8}).json()
    assert wait(job["id"], 120.0).state == "done"
    refined = client.get(path).json()
    assert (refined["made_from"], refined["fit"]["state"]) == ("surface", "refined")
    assert (refined["surface"]["refinement"]["kept"], refined["fit"]["fle_mm"]) == (32, None)
    assert [pair["residual_mm"] is not None for pair in refined["pairs"]] == [True] * 5
    errors = client.get(f"{path}/errors", params={"plan_id": SAMPLE_PLAN}).json()
    assert (errors["targets"], errors["path"]) == ([], None)
    cleared = client.request("DELETE", f"{path}/surface").json()
    assert (cleared["made_from"], cleared["surface"]) == ("pairs", None)
    assert cleared["transform"] == fitted["transform"]
    for wish in ({"count": 0}, {"noise_mm": -1.0}, {"keep": 0.5}):
        assert client.post(f"{path}/surface/touch", json=wish).status_code == 422
    assert client.post(f"{path}/surface/tracked", json={"seconds": 5.0}).status_code == 422


def test_a_traced_path_comes_into_a_plan(client: Client, made: dict[str, Any]) -> None:
    path = f"/api/v1/registrations/{made['id']}"
    plan = client.post(f"{CASE}/plans", json={"name": "Traced", "copy_of": SAMPLE_PLAN}).json()
    traced = f"/api/v1/plans/{plan['id']}/traced"
    refused = client.post(f"{traced}/simulated", json={})
    assert "no registration" in refused.json()["error"]["message"]
    fitted = touched_beads(client, path)
    done = client.post(f"{traced}/simulated", json={"noise_mm": 0.2, "seed": 1, "registration": made["id"]})
    assert (done.status_code, done.json()["name"], done.json()["traced_from"]) == (201, "Traced path 1", "simulated")
    assert done.headers["ETag"] == f'"{done.json()["plan"]["revision"]}"'
    assert done.json()["plan"]["path_id"] == done.json()["path"]
    client.request("PUT", f"/api/v1/plans/{plan['id']}/registration", json={"registration": made["id"]})
    transform = np.reshape(fitted["transform"], (4, 4))
    line = np.linspace([0.0, -20.0, 0.0], [0.0, 40.0, 0.0], 100) @ transform[:3, :3].T + transform[:3, 3]
    rows = "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in line.tolist())
    files = {"file": ("wire.csv", f"# unit=mm\n# frame=tracker\nx,y,z\n{rows}".encode(), "text/csv")}
    read = client.post(traced, files=files, data={"name": "Wire"}).json()
    assert (read["name"], read["samples"], read["length_mm"]) == ("Wire", 100, pytest.approx(60.0, abs=1.0))
    points = np.array([point["position"] for point in read["plan"]["points"]])
    np.testing.assert_allclose(points[:, [0, 2]], 0.0, atol=1e-6)
    again = client.post(traced, files=files, data={"name": "Wire"})
    assert (again.status_code, "same name" in again.json()["error"]["message"]) == (422, True)
    assert client.post(f"{traced}/tracked", json={"seconds": 5.0}).status_code == 422
    assert client.post(f"{traced}/tracked", json={"seconds": 900.0}).status_code == 422
    client.delete(f"/api/v1/plans/{plan['id']}")


@pytest.mark.parametrize(
    ("method", "path", "body", "words"),
    [
        ("POST", "/beads", {"diameter_mm": -1.0}, "diameter"),
        ("POST", "/beads", {"diameter_mm": 1e308}, "diameter"),
        ("POST", "/beads", {"threshold_hu": 0.0}, "threshold"),
        ("PATCH", "", {"fle": {"mm": 0.3, "x": 1}}, "fle"),
        ("PATCH", "", {"locked": 1}, "locked"),
        ("POST", "/surface/touch", {"seed": True}, "seed"),
        ("POST", "/surface/touch", {"count": True}, "count"),
        ("POST", "/pairs/p/touch", {"seed": True}, "seed"),
    ],
)
def test_what_cannot_be_is_refused_at_once(
    client: Client, made: dict[str, Any], method: str, path: str, body: dict[str, Any], words: str
) -> None:
    answer = client.request(method, f"/api/v1/registrations/{made['id']}{path}", json=body)
    assert (answer.status_code, words in answer.text) == (422, True), answer.text
    assert client.get(f"/api/v1/registrations/{made['id']}").json()["revision"] == made["revision"]


def test_a_revision_is_asked_for_as_it_was_told(client: Client, made: dict[str, Any]) -> None:
    path, revision = f"/api/v1/registrations/{made['id']}", made["revision"]
    for match in (f'"0{revision}"', f'W/"{revision}"', f"{revision}"):
        answer = client.patch(path, json={"name": "Other"}, headers={"If-Match": match})
        assert (answer.status_code, "one ETag" in answer.text) == (422, True)
    assert client.patch(path, json={"name": "Other"}, headers={"If-Match": f'"{revision}"'}).status_code == 200


def _schemas_of(part: Any) -> set[str]:
    """The names of the schemas that a part of an OpenAPI description refers to."""
    if isinstance(part, dict):
        own = {part["$ref"].rpartition("/")[2]} if "$ref" in part else set()
        return own.union(*map(_schemas_of, part.values()))
    return set().union(*map(_schemas_of, part)) if isinstance(part, list) else set()


def test_no_body_of_a_request_takes_a_key_that_nobody_knows() -> None:
    app = FastAPI()
    app.include_router(router)
    told = described(app.openapi())
    schemas, seen = told["components"]["schemas"], set[str]()
    new = _schemas_of([route.get("requestBody") for path in told["paths"].values() for route in path.values()])
    while new:
        seen |= new
        new = set().union(*(_schemas_of(schemas[name]) for name in new)) - seen
    assert "FleRequest" in seen
    objects = [name for name in seen if schemas[name]["type"] == "object"]
    assert [name for name in objects if schemas[name].get("additionalProperties") is not False] == []
