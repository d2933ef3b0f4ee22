"""Versions of a plan: saved, compared in words, gone back to as one edit, over REST and on the command line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from plan_editor import PlanEditor
from rest_client import Client, opened_client

from app.cases.service import Case, CaseFrame
from app.cli import main
from app.kit.errors import NotFound, PlanConflict, PlanLocked
from app.plans.diff import changes
from app.plans.model import PlanContent, PlanPath, PlanPoint
from app.plans.operations.document import LockPlan, SetPlanSettings, UndoPlan
from app.plans.operations.points import AddPoint, MovePoint
from app.plans.operations.versions import GoBack, SaveVersion
from app.plans.operations.zones import AddZone, DeleteZone
from app.plans.service import PlanService
from app.plans.versions import MAX_VERSIONS, PlanVersions
from app.plans.zones import PlanZone, RemovedBone
from app.services import Services, build_services
from app.settings import Settings
from tests.engine.scenes import curved_tube
from vfix_engine.errors import PlanError

SPHERE: dict[str, Any] = {"kind": "sphere", "centre": [1.0, 2.0, 3.0], "radius": 4.0}


@pytest.fixture
def versions(plans: PlanService) -> PlanVersions:
    return plans.versions


def test_a_version_is_gone_back_to_and_that_is_undone(plans: PlanService, versions: PlanVersions, case: Case) -> None:
    plan = plans.create(case.id, "Corridor")
    editor = PlanEditor(plans, plan.id)
    point = editor.add(AddPoint(position=(1, 2, 3)))
    zone = editor.add(AddZone(shape=SPHERE, name="eye"))
    editor.do(SaveVersion(name="Before lunch"), expected_revision=editor.revision)
    saved = versions.get(plan.id, "Before lunch")
    before = editor.plan.content
    editor.do(MovePoint(point_id=point, position=(4, 6, 3)))
    editor.do(DeleteZone(zone_id=zone))
    editor.do(SetPlanSettings(settings={"margin_mm": 0.5}))
    assert versions.differences(plan.id, saved.id) == (
        "Path ‘Path 1’: point ‘P1’: moved by 5.0 mm.",
        "Protected structure ‘eye’ is gone.",
        "Safety margin: 0.5 mm instead of 0.3 mm.",
    )
    after = editor.plan.content
    back = editor.do(GoBack(version_id="Before lunch"), expected_revision=editor.revision)
    assert back.content == replace(before, settings={"margin_mm": 0.5})
    assert editor.do(UndoPlan()).content == after
    with pytest.raises(PlanConflict):
        editor.do(GoBack(version_id=saved.id), expected_revision=1)
    editor.do(LockPlan(locked=True))
    with pytest.raises(PlanLocked):
        editor.do(GoBack(version_id=saved.id))


def test_versions_are_listed_renamed_deleted_and_restored(
    plans: PlanService, versions: PlanVersions, case: Case
) -> None:
    plan, other = plans.create(case.id, "Corridor"), plans.create(case.id, "Other")
    first, second = versions.save(plan.id, "First"), versions.save(plan.id, "Second")
    versions.save(other.id, "First")
    assert versions.list(plan.id) == (first, second)
    for name, call in {
        "First": lambda: versions.save(plan.id, "First"),
        "Second": lambda: versions.rename(plan.id, first.id, "Second"),
    }.items():
        with pytest.raises(PlanError, match=f"version '{name}' already"):
            call()
    for call in (lambda: versions.save(plan.id, first.id), lambda: versions.rename(plan.id, second.id, first.id)):
        with pytest.raises(PlanError, match="identifier of a version"):  # asked for by it, the other one would answer
            call()
    assert versions.rename(plan.id, "First", "1st").name == "1st"
    versions.delete(plan.id, "Second")
    assert [one.name for one in versions.list(plan.id)] == ["1st"]
    with pytest.raises(NotFound, match="there are: '1st'"):
        versions.get(plan.id, "Second")
    with pytest.raises(NotFound):
        versions.restore(other.id, second.id)
    assert versions.restore(plan.id, second.id) == second
    with pytest.raises(PlanConflict):
        versions.save(plan.id, "Third", expected_revision=99)
    assert [one.name for one in plans.list(case.id)] == ["Corridor", "Other"]  # a version is no plan


def test_a_plan_has_so_many_versions(
    plans: PlanService, versions: PlanVersions, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert MAX_VERSIONS >= 20
    monkeypatch.setattr("app.plans.versions.MAX_VERSIONS", 2)
    plan = plans.create(case.id, "Corridor")
    for n in range(2):
        versions.save(plan.id, f"v{n}")
    with pytest.raises(PlanError, match="2 versions"):
        versions.save(plan.id, "v2")
    gone = versions.delete(plan.id, "v0")
    newer = versions.save(plan.id, "v0")
    for message in ("'v0' already", "2 versions"):
        with pytest.raises(PlanError, match=message):
            versions.restore(plan.id, gone.id)
        if message != "2 versions":
            versions.rename(plan.id, newer.id, "v2")
    versions.delete(plan.id, "v1")
    assert versions.restore(plan.id, gone.id).name == "v0"


def test_versions_from_outside_give_way_to_newer_ones_and_never_fill_the_list(
    plans: PlanService, versions: PlanVersions, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.plans.versions.MAX_VERSIONS", 2)
    monkeypatch.setattr("app.plans.versions.MAX_PROPOSED", 3)
    plan = plans.create(case.id, "Corridor")
    mine = versions.save(plan.id, "Mine")
    made = [versions.propose(plan.id, f"Sent {n}", PlanContent()) for n in range(2)]
    versions.rename(plan.id, made[0].id, "Kept")  # somebody looked at it
    made += [versions.propose(plan.id, f"Sent {n}", PlanContent()) for n in range(2, 6)]
    assert [(one.name, one.proposed) for one in versions.list(plan.id)] == [
        ("Mine", False),
        ("Kept", False),
        ("Sent 3", True),
        ("Sent 4", True),
        ("Sent 5", True),
    ]
    with pytest.raises(NotFound):
        versions.documents.get(made[1].id)  # removed for good
    for call in (
        lambda: versions.save(plan.id, "Third"),
        lambda: versions.rename(plan.id, made[-1].id, "Third"),
    ):
        with pytest.raises(PlanError, match="2 versions"):
            call()
    versions.delete(plan.id, mine.id)
    assert versions.save(plan.id, "Third").proposed is False  # whatever came from outside


PATH = "Path ‘Path 1’:"
POINT = PlanPoint("p", "P1", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
WAY = PlanPath(points=(POINT,))
ZONE = PlanZone("z", "eye", SPHERE)
CONTENT = PlanContent(
    paths=(WAY,),
    targets=(PlanPoint("t", "T1", (1.0, 1.0, 1.0)),),
    zones=(ZONE,),
    removed_bone=(RemovedBone("b", "wall", SPHERE),),
)


def way(**fields: Any) -> dict[str, Any]:
    return {"paths": (replace(WAY, **fields),)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, []),
        ({"robot": {"name": "steady_hand", "base": [0.0] * 16, "q_start": [0.0]}}, ["The robot’s base is kept."]),
        (way(tool="straight_pointer"), ["Path ‘Path 1’: tool Straight pointer instead of Bent pointer, 30°."]),
        (way(tool_shape={"bend_deg": 25.0}), [f"{PATH} tool Bent pointer, 30° (25°) instead of Bent pointer, 30°."]),
        ({"robot": {"name": "ur5e", "base": None, "q_start": None}}, ["Robot: "]),
        (way(points=(replace(POINT, direction=(0.0, 1.0, 0.0)),)), [f"{PATH} point ‘P1’: the shaft is turned by 90"]),
        (way(points=(replace(POINT, direction=None),)), [f"{PATH} point ‘P1’: the shaft’s direction is left open."]),
        (way(points=(replace(POINT, roll_deg=-5.0),)), ["Path ‘Path 1’: point ‘P1’: roll −5° instead of left open."]),
        ({"targets": ()}, ["Target ‘T1’ is gone."]),
        ({"zones": (replace(ZONE, margin_mm=2.0),)}, ["Protected structure ‘eye’: margin 2 mm instead of 1 mm."]),
        ({"zones": (replace(ZONE, shape={**SPHERE, "radius": 5.0}),)},
         ["Protected structure ‘eye’: size 5 mm instead of 4 mm."]),
        ({"zones": (replace(ZONE, name="globe", visible=False),)},
         ["Protected structure ‘globe’: renamed from ‘eye’.", "Protected structure ‘globe’: hidden."]),
        ({"zones": (ZONE, replace(ZONE, id="y", name="nerve"))}, ["Protected structure ‘nerve’ is new."]),
        ({"removed_bone": ()}, ["Bone to be removed ‘wall’ is gone."]),
        ({"notes": "x"}, ["The notes were changed."]),
        ({"paths": (WAY, PlanPath("b", "Second"))}, ["Path ‘Second’ is new."]),
        (way(entry_side="left"), ["Path ‘Path 1’: enters left instead of nowhere said."]),
    ],
)  # fmt: skip
def test_each_change_is_told(change: dict[str, Any], words: list[str]) -> None:
    found = changes(CONTENT, replace(CONTENT, **change))
    assert len(found) == len(words)
    assert all(told.startswith(start) for told, start in zip(found, words, strict=True)), found


@pytest.fixture
def services(tmp_path: Path) -> Iterator[Services]:
    made = build_services(Settings(home=tmp_path / "home", port=0))
    yield made
    made.close()


def test_versions_over_rest_and_on_the_command_line(
    services: Services, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    case = services.cases.create("Tube", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": curved_tube()[0]})
    plan = services.plans.create(case.id, "Corridor")
    client: Client = opened_client(services)
    path = f"/api/v1/plans/{plan.id}"
    made = client.post(f"{path}/versions", json={"name": "Empty"}, headers={"If-Match": '"1"'})
    assert (made.status_code, made.json()["revision"]) == (201, 1)
    version = made.json()["id"]
    assert client.post(f"{path}/versions", json={"name": "x", "revision": 9}).status_code == 409
    assert client.post(f"{path}/versions", json={"name": "Empty"}).status_code == 422
    client.post(f"{path}/points", json={"position": [1, 2, 3]})
    assert client.get(f"{path}/versions/{version}/changes").json() == {"changes": ["Path ‘Path 1’: point ‘P1’ is new."]}
    assert client.get(f"{path}/versions/{version}/changes", params={"until": version}).json() == {"changes": []}
    assert client.get(f"{path}/versions/nobody/changes").status_code == 404
    renamed = client.patch(f"{path}/versions/{version}", json={"name": "Start"})
    assert (renamed.json()["name"], renamed.headers["etag"]) == ("Start", '"2"')  # the plan's
    stale = client.patch(f"{path}/versions/{version}", json={"name": "x"}, headers={"If-Match": '"1"'})
    assert stale.status_code == 412
    back = client.post(f"{path}/versions/{version}/go-back", json={"revision": 2})
    assert (back.json()["points"], back.headers["etag"]) == ([], '"3"')
    assert client.post(f"{path}/undo").json()["points"][0]["position"] == [1, 2, 3]
    assert client.delete(f"{path}/versions/Start").json() == renamed.json()
    assert client.get(f"{path}/versions").json() == []
    client.post(f"{path}/versions/{version}/restore")
    client.close()
    monkeypatch.setenv("VFIX_HOME", str(services.settings.home))

    def vfix(*words: str) -> Any:
        assert main(["plan", *words, "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    vfix("versions", plan.id, "--save", "With a point")
    assert [one["name"] for one in vfix("versions", plan.id)["versions"]] == ["Start", "With a point"]
    assert vfix("diff", plan.id, "Start")["changes"] == ["Path ‘Path 1’: point ‘P1’ is new."]
    assert vfix("diff", plan.id, "Start", "With a point")["changes"] == ["Path ‘Path 1’: point ‘P1’ is new."]
    vfix("versions", plan.id, "--go-back", "Start")
    assert vfix("diff", plan.id, "Start")["changes"] == []
    assert [one["name"] for one in vfix("versions", plan.id, "--delete", "Start")["versions"]] == ["With a point"]
    assert main(["plan", "diff", plan.id, "Start"]) == 2
