"""Segmentation of a case by REST and command line, and its structure in a plan."""

from __future__ import annotations

import json
import time
from dataclasses import replace

import numpy as np
import pytest
from rest_client import Client
from session_doubles import case_of_ct

from app.cases.model import CaseFrame
from app.cli import main
from app.imaging.segmenting import band_words, structure_request
from app.plans.shipped_head import SAMPLE_PLAN
from app.plans.zones import PlanZone
from app.services import Services
from vfix_engine.anatomy.labels.painting import mask_of_runs
from vfix_engine.anatomy.segmentation import HIGHEST_HU, LOWEST_HU, Band
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume


def ct() -> Volume:
    """Two balls of bone in air."""
    k, j, i = np.indices((40, 40, 60)).astype(float)
    one = np.sqrt((i - 20) ** 2 + (j - 20) ** 2 + (k - 20) ** 2) < 12
    other = np.sqrt((i - 50) ** 2 + (j - 20) ** 2 + (k - 20) ** 2) < 5
    hu = np.where(one | other, 900, -1000).astype(np.int16)
    return Volume(hu, [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], np.eye(3))


@pytest.fixture
def services(phantom_services: Services) -> Services:
    return phantom_services


@pytest.fixture
def case_id(services: Services) -> str:
    return case_of_ct(services, "Balls", ct()).id


def test_a_structure_is_stored_with_what_was_done(services: Services, case_id: str) -> None:
    wanted = structure_request("Large ball", "bone", None, None, None, True, 0.0, 1.0)
    job = services.jobs.wait(services.segmenting.start(case_id, wanted).id, 60.0)
    assert (job.state, job.kind, job.case_id) == ("done", "segmentation", case_id)
    case = services.cases.get(case_id)
    structure = case.structure(job.result or "")
    assert (structure.name, structure.role, structure.has_inside) == ("Large ball", "spare", True)
    assert structure.deviation_mm is not None
    assert 0.05 < structure.deviation_mm < 1.5
    told = " ".join(structure.notes)
    assert "1 of 2 islands were left out" in told
    assert f"{structure.deviation_mm:.2f} mm" in told
    mesh = services.cases.structure_mesh(case_id, structure.id)
    assert np.abs(mesh.vertices.mean(axis=0) - 20.0).max() < 0.2
    report = next(item.report for item in case.surfaces if item.name == structure.surface)
    assert report is not None
    assert report.error_mm == report.smoothed_mm == structure.deviation_mm


def test_what_cannot_be_segmented_is_refused(services: Services, case_id: str) -> None:
    with pytest.raises(InputError, match="preset"):
        structure_request("x", None, 100.0, None, None, False, 0.0, 0.0)
    empty = services.segmenting.start(case_id, structure_request("x", None, 5000.0, 6000.0, None, False, 0.0, 0.0))
    job = services.jobs.wait(empty.id, 60.0)
    assert job.state == "failed"
    assert "no voxel lies between" in str(job.error)
    surface = services.cases.create(
        "Surface", frame=CaseFrame("LPS", False), surfaces={"bone": extract_surface(ct())}
    )  # fmt: skip
    with pytest.raises(InputError, match="only a CT"):
        services.segmenting.start(surface.id, structure_request("x", "bone", None, None, None, False, 0.0, 0.0))


def test_on_the_command_line(
    services: Services, case_id: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(services.settings.home))
    options = ["--name", "Small ball", "--low", "200", "--high", "3000", "--crop=40,0,0,59,39,39", "--json"]
    assert main(["case", "segment", case_id, *options]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["case"] == case_id
    assert told["structure"]["name"] == "Small ball"
    assert told["structure"]["deviation_mm"] == 0.0
    assert any("Cropped" in note for note in told["structure"]["notes"])
    assert main(["case", "segment", case_id, "--name", "x", "--preset", "bone", "--crop", "1,2"]) == 2
    assert main(["case", "segment", case_id, "--preview", "--preset", "bone", "--largest", "--json"]) == 0
    preview = json.loads(capsys.readouterr().out)
    assert (preview["islands"], preview["left_out"]) == (2, 1)
    assert [item.name for item in services.cases.get(case_id).protectable] == ["Small ball"]


def test_a_smoothed_structure_grows_the_margin_of_its_zone(phantom_services: Services) -> None:
    services = phantom_services
    plan = services.plans.get(SAMPLE_PLAN)
    wanted = structure_request("Front", "bone", None, None, ((-20.0, -30.0, -10.0), (20.0, 0.0, 20.0)), True, 0.0, 1.0)
    structure = services.segmenting.run(plan.case_id, wanted)
    zone = PlanZone("z", "Front", {"kind": "structure", "structure": structure.id}, 0.5)
    found = services.planning.zones(replace(plan, content=replace(plan.content, zones=(zone,))))
    assert structure.deviation_mm
    assert found.zones[0].margin_mm == pytest.approx(0.5 + structure.deviation_mm)


def test_over_rest(client: Client, case_id: str) -> None:
    """The route, its job and its errors."""
    began = client.post(f"/api/v1/cases/{case_id}/segment", json={"name": "Bone", "preset": "bone"})
    assert began.status_code == 202
    for _ in range(600):
        job = client.get(f"/api/v1/jobs/{began.json()['id']}").json()
        if job["state"] in ("done", "failed"):
            break
        time.sleep(0.05)
    assert job["state"] == "done", job
    listed = client.get(f"/api/v1/cases/{case_id}/structures").json()
    assert job["result"] in [item["id"] for item in listed]
    wrong = client.post(f"/api/v1/cases/{case_id}/segment", json={"name": "x"})
    assert wrong.status_code == 422


def test_islands_are_told_at_half_resolution_at_once_and_in_full_as_a_job(client: Client, case_id: str) -> None:
    """The kept voxels are those of the large ball; nothing is stored."""
    address, wish = f"/api/v1/cases/{case_id}/segment/islands", {"preset": "bone", "largest": True}
    large = np.where(np.indices(ct().hu.shape)[2] < 36, ct().hu > 0, False)
    half = client.post(address, json=wish)
    assert (half.status_code, half.headers["X-Step"], half.headers["X-Left-Out"]) == (200, "2", "1")
    runs = np.frombuffer(half.content, dtype="<u4")
    np.testing.assert_array_equal(mask_of_runs(runs, (20, 20, 30)), large[::2, ::2, ::2])
    job = client.post(f"{address}/full", json=wish).json()
    for _ in range(600):
        job = client.get(f"/api/v1/jobs/{job['id']}").json()
        if job["state"] in ("done", "failed"):
            break
        time.sleep(0.05)
    assert (job["state"], job["kind"]) == ("done", "islands"), job
    full = client.get(f"{address}/{job['result']}")
    np.testing.assert_array_equal(mask_of_runs(np.frombuffer(full.content, dtype="<u4"), ct().hu.shape), large)
    assert float(full.headers["X-Volume-Mm3"]) == large.sum()
    assert client.get(f"{address}/islands-gone").status_code == 404
    assert client.post(address, json={"low_hu": 5000, "high_hu": 6000}).status_code == 422
    assert client.post(address, json={"low_hu": True, "high_hu": 100}).status_code == 422
    assert len(client.get(f"/api/v1/cases/{case_id}/structures").json()) == 1


def test_bone_that_was_not_seen_is_told_in_words(services: Services) -> None:
    """A sheet of 40 HU between two air spaces within the body, as a thin bone shows in a thick slice."""
    hu = np.full((30, 60, 60), 40, dtype=np.int16)
    hu[:, :8], hu[:, -8:] = -1000, -1000
    hu[6:24, 20:40, 20:40] = -1000
    hu[6:24, 20:40, 29:31] = 40
    hu[2:4, 10:12, 10:12] = 900
    volume = Volume(hu, np.zeros(3), np.ones(3), np.eye(3))
    case = case_of_ct(services, "Sheet", volume)
    made = services.segmenting.run(
        case.id, structure_request("Not seen", "unseen_bone", None, None, None, True, 0.0, 0.0)
    )
    assert any("not seen here but is expected" in note for note in made.notes)
    vertices = services.cases.structure_mesh(case.id, made.id).vertices
    assert np.abs(vertices[:, 0].mean() - 29.5) < 0.5
    assert np.ptp(vertices[:, 0]) < 6.0
    mucosa = services.segmenting.run(case.id, structure_request("Mucosa", "mucosa", None, None, None, False, 0.0, 0.0))
    assert any("within 3 mm of air" in note for note in mucosa.notes)
    assert services.cases.structure_mesh(case.id, mucosa.id).vertices[:, 0].min() > 16.0


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (120.0, HIGHEST_HU, "from 120 HU on"),
        (LOWEST_HU, -301.0, "up to -301 HU"),
        (-300.0, 119.0, "from -300 to 119 HU"),
        (LOWEST_HU, HIGHEST_HU, "of every HU"),
    ],
)
def test_an_open_end_of_a_threshold_is_told_as_open(low: float, high: float, words: str) -> None:
    assert band_words(Band(low, high)) == words
