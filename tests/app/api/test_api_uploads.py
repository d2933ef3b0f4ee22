"""REST: uploads become cases, ask what they leave open, end in time and leave nothing."""

import errno
import io
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest
from endless_reader import BEGUN, NEVER_S, never_end
from rest_client import CASE, PLAN, Client, flood, opened_client, wait

from app.api import cases as case_routes
from app.cases.model import SHIPPED
from app.gateway import body_limit
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.anatomy import head_import

SURFACE = b"v 0 0 0\nv 80 0 0\nv 0 80 0\nv 0 0 80\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def uploaded(services: Services) -> list[str]:
    return [path.name for path in services.settings.temporary_dir.rglob("*.obj")]


def wait_for_the_worker(services: Services, job: str) -> None:
    """Until it reads."""
    deadline = time.monotonic() + 120.0
    while not list(services.settings.temporary_dir.rglob(f"vfix-worker-*/{BEGUN}")):
        assert (services.jobs.get(job).error, time.monotonic() < deadline) == (None, True), services.jobs.get(job)
        time.sleep(0.01)
    assert services.jobs.get(job).stage == "Reading the surface"


def test_an_upload_becomes_a_case(client: Client, phantom_services: Services) -> None:
    form = {"frame": "LPS", "units": "mm", "name": "Uploaded"}
    answer = client.post("/api/v1/cases", files={"file": ("../../x.obj", SURFACE)}, data=form)
    assert answer.status_code == 202
    job = wait(client, answer.json())
    assert (job["state"], job["error"]) == ("done", None)
    assert client.get(f"/api/v1/cases/{job['result']}").json()["name"] == "Uploaded"
    assert uploaded(phantom_services) == []
    client.delete(f"/api/v1/cases/{job['result']}")


def test_the_planner_ends_at_once_and_keeps_no_upload(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-30: neither of the import that runs nor of the one that waits."""
    monkeypatch.setattr(head_import, "_read_surface", never_end)
    services = build_services(Settings(home=tmp_path / "home", port=0))
    client = opened_client(services)
    jobs = [client.post("/api/v1/cases", files={"file": ("x.obj", SURFACE)}).json()["id"] for _ in range(2)]
    wait_for_the_worker(services, jobs[0])
    assert uploaded(services) == ["x.obj", "x.obj"]
    start = time.monotonic()
    services.close()
    assert time.monotonic() - start < 0.5 * NEVER_S  # nobody waited for it
    assert "stopped" in str(services.jobs.get(jobs[0]).error)
    assert list(services.settings.temporary_dir.iterdir()) == [services.settings.temporary_dir / ".lock"]
    assert client.post("/api/v1/cases", files={"file": ("x.obj", SURFACE)}).is_error
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
    jobs = [client.post("/api/v1/cases", files={"file": ("x.obj", SURFACE)}, data=form).json()["id"] for _ in range(2)]
    wait_for_the_worker(services, jobs[0])
    listed = client.get("/api/v1/jobs").json()
    assert [(job["id"], job["kind"], job["case_id"], job["subject"]) for job in listed] == [
        (job, "import", None, "Head") for job in jobs
    ]
    assert [(job["state"], job["error"]) for job in listed] == [("running", None), ("queued", None)]
    for job in reversed(jobs):
        assert client.delete(f"/api/v1/jobs/{job}").status_code == 200
        ended = services.jobs.wait(job, 0.5 * NEVER_S)
        assert (ended.state, type(ended.error).__name__) == ("cancelled", "JobCancelled")
    assert uploaded(services) == []
    assert not list(services.settings.temporary_dir.rglob("vfix-worker-*"))
    assert [case["id"] for case in client.get("/api/v1/cases").json()] == list(SHIPPED)
    assert not list(services.settings.files_dir.glob("??/*"))
    assert client.get(f"/api/v1/jobs/{jobs[0]}").json()["error"]["code"] == "job_cancelled"
    assert client.delete(f"/api/v1/jobs/{jobs[0]}").json()["state"] == "cancelled"  # it is taken off the list
    assert [job["id"] for job in client.get("/api/v1/jobs").json()] == jobs[1:]
    services.close()
    client.close()


def test_an_upload_without_a_frame_is_asked_about(client: Client) -> None:
    job = wait(client, client.post("/api/v1/cases", files={"file": ("x.obj", SURFACE)}).json())
    assert job["state"] == "failed"
    error = job["error"]
    assert isinstance(error, dict)
    assert (error["code"], error["details"]) == ("frame_error", {"missing": ["frame", "unit"]})


def test_the_answer_repeats_an_import_without_another_upload(client: Client, phantom_services: Services) -> None:
    """A file waits here for its frame and unit, two at most; what is taken back or answered is removed (HAZ-30)."""

    def ask() -> str:
        job = wait(client, client.post("/api/v1/cases", files={"file": ("x.obj", SURFACE)}).json())
        return f"/api/v1/jobs/{job['id']}"

    asked = [ask() for _ in range(3)]
    assert len(uploaded(phantom_services)) == 2
    assert client.post(f"{asked[0]}/answer", json={"frame": "LPS", "units": "mm"}).status_code == 422
    half = wait(client, client.post(f"{asked[1]}/answer", json={"frame": "LPS"}).json())
    assert half["error"]["details"] == {"missing": ["unit"]}  # type: ignore[index]
    answer = client.post(f"/api/v1/jobs/{half['id']}/answer", json={"units": "mm"})
    assert answer.status_code == 202
    done = wait(client, answer.json())
    assert done["state"] == "done"
    assert client.post(f"/api/v1/jobs/{half['id']}/answer", json={"units": "mm"}).status_code == 422
    assert client.delete(f"{asked[2]}/upload").status_code == 204
    assert client.delete("/api/v1/jobs/nobody/upload").status_code == 404
    waits = ask()
    assert len(uploaded(phantom_services)) == 1
    assert client.delete(waits).status_code == 200  # with the file that was kept for the answer
    assert client.get(waits).status_code == 404
    assert uploaded(phantom_services) == []
    client.delete(f"/api/v1/cases/{done['result']}")


def test_nobody_is_asked_about_a_file_that_no_answer_makes_readable(client: Client, phantom_services: Services) -> None:
    for data, words in ((b"v 0 0 0\n", "no triangles"), (SURFACE.replace(b"80 0 0", b"nan 0 0"), "finite")):
        job = wait(client, client.post("/api/v1/cases", files={"file": ("x.obj", data)}).json())
        error = job["error"]
        assert isinstance(error, dict)
        assert error["code"] == "mesh_error"
        assert words in error["message"]
    assert uploaded(phantom_services) == []


def test_a_flood_is_stopped(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-30: by what it claims, and by what comes where nothing is claimed."""
    headers = {"content-length": "10000000000", "content-type": "multipart/form-data; boundary=x"}
    claimed = client.post("/api/v1/cases", headers=headers, content=b"--x")
    assert (claimed.status_code, claimed.json()["error"]["code"]) == (413, "too_large")
    assert "the file is larger than 2048 MiB" in claimed.json()["error"]["message"]
    monkeypatch.setattr(case_routes, "MAX_CASE_BYTES", 1 << 20)
    monkeypatch.setattr(body_limit, "DRAIN_BYTES", 1 << 16)  # what is read of the rest, and dropped
    sent: list[int] = []
    file = flood(b'--x\r\nContent-Disposition: form-data; name="file"; filename="x.obj"\r\n\r\n', 1 << 16, sent)
    streamed = client.post("/api/v1/cases", headers={"content-type": headers["content-type"]}, content=file)
    assert (streamed.status_code, streamed.json()["error"]["code"]) == (413, "too_large")
    assert "the file is larger than 1 MiB" in streamed.json()["error"]["message"]
    assert sum(sent) < 2 << 20
    plan = {"file": ("plan.json", b" " * (2 << 20) + b" " * (64 << 10))}  # small for a file, long for all who wait
    answer = client.post(f"{CASE}/plans/import", files=plan)
    assert (answer.status_code, "larger than 2 MiB" in answer.json()["error"]["message"]) == (413, True)


def part(options: str, data: bytes = b"x", more: str = "") -> bytes:
    return f"--x\r\nContent-Disposition: form-data{options}\r\n{more}\r\n".encode() + data + b"\r\n"


FILE = part('; name="file"; filename="x.obj"', SURFACE)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (FILE, "ends before its last boundary"),
        (FILE + part('; name="frame"', b"LPS") + b"--x", "ends before its last boundary"),
        (part("", b"LPS") + b"--x--", 'field "name" must be provided'),
        (FILE + part('; name="name"', bytes(5000)) + b"--x--", "Part exceeded maximum size of 4KB"),
        (part('; name="name"') * 9 + FILE + b"--x--", "Too many fields. Maximum number of fields is 8."),
        (FILE * 4 + b"--x--", "Too many files. Maximum number of files is 3."),  # names.json is one of them
        (b"no boundary", "Invalid multipart data"),
        (FILE + part('; name="other"') + b"--x--", "send files as 'file' and, where needed, "),
        (part('; name="file"') + b"--x--", "send files as 'file' and, where needed, "),
    ],
)
def test_a_form_that_is_cut_off_or_malformed_keeps_nothing(
    client: Client, phantom_services: Services, monkeypatch: pytest.MonkeyPatch, body: bytes, words: str
) -> None:
    monkeypatch.setattr(case_routes, "MAX_FILES", 2)
    own = phantom_services.store.scratch.open()
    before = set(own.iterdir())
    headers = {"content-type": "multipart/form-data; boundary=x"}
    answer = client.post("/api/v1/cases", headers=headers, content=body)
    assert answer.status_code == 422
    assert words in answer.json()["error"]["message"]
    assert set(own.iterdir()) == before


def test_names_and_fields_of_a_form_are_read_in_any_order_and_case(client: Client) -> None:
    """Headers in any case and other headers beside; a field twice counts with its last value."""
    file = FILE.replace(b"Content-Disposition", b"CONTENT-disposition").replace(b'obj"\r\n', b'obj"\r\nX-Y: z\r\n')
    body = (
        part('; name="units"', b"m") + file + part('; name="units"', b"mm") + part('; name="name"', "Kopf ü".encode())
    )
    headers = {"content-type": "multipart/form-data; boundary=x"}
    job = wait(client, client.post("/api/v1/cases", headers=headers, content=body + b"--x--").json())
    assert (job["subject"], job["error"]["details"]) == ("Kopf ü", {"missing": ["frame"]})  # type: ignore[index]
    client.delete(f"/api/v1/jobs/{job['id']}/upload")  # kept for an answer


def test_uploads_lie_in_the_home_alone(
    client: Client, phantom_services: Services, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """HAZ-33: the system's folder for temporary files may be another disk, and everybody's."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))  # whoever writes there fails
    body = SURFACE + b"# " + bytes(3 << 20) + b"\n"
    job = wait(client, client.post("/api/v1/cases", files={"file": ("x.obj", body)}).json())
    assert isinstance(job["error"], dict)
    assert job["error"]["code"] == "frame_error"
    client.delete(f"/api/v1/jobs/{job['id']}/upload")  # kept for an answer
    plan = client.get(f"{PLAN}/export").content + b" " * (3 << 19)
    made = client.post(f"{CASE}/plans/import", files={"file": ("x.json", plan)})
    assert made.status_code == 201
    client.delete(f"/api/v1/plans/{made.json()['id']}")
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
        answer = client.post("/api/v1/cases", files={"file": ("x.obj", SURFACE)})
    assert (answer.status_code, answer.json()["error"]["code"]) == (507, "storage_error")
    assert os.strerror(errno.ENOSPC) in answer.json()["error"]["message"]
    assert set(own.iterdir()) == before
