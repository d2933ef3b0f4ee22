"""A case from every kind of file, by the service and by the command line."""

import json
import re
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from pydicom.uid import generate_uid

from app.cases.import_names import NO_DESCRIPTION, WantedName, plain_name
from app.cases.model import HEAD_PHANTOM, Case, CaseContent
from app.cases.reading import case_content_from_json
from app.cases.service import CaseService
from app.cases.settings import settings_in_case
from app.cases.structures import Provenance
from app.cli import main
from app.exchange.resolve import resolve_case, resolve_plan
from app.imaging.importing import ImportRequest, ImportService
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from app.settings import Settings
from app.store import Store
from tests.engine.imaging_phantoms import dicom_slices, save_dicom
from vfix_engine.anatomy.bone import CONTROL_TRIANGLES
from vfix_engine.anatomy.segmentation import PRESETS, SegmentRequest, segment
from vfix_engine.control.settings import ControlSettings
from vfix_engine.errors import FrameError, ImageError, InputError
from vfix_engine.files.volume import Volume

TIME = r"\d{1,2} [A-Z][a-z]{2} \d\d:\d\d"  # of an import, as a plain name has it


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def imported(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    assert main(["import", *map(str, words), "--json"]) == 0
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def bounds_of(answer: dict[str, Any], name: str = "bone") -> np.ndarray:
    (surface,) = [surface for surface in answer["surfaces"] if surface["name"] == name]
    return np.array(surface["bounds_lps_mm"])


def test_real_head_as_nrrd_and_as_dicom(home: Path, trial_data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """HAZ-14: both bring the same bone, within a voxel."""
    folder = trial_data / "head_ct"
    nrrd = imported(capsys, folder / "cthead_hu_lps.nrrd")
    series = imported(capsys, folder / "cthead_derived_dicom.zip")
    for answer, number in ((nrrd, 1), (series, 2)):
        assert re.fullmatch(rf"CT {number}, {TIME}", answer["name"])
        assert answer["frame"] == {"name": "LPS", "assumed": False}
        assert answer["spacing_mm"] == [1.0, 1.0, 2.0]
        triangles = {surface["name"]: surface["triangles"] for surface in answer["surfaces"]}
        assert 200_000 < triangles["bone"] <= CONTROL_TRIANGLES
        assert triangles["display"] <= 60_001
        reports = {surface["name"]: surface["report"] for surface in answer["surfaces"]}
        assert reports["bone"]["max_deviation_mm"] == 0.0, "not thinned"
        assert reports["bone"]["dropped"]["pieces"] == 10, "the shell of its headrest"
        assert "Not in the bone: 10 pieces beside the head, as of a headrest." in " ".join(answer["notes"])
        assert 200 < reports["display"]["dropped"]["pieces"] < reports["display"]["dropped"]["triangles"] / 4
        assert 5.0 < reports["display"]["dropped"]["extent_mm"] < 30.0
        assert 0.05 < reports["display"]["mean_deviation_mm"] < 0.2
        assert 1.0 < reports["display"]["max_deviation_mm"] < 4.0
        assert answer["surface_uncertainty_mm"] == 1.0, "half of the slices' 2 mm"
    assert np.abs(bounds_of(nrrd) - bounds_of(series)).max() < 1.0
    assert nrrd["case"] != series["case"]


def test_surface_keeps_its_triangles_and_what_is_assumed_is_said(
    home: Path, trial_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = trial_data / "head_ct" / "nose_sinus_bone_lps_mm.ply"
    assumed = imported(capsys, file)
    assert assumed["frame"] == {"name": "LPS", "assumed": True}
    assert assumed["spacing_mm"] is None
    assert assumed["surfaces"][0]["triangles"] == 182_000
    told = imported(capsys, file, "--frame", "RAS", "--units", "mm", "--name", "Nose of RAS")
    assert told["frame"] == {"name": "RAS", "assumed": False}
    assert told["name"] == "Nose of RAS"
    turned = bounds_of(assumed) * [-1, -1, 1]
    assert np.allclose(bounds_of(told), np.sort(turned, axis=0), atol=1e-6)


@pytest.mark.parametrize(
    "name", ["bad_magic.nii", "truncated_gzip.nrrd", "nan_vertex.stl", "truncated.mrk.json", "quad_face.ply"]
)
def test_malformed_files_end_in_one_line(
    home: Path, trial_data: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """HAZ-16: no traceback, status 2, and the reason as JSON too."""
    assert main(["import", str(trial_data / "formats" / "malformed" / name), "--json"]) == 2
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    assert json.loads(out)["error"]["message"]
    assert "vfix: " in err


@pytest.fixture
def service(tmp_path: Path) -> ImportService:
    return ImportService(CaseService(Store(Settings(home=tmp_path / "home"))))


def save_nrrd(file: Path, hu: np.ndarray, space: str) -> Path:
    sizes = " ".join(str(size) for size in hu.shape[::-1])
    file.write_bytes(
        f"NRRD0004\ntype: short\ndimension: 3\n{space}sizes: {sizes}\nspace directions: (2,0,0) (0,2,0) (0,0,2)\n"
        f"endian: little\nencoding: raw\nspace origin: (0,0,0)\n\n".encode()
        + hu.astype("<i2").tobytes()
    )
    return file


def block(air: int, bone: int) -> np.ndarray:
    hu = np.full((20, 20, 20), air, dtype=np.int16)
    hu[4:15, 5:13, 6:17] = bone
    return hu


def test_page_is_asked_for_what_is_missing(tmp_path: Path, service: ImportService) -> None:
    """HAZ-14: without `assume` nothing is guessed; the answer goes into the next request."""
    file = save_nrrd(tmp_path / "head.nrrd", block(-1000, 1000), "")
    with pytest.raises(FrameError) as asked:
        service.run(ImportRequest(file))
    assert asked.value.missing == ("frame",)
    stages: list[tuple[str, float]] = []
    case = service.run(ImportRequest(file, frame="RAS"), lambda stage, fraction: stages.append((stage, fraction)))
    assert (case.frame.name, case.frame.assumed) == ("RAS", False)
    assert re.fullmatch(f"CT 1, {TIME}", case.name)
    fractions = [fraction for _, fraction in stages]
    assert fractions == sorted(fractions)
    assert stages[-1] == ("Storing the case", 0.95)
    assert len(stages) >= 4


def test_what_is_stored_comes_back(tmp_path: Path) -> None:
    cases = CaseService(Store(Settings(home=tmp_path / "home")))
    file = save_nrrd(tmp_path / "head.nrrd", block(-1000, 1000), "space: left-posterior-superior\n")
    case = ImportService(cases).run(ImportRequest(file, name="Block"))
    volume = cases.volume(case)
    assert isinstance(volume, Volume)
    assert np.array_equal(volume.hu, block(-1000, 1000))
    bone = cases.case_surface(case.id)
    assert np.allclose(bone.bounds, [[11.25, 9.25, 7.25], [32.75, 24.75, 28.75]], atol=0.02)
    assert [surface.name for surface in case.surfaces] == ["bone", "display"]
    (structure,) = case.structures
    assert (structure.id, structure.role, structure.provenance) == ("bone", "bone", Provenance("ct", 250.0))
    assert (structure.deviation_mm, structure.has_inside, structure.frame) == (0.0, True, "LPS")
    assert structure.geometry == case.surfaces[0].source


def test_what_was_left_out_is_stored_and_told(home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A speck beside the bone is bone as well; 5 mm slices hide more than the margin covers."""
    hu = block(-1000, 1000)
    hu[17, 2, 2] = 1000
    file = save_nrrd(tmp_path / "head.nrrd", hu, "space: left-posterior-superior\n")
    thick = tmp_path / "thick.nrrd"
    thick.write_bytes(file.read_bytes().replace(b"(0,0,2)", b"(0,0,5)"))
    answer = imported(capsys, file)
    bone = answer["surfaces"][0]
    assert bone["report"] == {
        "mean_deviation_mm": 0.0,
        "max_deviation_mm": 0.0,
        "dropped": {"pieces": 0, "triangles": 0, "extent_mm": 0.0},
        "certified_mm": 0.0,
        "put_back": 0,
        "smoothed_mm": 0.0,
        "resampled_mm": 0.0,
    }
    assert main(["case", "show", answer["case"]]) == 0
    assert f"{bone['triangles']:,} triangles; not thinned" in capsys.readouterr().out
    assert main(["import", str(thick)]) == 0
    assert (
        "bone may lie 2.50 mm off its surface, thin bone further (2.50 mm: slices 5 mm apart)"
        in capsys.readouterr().err
    )


def test_the_error_of_resampled_slices_is_told_and_added_to_the_margin(tmp_path: Path) -> None:
    """HAZ-37: from the files of a tilted series to the margin that is kept, and to a structure segmented from it."""
    cases = CaseService(Store(Settings(home=tmp_path / "home")))
    slices = dicom_slices(Volume(block(-1000, 1000), np.zeros(3), np.array([1.0, 1.0, 2.0]), np.eye(3)))
    for number, one in enumerate(slices):
        one.ImagePositionPatient[1] += 0.3 * number
    case = ImportService(cases).run(ImportRequest(save_dicom(slices, tmp_path / "series")))
    error_mm = cases.volume(case).resampled_mm
    assert error_mm is not None
    assert 0.01 < error_mm < 0.5
    assert f"by {error_mm:.2f} mm, which is added" in " ".join(case.notes)
    assert case.uncertainty.added_mm == error_mm
    assert f"{error_mm:.2f} mm: tilted slices resampled, added to the margin" in case.uncertainty.words()
    assert settings_in_case({}, case.uncertainty).kept_mm == pytest.approx(ControlSettings().margin_mm + error_mm)
    assert case_content_from_json(content_of(case).to_json()).surfaces == case.surfaces
    found = segment(cases.volume(case), SegmentRequest(PRESETS["bone"]))
    assert found.resampled_mm == error_mm


def content_of(case: Case) -> CaseContent:
    return CaseContent(case.frame, case.surfaces, case.volumes, structures=case.structures)


def test_a_case_from_before_says_that_nothing_was_recorded(cases: CaseService, case: Case) -> None:
    document = CaseContent(case.frame, case.surfaces).to_json()
    del document["surfaces"][0]["report"], document["structures"], document["kind"]
    content = case_content_from_json(document)
    assert content.surfaces[0].report is None
    assert "not recorded" in content.surfaces[0].words
    assert case_content_from_json(content.to_json()) == content
    (bone,) = content.structures
    assert (content.kind, bone.id, bone.role, bone.geometry) == ("head", "bone", "bone", case.surfaces[0].source)
    assert (bone.provenance, bone.deviation_mm, bone.has_inside) == (Provenance("surface"), None, None)


def test_values_that_are_not_hounsfield_units_are_refused(tmp_path: Path, service: ImportService) -> None:
    file = save_nrrd(tmp_path / "raw.nrrd", block(24, 2024), "space: left-posterior-superior\n")
    with pytest.raises(ImageError, match="not Hounsfield"):
        service.run(ImportRequest(file))


def ball(radius: float) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=4, radius=radius)


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main([*map(str, words), "--json"]) == 2
    message: str = json.loads(capsys.readouterr().out)["error"]["message"]
    return message


def test_what_is_doubtful_about_a_surface_is_said_and_kept(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-09: with the figures, on stderr, as JSON and with the case; what the file names is not said to be assumed."""
    mesh = ball(20.0)
    faces = np.vstack([mesh.faces, [[0, 0, 1], [2, 2, 2]]])
    vertices = np.vstack([mesh.vertices, [[0.0, 0.0, 9.0]]])
    lines = ["# SPACE=RAS", *("v {} {} {}".format(*v) for v in vertices), *("f {} {} {}".format(*f + 1) for f in faces)]
    file = tmp_path / "head.obj"
    file.write_text("\n".join(lines) + "\n")
    assert main(["import", str(file), "--json"]) == 0
    out, err = capsys.readouterr()
    notes = json.loads(out)["notes"]
    expected = (
        "does not name its unit; mm was assumed.",
        "40 x 40 x 40 mm large, which is unusual",
        "2 of 5,122 triangles are without area",
        "1 of 2,563 corners belong to no triangle",
    )
    assert len(notes) == len(expected)
    for note, words in zip(notes, expected, strict=True):
        assert words in note
        assert f"vfix: {note}" in err
    assert main(["case", "show", json.loads(out)["case"], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["notes"] == notes


def test_thickness_of_slices_is_told_and_stored(home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """HAZ-15: and one of several series is chosen on the command line."""
    hu = np.full((24, 48, 48), -1000, dtype=np.int16)
    hu[6:18, 12:36, 12:36] = 1000
    slices = dicom_slices(Volume(hu, np.zeros(3), np.array([1.0, 1.0, 2.0]), np.eye(3)))
    for one in slices:
        one.SliceThickness = 5
    slices[0].SeriesInstanceUID = generate_uid()
    folder = save_dicom(slices, tmp_path / "series")
    assert "--series" in refused(capsys, "import", folder)
    answer = imported(capsys, folder, "--series", 1)
    assert answer["slice_thickness_mm"] == 5.0
    assert any("The CT is coarse" in note for note in answer["notes"])
    store = Store(Settings(home=home))
    cases = CaseService(store)
    volume = cases.volume(cases.get(answer["case"]))
    store.close()
    assert volume is not None
    assert (volume.slice_thickness_mm, len(volume.hu)) == (5.0, 23)


def test_a_rehearsal_takes_a_file_as_an_import_does(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-14: metres and what are no Hounsfield units are refused, what is assumed is said; --units is heard."""
    mesh, plan = tmp_path / "head.stl", tmp_path / "plan.csv"
    ball(0.1).export(mesh)
    plan.write_text("# frame=LPS\n# unit=mm\nlabel,x,y,z\na,500,0,0\nb,520,0,0\n")
    raw = save_nrrd(tmp_path / "raw.nrrd", block(24, 2024), "space: left-posterior-superior\n")
    for case, words in ((mesh, "Its unit is metres"), (raw, "not Hounsfield"), (tmp_path / "gone.stl", "no case")):
        assert words in refused(capsys, "rehearse", "--case", case, "--plan", plan)
    assert main(["rehearse", "--case", str(mesh), "--plan", str(plan), "--units", "m", "--tool", "none"]) == 2
    err = capsys.readouterr().err
    assert "does not name its frame; LPS was assumed" in err
    assert "The path lies outside the head, 400 mm or more away" in err
    assert main(["plan", "import", str(plan), "--case", HEAD_PHANTOM]) == 0
    assert "vfix: The path lies outside the head" in capsys.readouterr().err


def test_a_file_that_is_called_like_a_case_is_no_case(
    phantom_services: Services, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An id is always the case's; a name that is a file's or a folder's too is asked about."""
    monkeypatch.chdir(tmp_path)
    phantom = resolve_case(phantom_services, HEAD_PHANTOM)
    plan = resolve_plan(phantom_services, phantom, SAMPLE_PLAN).plan
    for folder in (HEAD_PHANTOM, phantom.name):
        Path(folder).mkdir()
    for file in (plan.id, plan.name):
        Path(file).write_text("{}")
    assert resolve_case(phantom_services, HEAD_PHANTOM).id == HEAD_PHANTOM
    assert resolve_plan(phantom_services, phantom, plan.id).plan.content.points == plan.content.points
    with pytest.raises(InputError, match=rf"is a case and also a file or folder here.*\./{phantom.name}"):
        resolve_case(phantom_services, phantom.name)
    with pytest.raises(InputError, match="is a plan of this case and also a file"):
        resolve_plan(phantom_services, phantom, plan.name)
    with pytest.raises(InputError, match="no DICOM file"):
        resolve_case(phantom_services, f"./{phantom.name}")
    with pytest.raises(InputError, match="a plan is read from"):
        resolve_plan(phantom_services, phantom, f"./{plan.name}")


def test_wrong_paths_are_refused(tmp_path: Path, service: ImportService) -> None:
    (tmp_path / "notes.docx").write_text("x")
    (tmp_path / "empty").mkdir()
    for path in (tmp_path / "missing.nrrd", tmp_path / "notes.docx", tmp_path / "empty"):
        with pytest.raises(InputError):
            service.run(ImportRequest(path))


def test_a_plain_name_has_sort_number_and_time() -> None:
    """HAZ-32, HAZ-33: numbers go on behind the largest, also where one between is free; other names do not count."""
    now = datetime(2025, 11, 25, 19, 40, 59)
    assert plain_name("CT", (), now) == "CT 1, 25 Nov 19:40"
    taken = ("CT 1, 25 Nov 19:40", "CT 7, 1 Jan 00:00", "CT 9", "CT 8 days after", "MR 30, 2 Feb 10:00", "Doe")
    assert plain_name("CT", taken, now) == "CT 8, 25 Nov 19:40"
    assert plain_name("Surface", taken, now.replace(month=5, day=1, hour=7)) == "Surface 1, 1 May 07:40"


def test_a_description_is_a_name_only_when_that_is_asked_for() -> None:
    """HAZ-32, HAZ-33: an empty one, or one that cannot be a name, gives way to the plain name."""
    agreed, silent = WantedName(None, True, "case"), WantedName(None, False, "case")
    assert agreed.among({"Sinus 0.6"}, "CT", "Sinus 0.6") == ("Sinus 0.6 2", ())
    for description in ("", "  ", "\u202eSinus", "x" * 200):
        name, notes = agreed.among((), "CT", description)
        assert re.fullmatch(f"CT 1, {TIME}", name), description
        assert notes == (NO_DESCRIPTION,)
    name, notes = silent.among((), "CT", "Doe, John")
    assert re.fullmatch(f"CT 1, {TIME}", name)
    assert notes == ()
    assert WantedName(" Nose ", False, "case").among({"Nose"}, "CT", "Doe") == ("Nose", ())
    with pytest.raises(InputError, match="not both"):
        WantedName("Nose", True, "case").check()


def test_the_command_line_names_a_head_by_its_description_when_asked(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-33: series, volume over a head, enhanced or not, and a file without a description."""
    slices = dicom_slices(Volume(block(-1000, 1000), np.zeros(3), np.full(3, 2.0), np.eye(3)))
    for one in slices:
        one.SeriesDescription = "Sinus\t0.6"
    folder = save_dicom(slices, tmp_path / "Doe")
    assert imported(capsys, folder, "--use-description")["name"] == "Sinus 0.6"
    assert imported(capsys, folder, "--use-description")["name"] == "Sinus 0.6 2"
    plain = imported(capsys, folder)
    assert re.fullmatch(f"CT 1, {TIME}", plain["name"])
    over = imported(capsys, folder, "--over", plain["case"], "--use-description")
    assert over["overlay"]["name"] == "Sinus 0.6"
    assert "not both" in refused(capsys, "import", folder, "--use-description", "--name", "Nose")
    file = save_nrrd(tmp_path / "Doe.nrrd", block(-1000, 1000), "space: left-posterior-superior\ncontent: Doe\n")
    assert re.fullmatch(f"CT 2, {TIME}", imported(capsys, file, "--use-description")["name"])
    assert re.fullmatch(f"Volume 1, {TIME}", imported(capsys, file, "--over", plain["case"])["overlay"]["name"])


def test_a_plan_in_metres_and_one_without_a_frame_are_told(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-14: what says mm and is metres is noted; where no option can name the frame, the message says what can."""
    tiny, bare = tmp_path / "tiny.csv", tmp_path / "bare.csv"
    tiny.write_text("# frame=LPS\n# unit=mm\nlabel,x,y,z\na,0.006,-0.011,0.003\nb,0.005,0.046,-0.001\n")
    bare.write_text("# unit=mm\nlabel,x,y,z\na,6,-11,3\nb,5,46,-1\n")
    assert main(["plan", "import", str(tiny), "--case", HEAD_PHANTOM]) == 0
    metres = "The points of the path lie within 0.057 mm, which is no way into a head. Is the file in metres? Check"
    assert metres in capsys.readouterr().err
    mesh = tmp_path / "head.stl"
    ball(100.0).export(mesh)
    message = refused(capsys, "rehearse", "--case", mesh, "--plan", bare)
    assert "does not name its frame" in message
    assert "Write it into the file, or store the plan first: vfix plan import --frame" in message
