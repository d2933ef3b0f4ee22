"""Protected structures act: they move a clicked point, end dry run and drive alike, and are measured by coal."""

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from rest_client import Client, opened_client
from scipy.spatial import cKDTree

from app.cases.service import CaseFrame
from app.cli import main
from app.commands.plan_evaluate import as_json
from app.exchange.plan_files import export_text, read_plan
from app.planning.protected_structures import engine_zones, within_margin
from app.plans.document import PLAN
from app.plans.model import PlanContent, PlanPoint
from app.plans.paths import PlanPath
from app.plans.service import Plan
from app.plans.zones import PlanZone, RemovedBone
from app.services import Services, build_services
from app.settings import Settings
from app.tabs.rehearse.preparation import prepare
from tests.engine.scenes import CoalJudge, curved_tube
from vfix_engine.errors import PlanError
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Sphere
from vfix_engine.virtual_fixtures import SoftRegion, SoftZone
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

ACROSS = {"kind": "sphere", "centre": [0.0, 30.0, 3.8], "radius": 4.0}
BESIDE = {"kind": "capsules", "points": [[-8.0, 30.0, 8.0], [0.0, 30.0, 8.5], [8.0, 30.0, 8.0]], "radius": 1.5}
EYE = np.eye(4).ravel().tolist()
MESH, POINTS = curved_tube()


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Services]:
    """Services with a curved tube as a head."""
    made = build_services(Settings(home=tmp_path_factory.mktemp("tube"), port=0))
    yield made
    made.close()


@pytest.fixture(scope="module")
def tube(services: Services) -> str:
    return services.cases.create("Tube", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": MESH}).id


PATCH = {"kind": "patch", "centre": POINTS[2].tolist(), "radius": 20.0}


def content(*zones: PlanZone) -> PlanContent:
    points = tuple(PlanPoint(f"p-{n}", f"P{n}", (x, y, z)) for n, (x, y, z) in enumerate(POINTS[:4].tolist()))
    return PlanContent(paths=(PlanPath(points=points),), zones=zones)


def zone(shape: dict[str, Any], name: str = "optic nerve", margin_mm: float = 0.8, **fields: Any) -> PlanZone:
    return PlanZone("z", name, shape, margin_mm, **fields)


def drive(services: Services, plan: Plan) -> tuple[list[RigidSnapshot], RigidSnapshot]:
    """Every pose of the scripted hand in the scene that the control process gets, and the last one."""
    poses: list[RigidSnapshot] = []
    prepared = prepare(services, plan)
    last = HeadlessRun(Rehearsal(prepared.spec.scene.build(), prepared.settings), poses.append).follow()
    return poses, last


def test_dry_run_and_drive_end_at_the_same_sphere_with_its_name(services: Services, tube: str) -> None:
    plan = services.plans.create(tube, "Across", content(zone(ACROSS)))
    found = services.planning.evaluate(plan)
    assert not found.completed
    assert found.reason == "protected structure 'optic nerve' on the tip, 0.8 mm away"
    poses, last = drive(services, plan)
    assert last.reason == found.reason
    assert last.progress_mm == pytest.approx(found.reached_mm, abs=1.0)
    ball = trimesh.creation.icosphere(subdivisions=4, radius=4.0)
    ball.apply_translation(ACROSS["centre"])
    judge = CoalJudge(TriangleMesh(ball.vertices, ball.faces))
    radius = poses[0].capsules[:, 6]
    least = min(judge.clearance(Segments(one.segments_start, one.segments_end, radius)) for one in poses)
    assert 0.8 <= least < 0.85  # a mesh lies within its ball: it can only be farther away
    free = services.plans.create(tube, "Free", content())
    assert services.planning.evaluate(free).completed


def test_a_patch_of_the_bone_keeps_a_margin_of_its_own(services: Services, tube: str) -> None:
    """The patch's margin is larger than the bone's; coal measures the patch alone. Without it the tool comes nearer."""
    at = MESH.vertices[(np.linalg.norm(MESH.vertices - POINTS[2], axis=1)).argmin()]
    patch = zone({"kind": "patch", "centre": at.tolist(), "radius": 6.0}, "carotid", 3.5)
    near = np.linalg.norm(MESH.triangles - at, axis=2).min(axis=1) <= 6.0
    judge = CoalJudge(TriangleMesh(MESH.vertices, MESH.faces[near]))

    def least(*zones: PlanZone) -> float:
        poses, _ = drive(services, services.plans.create(tube, "Patch", content(*zones)))
        radius = poses[0].capsules[:, 6]
        return min(judge.clearance(Segments(one.segments_start, one.segments_end, radius)) for one in poses)

    assert least(patch) >= 3.5 > least()


def test_a_soft_structure_pushes_back_and_its_depth_is_a_bound(services: Services, tube: str) -> None:
    soft = zone(BESIDE, "turbinate", 3.0, kind="soft", stiffness_n_per_mm=0.3, max_depth_mm=1.0)
    found = services.planning.evaluate(services.plans.create(tube, "Soft", content(soft)))
    assert [one.name for one in found.zones.soft_zones] == ["turbinate (1 of 2)", "turbinate (2 of 2)"]
    assert [(one.name, one.margin_mm) for one in found.zones.zones] == [
        ("turbinate (1 of 2), 1 mm deep", 2.0),
        ("turbinate (2 of 2), 1 mm deep", 2.0),
    ]
    assert found.completed
    hard = services.plans.create(tube, "Hard", content(zone(BESIDE, "turbinate", 8.0)))
    assert "'turbinate (" in services.planning.evaluate(hard).reason


def test_the_verdict_names_the_soft_structure_that_the_tool_goes_into(services: Services, tube: str) -> None:
    soft = zone(BESIDE, "turbinate", 3.0, kind="soft", stiffness_n_per_mm=0.3)
    away = zone({"kind": "sphere", "centre": [90.0, 90.0, 90.0], "radius": 4.0}, "far", 1.0, kind="soft")
    plan = services.plans.create(tube, "Into", content(soft, PlanZone(**{**vars(away), "id": "y"})))
    verdict = services.planning.evaluate(plan).verdict
    (one,) = verdict.soft
    assert one.name == "turbinate"
    assert f" Goes {one.depth_mm:.1f} mm deep into turbinate (at {one.s_mm:.0f} mm)." in verdict.words
    told = json.loads(json.dumps(as_json(services.path_evaluations.of_plan(plan))))
    assert told["soft_structures"] == [{"name": "turbinate", "depth_mm": one.depth_mm, "s_mm": one.s_mm}]
    poses, _ = drive(services, plan)
    radius, depth = poses[0].capsules[:, 6], 0.0
    links = [CapsuleShape(a, b, 1.5) for a, b in pairwise(BESIDE["points"])]
    for pose in poses:
        for start, end, r in zip(pose.segments_start, pose.segments_end, radius, strict=True):
            points = start + np.linspace(0.0, 1.0, 1500)[:, None] * (end - start)
            depth = max(depth, *(3.0 + r - signed_distance(link, points).min() for link in links))
    assert one.depth_mm == pytest.approx(depth, abs=0.1)


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"shape": {"kind": "structure", "structure": "bone"}}, "all of the bone is protected already"),
        (
            {"shape": {"kind": "patch", "centre": [900.0, 0.0, 0.0], "radius": 5.0}},
            "no part of the surface is within 5 mm",
        ),
        ({"shape": PATCH, "kind": "soft", "margin_mm": 1.0, "max_depth_mm": 3.0}, "a surface has no inside"),
        ({"shape": {"kind": "structure", "structure": "bone"}, "kind": "soft", "max_depth_mm": 0.5}, "all of the bone"),
        (
            {"shape": {"kind": "box", "transform_box_to_patient": EYE, "half_size": [0, 0, 0]}},
            "half of a box's size is 0 mm",
        ),
        ({"shape": {"centre": [0.0, 0.0, 0.0], "radius": 3.0}}, "places and sizes in mm; known are sphere"),
        (
            {"shape": {"kind": "box", "transform_box_to_patient": [2.0, *EYE[1:]], "half_size": [1, 1, 1]}},
            "give a rotation without scale or mirror in the first three columns",
        ),
    ],
)
def test_a_structure_that_no_drive_could_keep_is_refused_at_once(
    rest: Client, services: Services, tube: str, wish: dict[str, Any], words: str
) -> None:
    plan = services.plans.create(tube, "Never kept", content())
    answer = rest.post(f"/api/v1/plans/{plan.id}/zones", json=wish)
    assert answer.status_code == 422, answer.text
    assert words in answer.json()["error"]["message"]
    patch = {"shape": PATCH, "kind": "soft", "margin_mm": 1.0, "max_depth_mm": 1.0, "name": "lining"}
    added = rest.post(f"/api/v1/plans/{plan.id}/zones", json=patch)
    assert added.status_code == 201, added.text
    zone_id = services.plans.get(plan.id).content.zones[0].id
    deeper = rest.patch(f"/api/v1/plans/{plan.id}/zones/{zone_id}", json={"max_depth_mm": 2.0})
    assert deeper.status_code == 422
    assert "'lining' cannot be kept" in deeper.json()["error"]["message"]
    assert rest.patch(f"/api/v1/plans/{plan.id}/zones/{zone_id}", json={"kind": "hard"}).status_code == 200


def test_a_click_goes_clear_of_what_is_spared(services: Services, tube: str) -> None:
    plan = services.plans.create(tube, "Snap", content(zone(ACROSS)))
    case = services.cases.get(tube)
    free = services.planning.snap(case, POINTS[2])
    assert free.moved_mm == 0.0
    moved = services.planning.snap(case, POINTS[2], plan)
    zones = services.planning.zones(plan).zones
    assert not within_margin(zones, np.array([moved.position]), 1.0).any()
    assert moved.reason == f"moved {moved.moved_mm:.1f} mm, clear of bone and protected structures"


def test_a_structure_that_is_not_there_is_named(services: Services, tube: str) -> None:
    plan = services.plans.create(tube, "Gone", content(zone({"kind": "structure", "structure": "ica"}, "carotid")))
    with pytest.raises(PlanError, match=r"protected structure 'carotid' cannot be kept: .*'ica'"):
        services.planning.evaluate(plan)
    bone = services.plans.create(tube, "Bone", content(zone({"kind": "structure", "structure": "bone"}, "skull")))
    with pytest.raises(PlanError, match="as a patch"):
        services.planning.evaluate(bone)


def test_a_greatest_depth_is_a_core(services: Services) -> None:
    def nothing(structure_id: str) -> TriangleMesh:
        raise AssertionError(structure_id)

    def core(shape: dict[str, Any], margin: float, depth: float) -> Any:
        one = zone(shape, "soft", margin, kind="soft", stiffness_n_per_mm=0.5, max_depth_mm=depth)
        found = engine_zones([one], nothing).zones
        return found[0].solid if found else None

    eye = [float(i % 5 == 0) for i in range(16)]
    assert core(ACROSS, 1.0, 3.0).radius == pytest.approx(2.0)
    assert core(ACROSS, 1.0, 5.0) is None
    box = {"kind": "box", "transform_box_to_patient": eye, "half_size": [3.0, 4.0, 5.0]}
    assert core(box, 0.5, 2.0).half_size.tolist() == [1.5, 2.5, 3.5]
    plane = {"kind": "half_space", "point": [0.0, 0.0, 1.0], "normal": [0.0, 0.0, -2.0]}
    assert core(plane, 0.0, 2.0).point.tolist() == [0.0, 0.0, 3.0]
    lining = {"kind": "patch", "centre": [0.0, 0.0, 0.0], "radius": 30.0}
    patch = zone(lining, "lining", 1.0, kind="soft", stiffness_n_per_mm=0.5, max_depth_mm=2.0)
    with pytest.raises(PlanError, match="no inside"):
        engine_zones([patch], lambda structure_id: MESH)


def test_a_soft_structure_with_a_closed_surface_is_soft_within() -> None:
    """Its depth may be more than its layer; an open surface has no inside."""
    made = trimesh.creation.icosphere(subdivisions=3, radius=6.0)
    whole = TriangleMesh(np.asarray(made.vertices), np.asarray(made.faces))

    def kept(depth: float | None, mesh: TriangleMesh = whole, margin: float = 1.0) -> ZoneSet:
        shape = {"kind": "structure", "structure": "gland"}
        one = zone(shape, "gland", margin, kind="soft", stiffness_n_per_mm=0.4, max_depth_mm=depth)
        return engine_zones([one], lambda structure_id: mesh)

    found = kept(4.0)
    assert found.zones == ()
    (region,) = found.soft_zones
    assert isinstance(region, SoftRegion)
    assert (region.max_depth_mm, region.layer_mm, region.stiffness_n_per_mm) == (4.0, 1.0, 0.4)
    assert region.field.at([[0.0, 0.0, 3.0], [0.0, 9.0, 0.0]]) == pytest.approx([-3.0, 3.0], abs=0.15)
    assert isinstance(kept(None).soft_zones[0], SoftRegion)
    shallow = kept(0.6)  # within the layer: kept exactly, from the surface
    assert [(core.name, core.margin_mm) for core in shallow.zones] == [("gland, 0.6 mm deep", 0.4)]
    with pytest.raises(PlanError, match=r"'gland' cannot be kept: .*more than 0\.65 mm"):
        kept(0.3, margin=0.2)
    open_one = TriangleMesh(whole.vertices, whole.faces[:-3])
    assert isinstance(kept(0.6, open_one).soft_zones[0], SoftZone)
    with pytest.raises(PlanError, match="no inside"):
        kept(4.0, open_one)


@pytest.mark.parametrize(
    ("shape", "surface"),
    [
        (Sphere((1, 2, 3), 4.0), trimesh.creation.icosphere(subdivisions=5, radius=4.0)),
        (CapsuleShape((1, 2, 0), (1, 2, 6), 2.0), trimesh.creation.capsule(6.0, 2.0, count=[96, 96])),
        (Box(np.eye(4) + np.array([[0, 0, 0, 1], [0, 0, 0, 2], [0, 0, 0, 3], [0, 0, 0, 0]]), (1, 2, 3)),
         trimesh.creation.box((2, 4, 6))),
    ],
)  # fmt: skip
def test_distances_from_shapes_are_those_from_their_surfaces(shape: Any, surface: trimesh.Trimesh) -> None:
    surface.apply_translation(np.array([1.0, 2.0, 3.0]) - surface.bounds.mean(axis=0))
    places = np.random.default_rng(4).uniform(-6, 9, (200, 3))
    samples = trimesh.sample.sample_surface(surface, 400_000, seed=4)[0]
    found = signed_distance(shape, places)
    np.testing.assert_allclose(np.abs(found), cKDTree(samples).query(places)[0], atol=0.05)
    clear = np.abs(found) > 0.05
    np.testing.assert_array_equal(surface.contains(places[clear]), found[clear] < 0.0)


def test_the_distance_from_a_half_space_is_along_its_normal() -> None:
    plane = HalfSpace((0, 0, 2), (0, 0, -3))
    assert signed_distance(plane, [[5, 5, 0], [1, 1, 5]]).tolist() == [2.0, -3.0]


EVERY = content(
    zone(ACROSS, "eye"),
    PlanZone("z2", "nerve", BESIDE, 1.0, "soft", 0.4, 0.5),
    PlanZone("z3", "plane", {"kind": "half_space", "point": [0.0, 0.0, 40.0], "normal": [0.0, 0.0, -1.0]}),
    PlanZone("z4", "label", {"kind": "structure", "structure": "ica"}),
)


def test_slicer_gets_the_regions_and_the_plan_comes_back_without_them() -> None:
    turned = trimesh.transformations.rotation_matrix(0.5, [0, 0, 1], [1, 2, 3])
    box = {"kind": "box", "transform_box_to_patient": turned.ravel().tolist(), "half_size": [1.0, 2.0, 3.0]}
    whole = replace(EVERY, removed_bone=(RemovedBone("b", "septum", box),))
    plan = PLAN.draft("case-1", "ab" * 32, "Every", whole)
    text = export_text(plan, "mrk.json")
    nodes = [node for node in json.loads(text)["markups"] if node["type"] not in ("Curve", "Fiducial")]
    assert [(node["type"], node["name"]) for node in nodes] == [
        ("Line", "eye"), ("Line", "nerve"), ("Line", "nerve"), ("Line", "plane"), ("ROI", "septum"),
    ]  # fmt: skip
    assert "hard, margin 0.8 mm. Sphere, radius 4 mm" in nodes[0]["description"]
    assert "soft, 0.4 N/mm, 0.5 mm deep at most, margin 1 mm" in nodes[1]["description"]
    roi = nodes[-1]
    assert (roi["center"], roi["size"]) == (turned[:3, 3].tolist(), [2.0, 4.0, 6.0])
    assert np.reshape(roi["orientation"], (3, 3)) == pytest.approx(turned[:3, :3])
    read = read_plan("x.mrk.json", text.encode()).content
    assert [point.position for point in read.points] == [point.position for point in EVERY.points]
    assert read.targets == ()


def test_the_command_line_keeps_the_zones_of_a_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    trimesh.Trimesh(MESH.vertices, MESH.faces, process=False).export(tmp_path / "tube.ply")
    plan = PLAN.draft("case-1", "", "Across", content(zone(ACROSS)))
    (tmp_path / "plan.json").write_text(export_text(plan, "json"))
    command = ["rehearse", "--case", str(tmp_path / "tube.ply"), "--plan", str(tmp_path / "plan.json"), "--json"]
    assert main(command) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["reason"] == "protected structure 'optic nerve' on the tip, 0.8 mm away"
    assert report["zones"][0]["min_distance_mm"] >= 0.8
    ball = {"kind": "sphere", "centre": [0, 0, 90], "radius": 1}
    more = {"schema": "vfix-zones/1", "frame": "LPS", "unit": "mm"}
    more["zones"] = [{"name": "optic nerve", "margin_mm": 1, "shape": ball}]  # type: ignore[assignment]
    (tmp_path / "zones.json").write_text(json.dumps(more))
    assert main([*command, "--zones", str(tmp_path / "zones.json")]) == 2
    message = json.loads(capsys.readouterr().out)["error"]["message"]
    assert "two protected structures are called 'optic nerve'" in message
    assert main([*command, "--path", "Left"]) == 2
    assert "it has 'Path 1'" in json.loads(capsys.readouterr().out)["error"]["message"]


@pytest.fixture(scope="module")
def rest(services: Services) -> Iterator[Client]:
    opened = opened_client(services)
    yield opened
    opened.close()


def test_regions_and_paths_over_rest(rest: Client, services: Services, tube: str) -> None:
    """Each edit tells the revision that it made, asks for the one before, and is refused on a locked plan."""
    plan = services.plans.create(tube, "REST", content())
    path = f"/api/v1/plans/{plan.id}"
    made = rest.post(f"{path}/zones", json={"shape": ACROSS, "name": "eye", "revision": plan.revision}).json()
    bone = rest.post(f"{path}/removed-bone", json={"shape": ACROSS}).json()
    edits: list[tuple[str, str, dict[str, Any] | None]] = [
        ("PATCH", f"/zones/{made['id']}", {"kind": "soft", "stiffness_n_per_mm": 0.7, "max_depth_mm": None}),
        ("PATCH", f"/removed-bone/{bone['id']}", {"name": "sphenoid"}),
        ("POST", "/paths", {"name": "Right", "copy_of": "path-1"}),
        ("PATCH", "/paths/path-1", {"entry_side": "left"}),
        ("PATCH", "/paths/path-1", {"chosen": True}),
        ("PATCH", "/paths/path-1", {"name": "Left"}),
        ("PUT", "/points/p-0/shaft", {"direction": [0, -2, 0], "roll_deg": 15}),
        ("PUT", "/notes", {"notes": "two\nlines"}),
        ("DELETE", f"/removed-bone/{bone['id']}", None),
    ]
    revision = bone["revision"]
    for method, place, body in edits:
        stale = rest.request(method, path + place, json=body, headers={"If-Match": '"999"'})
        assert (stale.status_code, stale.json()["error"]["code"]) == (412, "plan_conflict"), place
        rest.patch(path, json={"locked": True})
        assert rest.request(method, path + place, json=body).status_code == 423, place
        rest.patch(path, json={"locked": False})
        answer = rest.request(method, path + place, json=body, headers={"If-Match": f'"{revision + 2}"'})
        assert answer.is_success, answer.text
        revision += 3
        assert (answer.headers["etag"], answer.json()["revision"]) == (f'"{revision}"', revision)
    now = rest.get(path).json()
    assert [(one["name"], one["entry_side"], len(one["points"])) for one in now["paths"]] == [
        ("Left", "left", 4),
        ("Right", "", 4),
    ]
    assert (now["points"][0]["direction"], now["points"][0]["roll_deg"]) == ([0, -1, 0], 15)
    assert (now["notes"], now["zones"][0]["kind"], now["removed_bone"]) == ("two\nlines", "soft", [])
    assert rest.get(f"{path}/zones").json() == now["zones"]
    assert rest.get(f"{path}/paths").json() == now["paths"]
    assert rest.delete(f"{path}/zones/{made['id']}").json()["zones"] == []
    assert rest.get(f"{path}/removed-bone").json() == []


@pytest.mark.parametrize(
    ("method", "place", "body", "status"),
    [
        ("POST", "/zones", {"name": "no shape"}, 422),
        ("POST", "/zones", {"shape": {"kind": "cone"}}, 422),
        ("POST", "/zones", {"shape": ACROSS, "margin_mm": "wide"}, 422),
        ("POST", "/zones", {"shape": ACROSS, "margin_mm": 99}, 422),
        ("POST", "/zones", {"shape": {"kind": "structure", "structure": "nobody"}}, 422),
        ("PATCH", "/zones/z", {"shape": {"kind": "structure", "structure": "nobody"}}, 422),
        ("PATCH", "/zones/nobody", {"margin_mm": 1}, 404),
        ("PATCH", "/zones/nobody", {}, 422),
        ("PATCH", "/zones/nobody", {"colour": None}, 422),
        ("DELETE", "/zones/nobody", None, 404),
        ("POST", "/removed-bone", {"shape": {"kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]}}, 422),
        ("PATCH", "/removed-bone/nobody", {}, 422),
        ("PATCH", "/removed-bone/nobody", {"name": "x"}, 404),
        ("PATCH", "/paths/path-1", {"name": "x", "chosen": True}, 422),
        ("PATCH", "/paths/path-1", {"entry_side": "up"}, 422),
        ("DELETE", "/paths/path-1", None, 422),
        ("POST", "/paths", {"copy_of": "nobody"}, 404),
        ("PUT", "/points/nobody/shaft", {"direction": [0, 0, 1]}, 404),
        ("PUT", "/points/p-0/shaft", {"direction": [0, 0, 0]}, 422),
        ("PUT", "/notes", {"notes": "x" * 10_001}, 422),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(
    rest: Client, services: Services, tube: str, method: str, place: str, body: Any, status: int
) -> None:
    plan = services.plans.create(tube, "Refused", content(zone(ACROSS)))
    answer = rest.request(method, f"/api/v1/plans/{plan.id}{place}", json=body)
    assert (answer.status_code, answer.json()["error"]["message"] != "") == (status, True)
    assert services.plans.get(plan.id) == plan
