"""A second volume over a head: an MR is imported to look at, and the plan keeps what is laid over how."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import trimesh
from rest_client import Client, wait

from app.cases.model import Case
from app.cases.second_volume import IDENTITY, SecondVolume
from app.cases.service import CaseFrame
from app.cli import main
from app.exchange.plan_files import from_native_json, to_native_json
from app.plans.diff import changes
from app.services import Services
from app.tabs.plan.edited_plan import EditedPlan
from tests.engine.imaging_phantoms import dicom_slices, save_dicom
from vfix_engine.errors import PlanError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

MOVED = (0.0, -1.0, 0.0, 5.0, 1.0, 0.0, 0.0, 6.0, 0.0, 0.0, 1.0, 7.0, 0.0, 0.0, 0.0, 1.0)


def scan(low: int = -1000, high: int = 700) -> Volume:
    hu = np.full((24, 30, 36), low, dtype=np.int16)
    hu[4:20, 4:26, 4:32] = high
    hu[10, 10:14, 10:14] = 333
    return Volume(hu, np.array([-50.0, -40.0, 10.0]), np.array([3.0, 3.0, 2.5]), np.eye(3))


@pytest.fixture
def head(phantom_services: Services) -> Iterator[Case]:
    box = trimesh.creation.box((84.0, 64.0, 40.0))
    mesh = TriangleMesh(np.array(box.vertices), np.array(box.faces))
    frame = CaseFrame("LPS", assumed=False)
    made = phantom_services.cases.create("Block", frame=frame, surfaces={"bone": mesh}, volume=scan())
    yield made
    phantom_services.purge.run(made.id)


def mr_series(folder: Path) -> Path:
    """DICOM of the modality MR, whose values have no rescale, in a file name that nobody is shown."""
    slices = dicom_slices(scan(40, 900))
    for one in slices:
        one.Modality = "MR"
        del one.RescaleSlope, one.RescaleIntercept
    return save_dicom(slices, folder)


def sent(client: Client, case_id: str, *files: Path, **fields: str) -> dict[str, Any]:
    parts = [("file", (file.name, file.read_bytes())) for file in files]
    answer = client.post(f"/api/v1/cases/{case_id}/overlays", files=parts, data=fields)
    assert answer.status_code == 202, answer.text
    return wait(client, answer.json())


def test_an_mr_is_laid_over_a_head_and_is_no_head(client: Client, head: Case, tmp_path: Path) -> None:
    files = sorted(mr_series(tmp_path / "Canary Doe").iterdir())
    job = sent(client, head.id, *files)
    assert (job["state"], job["kind"], job["result"]) == ("done", "overlay", head.id), job
    (made,) = client.get(f"/api/v1/cases/{head.id}/overlays").json()
    assert re.fullmatch(r"MR 1, \d{1,2} \w{3} \d\d:\d\d", made["name"])
    grid = client.get(f"/api/v1/cases/{head.id}/volume", params={"volume": made["id"]}).json()
    answer = client.get(grid["voxels"])
    stored = np.frombuffer(answer.content, "<i2").reshape(24, 30, 36)
    np.testing.assert_array_equal(stored, scan(40, 900).hu + 1024)  # as the file stores it
    np.testing.assert_allclose(grid["origin_mm"], scan().origin, atol=1e-6)
    assert made["level"] - made["window"] / 2 >= 1064 - 1
    after = client.get(f"/api/v1/cases/{head.id}").json()
    assert after["content_hash"] == head.content_hash
    assert [volume["name"] for volume in after["volumes"]] == ["ct"]
    assert client.patch(f"/api/v1/cases/{head.id}/overlays/{made['id']}", json={"name": "T2"}).json()[0]["name"] == "T2"
    uploaded = [("file", (f.name, f.read_bytes())) for f in files]
    refused = wait(client, client.post("/api/v1/cases", files=uploaded).json())
    assert refused["state"] == "failed"
    assert "not a CT image" in str(refused["error"])
    assert client.delete(f"/api/v1/cases/{head.id}/overlays/{made['id']}").json() == []
    assert client.get(f"/api/v1/cases/{head.id}/volume", params={"volume": made["id"]}).status_code == 404


def test_fractions_of_an_image_are_scaled_and_told(
    client: Client, phantom_services: Services, head: Case, tmp_path: Path
) -> None:
    values = np.linspace(0.0, 1.0, 24 * 30 * 36).reshape(36, 30, 24)
    image = nibabel.Nifti1Image(values.astype(np.float32), np.diag([-3.0, -3.0, 2.5, 1.0]))
    image.header.set_xyzt_units("mm")
    image.set_sform(image.affine, code=1)
    nibabel.save(image, tmp_path / "t1.nii.gz")
    assert sent(client, head.id, tmp_path / "t1.nii.gz", name="T1")["state"] == "done"
    case = phantom_services.cases.get(head.id)
    assert case.overlays[0].notes == ("Its values from 0 to 1 are shown as 0 to 4000.",)
    voxels = phantom_services.cases.volume(case, case.overlays[0].id)
    assert voxels is not None
    np.testing.assert_allclose(voxels.hu / 4000.0, values.T, atol=2e-4)


def test_a_plan_keeps_what_lies_over_it(client: Client, phantom_services: Services, head: Case) -> None:
    """In its document with undo, in its file, and in the words of what changed."""
    plan = phantom_services.plans.create(head.id, "Over")
    wish: dict[str, Any] = {"case": "head-phantom", "transform": list(MOVED), "opacity": 0.25, "other_head": True}
    answer = client.request("PUT", f"/api/v1/plans/{plan.id}/second-volume", json={"second_volume": wish})
    told = answer.json()["second_volume"]
    assert told == {**wish, "volume": None, "window": 2500.0, "level": 600.0}
    kept = phantom_services.plans.get(plan.id)
    assert kept.content.second_volume == SecondVolume("head-phantom", None, MOVED, 0.25, other_head=True)
    assert from_native_json(to_native_json(kept)).content.second_volume == kept.content.second_volume
    assert changes(plan.content, kept.content) == ("A second volume is laid over the head.",)
    faded = replace(kept.content, second_volume=replace(kept.content.second_volume, opacity=0.75, transform=IDENTITY))
    words = ("The second volume lies elsewhere.", "Opacity of the second volume: 75 % instead of 25 %.")
    assert changes(kept.content, faded) == words
    assert changes(kept.content, plan.content) == ("A second volume is not laid over the head any more.",)
    assert client.post(f"/api/v1/plans/{plan.id}/undo").json()["second_volume"] is None
    assert client.post(f"/api/v1/plans/{plan.id}/redo").json()["second_volume"] == told
    nothing = client.request("PUT", f"/api/v1/plans/{plan.id}/second-volume", json={"second_volume": None})
    assert nothing.json()["second_volume"] is None
    old = json.loads(to_native_json(kept))
    del old["second_volume"]
    assert from_native_json(json.dumps(old)).content.second_volume is None


def test_another_heads_volume_is_asked_about(client: Client, phantom_services: Services, head: Case) -> None:
    """HAZ-38: both are named with their dates, and the answer is kept in the plan."""
    plan, path = phantom_services.plans.create(head.id, "Of whom"), "/api/v1/plans/{}/second-volume"
    wish = {"case": "head-phantom"}
    refused = client.request("PUT", path.format(plan.id), json={"second_volume": wish})
    assert refused.status_code == 422
    phantom = phantom_services.cases.get("head-phantom")
    for words in (head.name, head.created[:10], phantom.name, phantom.created[:10], "same patient", "other_head"):
        assert words in refused.text
    assert phantom_services.plans.get(plan.id).content.second_volume is None
    confirmed = client.request("PUT", path.format(plan.id), json={"second_volume": {**wish, "other_head": True}})
    assert confirmed.json()["second_volume"]["other_head"] is True
    kept = phantom_services.plans.get(plan.id)
    assert from_native_json(to_native_json(kept)).content.second_volume == SecondVolume("head-phantom", other_head=True)


def test_choices_tell_other_heads_apart(phantom_services: Services, head: Case) -> None:
    plan = phantom_services.plans.create(head.id, "Apart")
    edited = EditedPlan(phantom_services, plan.id)
    (choice,) = (one for one in edited.second_volume.section().build()["choices"] if one["case"] == "head-phantom")
    assert choice["other_head"] == phantom_services.cases.get("head-phantom").created
    file = json.loads(to_native_json(plan)) | {"second_volume": {"case": "head-phantom"}}  # of a plan from elsewhere
    edited = EditedPlan(
        phantom_services, phantom_services.plans.add_file(head.id, from_native_json(json.dumps(file))).id
    )
    laid = edited.second_volume.section().build()["laid"]
    assert laid is not None
    assert laid["to_confirm"]


@pytest.mark.parametrize(
    "wish",
    [
        {"transform": [2.0, *MOVED[1:]]},
        {"transform": [float("nan"), *MOVED[1:]]},
        {"transform": list(MOVED[:15])},
        {"transform": [-1.0, *IDENTITY[1:]]},  # a mirror: orthonormal, but left becomes right
        {"transform": [*IDENTITY[:3], 1e5, *IDENTITY[4:]]},
        {"transform": [True, *IDENTITY[1:]]},
        {"opacity": True},
        {"other_head": "yes"},
        {"opacity": 1.5},
        {"window": 0.0},
        {"case": "../etc"},
        {"colour": "red"},
    ],
)
def test_what_cannot_be_laid_over_is_refused(
    client: Client, phantom_services: Services, head: Case, wish: dict[str, Any]
) -> None:
    plan = phantom_services.plans.create(head.id, "Refused")
    body = json.dumps({"second_volume": {"case": head.id, **wish}})
    answer = client.request(
        "PUT", f"/api/v1/plans/{plan.id}/second-volume", content=body, headers={"Content-Type": "application/json"}
    )
    assert answer.status_code == 422, answer.text
    assert phantom_services.plans.get(plan.id).content.second_volume is None
    file = json.loads(to_native_json(plan)) | {"second_volume": {"case": head.id, **wish}}
    with pytest.raises(PlanError):
        from_native_json(json.dumps(file))


def test_the_command_line_lays_a_volume_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    folder = mr_series(tmp_path / "Canary Doe")
    assert main(["import", str(folder), "--over", "head-phantom", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["case"] == "head-phantom"
    assert printed["overlay"]["name"].startswith("MR 1, ")
    assert printed["overlay"]["shape"] == [36, 30, 24]
    assert main(["import", str(folder), "--over", "head-phantom", "--into", "head-phantom"]) == 2
    assert "--over is said of" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"transform": [*IDENTITY[:3], 5e3, *IDENTITY[4:]]}, "mm beside the head's CT"),
        ({"case": "nowhere"}, "is not there"),
        ({"volume": "nothing"}, "is not there"),
    ],
)
def test_a_volume_that_is_not_there_or_beside_the_head_is_told(
    client: Client, phantom_services: Services, head: Case, wish: dict[str, Any], words: str
) -> None:
    plan = phantom_services.plans.create(head.id, "Elsewhere")
    laid = {"second_volume": {"case": head.id, **wish}}
    answer = client.request("PUT", f"/api/v1/plans/{plan.id}/second-volume", json=laid)
    assert answer.status_code == 422
    assert words in answer.text
    assert phantom_services.plans.get(plan.id).content.second_volume is None
