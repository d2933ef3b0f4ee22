"""Switches of a rehearsal: fixtures of the scene that is driven, in force from a start at the entry or a reset."""

from __future__ import annotations

import numpy as np
import pytest
from session_doubles import CLIENT, SAMPLE, Robot, other_case, put_in_place, views_of

from app.messages.client import Client
from app.services import Services
from app.steps.rehearse import commands as c
from app.steps.rehearse.options import NO_OPTIONS, Options, fixtures_of, options_section
from app.steps.rehearse.preparation import plan_key
from app.steps.rehearse.shared_drives import SharedDrives
from app.steps.rehearse.step import RehearseStep
from vfix_engine.errors import PlanError
from vfix_engine.fixtures import CartesianLimits, RemoteCentre, SoftZone

OTHER = Client("tab-two-0", "holds")
ALL = Options(soft_tissue=True, remote_centre=True, speed_limit=True)


def test_each_switch_is_a_fixture_of_the_plan(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    soft, centre, limits = fixtures_of(ALL, phantom_services, plan)
    assert isinstance(soft, SoftZone)
    assert isinstance(centre, RemoteCentre)
    assert isinstance(limits, CartesianLimits)
    assert 0.5 < soft.thickness_mm < 2.0  # the phantom's mucosa is about 1 mm thick
    assert centre.point.tolist() == list(plan.points[0].position)
    assert centre.tolerance_mm == pytest.approx(3.0 + 15.0 * np.sin(np.radians(30.0)))
    assert fixtures_of(NO_OPTIONS, phantom_services, plan) == ()


def test_a_head_without_a_ct_has_no_soft_tissue_and_says_why(phantom_services: Services) -> None:
    case = other_case(phantom_services)
    plan = phantom_services.plans.create(case.id, "Bare")
    with pytest.raises(PlanError, match="no CT"):
        fixtures_of(Options(soft_tissue=True), phantom_services, plan)
    items = {item["name"]: item for item in options_section(NO_OPTIONS, None, 0, False, True)["items"]}
    assert "no CT" in items["soft_tissue"]["refusal"]
    assert "no entry point" in items["remote_centre"]["refusal"]
    assert items["speed_limit"]["refusal"] == ""
    phantom_services.cases.delete(case.id)


def test_a_switch_comes_into_force_with_a_reset_and_the_page_says_so(phantom_services: Services) -> None:
    plan = phantom_services.plans.duplicate(SAMPLE)
    views = views_of(phantom_services)
    step = RehearseStep(views, SharedDrives())
    views.plan.provide(lambda: phantom_services.plans.get(plan.id))
    views.plan.opened()
    step.active = True
    drive = step.drive
    assert drive is not None
    drive.lease.take(CLIENT)
    put_in_place(drive, Robot(), plan)
    assert step.sections(True)["options"]["words"] == ""
    step.handle(c.SetOptions(type="rehearsal.options", soft_tissue=False, remote_centre=True, speed_limit=False))
    section = step.sections(True)["options"]
    assert [item["name"] for item in section["items"] if item["on"]] == ["remote_centre"]
    assert "Reset to entry" in section["words"]
    step.handle(c.DriveCommand(type="rehearsal.reset"))
    assert (drive.state, drive.is_for(plan_key(plan))) == ("starting", True)  # it is placed anew, with the fixture

    drive.lease.let_go(CLIENT)
    drive.lease.take(OTHER)
    with pytest.raises(PlanError, match="holds the handle"):
        step.handle(c.SetOptions(type="rehearsal.options", soft_tissue=False, remote_centre=False, speed_limit=False))
    assert {item["refusal"] for item in step.sections(True)["options"]["items"]} == {"Another window holds the handle."}
    step.close()
    phantom_services.plans.delete(plan.id)
