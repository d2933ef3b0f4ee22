"""Bone removal: snapping, dry run, drive and distance fields of a plan use the bone that is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.plans.model import Plan
from app.plans.shipped_head import SAMPLE_PLAN
from app.plans.zones import RemovedBone
from app.services import Services
from app.tabs.rehearse.preparation import prepare
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shapes import Sphere


@pytest.fixture
def opened(phantom_services: Services) -> tuple[Plan, Sphere]:
    """The sample plan with a ball of the bone that is nearest to the middle of its path taken away."""
    services = phantom_services
    plan = services.plans.get(SAMPLE_PLAN)
    case = services.cases.get(plan.case_id)
    middle = np.array(plan.content.points[len(plan.content.points) // 2].position)
    nearest = services.cases.tree(case).point_distance(middle[None])[1][0]
    ball = Sphere(nearest, 3.0)
    shape = {"kind": "sphere", "centre": nearest.tolist(), "radius": 3.0}
    return replace(plan, content=replace(plan.content, removed_bone=(RemovedBone("opening", "Opening", shape),))), ball


def test_the_bone_of_a_plan_is_what_is_left(phantom_services: Services, opened: tuple[Plan, Sphere]) -> None:
    plan, ball = opened
    case = phantom_services.cases.get(plan.case_id)
    whole = phantom_services.cases.tree(case)
    bone = phantom_services.planning.bone(plan)
    assert 1.0 < bone.removed_mm3 < 4.0 / 3.0 * np.pi * 27.0
    at = ball.centre[None]
    assert whole.point_distance(at)[0][0] < 1e-9
    assert bone.tree.point_distance(at)[0][0] > 1.5
    random = np.random.default_rng(3)
    points = ball.centre + random.uniform(-8.0, 8.0, (2000, 3))
    left, before = bone.tree.point_distance(points)[0], whole.point_distance(points)[0]
    away = signed_distance(ball, points)
    unaffected = (away > 0.0) & (before < away)  # what is nearest to them was not taken
    assert unaffected.any()
    np.testing.assert_allclose(left[unaffected], before[unaffected], atol=1e-9)
    assert not bone.inside(points[away < 0.0]).any()
    again = phantom_services.planning.bone(replace(plan, content=replace(plan.content, removed_bone=())))
    assert again.tree is whole
    assert again.removed_mm3 == 0.0


def test_snap_and_fields_see_the_opening(phantom_services: Services, opened: tuple[Plan, Sphere]) -> None:
    plan, ball = opened
    services = phantom_services
    case = services.cases.get(plan.case_id)
    thin = replace(plan, content=plan.content.with_tool(plan.content.tool, {"shaft_radius_mm": 0.5}))
    closed = services.planning.snap(case, ball.centre, replace(thin, content=replace(thin.content, removed_bone=())))
    free = services.planning.snap(case, ball.centre, thin)
    assert free.moved_mm < closed.moved_mm
    before = services.distance_fields.of_plan(replace(plan, content=replace(plan.content, removed_bone=())))
    after = services.distance_fields.of_plan(plan)
    assert before.bone.at(ball.centre[None])[0] < after.bone.at(ball.centre[None])[0] > 2.0
    assert after.tissue is not None
    assert after.tissue.at(ball.centre[None])[0] > 2.0


def test_dry_run_and_drive_are_in_the_opened_bone(phantom_services: Services, opened: tuple[Plan, Sphere]) -> None:
    plan, _ = opened
    services = phantom_services
    found = services.planning.evaluate(plan)
    assert found.removed_mm3 == services.planning.bone(plan).removed_mm3 > 0.0
    remark = services.planning.curve(plan)[1]
    assert "mm³ of bone are removed first" in remark
    prepared = prepare(services, plan)
    mesh = services.planning.bone(plan).mesh
    np.testing.assert_array_equal(prepared.spec.scene.faces, mesh.faces)
    assert prepared.settings.surface_error_mm == services.cases.get(plan.case_id).uncertainty.added_mm > 0.0
