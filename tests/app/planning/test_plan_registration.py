"""A plan with a registration: where its robot stands, and what the verdict states about the error."""

import json
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.cli import main
from app.exchange.plan_files import to_native_json
from app.exchange.robot_frame import BaseExport
from app.planning.dry_runs import DryRunJobs
from app.planning.evaluation import Planning, registered_key
from app.plans.model import Plan
from app.plans.operations.instruments import UseRegistration
from app.plans.shipped_head import SAMPLE_PLAN
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.driven import DrivenRegistration
from app.registration.fit_report import refitted
from app.services import Services
from app.tabs.rehearse.preparation import plan_key, prepare
from vfix_engine.errors import PlanError, StartRefused
from vfix_engine.frames import ImageRegistration
from vfix_engine.registration import register_points

BEADS = np.array([[-60, -60, 0], [60, -60, 5], [0, -95, 60], [-45, -70, 70], [40, -72, 75]], dtype=np.float64)
MOTION = np.eye(4)
MOTION[:3, :3] = Rotation.from_euler("zyx", [40.0, -25.0, 10.0], degrees=True).as_matrix()
MOTION[:3, 3] = [300.0, -120.0, 850.0]


def measured(seed: int, sigma: float) -> DrivenRegistration:
    """A registration by five beads that were touched with this noise per axis."""
    touched = BEADS @ MOTION[:3, :3].T + MOTION[:3, 3] + np.random.default_rng(seed).normal(0.0, sigma, BEADS.shape)
    fit = register_points(touched, BEADS)
    return DrivenRegistration("registration-1", "OR", ImageRegistration(fit.transform), fit, np.sqrt(3.0) * sigma)


def planning(services: Services, registered: DrivenRegistration | None) -> Planning:
    return Planning(services.cases, services.instruments, services.distance_fields, lambda plan: registered)


def registered_sample(services: Services) -> Plan:
    """The sample plan with a registration, which the doubles of `planning` do not look up."""
    return replace(
        services.plans.get(SAMPLE_PLAN),
        content=replace(services.plans.get(SAMPLE_PLAN).content, registration="registration-1"),
    )


def test_a_path_that_is_nearer_to_bone_than_the_registration_is_exact_is_tight(phantom_services: Services) -> None:
    plan = registered_sample(phantom_services)
    fine = planning(phantom_services, measured(1, 0.02)).evaluate(plan)
    assert fine.verdict.level == "fits"
    assert fine.verdict.doubt is None
    registered = measured(1, 0.6)
    rough = planning(phantom_services, registered).evaluate(plan)
    verdict, profile = rough.verdict, rough.profile
    assert verdict.level == "tight"
    assert verdict.doubt is not None
    assert profile.off_mm is not None
    np.testing.assert_allclose(profile.off_mm, registered.off_mm(rough.run.tip[profile.rows]))
    worst = int((profile.clearance - profile.off_mm).argmin())
    assert verdict.doubt.s_mm == profile.s[worst]
    assert verdict.doubt.off_mm > verdict.doubt.clearance_mm == pytest.approx(profile.clearance[worst])
    said = f"The registration may be off by {verdict.doubt.off_mm:.2f} mm (95 %) at {verdict.doubt.s_mm:.0f} mm"
    assert said in verdict.words
    assert "with a margin" not in verdict.words


def test_where_the_robot_is_placed_freely_the_drive_is_that_of_the_image(phantom_services: Services) -> None:
    """The base is told in the patient's frame, where somebody has to put the robot."""
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    alone, registered = phantom_services.planning.evaluate(plan), measured(2, 0.02)
    behind = planning(phantom_services, registered).evaluate(registered_sample(phantom_services))
    np.testing.assert_array_equal(behind.run.q, alone.run.q)
    np.testing.assert_array_equal(behind.base, alone.base)
    assert behind.placement is not None
    np.testing.assert_allclose(behind.placement, registered.image.transform @ alone.base, atol=1e-9)


def test_a_robot_beside_the_patient_is_driven_from_where_the_registration_says(phantom_services: Services) -> None:
    """Registered to its base: the same place gives the same clearance, and one that is out of reach is told."""
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    alone = phantom_services.planning.evaluate(plan)
    to_base = ImageRegistration(np.linalg.inv(alone.base), "base")
    used = DrivenRegistration("registration-2", "Robot", to_base)
    behind = planning(phantom_services, used).evaluate(registered_sample(phantom_services))
    assert behind.completed
    assert behind.placement is None
    np.testing.assert_allclose(behind.base, alone.base, atol=1e-9)
    np.testing.assert_allclose(behind.run.tip[-1], alone.run.tip[-1], atol=1e-3)
    away = to_base.transform.copy()
    away[:3, 3] += 600.0
    far = DrivenRegistration("registration-3", "Robot", ImageRegistration(away, "base"))
    with pytest.raises(StartRefused, match="from where it stands"):
        planning(phantom_services, far).evaluate(registered_sample(phantom_services))


def test_a_stored_registration_is_driven_through_and_a_deleted_one_refuses(phantom_services: Services) -> None:
    """Nothing is driven as if there were no registration."""
    services = phantom_services
    plan = services.plans.documents.duplicate(SAMPLE_PLAN)
    fit = measured(3, 0.5).fit
    assert fit is not None
    pairs = tuple(
        FiducialPair(f"Bead {n}", tuple(image), tuple(touched), id=f"p{n}")
        for n, (image, touched) in enumerate(zip(fit.moving.tolist(), fit.fixed.tolist(), strict=True), 1)
    )
    content = refitted(RegistrationContent(pairs=pairs, fle_mm=1.2))
    made = services.registrations.create(plan.case_id, "OR", content)
    before = services.planning.content_key(plan)
    plan = services.plans.do(plan.id, UseRegistration(registration=made.id))
    assert services.planning.content_key(plan) != before
    evaluation = services.planning.evaluate(plan)
    assert evaluation.registered is not None
    np.testing.assert_allclose(evaluation.registered.image.transform, fit.transform, atol=1e-9)
    assert evaluation.profile.off_mm is not None
    np.testing.assert_allclose(
        evaluation.profile.off_mm, fit.tre_95_mm(evaluation.run.tip[evaluation.profile.rows], 1.2)
    )
    services.registrations.delete(made.id)
    with pytest.raises(PlanError, match="was deleted"):
        services.planning.evaluate(plan)


def test_what_is_driven_judged_and_written_is_of_one_reading(phantom_services: Services) -> None:
    """Although somebody changes the registration meanwhile, and changes it back."""
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    robot, plan = phantom_services.planning.placed_robot(plan), registered_sample(phantom_services)
    placed = replace(plan, content=replace(plan.content, robot=robot))
    first, other = measured(4, 0.02), measured(4, 0.6)
    read: list[DrivenRegistration] = []

    def reading(_: Plan) -> DrivenRegistration:
        read.append(first if len(read) % 2 == 0 else other)
        return read[-1]

    planned = Planning(phantom_services.cases, phantom_services.instruments, phantom_services.distance_fields, reading)
    services = copy(phantom_services)
    services.planning, services.dry_runs = planned, DryRunJobs(phantom_services.jobs, planned)
    for ask in (services.dry_runs.evaluate, planned.evaluate):
        read.clear()
        found = ask(plan)
        assert (read, found.registered) == ([first], first)
    read.clear()
    planned.cones(plan)
    assert read == [first]
    read.clear()
    written = json.loads(BaseExport(planned, services.registrations).text(placed, "json"))
    assert read == [first]
    assert written["registration"]["id"] == first.id
    read.clear()
    read.append(first)  # the page has told which plan is driven by this reading; the robot is placed by the next one
    prepared = prepare(services, plan)
    assert read == [first, other]
    assert prepared.made_of == plan_key(plan, registered_key(other)) != plan_key(plan, registered_key(first))
    assert prepared.recording is not None
    prepared.recording.keep()


def test_the_command_line_drives_through_it_too(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """From where the registration puts the robot; a file of the plan does not have it, which is said."""
    services = phantom_services
    monkeypatch.setenv("VFIX_HOME", str(services.settings.home))
    plan = services.plans.documents.duplicate(SAMPLE_PLAN, "Beside the robot")
    to_base = np.linalg.inv(services.planning.evaluate(plan).base)
    content = RegistrationContent("base", tuple(to_base.ravel().tolist()), made_from="given")
    made = services.registrations.create(plan.case_id, "Robot", content)
    services.plans.do(plan.id, UseRegistration(registration=made.id))
    arguments = ["rehearse", "--case", plan.case_id, "--json", "--plan"]
    assert main([*arguments, plan.id]) == 0
    assert json.loads(capsys.readouterr().out)["completed"]
    file = services.settings.home / "plan.json"
    file.write_text(to_native_json(services.plans.get(plan.id)), encoding="utf-8")
    assert main([*arguments, str(file)]) == 0
    assert "a registration, which its file does not have" in " ".join(json.loads(capsys.readouterr().out)["notes"])
    services.registrations.delete(made.id)
    assert main([*arguments, plan.id]) == 2
    assert "was deleted" in capsys.readouterr().err
