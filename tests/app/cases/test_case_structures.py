"""Segmentations become structures of a case: service, REST and command line; what is open is answered without another
upload.
"""

import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import trimesh
from rest_client import Client, wait

from app.cases.model import Case
from app.cases.segments import OUTLINE_COLOUR, usable_name
from app.cases.service import CaseFrame
from app.cases.structures import encloses, is_closed
from app.cli import main
from app.services import Services
from app.store.models import DocumentStateRow
from app.workspace.case_view import case_section
from tests.engine.label_files import ellipsoid, save_dicom_seg, save_nifti, save_seg_nrrd
from vfix_engine.anatomy.labels.label_map import CroppedLabel
from vfix_engine.anatomy.labels.surfaces import surface_of
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

SHAPE = (30, 40, 50)
COARSE = "Its voxels are up to 2.5 mm long: its surface may be 1.25 mm off, by which the margin of a hard zone grows."


def scan() -> Volume:
    hu = np.full(SHAPE, -1000, dtype=np.int16)
    hu[4:26, 4:36, 4:46] = 700
    return Volume(hu, np.array([-50.0, -40.0, 10.0]), np.array([2.0, 2.0, 2.5]), np.eye(3))


EYE, NERVE = ellipsoid(SHAPE, (15, 20, 15), (6, 6, 5)), ellipsoid(SHAPE, (30, 20, 15), (8, 2, 2))


@pytest.fixture
def head(phantom_services: Services) -> Iterator[Case]:
    box = trimesh.creation.box((84.0, 64.0, 55.0))
    box.apply_translation([0.0, 0.0, 47.0])
    mesh = TriangleMesh(np.array(box.vertices), np.array(box.faces))
    frame = CaseFrame("LPS", assumed=False)
    made = phantom_services.cases.create("Block", frame=frame, surfaces={"bone": mesh}, volume=scan())
    yield made
    phantom_services.purge.run(made.id)


def seg_nrrd(folder: Path) -> Path:
    segments = [
        {"Name": "Left eye", "LabelValue": 1, "Layer": 0, "Color": "1 0 0"},
        {"Name": "Optic nerve", "LabelValue": 2, "Layer": 0, "Color": "0 0 1"},
    ]
    labels = [np.where(EYE, 1, np.where(NERVE, 2, 0))]
    return save_seg_nrrd(folder / "Canary Patient.seg.nrrd", labels, segments, scan().transform_index_to_lps)


def sent(client: Client, path: str, *files: Path, **fields: Any) -> dict[str, Any]:
    parts = [("file", (file.name, file.read_bytes())) for file in files]
    names = fields.pop("names", None)
    if names is not None:
        parts.append(("names", (names.name, names.read_bytes())))
    answer = client.post(path, files=parts, data=fields)
    assert answer.status_code == 202, answer.text
    return wait(client, answer.json())


def structures(client: Client, case: Case) -> list[dict[str, Any]]:
    return [item for item in client.get(f"/api/v1/cases/{case.id}/structures").json() if item["role"] == "spare"]


def test_a_segmentation_over_rest(client: Client, phantom_services: Services, head: Case, tmp_path: Path) -> None:
    """Uploaded, listed, renamed, recoloured and deleted; the case's own hash and surfaces stay."""
    job = sent(client, f"/api/v1/cases/{head.id}/structures", seg_nrrd(tmp_path))
    assert (job["state"], job["kind"], job["case_id"], job["result"]) == ("done", "structures", head.id, head.id)
    eye, nerve = structures(client, head)
    assert [eye["name"], nerve["name"]] == ["Left eye", "Optic nerve"]
    assert (eye["colour"], eye["has_inside"], eye["notes"]) == ("#ff0000", True, [COARSE])
    assert eye["provenance"] == {"origin": "segmentation", "threshold_hu": None, "label": 1, "voxel_mm": 2.5}
    mesh = phantom_services.cases.structure_mesh(head.id, eye["id"])
    inside = scan().index_to_lps(np.argwhere(EYE)[:, ::-1])
    assert np.abs(mesh.bounds - [inside.min(axis=0), inside.max(axis=0)]).max() <= 1.25
    case = client.get(f"/api/v1/cases/{head.id}").json()
    assert case["content_hash"] == head.content_hash
    assert list(phantom_services.cases.display_meshes(head.id)) == ["bone"]
    path = f"/api/v1/cases/{head.id}/structures"
    changed = client.patch(f"{path}/{eye['id']}", json={"name": "Eye <left>", "colour": "#00ff00"}).json()
    assert (changed["name"], changed["colour"]) == ("Eye <left>", "#00ff00")
    assert client.patch(f"{path}/{eye['id']}", json={"colour": "red"}).status_code == 422
    refused = client.patch(f"{path}/{eye['id']}", json={"colour": "#f0c050"})
    assert (refused.status_code, "bone's outline" in refused.text) == (422, True)
    stored = phantom_services.cases.get(head.id)
    shown, fewer = (case_section(stored, "", hidden)["outlines"] for hidden in ((), {eye["id"]}))
    assert [one["colour"] for one in shown][:2] == [OUTLINE_COLOUR, "#00ff00"]
    assert [one["closed"] for one in shown] == [True, False, False]
    assert [one["surface"] for one in shown if one not in fewer] == [eye["id"]]
    assert client.patch(f"{path}/bone", json={"name": "x"}).status_code == 422
    assert client.delete(f"{path}/bone").status_code == 422
    assert client.delete(f"{path}/nobody").status_code == 404
    assert client.delete(f"{path}/{eye['id']}").status_code == 200
    assert [item["name"] for item in structures(client, head)] == ["Optic nerve"]
    assert client.post("/api/v1/cases/nobody/structures", files={"file": ("x.seg.nrrd", b"")}).status_code == 404


def test_names_come_along_in_a_table(client: Client, head: Case, tmp_path: Path) -> None:
    labels = save_nifti(tmp_path / "x.nii.gz", np.where(EYE, 1, np.where(NERVE, 2, 0)), scan().transform_index_to_lps)
    table = tmp_path / "names.csv"
    table.write_text("label,name\n1,eye\n")
    job = sent(client, f"/api/v1/cases/{head.id}/structures", labels, names=table)
    assert job["state"] == "done"
    found = structures(client, head)
    assert [item["name"] for item in found] == ["eye", "Label 2"]
    assert found[0]["colour"] != found[1]["colour"]


def masks(folder: Path) -> Path:
    """As TotalSegmentator writes them: a file for each structure, empty ones among them, and its statistics."""
    folder.mkdir(parents=True)
    for name, mask in (("eye_left", EYE), ("optic_nerve_left", NERVE), ("liver", np.zeros(SHAPE, dtype=bool))):
        save_nifti(folder / f"{name}.nii.gz", mask.astype(np.uint8), scan().transform_index_to_lps)
    (folder / "statistics.json").write_text("{}")
    return folder


def test_a_coarse_map_tells_how_far_its_surface_may_be_off(
    client: Client, phantom_services: Services, head: Case, tmp_path: Path
) -> None:
    """Half a slice of 5 mm; of voxels of 1 mm nothing is told, which is what a CT's own surfaces follow."""
    for size, off in ((5.0, 2.5), (1.0, 0.0)):
        transform = np.diag([1.0, 1.0, size, 1.0])
        transform[:3, 3] = scan().bounds.mean(axis=0) - [25.0, 20.0, 7.5 * size]
        file = save_nifti(tmp_path / f"{size}.nii.gz", EYE.astype(np.uint8)[::2], transform)
        assert sent(client, f"/api/v1/cases/{head.id}/structures", file)["state"] == "done"
        made = structures(client, head)[-1]
        assert made["deviation_mm"] == off
        assert any("its surface may be 2.50 mm off" in note for note in made["notes"]) == bool(off)
        assert phantom_services.cases.get(head.id).structure_errors()[made["id"]] == off


def test_a_folder_of_masks_names_structures_after_its_files(
    client: Client, phantom_services: Services, head: Case, tmp_path: Path
) -> None:
    """Each mask lands where the label map of all of them does; what is imported again is told apart by its name."""
    folder = masks(tmp_path / "Canary Doe")
    files = sorted(folder.glob("*.nii.gz"))
    assert sent(client, f"/api/v1/cases/{head.id}/structures", *files)["state"] == "done"
    made = structures(client, head)
    assert [item["name"] for item in made] == ["Eye left", "Optic nerve left"]
    assert made[0]["notes"] == ["'Liver' has no voxel and was left out.", COARSE]
    labels = np.where(EYE, 1, np.where(NERVE, 2, 0)).astype(np.uint8)
    whole = save_nifti(tmp_path / "map.nii.gz", labels, scan().transform_index_to_lps)
    sent(client, f"/api/v1/cases/{head.id}/structures", whole)
    cases = phantom_services.cases
    for one, other in zip(structures(client, head)[:2], structures(client, head)[2:], strict=True):
        mesh, same = (cases.structure_mesh(head.id, item["id"]) for item in (one, other))
        np.testing.assert_array_equal(mesh.vertices, same.vertices)
    archive = tmp_path / "masks.zip"
    with zipfile.ZipFile(archive, "w") as packed:
        for file in folder.iterdir():
            packed.write(file, f"segmentations/{file.name}")
    assert sent(client, f"/api/v1/cases/{head.id}/structures", archive)["state"] == "done"
    assert [item["name"] for item in structures(client, head)[4:]] == ["Eye left 2", "Optic nerve left 2"]
    asked: Any = wait(client, client.post("/api/v1/cases", files={"file": ("m.zip", archive.read_bytes())}).json())
    assert asked["error"]["details"]["missing"] == ["into"]


def test_a_folder_of_something_else_is_no_folder_of_masks(client: Client, head: Case, tmp_path: Path) -> None:
    labels = np.where(EYE, 1, np.where(NERVE, 2, 0)).astype(np.uint8)
    folder = masks(tmp_path / "masks")
    save_nifti(folder / "all_of_them.nii.gz", labels, scan().transform_index_to_lps)
    refused = sent(client, f"/api/v1/cases/{head.id}/structures", *sorted(folder.glob("*.nii.gz")))
    assert "'All of them' holds several values" in str(refused["error"])
    (folder / "slice.dcm").write_bytes(b"not DICOM")
    refused = sent(client, f"/api/v1/cases/{head.id}/structures", *sorted(folder.glob("*.*[mz]")))
    assert "one NIfTI mask for each structure" in str(refused["error"])
    assert structures(client, head) == []


def test_a_segmentation_sent_as_a_head_waits_for_its_case(
    client: Client, phantom_services: Services, head: Case, tmp_path: Path
) -> None:
    """Whatever its format; the answer alone imports it, and a wrong answer does not lose the file."""
    table = tmp_path / "names.json"
    table.write_text('{"1": "eye"}')
    files = (
        seg_nrrd(tmp_path),
        save_dicom_seg(tmp_path / "x.dcm", [EYE], ["eye"], scan()),
        save_nifti(tmp_path / "x.nii", EYE.astype(int), scan().transform_index_to_lps),
    )
    for file in files:
        before = len(structures(client, head))
        asked = sent(client, "/api/v1/cases", file, names=table)
        assert asked["error"]["code"] == "segmentation_found"
        assert asked["error"]["details"] == {"missing": ["into"]}
        answer = f"/api/v1/jobs/{asked['id']}/answer"
        assert client.post(answer, json={"into": "nobody"}).status_code == 404
        done = wait(client, client.post(answer, json={"into": head.id}).json())
        assert (done["state"], done["kind"]) == ("done", "structures"), done
        assert len(structures(client, head)) > before
    assert structures(client, head)[-1]["name"] == "eye 2"
    assert not [file for file in phantom_services.settings.temporary_dir.rglob("*") if file.name.startswith("x.")]


def test_a_wrong_answer_costs_no_second_upload(client: Client, phantom_services: Services, tmp_path: Path) -> None:
    """A unit that makes a giant of the head: the question is open again, with why, and the next answer is taken."""
    file = tmp_path / "x.obj"
    made = trimesh.creation.icosphere(subdivisions=3, radius=60.0)
    rows = [f"v {x} {y} {z}" for x, y, z in made.vertices] + [f"f {a} {b} {c}" for a, b, c in made.faces + 1]
    file.write_text("\n".join(rows) + "\n")
    asked = sent(client, "/api/v1/cases", file)
    given = {"frame": "LPS", "units": "m"}
    wrong = wait(client, client.post(f"/api/v1/jobs/{asked['id']}/answer", json=given).json())
    assert wrong["error"]["code"] == "answer_unusable"  # type: ignore[index]
    assert "cannot be a head" in wrong["error"]["message"]  # type: ignore[index]
    assert wrong["error"]["details"] == {"missing": ["frame", "unit"]}  # type: ignore[index]
    right = client.post(f"/api/v1/jobs/{wrong['id']}/answer", json={"frame": "RAS", "units": "mm"}).json()
    done = wait(client, right)
    assert done["state"] == "done", done
    assert client.get(f"/api/v1/cases/{done['result']}").json()["frame"] == {"name": "RAS", "assumed": False}
    assert not list(phantom_services.settings.temporary_dir.rglob("x.obj"))
    phantom_services.purge.run(str(done["result"]))


def test_a_map_without_a_place_waits_for_its_frame(client: Client, head: Case, tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(EYE.T.astype(np.uint8), np.diag([2.0, 2.0, 2.5, 1.0]))
    image.set_sform(None, code=0)
    image.set_qform(None, code=0)
    nibabel.save(image, tmp_path / "x.nii")
    asked = sent(client, f"/api/v1/cases/{head.id}/structures", tmp_path / "x.nii")
    assert asked["error"]["details"] == {"missing": ["frame"]}
    done = wait(client, client.post(f"/api/v1/jobs/{asked['id']}/answer", json={"frame": "LPS"}).json())
    assert done["state"] == "done", done


def test_a_structure_that_a_plan_uses_stays(
    client: Client, phantom_services: Services, head: Case, tmp_path: Path
) -> None:
    sent(client, f"/api/v1/cases/{head.id}/structures", seg_nrrd(tmp_path))
    eye, _ = structures(client, head)
    plan = client.post(f"/api/v1/cases/{head.id}/plans", json={"name": "Protecting"}).json()
    with phantom_services.store.writing() as session:
        state = session.get(DocumentStateRow, (plan["id"], 0))
        assert state is not None
        state.refs = [*state.refs, {"kind": "structure", "id": eye["id"]}]
    with pytest.raises(InputError, match="the plan 'Protecting'"):
        phantom_services.structures.delete(head.id, eye["id"])
    client.delete(f"/api/v1/plans/{plan['id']}")
    phantom_services.structures.delete(head.id, eye["id"])


def test_a_label_that_touches_itself_still_has_an_inside() -> None:
    """Speckle meets corner to corner: its surface is no manifold, and has no border all the same."""
    mask = np.random.default_rng(1).random((12, 12, 12)) > 0.5
    mesh = surface_of(CroppedLabel(1, "", None, mask, np.zeros(3, dtype=np.int64), np.eye(4))).mesh
    assert not is_closed(mesh)
    assert encloses(mesh)
    assert not encloses(TriangleMesh(mesh.vertices, mesh.faces[1:]))


@pytest.mark.parametrize(
    ("text", "name"),
    [("a\x07b\n c", "a b c"), ("\u202eevil", "evil"), ("", "other"), ("\u2800", "other"), ("x" * 300, "x" * 120)],
)
def test_names_out_of_files_are_usable(text: str, name: str) -> None:
    """HAZ-32."""
    assert usable_name(text, "other") == name


def test_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Import into a case, list, rename, recolour, delete; the phantom keeps its structures over a start."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    transform = np.diag([2.0, 2.0, 2.5, 1.0])
    transform[:3, 3] = [-50.0, -60.0, -30.0]
    file = save_nifti(tmp_path / "x.nii.gz", EYE.astype(int), transform, {1: "eye"})

    def said(*words: object) -> dict[str, Any]:
        assert main([*map(str, words), "--json"]) == 0
        return json.loads(capsys.readouterr().out)  # type: ignore[no-any-return]

    (tmp_path / "masks").mkdir()
    save_nifti(tmp_path / "masks" / "right_eye.nii.gz", EYE.astype(int), transform)
    of_folder = said("import", tmp_path / "masks", "--into", "head-phantom")["structures"]
    assert [item["name"] for item in of_folder] == ["Right eye"]
    said("case", "structures", "head-phantom", "--delete", "Right eye")
    made = said("import", file, "--into", "head-phantom")
    assert [(item["name"], item["role"]) for item in made["structures"]] == [("eye", "spare")]
    assert "a grid of its own" in made["structures"][0]["notes"][0]
    identity = made["structures"][0]["id"]
    listed = said("case", "structures", "head-phantom")["structures"]
    assert [item["id"] for item in listed] == ["bone", identity]
    renamed = said("case", "structures", "head-phantom", "--rename", "eye", "Left eye")["structures"]
    assert renamed[1]["name"] == "Left eye"
    assert (
        said("case", "structures", "head-phantom", "--colour", identity, "#ABCDEF")["structures"][1]["colour"]
        == "#abcdef"
    )
    assert [
        item["id"] for item in said("case", "structures", "head-phantom", "--delete", "Left eye")["structures"]
    ] == ["bone"]
    assert main(["import", str(file), "--into", "nobody"]) == 2
    assert main(["import", str(file), "--names", str(file)]) == 2
    assert main(["import", str(file), "--into", "head-phantom", "--name", "x"]) == 2
    assert main(["import", str(file), "--into", "head-phantom", "--names", str(file)]) == 2
    err = capsys.readouterr().err
    assert "Traceback" not in err
