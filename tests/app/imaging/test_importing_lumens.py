"""Lumens imported as cases: from a file by the service, over REST and by the command line, and another one of a CT."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import SimpleITK
from rest_client import Client, wait

from app.cli import main
from app.imaging.importing import ImportRequest
from app.services import Services
from app.workspace.case_view import case_section
from vfix_engine.errors import InputError

SPACING = 2.0
_HEAD = re.compile(r"\b(bones?|heads?|skull|teeth|face|margin)\b", re.IGNORECASE)


def abdomen(folder: Path) -> tuple[Path, Path]:
    """A CT with an air-filled tube along z and a second, smaller one, and a label map of the first."""
    k, j, i = np.mgrid[:60, :50, :70]
    first = (i - 20) ** 2 + (j - 25) ** 2 <= 49
    second = (i - 50) ** 2 + (j - 25) ** 2 <= 25
    middle = (k > 5) & (k < 54)
    hu = np.where((i > 4) & (i < 65) & (j > 4) & (j < 45), 40, -1000).astype(np.int16)
    hu[(first | second) & middle] = -1000
    files = folder / "abdomen.nrrd", folder / "colon.nii.gz"
    for file, values in zip(files, (hu, (first & middle).astype(np.uint8)), strict=True):
        image = SimpleITK.GetImageFromArray(values)
        image.SetSpacing([SPACING] * 3)
        SimpleITK.WriteImage(image, file)
    return files


VOLUME_MM3 = np.pi * 49 * 48 * SPACING**3


def test_a_ct_becomes_a_lumen_with_slices_and_another_one_at_a_seed(
    client: Client, phantom_services: Services, tmp_path: Path
) -> None:
    services, (ct, labels) = phantom_services, abdomen(tmp_path)
    case = services.importing.run(ImportRequest(ct, kind="lumen"))
    assert (case.kind, case.has_volume, case.anatomy.has_inside) == ("lumen", True, True)
    assert (case.anatomy.provenance.origin, case.anatomy.provenance.threshold_hu) == ("ct", -500.0)
    assert services.cases.case_surface(case.id).volume_mm3 == pytest.approx(VOLUME_MM3, rel=0.1)
    seed = [100.0, 50.0, 60.0]  # in the second tube
    answer = client.post(f"/api/v1/cases/{case.id}/lumen", json={"seed": seed})
    assert answer.status_code == 202
    made = wait(client, answer.json())
    assert made["state"] == "done", made
    other = services.cases.get(str(made["result"]))
    middle = services.cases.case_surface(other.id).bounds.mean(axis=0)
    np.testing.assert_allclose(middle[:2], seed[:2], atol=2.0 * SPACING)
    assert other.volumes[0].source == case.volumes[0].source
    in_tissue = client.post(f"/api/v1/cases/{case.id}/lumen", json={"seed": [70.0, 50.0, 60.0]})
    assert "put it into the lumen" in str(wait(client, in_tissue.json())["error"])
    of_labels = services.importing.run(ImportRequest(labels, kind="lumen"))
    assert (of_labels.has_volume, of_labels.anatomy.provenance.origin) == (False, "segmentation")
    assert of_labels.anatomy.provenance.voxel_mm == pytest.approx(SPACING)
    assert of_labels.uncertainty.words("the wall")
    assert client.post(f"/api/v1/cases/{of_labels.id}/lumen", json={"seed": seed}).status_code == 202
    with pytest.raises(InputError, match="say that it is one"):
        services.importing.run(ImportRequest(ct, label=3))


def test_what_is_said_of_a_lumen_in_a_form_is_checked(client: Client, tmp_path: Path) -> None:
    ct, _ = abdomen(tmp_path)
    data = ct.read_bytes()
    for fields in ({"label": "one"}, {"seed": "1,2"}, {"seed": "a,b,c"}, {"seed": "nan,0,0"}, {"air_hu": "cold"}):
        answer = client.post("/api/v1/cases", files={"file": (ct.name, data)}, data={"kind": "lumen", **fields})
        assert answer.status_code == 422, fields


def test_a_lumen_comes_in_by_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    ct, _ = abdomen(tmp_path)
    words = ["import", str(ct), "--kind", "lumen", "--seed", "100", "50", "60", "--air", "-600", "--json"]
    assert main(words) == 0
    printed = capsys.readouterr()
    assert "the wall may lie" in printed.err
    assert "the certificate knows that surface alone." in printed.err
    assert "Images of a lumen can identify the patient: they show the body." in printed.err
    assert not _HEAD.search(printed.out + printed.err)
    answer = json.loads(printed.out)
    assert [surface["name"] for surface in answer["surfaces"]] == ["lumen"]
    assert any("at the seed" in note for note in answer["notes"])
    assert main(["case", "show", answer["case"]]) == 0
    shown = capsys.readouterr().out
    assert "the wall may lie" in shown
    assert not _HEAD.search(shown)
    assert main([*words[:4], "--label", "1"]) == 2
    assert "this is a CT" in capsys.readouterr().err


def test_what_is_wrong_with_a_lumen_and_what_is_shown_of_it_is_said_in_words_of_a_lumen(
    phantom_services: Services, tmp_path: Path
) -> None:
    ct, labels = abdomen(tmp_path)
    services = phantom_services
    for request, words in (
        (ImportRequest(labels, kind="lumen", seed=(0.0, 0.0, 0.0)), "label map"),
        (ImportRequest(ct, kind="lumen", air_hu=50.0), "threshold"),
        (ImportRequest(ct, kind="lumen", seed=(70.0, 50.0, 60.0)), "put it into the lumen"),
        (ImportRequest(ct, kind="lumen", label=1), "this is a CT"),
    ):
        with pytest.raises(InputError, match=words) as refused:
            services.importing.run(request)
        assert not _HEAD.search(str(refused.value))
    stages: list[str] = []
    case = services.importing.run(ImportRequest(labels, kind="lumen"), lambda stage, share: stages.append(stage))
    section = case_section(case, "")
    told = [*stages, section["uncertainty"], *section["notes"], *(one["words"] for one in section["surfaces"])]
    assert "the wall may lie" in section["uncertainty"]
    assert not _HEAD.search(" ".join(told))
