"""What an endoscope sees, over REST: made once, in clusters that hold their triangles; gone with its case (HAZ-34)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rest_client import Client
from session_doubles import HEAD, case_of_ct

from app.cases.service import Case, CaseFrame
from app.imaging import endoscope
from app.imaging.endoscope import EndoscopeSurface
from app.imaging.endoscope_file import HEADER, MAGIC, VERSION, EndoscopeFile
from app.services import Services
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume

PLACES = [[-9.0, 0.0, 0.0], [9.0, 0.0, 0.0]]  # mm: the ends of a path through a ball of air
RADIUS = 12.0


@pytest.fixture
def services(phantom_services: Services) -> Services:
    return phantom_services


@pytest.fixture
def case(services: Services) -> Iterator[Case]:
    k, j, i = np.indices((64, 64, 64)).astype(float) - 32.0
    r = np.sqrt(i**2 + j**2 + k**2)
    hu = np.where(r > 24.0, 900.0, np.clip(500.0 * (r - RADIUS) - 300.0, -1000.0, 40.0))
    yield case_of_ct(services, "Hollow", Volume(hu.astype(np.int16), np.full(3, -32.0), np.ones(3), np.eye(3)))
    for file in derived(services):
        file.unlink()


def derived(services: Services) -> list[Path]:
    return sorted(services.settings.derived_dir.glob("*.endoscope-*"))


def plan_in(client: Client, case: Case, places: list[list[float]]) -> str:
    plan: str = client.post(f"/api/v1/cases/{case.id}/plans", json={"name": "Through"}).json()["id"]
    for place in places:
        assert client.post(f"/api/v1/plans/{plan}/points", json={"position": place}).status_code == 201
    return plan


def parts_of(data: bytes) -> dict[str, Array | Any]:
    header = np.frombuffer(data, HEADER, 1)[0]
    version, v, f, c = (int(count) for count in header["counts"])
    layout = [("positions", "<f4", v, 3), ("normals", "<i1", v, 4), ("colours", "<u1", v, 4), ("corners", "<u4", f, 3)]
    parts: dict[str, Any] = {"magic": header["magic"], "version": version, "box": header["box"].reshape(2, 3)}
    at = HEADER.itemsize
    for name, kind, rows, columns in [*layout, ("clusters", "<f4", c, 6)]:
        parts[name] = np.frombuffer(data, kind, rows * columns, at).reshape(rows, columns)
        at += parts[name].nbytes
    assert at == len(data)
    return parts


def test_it_is_made_once_and_is_what_the_page_can_draw(
    services: Services, client: Client, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plan_in(client, case, PLACES)
    address = f"/api/v1/plans/{plan}/endoscope"
    missing = client.get(address)
    assert (missing.status_code, "POST makes it" in missing.json()["error"]["message"]) == (404, True)
    job = client.post(address).json()
    ended = services.jobs.wait(job["id"], 60.0)
    assert (job["kind"], ended.state, ended.case_id) == ("endoscope", "done", case.id)
    assert len(derived(services)) == 1

    def not_made(volume: Volume, box: Array, **more: object) -> object:
        raise AssertionError("the surface is known")

    monkeypatch.setattr(endoscope, "air_surface", not_made)
    services.endoscope.forget([])
    told = client.get(address)
    etag = told.headers["ETag"]
    assert client.get(address, headers={"If-None-Match": etag}).status_code == 304
    parts = parts_of(told.content)
    assert (parts["magic"], parts["version"]) == (MAGIC, VERSION)
    low, high = parts["box"]
    assert (low <= [-34.0, -25.0, -25.0]).all()
    assert (high >= [34.0, 25.0, 25.0]).all()
    positions, corners = parts["positions"].astype(float), parts["corners"]
    assert np.abs(np.linalg.norm(positions, axis=1) - RADIUS).max() < 0.2
    assert (parts["normals"][:, :3] * -positions).sum(axis=1).min() > 0.0
    covered = []
    for first, count, *ball in parts["clusters"]:
        mine = corners.ravel()[int(first) : int(first + count)]
        covered.append(mine)
        assert np.linalg.norm(positions[mine] - ball[:3], axis=1).max() <= ball[3] + 1e-3
    assert np.array_equal(np.concatenate(covered), corners.ravel())
    first = derived(services)[0]
    first.write_bytes(first.read_bytes()[:1000])
    services.endoscope.forget([])
    monkeypatch.undo()
    assert client.get(address).status_code == 404  # what is damaged is made again
    services.jobs.wait(client.post(address).json()["id"], 60.0)
    assert client.get(address).headers["ETag"] == etag
    assert first.stat().st_size > 1000
    services.cases.delete(case.id)
    services.purge.run(case.id)
    assert derived(services) == []


def test_bone_that_a_plan_removes_is_air_in_a_file_of_its_own(services: Services, client: Client, case: Case) -> None:
    plan = plan_in(client, case, PLACES)
    address = f"/api/v1/plans/{plan}/endoscope"
    sizes = []
    for x in (None, 14.0, 15.0):
        if x is not None:
            ball = {"shape": {"kind": "sphere", "centre": [x, 0.0, 0.0], "radius": 4.0}}
            assert client.post(f"/api/v1/plans/{plan}/removed-bone", json=ball).status_code == 201
        services.jobs.wait(client.post(address).json()["id"], 60.0)
        positions = parts_of(client.get(address).content)["positions"]
        sizes.append(float(positions[:, 0].max()))
    assert sizes == pytest.approx([RADIUS, 18.0, 19.0], abs=0.3)
    assert len(derived(services)) == 3


def test_of_a_ct_only_the_files_that_were_used_last_are_kept(
    services: Services, client: Client, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(endoscope, "KEPT", 2)
    plans = [plan_in(client, case, [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0]]) for x in (-14.0, -3.0, 14.0)]

    def made(plan: str) -> set[str]:
        before = {file.name for file in derived(services)}
        services.jobs.wait(client.post(f"/api/v1/plans/{plan}/endoscope").json()["id"], 60.0)
        return {file.name for file in derived(services)} - before

    first, second = made(plans[0]), made(plans[1])
    assert len(first) == len(second) == 1
    services.endoscope.forget([])
    assert made(plans[0]) == set(), "it is read, and so used"
    third = made(plans[2])
    assert {file.name for file in derived(services)} == first | third


def test_it_says_what_is_missing(services: Services, client: Client, case: Case) -> None:
    empty = client.get(f"/api/v1/plans/{plan_in(client, case, [])}/endoscope")
    assert (empty.status_code, "this plan has none" in empty.json()["error"]["message"]) == (422, True)
    surfaces = {"bone": services.cases.case_surface(HEAD)}
    bare = services.cases.create("Bare", frame=CaseFrame("LPS", False), surfaces=surfaces)
    without = client.post(f"/api/v1/plans/{plan_in(client, bare, PLACES)}/endoscope")
    assert (without.status_code, "no CT" in without.json()["error"]["message"]) == (422, True)
    assert client.get("/api/v1/plans/nothing/endoscope").status_code == 404


def test_of_several_cts_the_finest_that_holds_the_path_is_taken(services: Services) -> None:
    within, beyond = (0.0, 40.0, 0.0), (0.0, 150.0, 0.0)
    assert services.endoscope.about(HEAD, [within])._volume != services.endoscope.about(HEAD, [beyond])._volume


def test_a_damaged_file_is_refused() -> None:
    for data in (b"", b"VFXS" + bytes(60), MAGIC + np.array([VERSION, 1, 1, 1], "<u4").tobytes() + bytes(28)):
        with pytest.raises(InputError):
            EndoscopeFile(data)


def test_surfaces_of_two_heads_wait_for_each_other_without_a_thread(
    services: Services, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    lanes: list[str] = []
    monkeypatch.setattr(services.jobs, "submit", lambda work, **how: lanes.append(how["lane"]))
    other = case_of_ct(services, "Another", services.cases.volume(case))
    for one in (case, other):
        box = np.array([[-9.0] * 3, [9.0] * 3])
        EndoscopeSurface(services.store, services.cases, services.jobs, box, None).start(one.id)
    assert lanes == ["endoscope", "endoscope"]
