"""The folder for 3D Slicer: its scene refers to every file, and libraries of others read the same places from them.

Among them are 3D Slicer's own, which open the scene and write it again.
"""

import importlib.util
import io
import json
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
import SimpleITK
import trimesh
from rest_client import Client

from app.cases.model import HEAD_PHANTOM
from app.cases.service import Case, CaseBead, CaseFrame
from app.cli import main
from app.exchange.markups import from_markups
from app.exchange.slicer import SCENE
from app.exchange.slicer.scene import SceneNode, scene_text
from app.plans.model import Plan, PlanContent, PlanPoint
from app.plans.paths import PlanPath
from app.plans.zones import PlanZone, RemovedBone
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.fit_report import refitted
from app.services import Services
from app.store.errors import StorageError
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.registration.transform_files import read_transform, tfm_comments

# A rigid transform that is neither symmetric nor its own inverse.
TURN = np.array([[0.0, -1.0, 0.0, 5.5], [0.0, 0.0, -1.0, -7.25], [1.0, 0.0, 0.0, 1 / 3], [0.0, 0.0, 0.0, 1.0]])
POINTS = (
    PlanPoint("a", "entry <&\"'>", (-29.512345678901, 1 / 3, -14.0), (0.6, 0.0, -0.8)),
    PlanPoint("b", "end", (1.5, -2.25, 7.0)),
)
READER = Path(__file__).resolve().parents[3] / "scripts" / "pictures" / "slicer_scene.py"
TO_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
SPHERE = {"kind": "sphere", "centre": [1.0, 2.0, 3.0], "radius": 2.0}
PLANE = {"kind": "half_space", "point": [3.0, -4.0, 5.0], "normal": [1.0, 2.0, -2.0]}
BOX = {"kind": "box", "transform_box_to_patient": TURN.ravel().tolist(), "half_size": [1.0, 2.0, 3.0]}


def a_volume() -> Volume:
    """Oblique and left-handed, so that no axis can be taken for another."""
    hu = np.random.default_rng(5).integers(-1000, 3000, (4, 5, 6)).astype(np.int16)
    direction = np.array([[0.0, -0.6, 0.8], [-1.0, 0.0, 0.0], [0.0, -0.8, -0.6]])
    return Volume(hu, np.array([1 / 3, -70.0, 12.5]), np.array([0.4, 0.5, 1.25]), direction, window=(1500.0, 300.0))


def touched() -> tuple[FiducialPair, ...]:
    """Four points touched by the simulated pointer, some tenths of a millimetre off, and one that is left out."""
    image = np.array([(0.0, 0.0, 0.0), (50.0, 1.0, 2.0), (3.0, 60.0, 4.0), (-5.0, 6.0, 40.0), (9.0, 9.0, 9.0)])
    there = image @ TURN[:3, :3].T + TURN[:3, 3] + np.random.default_rng(3).normal(0.0, 0.2, image.shape)
    return tuple(
        FiducialPair(f"F{n + 1}", tuple(a), tuple(b), f"p-{n}", n < 4, measured_from="simulated")
        for n, (a, b) in enumerate(zip(image.tolist(), there.tolist(), strict=True))
    )


@pytest.fixture(scope="module")
def head(phantom_services: Services) -> Case:
    corners = np.array([[0.1, 0, 0], [10, 0, 1 / 3], [0, 10, 0], [0, 0, 10]])
    mesh = TriangleMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    made = phantom_services.cases.create(
        "Head", frame=CaseFrame("LPS", False), surfaces={"bone": mesh}, volume=a_volume(),
        beads=(CaseBead("marker", (9.0, 8.0, 1 / 7)),),
    )  # fmt: skip
    content = RegistrationContent("patient", tuple(TURN.ravel().tolist()), made_from="given")
    phantom_services.registrations.create(made.id, "Left/right: ü", content)
    phantom_services.registrations.create(made.id, "Not made yet", RegistrationContent())
    phantom_services.registrations.create(made.id, "Touched", refitted(RegistrationContent(pairs=touched())))
    return made


@pytest.fixture(scope="module")
def plan(phantom_services: Services, head: Case) -> Plan:
    content = PlanContent(
        paths=(PlanPath(points=POINTS),),
        targets=(PlanPoint("t", "ostium", (1.0, 2.0, 3.125)),),
        zones=(PlanZone("z-1", "Eye", SPHERE), PlanZone("z-2", "Skull base", PLANE, visible=False)),
        removed_bone=(RemovedBone("r-1", "Window", BOX),),
    )
    touched_id = next(one.id for one in phantom_services.registrations.titles(head.id) if one.name == "Touched")
    content = replace(content, registration=touched_id)
    other = PlanPath("other", "Path 2", (PlanPoint("o", "", (4.0, 5.0, 6.0)), PlanPoint("p", "", (7.0, 8.0, 9.0))))
    return phantom_services.plans.create(head.id, "Way", replace(content, paths=(*content.paths, other)))


@pytest.fixture(scope="module")
def folder(phantom_services: Services, plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("slicer") / "out"
    names = phantom_services.slicer.write(plan, made)
    assert {path.name for path in made.iterdir()} == set(names)
    return made


@pytest.fixture(scope="module")
def in_slicer(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """What 3D Slicer has in its scene, by name, and the folder of the files that it writes of it."""
    if importlib.util.find_spec("slicer") is None:
        pytest.skip("slicer-core is not published for this platform")
    saved = tmp_path_factory.mktemp("saved")
    command = [sys.executable, str(READER), str(folder / SCENE), "--save", str(saved)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), saved


def elements(folder: Path) -> list[ET.Element]:
    return list(ET.parse(folder / SCENE).getroot())


def files(folder: Path) -> dict[str, Path]:
    """File of each node by the node's name, through the references that Slicer follows."""
    known = {one.attrib["id"]: one for one in elements(folder)}
    found = {}
    for one in elements(folder):
        references = dict(part.split(":") for part in one.attrib.get("references", "").split(";") if part)
        if "storage" in references:
            found[one.attrib["name"]] = folder / unquote(known[references["storage"]].attrib["fileName"])
    return found


def markup(path: Path) -> dict[str, Any]:
    data = json.loads(path.read_text(encoding="utf-8"))
    assert "markups-schema-v1.0.3" in data["@schema"]
    (one,) = data["markups"]
    assert (one["coordinateSystem"], one["coordinateUnits"]) == ("LPS", "mm")
    return dict(one)


def places(path: Path) -> Any:
    return np.array([point["position"] for point in markup(path)["controlPoints"]])


def test_every_reference_of_the_scene_is_there_and_every_file_is_referred_to(folder: Path) -> None:
    found = elements(folder)
    ids = [one.attrib["id"] for one in found]
    assert len(set(ids)) == len(ids)
    for one in found:
        for reference in filter(None, one.attrib.get("references", "").split(";")):
            assert reference.split(":")[1] in ids
    named = {unquote(one.attrib["fileName"]) for one in found if "fileName" in one.attrib}
    assert named | {SCENE} == {path.name for path in folder.iterdir()}
    assert not any("/" in name or ".." in name for name in named)
    assert {one.attrib["coordinateSystem"] for one in found if one.tag == "ModelStorage"} == {"LPS"}


def test_names_and_colours_are_the_plans(folder: Path) -> None:
    by_name = {one.attrib["name"]: one for one in elements(folder)}
    assert {
        "Way",
        "Way targets",
        "Path 2",
        "Eye",
        "Skull base",
        "Window",
        "Beads",
        "Bone",
        "ct",
        "Left/right: ü",
    } <= set(by_name)
    assert by_name["Skull base"].tag == "MarkupsPlane"
    shown = [one for one in elements(folder) if one.tag == "MarkupsPlaneDisplay"]
    assert [one.attrib["visibility"] for one in shown] == ["false"]
    assert {one.attrib["backgroundVolumeID"] for one in elements(folder) if one.tag == "SliceComposite"} == {
        by_name["ct"].attrib["id"]
    }


def test_marks_are_where_the_plan_has_them(folder: Path) -> None:
    found = files(folder)
    np.testing.assert_allclose(places(found["Way"]), [point.position for point in POINTS], rtol=0, atol=1e-9)
    np.testing.assert_allclose(places(found["Way targets"]), [[1.0, 2.0, 3.125]], rtol=0, atol=1e-9)
    np.testing.assert_allclose(places(found["Path 2"]), [[4, 5, 6], [7, 8, 9]], rtol=0, atol=1e-9)
    np.testing.assert_allclose(places(found["Beads"]), [[9.0, 8.0, 1 / 7]], rtol=0, atol=1e-9)
    start, end = places(found["Shaft at entry <&\"'>"])
    np.testing.assert_allclose((end - start) / 50.0, POINTS[0].direction, rtol=0, atol=1e-9)
    assert [point["label"] for point in markup(found["Way"])["controlPoints"]] == ["entry <&\"'>", "end"]


def test_a_plane_has_its_normal_where_slicer_reads_it(folder: Path) -> None:
    """Slicer negates the first two rows of both matrices and takes the plane's axes from their product."""
    plane = markup(files(folder)["Skull base"])
    flip = np.diag([-1.0, -1.0, 1.0, 1.0])
    object_to_base = flip @ np.reshape(plane["objectToBase"], (4, 4))
    base_to_ras = flip @ np.reshape(plane["baseToNode"], (4, 4))
    in_lps = flip @ base_to_ras @ object_to_base
    np.testing.assert_allclose(in_lps[:3, 2], np.array([1.0, 2.0, -2.0]) / 3.0, atol=1e-12)
    np.testing.assert_allclose(in_lps[:3, 3], PLANE["point"], atol=1e-12)
    np.testing.assert_allclose(in_lps[:3, :3].T @ in_lps[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(in_lps[:3, :3]) == pytest.approx(1.0)


def test_a_box_keeps_its_axes(folder: Path) -> None:
    roi = markup(files(folder)["Window"])
    np.testing.assert_allclose(np.reshape(roi["orientation"], (3, 3)), TURN[:3, :3], atol=1e-12)
    np.testing.assert_allclose(roi["center"], TURN[:3, 3], atol=1e-12)
    assert roi["size"] == [2.0, 4.0, 6.0]


def test_simpleitk_reads_the_volume(folder: Path) -> None:
    image, volume = SimpleITK.ReadImage(str(files(folder)["ct"])), a_volume()
    np.testing.assert_array_equal(SimpleITK.GetArrayFromImage(image), volume.hu)
    for index in ((0, 0, 0), (5, 4, 3), (2, 3, 1)):
        there = image.TransformIndexToPhysicalPoint(index)
        np.testing.assert_allclose(there, volume.index_to_lps(index), rtol=0, atol=1e-6)


def test_trimesh_reads_the_surface(folder: Path, phantom_services: Services, head: Case) -> None:
    path = files(folder)["Bone"]
    mesh, own = trimesh.load(path, process=False), phantom_services.cases.case_surface(head.id)
    assert b"comment SPACE=LPS" in path.read_bytes()[:200]
    np.testing.assert_allclose(np.asarray(mesh.vertices), own.vertices, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(np.asarray(mesh.faces), own.faces)


def test_itk_reads_the_registration_as_the_way_back(folder: Path) -> None:
    transform = SimpleITK.ReadTransform(str(files(folder)["Left/right: ü"]))
    for place in POINTS:
        on_patient = TURN[:3, :3] @ place.position + TURN[:3, 3]
        np.testing.assert_allclose(transform.TransformPoint(on_patient.tolist()), place.position, rtol=0, atol=1e-6)


IN_USE = "Touched (simulated, used by the plan)"


def test_a_transform_says_what_it_is_and_which_one_the_plan_goes_by(folder: Path) -> None:
    words = {one.attrib["name"]: one.attrib["description"] for one in elements(folder) if "description" in one.attrib}
    for part in (
        "From the image to the patient.", "Four points are fitted. FRE 0.", "not the target error",
        "Simulated: nothing here is of a real patient", "The plan goes by this registration.", "in 95 % of cases",
        "Measured by a simulated pointer",
    ):  # fmt: skip
        assert part in words[IN_USE]
    assert "Not marked as simulated. The plan does not go by it." in words["Left/right: ü"]
    file = files(folder)[IN_USE]
    comments = dict(tfm_comments(file.read_text("utf-8")))
    assert comments["simulated"] == "yes, nothing here is of a real patient"
    assert {"notice", "name", "registration", "parameters", "fre_mm", "points", "error_of_a_point_mm"} <= set(comments)


def test_the_points_of_a_registration_stand_in_both_frames(folder: Path) -> None:
    pairs, found = touched()[:4], files(folder)
    image, there = f"{IN_USE}: in the image", f"{IN_USE}: measured, in the frame of the patient"
    np.testing.assert_allclose(places(found[image]), [pair.in_image for pair in pairs], rtol=0, atol=1e-9)
    np.testing.assert_allclose(places(found[there]), [pair.measured for pair in pairs], rtol=0, atol=1e-9)
    for name in (image, there):
        assert [point["label"] for point in markup(found[name])["controlPoints"]] == ["F1", "F2", "F3", "F4"]
        assert "Simulated: nothing here is of a real patient" in markup(found[name])["description"]
    assert "not of the image" in markup(found[there])["description"]


def test_slicer_fits_the_points_to_what_the_transform_says(in_slicer: tuple[dict[str, Any], Path]) -> None:
    """The rigid fit of both lists as Slicer has them, which its Fiducial Registration Wizard makes."""
    nodes, _ = in_slicer
    lists = [nodes[f"{IN_USE}: {what}"] for what in ("in the image", "measured, in the frame of the patient")]
    assert not any(one["visible"] for one in lists)
    source, target = (np.array(one["places"]) for one in lists)
    away, there = source - source.mean(0), target - target.mean(0)
    u, _, vt = np.linalg.svd(away.T @ there)
    turn = (u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt).T
    fitted = np.eye(4)
    fitted[:3, :3], fitted[:3, 3] = turn, target.mean(0) - turn @ source.mean(0)
    np.testing.assert_allclose(nodes[IN_USE]["to_world"], fitted, rtol=0, atol=1e-6)
    assert "Simulated: nothing here is of a real patient" in nodes[IN_USE]["description"]


def test_slicer_has_the_points_where_the_plan_has_them(in_slicer: tuple[dict[str, Any], Path]) -> None:
    nodes, _ = in_slicer
    for name, there in (
        ("Way", [point.position for point in POINTS]),
        ("Way targets", [(1.0, 2.0, 3.125)]),
        ("Path 2", [(4.0, 5.0, 6.0), (7.0, 8.0, 9.0)]),
        ("Beads", [(9.0, 8.0, 1 / 7)]),
    ):
        np.testing.assert_allclose(nodes[name]["places"], np.array(there) @ TO_RAS[:3, :3], rtol=0, atol=1e-9)
    assert nodes["Way"]["labels"] == ["entry <&\"'>", "end"]
    assert nodes["Way"]["visible"]
    assert not nodes["Path 2"]["visible"]


def test_slicer_has_the_regions_where_the_plan_has_them(in_slicer: tuple[dict[str, Any], Path]) -> None:
    nodes, _ = in_slicer
    plane, box, ball = nodes["Skull base"], nodes["Window"], nodes["Eye surface"]
    np.testing.assert_allclose(plane["origin"], TO_RAS[:3, :3] @ PLANE["point"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(plane["normal"], TO_RAS[:3, :3] @ PLANE["normal"] / 3.0, rtol=0, atol=1e-9)
    assert not plane["visible"]
    np.testing.assert_allclose(box["size"], [2.0, 4.0, 6.0], rtol=0, atol=1e-9)
    axes = np.array(box["axes"])  # where the box's own axes point, to either side
    np.testing.assert_allclose(axes[:3, 3], (TO_RAS @ TURN)[:3, 3], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.abs(axes[:3, :3]), np.abs(TURN[:3, :3]), rtol=0, atol=1e-9)
    centre = TO_RAS[:3, :3] @ SPHERE["centre"]
    away = np.linalg.norm(np.array(ball["points"]) - centre, axis=1)
    np.testing.assert_allclose(away, SPHERE["radius"], rtol=0, atol=1e-5)  # Slicer's surfaces are of single precision


def test_slicer_has_the_head_where_the_case_has_it(in_slicer: tuple[dict[str, Any], Path]) -> None:
    nodes, _ = in_slicer
    volume, ct = a_volume(), nodes["ct"]
    assert ct["size"] == [6, 5, 4]
    assert ct["hu"] == [volume.hu[0, 0, 0], volume.hu[3, 2, 1]]
    there = np.array(ct["ijk_to_ras"]) @ [1.0, 2.0, 3.0, 1.0]
    np.testing.assert_allclose(there[:3], TO_RAS[:3, :3] @ volume.index_to_lps((1, 2, 3)), rtol=0, atol=1e-9)
    corners = np.array([[0.1, 0, 0], [10, 0, 1 / 3], [0, 10, 0], [0, 0, 10]])
    np.testing.assert_allclose(nodes["Bone"]["points"], corners @ TO_RAS[:3, :3], rtol=0, atol=1e-5)
    assert nodes["Bone"]["triangles"] == 4


def test_slicer_moves_the_image_onto_the_patient(in_slicer: tuple[dict[str, Any], Path]) -> None:
    nodes, _ = in_slicer
    np.testing.assert_allclose(nodes["Left/right: ü"]["to_world"], TO_RAS @ TURN @ TO_RAS, rtol=0, atol=1e-9)


def test_what_slicer_writes_comes_back_as_it_was(in_slicer: tuple[dict[str, Any], Path], folder: Path) -> None:
    """A path through 3D Slicer's own file, in the frame that it chooses, and a registration through its transform."""
    _, saved = in_slicer
    path = (saved / files(folder)["Way"].name).read_text("utf-8")
    assert [(point.label, point.position) for point in from_markups(path).content.points] == [
        (point.label, pytest.approx(point.position, abs=1e-6)) for point in POINTS
    ]
    transform = read_transform(saved / files(folder)["Left/right: ü"].name)
    np.testing.assert_allclose(transform, TURN, rtol=0, atol=1e-6)


def test_a_folder_that_holds_something_is_left_alone(phantom_services: Services, plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="not an empty folder"):
        phantom_services.slicer.write(plan, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_nothing_is_left_of_an_export_that_fails(
    phantom_services: Services, plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.exchange.slicer.export.write_ply", full)
    with pytest.raises(StorageError, match="No space left"):
        phantom_services.slicer.write(plan, tmp_path / "deep" / "out")
    assert list((tmp_path / "deep").iterdir()) == []


def test_names_that_look_alike_get_files_of_their_own() -> None:
    nodes = [SceneNode("Model", name, "x.ply") for name in ("A", "B")]
    root = ET.fromstring(scene_text(nodes))
    assert [one.attrib["id"] for one in root if one.tag == "Model"] == ["vtkMRMLModelNode1", "vtkMRMLModelNode2"]


def test_the_command_line_writes_the_sample(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    assert main(["plan", "export-slicer", "head-phantom-sample", str(tmp_path / "out"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["files"][0] == SCENE
    assert {path.name for path in (tmp_path / "out").iterdir()} == set(answer["files"])
    driven = [one for one in elements(tmp_path / "out") if one.tag == "MarkupsCurve"]
    assert len(driven) == 2  # the path as planned and as driven


def test_two_plans_of_one_name_are_told_by_their_ids(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, phantom_services: Services, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(phantom_services.settings.home))
    made = [phantom_services.plans.create(HEAD_PHANTOM, "Twice").id for _ in range(2)]
    assert main(["plan", "export-slicer", "Twice", str(tmp_path / "out"), "--json"]) == 2
    assert f"name it by its id: {', '.join(made)}." in json.loads(capsys.readouterr().out)["error"]["message"]
    for plan_id in made:
        phantom_services.plans.documents.delete(plan_id)


def test_rest_sends_the_folder_as_a_zip_and_leaves_nothing(
    client: Client, phantom_services: Services, plan: Plan, folder: Path
) -> None:
    """HAZ-34: what holds images is asked about."""
    before = list(phantom_services.store.scratch.open().iterdir())
    refused = client.get(f"/api/v1/plans/{plan.id}/export/slicer")
    assert (refused.status_code, "with_images=true" in refused.text) == (422, True)  # HAZ-34
    answer = client.get(f"/api/v1/plans/{plan.id}/export/slicer?with_images=true")
    assert answer.status_code == 200
    with zipfile.ZipFile(io.BytesIO(answer.content)) as packed:
        sent = {name.removeprefix("Way/"): packed.read(name) for name in packed.namelist() if not name.endswith("/")}
    assert sent == {path.name: path.read_bytes() for path in folder.iterdir()}
    assert list(phantom_services.store.scratch.open().iterdir()) == before


def test_a_stored_name_that_xml_cannot_hold_spoils_no_scene() -> None:
    text = scene_text([SceneNode("Model", "optic \uffff\ufffe\x01 nerve \U0001f600", "x.ply")])
    model = ET.fromstring(text).find("Model")
    assert model is not None
    assert model.attrib["name"] == "optic \ufffd\ufffd\ufffd nerve \U0001f600"


def test_a_folder_that_nobody_can_make_is_told_in_words(phantom_services: Services, tmp_path: Path) -> None:
    plan = phantom_services.plans.list(HEAD_PHANTOM)[0]
    with pytest.raises(InputError, match="cannot be a folder"):
        phantom_services.slicer.write(plan, tmp_path / ("n" * 300))
    with pytest.raises(InputError, match=r"^/ is there already"):
        phantom_services.slicer.write(plan, Path("/"))
