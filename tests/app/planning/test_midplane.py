"""The midline of a head that lies aside in its scan: between its nostrils once they are known, else of its bone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rest_client import Client
from session_doubles import HEAD

from app.cases.model import Case
from app.cases.service import CaseFrame
from app.planning.suggestions import draft
from app.plans.model import Plan, PlanContent, PlanPoint
from app.plans.paths import EntrySide, PlanPath, side_caution
from app.services import Services
from vfix_engine.anatomy.phantom import load_nose_ct
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

ASIDE_MM = 20.0
ASIDE = np.array([ASIDE_MM, 0.0, 0.0])
RIGHT_NOSTRIL = (ASIDE_MM - 7.0, -10.0, 0.0)  # to the left of the scan's origin


def case_aside(services: Services) -> Case:
    bone, ct = services.cases.case_surface(HEAD), load_nose_ct()
    moved = TriangleMesh(bone.vertices + ASIDE, bone.faces)
    volume = Volume(ct.hu, ct.origin + ASIDE, ct.spacing, ct.direction)
    return services.cases.create("Aside", frame=CaseFrame("LPS", False), surfaces={"bone": moved}, volume=volume)


def plan_in(case: Case, side: EntrySide) -> Plan:
    path = PlanPath(points=(PlanPoint("p", "P1", RIGHT_NOSTRIL),), entry_side=side)
    return draft(case, replace(PlanContent(), paths=(path,), path_id=path.id))


def test_a_head_that_lies_aside_has_its_own_midline(phantom_services: Services, client: Client) -> None:
    services = phantom_services
    case = case_aside(services)
    right, left = plan_in(case, "right"), plan_in(case, "left")
    before = services.planning.midplane(right)
    assert before.known_from.startswith("the middle of the bone")
    assert before.point[0] == pytest.approx(ASIDE_MM, abs=0.01)
    found = client.get(f"/api/v1/cases/{case.id}/openings").json()
    after = services.planning.midplane(right)
    assert after.known_from == "halfway between the nostrils"
    assert after.point == pytest.approx(
        [0.5 * (a + b) for a, b in zip(found[0]["position"], found[1]["position"], strict=True)]
    )
    assert after.point[0] == pytest.approx(ASIDE_MM, abs=1.0)
    assert after.left[0] > 0.95
    for midplane in (before, after):
        assert side_caution(right.content.path, midplane) == ""
        assert midplane.left_mm(RIGHT_NOSTRIL) == pytest.approx(-7.0, abs=1.0)
        assert " right of the midline, not on the left." in side_caution(left.content.path, midplane)
    services.cases.delete(case.id)
    services.purge.run(case.id)
