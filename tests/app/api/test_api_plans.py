"""REST: plans, their revisions, their exports and imports."""

import json

import numpy as np
import pytest
from rest_client import CASE, PLAN, Client


def test_a_plan_is_made_edited_undone_and_deleted(client: Client) -> None:
    plan = client.post(f"{CASE}/plans", json={"name": "REST"}).json()
    path = f"/api/v1/plans/{plan['id']}"
    point = client.post(f"{path}/points", json={"position": [1, 2, 3], "revision": 1}).json()
    assert point["position"] == [1.0, 2.0, 3.0]
    moved = client.patch(f"{path}/points/{point['id']}", json={"position": [4, 5, 6]}).json()
    assert moved["position"] == [4.0, 5.0, 6.0]
    target = client.post(f"{path}/targets", json={"position": [7, 8, 9], "label": "ostium"}).json()
    assert client.patch(f"{path}/points/{target['id']}", json={"label": "sinus"}).json()["label"] == "sinus"
    assert client.delete(f"{path}/points/{target['id']}").json()["targets"] == []
    assert [t["label"] for t in client.post(f"{path}/undo").json()["targets"]] == ["sinus"]
    assert client.post(f"{path}/redo").json()["targets"] == []
    assert client.patch(path, json={"locked": True}).json()["locked"]
    assert client.post(f"{path}/points", json={"position": [1, 2, 3]}).status_code == 423
    assert client.delete(path).status_code == 423
    client.patch(path, json={"locked": False})
    assert client.delete(path).json()["deleted_at"]
    assert plan["id"] not in [p["id"] for p in client.get(f"{CASE}/plans").json()]
    assert client.post(f"{path}/restore").json()["deleted_at"] is None
    client.delete(path)


@pytest.mark.parametrize("name", ["../tools/bent_30", "/dev/zero", "tools/bent_30.json"])
def test_a_tool_is_no_path(client: Client, name: str) -> None:
    """HAZ-19: no file of the server is opened, and the plan can be read as before."""
    plan = client.post(f"{CASE}/plans", json={"name": "No path"}).json()
    path = f"/api/v1/plans/{plan['id']}"
    answer = client.patch(path, json={"tool": {"name": name}})
    assert (answer.status_code, "letters, digits" in answer.text) == (422, True)
    assert client.get(path).json() == plan
    client.delete(path)


def test_every_edit_tells_the_revision_that_it_made_and_may_ask_for_the_one_before(client: Client) -> None:
    made = client.post(f"{CASE}/plans", json={"name": "editions"})
    path, tag = f"/api/v1/plans/{made.json()['id']}", made.headers["etag"]
    assert (tag, client.get(path).headers["etag"]) == ('"1"', '"1"')
    first: dict[str, str] = {}
    edits: list[tuple[str, str, dict[str, object] | None]] = [
        ("POST", "/points", {"position": [1, 2, 3]}),
        ("POST", "/targets", {"position": [1, 2, 3]}),
        ("PATCH", "/points/{points}", {"position": [4, 5, 6]}),
        ("PATCH", "/points/{targets}", {"position": [4, 5, 6]}),
        ("PATCH", "/points/{points}", {"label": "entry"}),
        ("POST", "/undo", None),
        ("POST", "/redo", None),
        ("PATCH", "", {"settings": {"margin_mm": 0.4}}),
        ("PATCH", "", {"name": "other"}),
        ("PATCH", "", {"locked": True}),
        ("PATCH", "", {"locked": False}),
        ("DELETE", "/points/{points}", None),
        ("DELETE", "/points/{targets}", None),
        ("DELETE", "", None),
        ("POST", "/restore", None),
        ("PATCH", "", {"deleted": True}),
    ]
    for number, (method, place, body) in enumerate(edits, start=2):
        where = path + place.format(**first)
        stale = client.request(method, where, json=body, headers={"If-Match": '"999"'})
        assert (stale.status_code, stale.json()["error"]["code"]) == (412, "plan_conflict"), where
        assert f"revision {number - 1}" in stale.json()["error"]["message"]
        answer = client.request(method, where, json=body, headers={"If-Match": tag})
        assert answer.is_success, answer.text
        tag = answer.headers["etag"]
        assert (tag, answer.json()["revision"]) == (f'"{number}"', number)
        first.setdefault(place.strip("/"), answer.json()["id"])
    assert client.post(f"{path}/restore", headers={"If-Match": "*"}).headers["etag"] == f'"{number + 1}"'
    client.delete(path)


def test_a_copy_asks_for_the_revision_of_its_source(client: Client) -> None:
    source = client.post(f"{CASE}/plans", json={"name": "source"}).json()["id"]
    body = {"name": "copy", "copy_of": source}
    stale = client.post(f"{CASE}/plans", json=body, headers={"If-Match": '"2"'})
    assert (stale.status_code, stale.json()["error"]["code"]) == (412, "plan_conflict")
    copy = client.post(f"{CASE}/plans", json=body, headers={"If-Match": '"1"'})
    assert copy.status_code == 201
    new = client.post(f"{CASE}/plans", json={"name": "new"}, headers={"If-Match": '"1"'})
    assert (new.status_code, new.json()["error"]["code"]) == (422, "input_error")
    for plan in (source, copy.json()["id"]):
        client.delete(f"/api/v1/plans/{plan}")


@pytest.mark.parametrize("tag", ["7", 'W/"7"', '"7", "8"', '"seven"', '"' + "7" * 40 + '"', ""])
def test_a_condition_that_is_no_revision_is_refused(client: Client, tag: str) -> None:
    answer = client.post(f"{PLAN}/undo", headers={"If-Match": tag})
    assert (answer.status_code, answer.json()["error"]["code"]) == (422, "input_error")


def test_two_conditions_that_differ_are_refused(client: Client) -> None:
    body = {"position": [1, 2, 3], "revision": 1}
    answer = client.post(f"{PLAN}/points", json=body, headers={"If-Match": '"2"'})
    assert answer.status_code == 422
    assert "say one" in answer.json()["error"]["message"]


def test_what_the_body_of_a_delete_says_is_heard(client: Client) -> None:
    """A condition on the revision counts there too; what else it says is refused instead of left unheard."""
    made = client.post(f"{PLAN}/points", json={"position": [1, 2, 3]}).json()
    path, revision = f"{PLAN}/points/{made['id']}", made["revision"]

    def deleted(body: dict[str, object], query: str = "", **headers: str) -> int:
        return client.request("DELETE", f"{path}{query}", json=body, headers=headers).status_code

    assert deleted({"revision": revision - 1}) == 409
    assert deleted({"revision": revision}, f"?revision={revision - 1}") == 422
    assert deleted({"revision": revision}, **{"If-Match": f'"{revision - 1}"'}) == 422
    assert deleted({"position": [1, 2, 3]}) == 422
    assert client.get(PLAN).json()["revision"] == revision
    assert deleted({"revision": revision}, f"?revision={revision}") == 200


@pytest.mark.parametrize("form", ["json", "mrk.json", "csv"])
def test_an_export_can_be_imported_again(client: Client, form: str) -> None:
    """HAZ-14, HAZ-35."""
    plan = client.get(PLAN).json()
    export = client.get(f"{PLAN}/export", params={"format": form})
    assert "Not for clinical use" in export.text
    assert f'.{form}"' in export.headers["content-disposition"]
    files = {"file": (f"plan.{form}", export.content)}
    made = client.post(f"{CASE}/plans/import", files=files)
    assert made.status_code == 201
    for kind in ("points", "targets"):
        assert [p["label"] for p in made.json()[kind]] == [p["label"] for p in plan[kind]]
        assert np.allclose([p["position"] for p in made.json()[kind]], [p["position"] for p in plan[kind]], atol=1e-6)
    assert (made.json()["name"].startswith(f"{plan['name']} "), made.json()["frame"]) == (True, "LPS")
    client.delete(f"/api/v1/plans/{made.json()['id']}")


def test_a_plan_of_another_case_is_asked_about(client: Client) -> None:
    data = json.loads(client.get(f"{PLAN}/export").text) | {"case_hash": "0" * 64}
    files = {"file": ("plan.json", json.dumps(data))}
    error = client.post(f"{CASE}/plans/import", files=files).json()["error"]
    assert error["code"] == "other_case"
    assert "another case" in error["message"]
    made = client.post(f"{CASE}/plans/import", files=files, data={"other_case": "yes"})
    assert made.json()["robot"]["base"] is None
    client.delete(f"/api/v1/plans/{made.json()['id']}")


def test_a_file_without_a_frame_is_asked_about(client: Client) -> None:
    """HAZ-14."""
    files = {"file": ("p.csv", b"label,x,y,z\na,1,2,3\n")}
    error = client.post(f"{CASE}/plans/import", files=files).json()["error"]
    assert (error["code"], error["details"]) == ("frame_error", {"missing": ["frame"]})
    made = client.post(f"{CASE}/plans/import", files=files, data={"frame": "RAS", "name": "Told"}).json()
    assert (made["name"], made["points"][0]["position"]) == ("Told", [-1.0, -2.0, 3.0])
    client.delete(f"/api/v1/plans/{made['id']}")


def test_targets_are_taken_from_another_plan(client: Client) -> None:
    made, other = (client.post(f"{CASE}/plans", json={"name": name}).json()["id"] for name in ("To", "From"))
    client.post(f"/api/v1/plans/{other}/targets", json={"position": [1, 2, 3], "label": "ostium"})
    taken = client.post(f"/api/v1/plans/{made}/targets/take", json={"plan": other}).json()["targets"]
    assert [(one["label"], one["position"]) for one in taken] == [("ostium", [1, 2, 3])]
    again = client.post(f"/api/v1/plans/{made}/targets/take", json={"plan": other})
    assert (again.status_code, "not here already" in again.text) == (422, True)
    for plan_id in (made, other):
        client.delete(f"/api/v1/plans/{plan_id}")


def test_whether_points_are_a_path_or_targets_is_asked(client: Client) -> None:
    lines = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = x,y,z,label\n1,2,3,a\n"
    files = {"file": ("F.fcsv", lines.encode())}
    error = client.post(f"{CASE}/plans/import", files=files).json()["error"]
    assert (error["code"], error["details"]) == ("points_unclear", {"missing": ["points_as"]})
    assert client.post(f"{CASE}/plans/import", files=files, data={"points_as": "zones"}).status_code == 422
    made = client.post(f"{CASE}/plans/import", files=files, data={"points_as": "targets"}).json()
    assert (made["points"], [target["label"] for target in made["targets"]]) == ([], ["a"])
    client.delete(f"/api/v1/plans/{made['id']}")
