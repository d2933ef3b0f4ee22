"""The volume of bone that a plan removes, by region and in total, in the service, REST and command line."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rest_client import Client
from session_doubles import Later, fail, workspace_of

from app.cli import main
from app.commands import plan as plan_command
from app.plans.model import Plan
from app.plans.operations.removed_bone import AddBone
from app.plans.shipped_head import SAMPLE_PLAN
from app.plans.zones import RemovedBone
from app.services import Services
from app.tabs.plan.region_sections import RemovedBoneSection
from app.tabs.plan.removed_bone import RemovedBoneCount
from vfix_engine.errors import InputError
from vfix_engine.files.volume import BONE_HU


def _with_regions(services: Services) -> Plan:
    """The sample plan with two balls that overlap at the nearest bone, and one in the air before the face."""
    plan = services.plans.get(SAMPLE_PLAN)
    tree = services.cases.tree(services.cases.get(plan.case_id))
    nearest = tree.point_distance([plan.content.points[len(plan.content.points) // 2].position])[1][0]
    entry = np.array(plan.content.points[0].position)
    centres = {"a": nearest, "b": nearest + np.array([0.0, 0.0, 2.0]), "far": entry - np.array([0.0, 60.0, 0.0])}
    regions = (
        RemovedBone(key, key.upper(), {"kind": "sphere", "centre": at.tolist(), "radius": 3.0})
        for key, at in centres.items()
    )
    return replace(plan, content=replace(plan.content, removed_bone=tuple(regions)))


def test_regions_are_counted_apart_and_what_they_share_once(phantom_services: Services) -> None:
    plan = _with_regions(phantom_services)
    found = phantom_services.removed_volumes.of_plan(plan)
    a, b, far = found.regions
    assert a.removed_mm3 > 1.0 < b.removed_mm3
    assert max(a.removed_mm3, b.removed_mm3) < found.removed_mm3 < a.removed_mm3 + b.removed_mm3
    # A count of its own: points drawn at random within the two balls.
    volumes = phantom_services.cases.volumes(phantom_services.cases.get(plan.case_id))
    centres = [np.array(region.shape["centre"]) for region in plan.content.removed_bone[:2]]
    random = np.random.default_rng(7)
    points = centres[0] + random.uniform([-3.0, -3.0, -3.0], [3.0, 3.0, 5.0], (400_000, 3))
    in_ball = np.array([np.linalg.norm(points - centre, axis=1) <= 3.0 for centre in centres])
    hu = volumes[0].sample(points)
    for volume in volumes[1:]:
        finer = volume.sample(points, outside=np.nan)
        hu = np.where(np.isnan(finer), hu, finer)
    cell = 6.0 * 6.0 * 8.0 / len(points)
    counted = [float((mask & (hu >= BONE_HU)).sum()) * cell for mask in (*in_ball, in_ball.any(axis=0))]
    assert [a.removed_mm3, b.removed_mm3, found.removed_mm3] == pytest.approx(counted, rel=0.05)
    assert far.removed_mm3 == 0.0
    assert far.words.startswith("removes nothing; bone is ")
    away = float(far.words.removeprefix("removes nothing; bone is ").removesuffix(" mm away"))
    tree = phantom_services.cases.tree(phantom_services.cases.get(plan.case_id))
    assert away == pytest.approx(
        tree.point_distance([plan.content.removed_bone[2].shape["centre"]])[0][0] - 3.0, abs=1.0
    )
    assert (
        phantom_services.removed_volumes.of_plan(replace(plan, content=replace(plan.content, removed_bone=()))).words
        == ""
    )


def test_rest_and_the_command_line_tell_the_same(
    client: Client, phantom_services: Services, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE_PLAN)
    for region in _with_regions(phantom_services).content.removed_bone:
        phantom_services.plans.do(plan.id, AddBone(shape=dict(region.shape), name=region.name))
    told: dict[str, Any] = client.get(f"/api/v1/plans/{plan.id}/removed-bone/volumes").json()
    assert [region["name"] for region in told["regions"]] == ["A", "B", "FAR"]
    assert told["words"] == f"{told['removed_mm3']:.0f} mm³ of bone are removed in all."
    assert client.get(f"/api/v1/plans/{plan.id}/report").json()["removed"] == told
    evaluation = client.get(f"/api/v1/plans/{plan.id}/evaluation").json()
    assert evaluation["removed_mm3"] == pytest.approx(told["removed_mm3"])
    monkeypatch.setattr(plan_command, "build_services", lambda _: phantom_services)
    assert main(["plan", "evaluate", plan.id, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["removed_bone"] == told["regions"]
    assert printed["removed_mm3"] == told["removed_mm3"]
    assert main(["plan", "evaluate", plan.id]) == 0
    assert "Bone to be removed, FAR: removes nothing; bone is" in capsys.readouterr().out


def shown(count: RemovedBoneCount, plan: Plan) -> RemovedBoneSection | None:
    count.refresh(plan)
    return count.section().build()


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (InputError("the CT cannot be read."), ": the CT cannot be read."),
        (RuntimeError("of Doe"), "; the planner's log"),
    ],
)
def test_bone_that_cannot_be_counted_is_told_and_counted_again_after_a_change(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch, error: Exception, words: str
) -> None:
    plan, workspace = _with_regions(phantom_services), workspace_of(phantom_services)
    count, later = RemovedBoneCount(workspace), workspace.executor
    assert isinstance(later, Later)
    with monkeypatch.context() as broken:
        broken.setattr(phantom_services.removed_volumes, "of_plan", lambda plan: fail(error))
        assert shown(count, plan) is None, "it is counted"
        later.work.pop()()
    section = shown(count, plan)
    assert section is not None
    assert section["items"] == []
    assert section["words"].startswith(f"The bone that is removed could not be counted{words}")
    changed = replace(plan, content=replace(plan.content, removed_bone=plan.content.removed_bone[:1]))
    assert shown(count, changed) is None
    later.work.pop()()
    section = shown(count, changed)
    assert section is not None
    assert [item["id"] for item in section["items"]] == ["a"]
