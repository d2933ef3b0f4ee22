"""REST: what is answered, one shape for every error, uploads that end in time, and a description of it all."""

import asyncio
import errno
import io
import json
import os
import re
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
from fastapi import FastAPI
from run_folder import write_run

from app.api import cases as case_routes
from app.api import router
from app.api.dependencies import ERRORS
from app.api.error_statuses import ERROR_STATUSES
from app.error_shape import error_code
from app.gateway.body_limit import MAX_BODY_BYTES, BodyLimit
from app.gateway.error_answers import install_error_answers
from app.services import Services, build_services
from app.services.case_model import HEAD_PHANTOM
from app.services.embedded import SAMPLE_PLAN
from app.services.errors import PlanLocked
from app.services.plans import PlanService
from app.settings import Settings
from app.store.errors import StorageError, StoreBusy, StoreDamaged, StoreUnusable
from vfix_engine.errors import VfixError
from vfix_engine.imaging import head_import

SURFACE = b"v 0 0 0\nv 80 0 0\nv 0 80 0\nv 0 0 80\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
CASE, PLAN = f"/api/cases/{HEAD_PHANTOM}", f"/api/plans/{SAMPLE_PLAN}"


class Client:
    """Talks to the application without a socket."""

    def __init__(self, app: FastAPI) -> None:
        self._runner = asyncio.Runner()
        transport = httpx.ASGITransport(app=app, raise_app_exceptions=False)
        self._http = httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1")

    def request(self, method: str, path: str, **options: Any) -> httpx.Response:
        return self._runner.run(self._http.request(method, path, **options))

    def get(self, path: str, **options: Any) -> httpx.Response:
        return self.request("GET", path, **options)

    def post(self, path: str, **options: Any) -> httpx.Response:
        return self.request("POST", path, **options)

    def patch(self, path: str, **options: Any) -> httpx.Response:
        return self.request("PATCH", path, **options)

    def delete(self, path: str) -> httpx.Response:
        return self.request("DELETE", path)

    def close(self) -> None:
        self._runner.run(self._http.aclose())
        self._runner.close()


@pytest.fixture(scope="module")
def client(phantom_services: Services) -> Iterator[Client]:
    opened = opened_client(phantom_services)
    yield opened
    opened.close()


def opened_client(services: Services) -> Client:
    app = FastAPI()
    app.state.services = services
    install_error_answers(app)
    app.add_middleware(BodyLimit)
    app.include_router(router)
    return Client(app)


def test_cases_are_listed_shown_renamed_and_taken_off(client: Client) -> None:
    (case,) = [c for c in client.get("/api/cases").json() if c["id"] == HEAD_PHANTOM]
    assert case["frame"] == {"name": "LPS", "assumed": False}
    (bone,) = case["structures"]
    assert (case["kind"], bone["id"], bone["role"], bone["deviation_mm"]) == ("head", "bone", "bone", 0.375)
    assert bone["provenance"] == {"origin": "shipped", "threshold_hu": None}
    assert client.get(CASE).json() == case
    name = "<script>alert(1)</script>"
    assert client.patch(CASE, json={"name": name}).json()["name"] == name
    assert client.patch(CASE, json={"name": case["name"], "deleted": True}).json()["deleted_at"]
    assert case["id"] not in [c["id"] for c in client.get("/api/cases").json()]
    assert client.post(f"{CASE}/restore").json() == case


def test_a_plan_is_made_edited_undone_and_deleted(client: Client) -> None:
    plan = client.post(f"{CASE}/plans", json={"name": "REST"}).json()
    path = f"/api/plans/{plan['id']}"
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


def test_every_edit_tells_the_revision_that_it_made_and_may_ask_for_the_one_before(client: Client) -> None:
    made = client.post(f"{CASE}/plans", json={"name": "editions"})
    path, tag = f"/api/plans/{made.json()['id']}", made.headers["etag"]
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
        client.delete(f"/api/plans/{plan}")


def test_the_description_of_the_routes_names_every_status_of_an_error() -> None:
    assert {line.status for line in ERROR_STATUSES} == set(ERRORS)


@pytest.mark.parametrize("tag", ["7", 'W/"7"', '"7", "8"', '"seven"', '"' + "7" * 40 + '"', ""])
def test_a_condition_that_is_no_revision_is_refused(client: Client, tag: str) -> None:
    answer = client.post(f"{PLAN}/undo", headers={"If-Match": tag})
    assert (answer.status_code, answer.json()["error"]["code"]) == (422, "input_error")


@pytest.mark.parametrize(
    ("kind", "status"),
    [(StoreBusy, 503), (StoreDamaged, 500), (StoreUnusable, 500), (StorageError, 507), (PlanLocked, 423)],
)
def test_what_the_store_refuses_has_a_status_of_its_own(
    client: Client, monkeypatch: pytest.MonkeyPatch, kind: type[VfixError], status: int
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise kind("in words.")

    monkeypatch.setattr(PlanService, "rename", refuse)
    answer = client.patch(PLAN, json={"name": "other"})
    assert (answer.status_code, answer.json()["error"]) == (
        status,
        {"code": error_code(kind("")), "message": "in words."},
    )
    assert ("retry-after" in answer.headers) is (status == 503)


def test_two_conditions_that_differ_are_refused(client: Client) -> None:
    body = {"position": [1, 2, 3], "revision": 1}
    answer = client.post(f"{PLAN}/points", json=body, headers={"If-Match": '"2"'})
    assert answer.status_code == 422
    assert "say one" in answer.json()["error"]["message"]


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "code"),
    [
        ("GET", "/api/cases/nobody", None, 404, "not_found"),
        ("GET", "/api/plans/nobody/export", None, 404, "not_found"),
        ("GET", "/api/jobs/nobody", None, 404, "not_found"),
        ("GET", f"{CASE}/surfaces/brain", None, 404, "not_found"),
        ("GET", f"{CASE}/slices/axial?position_mm=9000", None, 422, "image_error"),
        ("GET", f"{CASE}/slices/axial?position_mm=nan", None, 422, "request_invalid"),
        ("GET", f"{CASE}/slices/oblique?position_mm=0", None, 422, "request_invalid"),
        ("GET", f"{PLAN}/export?format=exe", None, 422, "request_invalid"),
        ("PATCH", CASE, {"name": "a\nb"}, 422, "input_error"),
        ("PATCH", CASE, {"name": ""}, 422, "request_invalid"),
        ("PATCH", CASE, {"id": "x"}, 422, "request_invalid"),
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
    assert (made.json()["name"], made.json()["frame"]) == (plan["name"], "LPS")
    client.delete(f"/api/plans/{made.json()['id']}")


def test_a_plan_of_another_case_is_asked_about(client: Client) -> None:
    data = json.loads(client.get(f"{PLAN}/export").text) | {"case_hash": "0" * 64}
    files = {"file": ("plan.json", json.dumps(data))}
    error = client.post(f"{CASE}/plans/import", files=files).json()["error"]
    assert error["code"] == "other_case"
    assert "another case" in error["message"]
    made = client.post(f"{CASE}/plans/import", files=files, data={"other_case": "yes"})
    assert made.json()["robot"]["base"] is None
    client.delete(f"/api/plans/{made.json()['id']}")


def test_a_file_without_a_frame_is_asked_about(client: Client) -> None:
    """HAZ-14."""
    files = {"file": ("p.csv", b"label,x,y,z\na,1,2,3\n")}
    error = client.post(f"{CASE}/plans/import", files=files).json()["error"]
    assert (error["code"], error["details"]) == ("frame_error", {"missing": ["frame"]})
    made = client.post(f"{CASE}/plans/import", files=files, data={"frame": "RAS", "name": "Told"}).json()
    assert (made["name"], made["points"][0]["position"]) == ("Told", [-1.0, -2.0, 3.0])
    client.delete(f"/api/plans/{made['id']}")


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


def uploaded(services: Services) -> list[str]:
    return [path.name for path in services.settings.temporary_dir.rglob("*.obj")]


def never_end(*_: object) -> None:
    time.sleep(60)


def wait(client: Client, job: dict[str, str]) -> dict[str, object]:
    for _ in range(600):
        answer: dict[str, object] = client.get(f"/api/jobs/{job['id']}").json()
        if answer["state"] in ("done", "failed", "cancelled"):
            return answer
        time.sleep(0.05)
    pytest.fail("the job did not end")


def test_an_upload_becomes_a_case(client: Client, phantom_services: Services) -> None:
    form = {"frame": "LPS", "units": "mm", "name": "Uploaded"}
    answer = client.post("/api/cases", files={"file": ("../../x.obj", SURFACE)}, data=form)
    assert answer.status_code == 202
    job = wait(client, answer.json())
    assert (job["state"], job["error"]) == ("done", None)
    assert client.get(f"/api/cases/{job['result']}").json()["name"] == "Uploaded"
    assert uploaded(phantom_services) == []
    client.delete(f"/api/cases/{job['result']}")


def test_the_planner_ends_at_once_and_keeps_no_upload(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-30: neither of the import that runs nor of the one that waits."""
    monkeypatch.setattr(head_import, "_read_surface", never_end)
    services = build_services(Settings(home=tmp_path / "home", port=0))
    client = opened_client(services)
    jobs = [client.post("/api/cases", files={"file": ("x.obj", SURFACE)}).json()["id"] for _ in range(2)]
    while services.jobs.get(jobs[0]).stage != "Reading the surface":
        time.sleep(0.01)
    assert uploaded(services) == ["x.obj", "x.obj"]
    start = time.monotonic()
    services.close()
    assert time.monotonic() - start < 5.0
    assert "stopped" in str(services.jobs.get(jobs[0]).error)
    assert list(services.settings.temporary_dir.iterdir()) == [services.settings.temporary_dir / ".lock"]
    assert client.post("/api/cases", files={"file": ("x.obj", SURFACE)}).is_error
    assert uploaded(services) == []
    services.store.scratch.close()
    client.close()


def test_an_import_is_cancelled_with_its_worker_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one that runs and the one that waits; a page that is loaded again finds both in the list."""
    monkeypatch.setattr(head_import, "_read_surface", never_end)
    services = build_services(Settings(home=tmp_path / "home", port=0))
    client = opened_client(services)
    form = {"name": "Head"}
    jobs = [client.post("/api/cases", files={"file": ("x.obj", SURFACE)}, data=form).json()["id"] for _ in range(2)]
    while services.jobs.get(jobs[0]).stage != "Reading the surface":
        time.sleep(0.01)
    listed = client.get("/api/jobs").json()
    assert [(job["id"], job["kind"], job["case_id"], job["subject"]) for job in listed] == [
        (job, "import", None, "Head") for job in jobs
    ]
    assert [job["state"] for job in listed] == ["running", "queued"]
    for job in reversed(jobs):
        assert client.delete(f"/api/jobs/{job}").status_code == 200
        ended = services.jobs.wait(job, 5.0)
        assert (ended.state, type(ended.error).__name__) == ("cancelled", "JobCancelled")
    assert uploaded(services) == []
    assert not list(services.settings.temporary_dir.rglob("vfix-worker-*"))
    assert [case["id"] for case in client.get("/api/cases").json()] == [HEAD_PHANTOM]
    assert not list(services.settings.files_dir.glob("??/*"))
    assert client.get(f"/api/jobs/{jobs[0]}").json()["error"]["code"] == "job_cancelled"
    assert client.delete(f"/api/jobs/{jobs[0]}").json()["state"] == "cancelled"  # it is taken off the list
    assert [job["id"] for job in client.get("/api/jobs").json()] == jobs[1:]
    services.close()
    client.close()


def test_an_upload_without_a_frame_is_asked_about(client: Client) -> None:
    job = wait(client, client.post("/api/cases", files={"file": ("x.obj", SURFACE)}).json())
    assert job["state"] == "failed"
    error = job["error"]
    assert isinstance(error, dict)
    assert (error["code"], error["details"]) == ("frame_error", {"missing": ["frame", "unit"]})


def test_the_answer_repeats_an_import_without_another_upload(client: Client, phantom_services: Services) -> None:
    """A file waits here for its frame and unit, two at most; what is taken back or answered is removed (HAZ-30)."""

    def ask() -> str:
        job = wait(client, client.post("/api/cases", files={"file": ("x.obj", SURFACE)}).json())
        return f"/api/jobs/{job['id']}"

    asked = [ask() for _ in range(3)]
    assert len(uploaded(phantom_services)) == 2
    assert client.post(f"{asked[0]}/answer", json={"frame": "LPS", "units": "mm"}).status_code == 422
    half = wait(client, client.post(f"{asked[1]}/answer", json={"frame": "LPS"}).json())
    assert half["error"]["details"] == {"missing": ["unit"]}  # type: ignore[index]
    answer = client.post(f"/api/jobs/{half['id']}/answer", json={"units": "mm"})
    assert answer.status_code == 202
    done = wait(client, answer.json())
    assert done["state"] == "done"
    assert client.post(f"/api/jobs/{half['id']}/answer", json={"units": "mm"}).status_code == 422
    assert client.delete(f"{asked[2]}/upload").status_code == 204
    assert client.delete("/api/jobs/nobody/upload").status_code == 404
    waits = ask()
    assert len(uploaded(phantom_services)) == 1
    assert client.delete(waits).status_code == 200  # with the file that was kept for the answer
    assert client.get(waits).status_code == 404
    assert uploaded(phantom_services) == []
    client.delete(f"/api/cases/{done['result']}")


def test_nobody_is_asked_about_a_file_that_no_answer_makes_readable(client: Client, phantom_services: Services) -> None:
    for data, words in ((b"v 0 0 0\n", "no triangles"), (SURFACE.replace(b"80 0 0", b"nan 0 0"), "finite")):
        job = wait(client, client.post("/api/cases", files={"file": ("x.obj", data)}).json())
        error = job["error"]
        assert isinstance(error, dict)
        assert error["code"] == "mesh_error"
        assert words in error["message"]
    assert uploaded(phantom_services) == []


def test_whether_points_are_a_path_or_targets_is_asked(client: Client) -> None:
    lines = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = x,y,z,label\n1,2,3,a\n"
    files = {"file": ("F.fcsv", lines.encode())}
    error = client.post(f"{CASE}/plans/import", files=files).json()["error"]
    assert (error["code"], error["details"]) == ("points_unclear", {"missing": ["points_as"]})
    assert client.post(f"{CASE}/plans/import", files=files, data={"points_as": "zones"}).status_code == 422
    made = client.post(f"{CASE}/plans/import", files=files, data={"points_as": "targets"}).json()
    assert (made["points"], [target["label"] for target in made["targets"]]) == ([], ["a"])
    client.delete(f"/api/plans/{made['id']}")


async def flood(first: bytes, size: int, sent: list[int]) -> AsyncIterator[bytes]:
    """A body without end, which tells how much of it was taken."""
    yield first
    for _ in range(1000):
        sent.append(size)
        yield b"x" * size


def test_a_flood_is_stopped(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-30: by what it claims, and by what comes where nothing is claimed."""
    headers = {"content-length": "10000000000", "content-type": "multipart/form-data; boundary=x"}
    claimed = client.post("/api/cases", headers=headers, content=b"--x")
    assert (claimed.status_code, claimed.json()["error"]["code"]) == (413, "too_large")
    assert "the file is larger than 2048 MiB" in claimed.json()["error"]["message"]
    monkeypatch.setattr(case_routes, "MAX_CASE_BYTES", 1 << 20)
    sent: list[int] = []
    file = flood(b'--x\r\nContent-Disposition: form-data; name="file"; filename="x.obj"\r\n\r\n', 1 << 16, sent)
    streamed = client.post("/api/cases", headers={"content-type": headers["content-type"]}, content=file)
    assert (streamed.status_code, streamed.json()["error"]["code"]) == (413, "too_large")
    assert "the file is larger than 1 MiB" in streamed.json()["error"]["message"]
    assert sum(sent) < 2 << 20
    plan = {"file": ("plan.json", b" " * (2 << 20) + b" " * (64 << 10))}  # small for a file, long for all who wait
    answer = client.post(f"{CASE}/plans/import", files=plan)
    assert (answer.status_code, "larger than 2 MiB" in answer.json()["error"]["message"]) == (413, True)


def test_uploads_lie_in_the_home_alone(
    client: Client, phantom_services: Services, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """HAZ-33: the system's folder for temporary files may be another disk, and everybody's."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))  # whoever writes there fails
    body = SURFACE + b"# " + bytes(3 << 20) + b"\n"
    job = wait(client, client.post("/api/cases", files={"file": ("x.obj", body)}).json())
    assert isinstance(job["error"], dict)
    assert job["error"]["code"] == "frame_error"
    client.delete(f"/api/jobs/{job['id']}/upload")  # kept for an answer
    plan = client.get(f"{PLAN}/export").content + b" " * (3 << 19)
    made = client.post(f"{CASE}/plans/import", files={"file": ("x.json", plan)})
    assert made.status_code == 201
    client.delete(f"/api/plans/{made.json()['id']}")
    assert uploaded(phantom_services) == []


@pytest.mark.parametrize("call", ["mkdir", "open", "write", "close"])
def test_a_full_disk_is_told_and_keeps_nothing(
    client: Client, phantom_services: Services, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    """HAZ-25, wherever in an upload it happens."""
    own = phantom_services.store.scratch.open()
    before = set(own.iterdir())
    real = Path.open

    class Full(io.FileIO):
        def write(self, data: Any) -> int:
            if call == "write":
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return super().write(data)

        def close(self) -> None:
            fails = call == "close" and not self.closed
            super().close()
            if fails:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def opened(path: Path, mode: str = "r", *args: Any, **options: Any) -> Any:
        if call == "open" and mode.startswith("x"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return Full(path, "x+") if mode.startswith("x") else real(path, mode, *args, **options)

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(Path, *(("mkdir", refuse) if call == "mkdir" else ("open", opened)))
        answer = client.post("/api/cases", files={"file": ("x.obj", SURFACE)})
    assert (answer.status_code, answer.json()["error"]["code"]) == (507, "storage_error")
    assert os.strerror(errno.ENOSPC) in answer.json()["error"]["message"]
    assert set(own.iterdir()) == before


@pytest.mark.parametrize("content_type", ["application/json", "multipart/form-data; boundary=x", "text/plain"])
def test_a_body_that_is_no_upload_is_small(client: Client, content_type: str) -> None:
    """HAZ-30: whatever it says that it is, claimed or not; none of it is kept."""
    paths = client.get("/openapi.json").json()["paths"]
    takers = [
        (method, path.format(case_id=HEAD_PHANTOM, plan_id=SAMPLE_PLAN, point_id="x", job_id="x"))
        for path, methods in paths.items()
        for method, operation in methods.items()
        if "application/json" in operation.get("requestBody", {}).get("content", {})
    ]
    assert len(takers) >= 9
    for method, path in takers:
        sent: list[int] = []
        body = flood(b'{"name": "', 1 << 14, sent)
        streamed = client.request(method, path, headers={"content-type": content_type}, content=body)
        assert sum(sent) < 2 * MAX_BODY_BYTES, (method, path)
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
    assert {"/api/cases", "/api/plans/{plan_id}/export", "/api/cases/{case_id}/slices/{axis}"} <= set(paths)
    assert {"CasePublic", "CaseUpdate", "PlanCreate", "PlanPublic", "PlanUpdate"} <= set(schemas)
    for operation in (operation for path in paths.values() for operation in path.values()):
        assert re.search(r"\w", operation["description"])


def test_runs_are_listed_read_and_deleted(client: Client, phantom_services: Services) -> None:
    runs = phantom_services.runs
    run = runs.keep(write_run(runs.new_folder()), origin="page", case_id=HEAD_PHANTOM, plan_id=SAMPLE_PLAN)
    (listed,) = client.get(f"{CASE}/runs").json()
    assert (listed["id"], listed["origin"], listed["world"], listed["whole"]) == (run.id, "page", "rigid", True)
    assert (listed["ticks"], listed["lost"], "manifest" in listed) == (100, 2, False)
    assert client.get("/api/runs?plan_id=nobody").json() == []
    assert client.get(f"{CASE}/runs?plan_id={SAMPLE_PLAN}").json() == [listed]
    shown = client.get(f"/api/runs/{run.id}").json()
    assert shown["manifest"]["seed"] == 7
    assert {key: value for key, value in shown.items() if key != "manifest"} == listed
    assert client.get(f"/api/runs/{run.id}/files/ticks.f64").content == bytes(800)
    for path in ("/api/runs/nobody", f"/api/runs/{run.id}/files/notes.txt", "/api/cases/nobody/runs"):
        assert client.get(path).status_code == 404
    assert client.delete(f"/api/runs/{run.id}").status_code == 204
    assert client.get("/api/runs").json() == []
