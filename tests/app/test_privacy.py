"""HAZ-33: what people wrote into files and file names is in no store, log, answer or export."""

import io
import json
import logging
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pydicom
import pytest
import SimpleITK as sitk  # noqa: N813
import trimesh
from pydicom.datadict import DicomDictionary
from pydicom.dataset import Dataset
from rest_client import Client, opened_client, wait

from app.cli import main
from app.services import Services, build_services
from app.settings import Settings
from tests.engine.imaging_phantoms import dicom_slices
from tests.engine.label_files import ellipsoid, save_dicom_seg, save_nifti, save_seg_nrrd
from vfix_engine.files.volume import Volume

CANARY = "Canary"
SHAPE = (24, 30, 36)
# Groups that say what a file is and how its pixels are stored; nobody writes into them.
_TECHNICAL_GROUPS = {0x0000, 0x0002, 0x0020, 0x0028, 0x0062, 0x5200, 0x7FE0}
_TEXT = {"AE", "CS", "LO", "LT", "PN", "SH", "ST", "UC", "UT", "UR"}
_KEPT = {"SOPClassUID", "Modality", "SpecificCharacterSet", "ImageType", "ContentLabel", "SegmentationType"}


def scan() -> Volume:
    hu = np.full(SHAPE, -1000, dtype=np.int16)
    hu[3:21, 3:27, 3:33] = 900
    return Volume(hu, np.array([-50.0, -40.0, -30.0]), np.array([3.0, 3.0, 3.0]), np.eye(3))


EYE = ellipsoid(SHAPE, (15, 15, 12), (5, 5, 4))


def sow(dataset: Dataset) -> int:
    """Put a canary into every text tag of the standard that nothing is read from, and into private ones."""
    sown = 0
    for tag, (vr, _, _, retired, keyword) in DicomDictionary.items():
        if vr not in _TEXT or retired or tag >> 16 in _TECHNICAL_GROUPS or keyword in _KEPT or not keyword:
            continue
        if keyword in dataset and keyword not in ("PatientName", "PatientID"):
            continue
        value = f"{CANARY}{sown}"[:16]
        setattr(dataset, keyword, f"http://{CANARY}/{sown}" if vr == "UR" else value.upper() if vr == "CS" else value)
        sown += 1
    for keyword in ("PatientComments", "ImageComments", "FrameOfReferenceUID"):
        if keyword != "FrameOfReferenceUID":
            setattr(dataset, keyword, f"{CANARY} comment")
    dataset.SeriesDescription, dataset.StudyDescription = f"{CANARY} series", f"{CANARY} study"
    block = dataset.private_block(0x0009, f"{CANARY} creator", create=True)
    block.add_new(1, "LO", f"{CANARY} private")
    return sown


def write_dicom(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.zip"
    with zipfile.ZipFile(file, "w") as archive:
        for number, one in enumerate(dicom_slices(scan())):
            assert sow(one) > 200
            stream = io.BytesIO()
            pydicom.dcmwrite(stream, one, enforce_file_format=True)
            archive.writestr(f"{CANARY}/{CANARY}{number}.dcm", stream.getvalue())
    return file


def image() -> Any:
    made = sitk.GetImageFromArray(scan().hu)
    made.SetOrigin(scan().origin.tolist())
    made.SetSpacing(scan().spacing.tolist())
    return made


def write_nrrd(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.nrrd"
    made = image()
    made.SetMetaData("PatientName", CANARY)
    sitk.WriteImage(made, str(file))
    data = file.read_bytes()
    end = data.index(b"\n\n")
    file.write_bytes(data[:end] + f"\n# {CANARY} comment\ncontent: {CANARY}".encode() + data[end:])
    return file


def write_mha(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.mha"
    made = image()
    made.SetMetaData("Name", CANARY)
    sitk.WriteImage(made, str(file))
    file.write_bytes(file.read_bytes().replace(b"NDims", f"Comment = {CANARY}\nNDims".encode(), 1))
    return file


def write_nifti(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.nii"  # unpacked, so that it can be searched
    made = nibabel.Nifti1Image(scan().hu.T, np.diag([-1.0, -1.0, 1.0, 1.0]) @ scan().transform_index_to_lps)
    made.header.set_xyzt_units("mm")
    made.header["descrip"], made.header["aux_file"], made.header["db_name"] = CANARY, CANARY, CANARY
    made.header["intent_name"] = CANARY
    made.header.extensions.append(nibabel.nifti1.Nifti1Extension(6, f"{CANARY} in an extension".encode()))
    nibabel.save(made, file)
    return file


def surface() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=4, radius=60.0)


def write_obj(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.obj"
    made = surface()
    rows = [f"v {x} {y} {z}" for x, y, z in made.vertices] + [f"f {a} {b} {c}" for a, b, c in made.faces + 1]
    head = f"# SPACE=LPS UNIT=mm\n# {CANARY}\no {CANARY}\nmtllib {CANARY}.mtl\nusemtl {CANARY}\n"
    file.write_text(head + "\n".join(rows) + "\n")
    return file


def write_stl(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.stl"
    data = surface().export(file_type="stl")
    file.write_bytes(f"SPACE=LPS UNIT=mm {CANARY}".encode().ljust(80) + data[80:])
    return file


def write_ply(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.ply"
    data = surface().export(file_type="ply")
    file.write_bytes(data.replace(b"\nelement", f"\ncomment SPACE=LPS UNIT=mm\ncomment {CANARY}\nelement".encode(), 1))
    return file


def write_glb(folder: Path) -> Path:
    file = folder / f"{CANARY} Doe.glb"
    scene = trimesh.Scene()
    made = surface()
    made.metadata["name"] = CANARY
    scene.add_geometry(made, geom_name=CANARY, node_name=CANARY)
    file.write_bytes(scene.export(file_type="glb"))
    return file


def seg_nrrd(folder: Path) -> Path:
    segments: list[dict[str, object]] = [
        {"Name": "eye", "LabelValue": 1, "Layer": 0, "ID": CANARY, "Tags": f"Name:{CANARY}|"}
    ]
    extra = {"Segmentation_ConversionParameters": CANARY, "content": CANARY}
    transform = scan().transform_index_to_lps
    return save_seg_nrrd(folder / f"{CANARY}.seg.nrrd", [EYE.astype(int)], segments, transform, **extra)


def dicom_seg(folder: Path) -> Path:
    file = save_dicom_seg(folder / f"{CANARY}.dcm", [EYE], ["eye"], scan())
    dataset = pydicom.dcmread(file)
    sow(dataset)
    dataset.SegmentSequence[0].SegmentDescription = CANARY
    dataset.save_as(file)
    return file


def label_map(folder: Path) -> Path:
    return save_nifti(folder / f"{CANARY}.nii.gz", EYE.astype(int), scan().transform_index_to_lps, {1: "eye"})


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Services]:
    built = build_services(Settings(home=tmp_path_factory.mktemp("private") / "home", port=0))
    yield built
    built.close()


@pytest.fixture(scope="module")
def rest(services: Services) -> Iterator[Client]:
    opened = opened_client(services)
    yield opened
    opened.close()


def holds(data: bytes) -> bool:
    return CANARY.lower().encode() in data.lower()


def check_home(home: Path) -> None:
    for file in home.rglob("*"):
        assert not holds(file.name.encode()), file
        if file.is_file():
            assert not holds(file.read_bytes()), file
            if zipfile.is_zipfile(file):
                with zipfile.ZipFile(file) as archive:
                    assert not any(holds(archive.read(name)) for name in archive.namelist()), file


HEADS = [write_dicom, write_nrrd, write_mha, write_nifti, write_obj, write_stl, write_ply, write_glb]
Write = Callable[[Path], Path]


@pytest.mark.parametrize("write", HEADS)
def test_of_a_head_nothing_written_is_kept(
    rest: Client, services: Services, tmp_path: Path, caplog: pytest.LogCaptureFixture, write: Write
) -> None:
    """Uploaded under a person's name; its answers, its slices and its plan's exports are searched, and the store."""
    caplog.set_level(logging.DEBUG)
    file = write(tmp_path)
    assert holds(file.read_bytes())
    form = {"frame": "LPS", "units": "mm"} if file.suffix == ".glb" else {}
    job = wait(rest, rest.post("/api/v1/cases", files={"file": (file.name, file.read_bytes())}, data=form).json())
    assert job["state"] == "done", job
    case = f"/api/v1/cases/{job['result']}"
    plan = rest.post(f"{case}/plans", json={"name": "Plan"}).json()
    paths = [case, "/api/v1/cases", "/api/v1/jobs", f"{case}/structures", f"/api/v1/plans/{plan['id']}/export"]
    for path in paths:
        answer = rest.get(path)
        assert answer.status_code == 200, path
        assert not holds(answer.content + str(answer.headers).encode()), path
    assert not holds(caplog.text.encode())
    check_home(services.settings.home)


@pytest.mark.parametrize("write", [seg_nrrd, dicom_seg, label_map])
def test_of_a_segmentation_only_the_names_of_labels_are_kept(
    rest: Client, services: Services, tmp_path: Path, caplog: pytest.LogCaptureFixture, write: Write
) -> None:
    caplog.set_level(logging.DEBUG)
    head = write_nrrd(tmp_path)
    job = wait(rest, rest.post("/api/v1/cases", files={"file": (head.name, head.read_bytes())}).json())
    path = f"/api/v1/cases/{job['result']}/structures"
    file = write(tmp_path)
    if write is not label_map:  # whose canary is its file's name
        assert holds(file.read_bytes())
    done = wait(rest, rest.post(path, files={"file": (file.name, file.read_bytes())}).json())
    assert done["state"] == "done", done
    found = rest.get(path)
    assert [item["name"] for item in found.json()] == ["Bone", "eye"]
    assert not holds(found.content + rest.get("/api/v1/jobs").content + caplog.text.encode())
    check_home(services.settings.home)


def test_the_command_line_says_nothing_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    assert main(["import", str(write_dicom(tmp_path)), "--json"]) == 0
    out, err = capfd.readouterr()
    case = json.loads(out)["case"]
    assert main(["import", str(seg_nrrd(tmp_path)), "--into", case]) == 0
    assert main(["case", "show", case]) == 0
    assert main(["case", "structures", case]) == 0
    more = capfd.readouterr()
    assert not holds(f"{out}{err}{more.out}{more.err}".encode())
    check_home(tmp_path / "home")


def test_a_description_is_shown_to_choose_by_and_stored_nowhere(
    rest: Client, services: Services, tmp_path: Path
) -> None:
    """Of several series; once one is chosen the question's job is taken off the list with what it quoted."""
    file = tmp_path / "two.zip"
    with zipfile.ZipFile(file, "w") as archive:
        for series in range(2):
            for number, one in enumerate(dicom_slices(scan())):
                one.SeriesDescription = f"{CANARY} {series}"
                stream = io.BytesIO()
                pydicom.dcmwrite(stream, one, enforce_file_format=True)
                archive.writestr(f"{series}/{number}.dcm", stream.getvalue())
    asked = wait(rest, rest.post("/api/v1/cases", files={"file": (file.name, file.read_bytes())}).json())
    assert asked["error"]["details"]["missing"] == ["series"]  # type: ignore[index]
    assert [one["description"] for one in asked["error"]["details"]["series"]] == [f"{CANARY} 0", f"{CANARY} 1"]  # type: ignore[index]
    wrong = wait(rest, rest.post(f"/api/v1/jobs/{asked['id']}/answer", json={"series": 7}).json())
    assert wrong["state"] == "failed"
    again = wait(rest, rest.post(f"/api/v1/jobs/{wrong['id']}/answer", json={"series": 2}).json())
    assert again["state"] == "done", again
    assert not holds(rest.get("/api/v1/jobs").content)
    check_home(services.settings.home)
