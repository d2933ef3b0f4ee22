"""The distance fields of a case: computed once, fine around the plan, no tissue without a CT."""

import numpy as np
import pytest

from app.cases.service import CaseFrame
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh


def test_fields_of_the_sample_plan(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    fields = phantom_services.distance_fields.of_plan(plan)
    assert fields.tissue is not None
    places = [point.position for point in plan.content.points]
    bone, tissue = fields.bone.at(places), fields.tissue.at(places)
    assert (bone > 0.0).all()
    assert (tissue <= bone + 0.05).all()  # bone is tissue as well
    assert (fields.bone.grids[0].step_mm, fields.bone.grids[1].step_mm) == (0.5, 1.0)
    exact = phantom_services.cases.tree(phantom_services.cases.get(plan.case_id)).point_distance(places)[0]
    assert np.abs(bone - exact).max() < 0.3
    assert phantom_services.distance_fields.of_plan(plan).bone is fields.bone
    # A point that moves a little stays in the same box.
    wanted = [*places, *(target.position for target in plan.content.targets)]
    assert (
        phantom_services.distance_fields.around(phantom_services.cases.get(plan.case_id), np.add(wanted, 0.01)).bone
        is fields.bone
    )


def test_without_a_ct_there_is_bone_and_no_tissue(phantom_services: Services) -> None:
    corners = [[0, 0, 0], [20, 0, 0], [0, 20, 0], [0, 0, 20]]
    mesh = TriangleMesh(np.array(corners, float), [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    case = phantom_services.cases.create("a wedge", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": mesh})
    fields = phantom_services.distance_fields.around(case, [[2.0, 2.0, 2.0]])
    assert fields.tissue is None
    at = fields.bone.at([[3.0, 3.0, 3.0], [-4.0, 5.0, 5.0], [500.0, 0.0, 0.0]])
    assert at[:2] == pytest.approx([-3.0, 4.0], abs=0.1)
    assert np.isnan(at[2])


def test_a_plan_without_places_is_told(phantom_services: Services) -> None:
    with pytest.raises(InputError, match="none yet"):
        phantom_services.distance_fields.around(phantom_services.cases.embedded_case(), np.zeros((0, 3)))
