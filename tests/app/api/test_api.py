"""REST: what is answered, one shape for every error, and a description of it all."""

import json
import re

import cv2
import numpy as np
import pytest
from rest_client import CASE, PLAN, Client, flood
from run_folder import write_run

from app.api.dependencies import ERRORS
from app.api.error_statuses import ERROR_STATUSES
from app.cases.model import HEAD_PHANTOM
from app.documents.documents import Documents
from app.error_shape import error_code
from app.gateway import body_limit
from app.gateway.body_limit import MAX_BODY_BYTES
from app.kit.errors import PlanLocked
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from app.store.errors import StorageError, StoreBusy, StoreDamaged, StoreUnusable
from vfix_engine.anatomy.scan_ends import faces_at_ends
from vfix_engine.errors import VfixError


def test_cases_are_listed_shown_renamed_and_taken_off(client: Client) -> None:
    (case,) = [c for c in client.get("/api/v1/cases").json() if c["id"] == HEAD_PHANTOM]
    assert case["frame"] == {"name": "LPS", "assumed": False}
    (bone,) = case["structures"]
    assert (case["kind"], bone["id"], bone["role"], bone["deviation_mm"]) == ("head", "bone", "bone", 0.112)
    assert bone["provenance"] == {"origin": "shipped", "threshold_hu": None, "label": None, "voxel_mm": None}
    assert client.get(CASE).json() == case
    name = "<script>alert(1)</script>"
    assert client.patch(CASE, json={"name": name}).json()["name"] == name
    assert client.patch(CASE, json={"name": case["name"], "deleted": True}).json()["deleted_at"]
    assert case["id"] not in [c["id"] for c in client.get("/api/v1/cases").json()]
    assert client.post(f"{CASE}/restore").json() == case


def test_the_description_of_the_routes_names_every_status_of_an_error() -> None:
    assert {line.status for line in ERROR_STATUSES} == set(ERRORS)


@pytest.mark.parametrize(
    ("kind", "status"),
    [(StoreBusy, 503), (StoreDamaged, 500), (StoreUnusable, 500), (StorageError, 507), (PlanLocked, 423)],
)
def test_what_the_store_refuses_has_a_status_of_its_own(
    client: Client, monkeypatch: pytest.MonkeyPatch, kind: type[VfixError], status: int
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise kind("in words.")

    monkeypatch.setattr(Documents, "rename", refuse)
    answer = client.patch(PLAN, json={"name": "other"})
    assert (answer.status_code, answer.json()["error"]) == (
        status,
        {"code": error_code(kind("")), "message": "in words."},
    )
    assert ("retry-after" in answer.headers) is (status == 503)


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "code"),
    [
        ("GET", "/api/v1/cases/nobody", None, 404, "not_found"),
        ("GET", "/api/v1/plans/nobody/export", None, 404, "not_found"),
        ("GET", "/api/v1/jobs/nobody", None, 404, "not_found"),
        ("GET", f"{CASE}/surfaces/brain", None, 404, "not_found"),
        ("GET", f"{CASE}/slices/axial?position_mm=9000", None, 422, "image_error"),
        ("GET", f"{CASE}/slices/axial?position_mm=nan", None, 422, "request_invalid"),
        ("GET", f"{CASE}/slices/oblique?position_mm=0", None, 422, "request_invalid"),
        ("GET", f"{PLAN}/export?format=exe", None, 422, "request_invalid"),
        ("PATCH", CASE, {"name": "a\nb"}, 422, "input_error"),
        ("PATCH", CASE, {"name": ""}, 422, "request_invalid"),
        ("PATCH", CASE, {"id": "x"}, 422, "request_invalid"),
        ("PATCH", CASE, {"name": "a" * 10_000}, 422, "request_invalid"),
        ("PATCH", CASE, {"deleted": 1}, 422, "request_invalid"),
        ("PATCH", f"{CASE}/structures/bone", {"colour": "#00ff00\n"}, 422, "request_invalid"),
        ("PATCH", f"{CASE}/structures/bone", {"name": "a" * 10_000}, 422, "request_invalid"),
        ("PATCH", f"{CASE}/structures/bone", {"role": "spare"}, 422, "request_invalid"),
        ("PATCH", f"{CASE}/structures/bone", {"colour": "#00ff00"}, 422, "input_error"),
        ("DELETE", f"{CASE}/structures/bone", None, 422, "input_error"),
        ("DELETE", f"{CASE}/structures/nobody", None, 404, "not_found"),
        ("PATCH", f"{CASE}/overlays/nobody", {}, 422, "request_invalid"),
        ("PATCH", f"{CASE}/overlays/nobody", {"name": [[0.0] * 1000] * 10}, 422, "request_invalid"),
        ("PATCH", f"{CASE}/overlays/nobody", {"name": "T2"}, 404, "not_found"),
        ("DELETE", f"{CASE}/overlays/nobody", None, 404, "not_found"),
        ("POST", f"{PLAN}/points", {"position": [1, 2]}, 422, "request_invalid"),
        ("POST", f"{PLAN}/points", {"position": [1, 2, 1e9]}, 422, "request_invalid"),
        ("POST", f"{PLAN}/points", {"position": [1, 2, True]}, 422, "request_invalid"),
        ("POST", f"{PLAN}/targets", {"position": [1, 2, "3"]}, 422, "request_invalid"),
        ("PATCH", PLAN, {"settings": {"margin_mm": True}}, 422, "request_invalid"),
        ("PATCH", PLAN, {"settings": {"margin_mm": "1"}}, 422, "request_invalid"),
        ("POST", f"{PLAN}/points", {"position": [1, 2, 3], "revision": 99999}, 409, "plan_conflict"),
        ("PATCH", PLAN, {"settings": {"speed": 1}}, 422, "input_error"),
        ("POST", f"{CASE}/plans/import", {"a": 1}, 422, "input_error"),
        ("PUT", PLAN, None, 405, "method_not_allowed"),
    ],
)
def test_every_error_has_one_shape(
    client: Client, method: str, path: str, body: dict[str, object] | None, status: int, code: str
) -> None:
    answer = client.request(method, path, json=body)
    assert (answer.status_code, answer.json()["error"]["code"]) == (status, code)
    assert set(answer.json()) == {"error"}
    assert set(answer.json()["error"]) <= {"code", "message", "details"}
    assert answer.json()["error"]["message"]


def test_slices_are_pictures_that_know_their_place(client: Client) -> None:
    grid = client.get(f"{CASE}/volume").json()
    middle = 0.5 * (grid["slices"]["coronal"]["low"] + grid["slices"]["coronal"]["high"])
    answer = client.get(f"{CASE}/slices/coronal", params={"position_mm": middle, "volume": "nose"})
    assert answer.headers["content-type"] == "image/jpeg"
    assert answer.headers["cache-control"] == "no-store"
    image = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_GRAYSCALE)
    transform = np.array(json.loads(answer.headers["x-transform-pixel-to-lps"]))
    assert image.std() > 5
    assert transform[1, 3] == pytest.approx(middle)


@pytest.mark.parametrize("form", ["arrays", "stl"])
def test_surfaces_are_binary(client: Client, phantom_services: Services, form: str) -> None:
    mesh = phantom_services.cases.case_surface(HEAD_PHANTOM, "skin")
    data = client.get(f"{CASE}/surfaces/skin", params={"format": form}).content
    if form == "stl":
        assert len(data) == 84 + 50 * len(mesh.faces)
        return
    counts = np.frombuffer(data, "<u4", 2)
    assert counts.tolist() == [len(mesh.vertices), len(mesh.faces)]
    assert len(data) == 8 + 12 * int(counts.sum())
    bone = phantom_services.cases.case_surface(HEAD_PHANTOM, "bone")  # of the finer CT, at whose ends it is closed
    _, fine = phantom_services.cases.volumes(phantom_services.cases.get(HEAD_PHANTOM))
    at_ends = int(faces_at_ends(bone, fine).sum())
    assert at_ends > 5000
    data = client.get(f"{CASE}/surfaces/bone", params={"format": form, "open_ends": True}).content
    assert np.frombuffer(data, "<u4", 2).tolist() == [len(bone.vertices), len(bone.faces) - at_ends]


class _Ids(dict[str, str]):
    """Ids by name; those of what a plan or a case has stay open."""

    def __missing__(self, name: str) -> str:
        return f"{{{name}}}"


@pytest.mark.parametrize("content_type", ["application/json", "multipart/form-data; boundary=x", "text/plain"])
def test_a_body_that_is_no_upload_is_small(client: Client, content_type: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-30: whatever it says that it is, claimed or not; none is kept, and a bounded part of the rest is read."""
    monkeypatch.setattr(body_limit, "DRAIN_BYTES", MAX_BODY_BYTES)
    paths = client.get("/openapi.json").json()["paths"]
    takers = [
        (method, re.sub(r"{[a-z_]+}", "x", path.format_map(_Ids(case_id=HEAD_PHANTOM, plan_id=SAMPLE_PLAN))))
        for path, methods in paths.items()
        for method, operation in methods.items()
        if "application/json" in operation.get("requestBody", {}).get("content", {})
    ]
    assert len(takers) >= 9
    for method, path in takers:
        sent: list[int] = []
        body = flood(b'{"name": "', 1 << 14, sent)
        streamed = client.request(method, path, headers={"content-type": content_type}, content=body)
        assert sum(sent) < 3 * MAX_BODY_BYTES, (method, path)
        claims = {"content-type": content_type, "content-length": "1000000000"}
        claimed = client.request(method, path, headers=claims, content=b"{")
        for answer in (streamed, claimed):
            assert (answer.status_code, answer.json()["error"]["code"]) == (413, "too_large"), (method, path)
            assert "64 KiB" in answer.json()["error"]["message"]


@pytest.mark.parametrize(
    "body",
    [
        {"settings": {f"{number:05d}": "x" for number in range(4000)}},
        {"settings": {f"{number:05d}": 1 for number in range(4000)}},
        {"settings": {"x" * 60_000: "x"}},
        {"x" * 60_000: 1},
        {f"{number:05d}": 1 for number in range(5000)},
    ],
    ids=["words", "numbers", "a long name", "a long field", "fields"],
)
def test_an_error_is_not_as_long_as_what_was_sent(client: Client, body: dict[str, object]) -> None:
    answer = client.patch(PLAN, json=body)
    assert answer.status_code == 422
    assert len(answer.content) < 10_000


def test_everything_is_described(client: Client) -> None:
    described = client.get("/openapi.json").json()
    paths, schemas = described["paths"], described["components"]["schemas"]
    assert {"/api/v1/cases", "/api/v1/plans/{plan_id}/export", "/api/v1/cases/{case_id}/slices/{axis}"} <= set(paths)
    assert {"CasePublic", "CaseUpdate", "PlanPublic", "SnapPublic"} <= set(schemas)
    for operation in (operation for path in paths.values() for operation in path.values()):
        assert re.search(r"\w", operation["description"])


def test_runs_are_listed_read_and_deleted(client: Client, phantom_services: Services) -> None:
    runs = phantom_services.runs
    run = runs.keep(write_run(runs.new_folder()), origin="page", case_id=HEAD_PHANTOM, plan_id=SAMPLE_PLAN)
    (listed,) = client.get(f"{CASE}/runs").json()
    assert (listed["id"], listed["origin"], listed["world"], listed["whole"]) == (run.id, "page", "rigid", True)
    assert (listed["ticks"], listed["lost"], "manifest" in listed) == (100, 2, False)
    assert client.get("/api/v1/runs?plan_id=nobody").json() == []
    assert client.get(f"{CASE}/runs?plan_id={SAMPLE_PLAN}").json() == [listed]
    shown = client.get(f"/api/v1/runs/{run.id}").json()
    assert shown["manifest"]["seed"] == 7
    assert {key: value for key, value in shown.items() if key != "manifest"} == listed
    assert client.get(f"/api/v1/runs/{run.id}/files/ticks.f64").content == bytes(800)
    for path in ("/api/v1/runs/nobody", f"/api/v1/runs/{run.id}/files/notes.txt", "/api/v1/cases/nobody/runs"):
        assert client.get(path).status_code == 404
    assert client.delete(f"/api/v1/runs/{run.id}").status_code == 204
    assert client.get("/api/v1/runs").json() == []
