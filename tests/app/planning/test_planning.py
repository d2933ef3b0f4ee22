"""Planning on the shipped head: points are snapped to where the tool fits, and the controller drives the path."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import trimesh
from plan_editor import PlanEditor

from app.cases.model import HEAD_PHANTOM
from app.cases.service import CaseFrame, CaseService
from app.exchange.plan_files import export_text
from app.exchange.resolve import resolve_case, resolve_plan, resolve_targets
from app.kit.errors import NotFound
from app.planning.evaluation import Planning, SnapResult
from app.plans.instruments import Instruments
from app.plans.operations.document import UndoPlan
from app.plans.operations.points import AddPoint
from app.plans.service import PlanService
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from app.store import Store
from app.tabs.plan.edited_plan import EditedPlan
from tests.engine.scenes import head_mesh
from vfix_engine.errors import PlanError
from vfix_engine.files.readers import read_volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import Tool
from vfix_engine.worlds.rigid import preparation


def test_a_point_on_bone_moves_to_where_the_tool_fits(phantom_services: Services) -> None:
    corner = phantom_services.cases.case_surface(HEAD_PHANTOM).vertices[5000]
    snapped = phantom_services.planning.snap(phantom_services.cases.embedded_case(), corner.tolist())
    room = float(Tool.load("bent_30").radius.max()) + 0.3
    distance, _, _ = phantom_services.cases.tree(phantom_services.cases.embedded_case()).point_distance(
        np.array([snapped.position])
    )
    assert distance[0] >= room - 1e-9
    assert snapped.moved_mm == pytest.approx(np.linalg.norm(np.subtract(snapped.position, corner)))
    assert "moved" in snapped.reason


def test_who_waits_for_kernels_is_told_how_many_there_are(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a first start; the hint line has the same share."""

    class Heard(Exception):
        pass

    def progress(stage: str, fraction: float) -> None:
        raise Heard(stage, fraction)

    monkeypatch.setattr(preparation, "wait", lambda go_on: go_on())
    monkeypatch.setattr(preparation, "progress", lambda: 0.42)
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    plan = replace(
        plan, content=plan.content.with_tool(plan.content.tool, {"shaft_radius_mm": 0.61})
    )  # not evaluated before
    for work in (
        lambda: phantom_services.planning.evaluate(plan, progress),
        lambda: phantom_services.suggestions._around(plan, [plan.content.points[0].position], progress),
    ):
        with pytest.raises(Heard) as heard:
            work()
        assert heard.value.args == ("Preparing the engine", 0.42)


def test_a_point_in_air_stays(phantom_services: Services) -> None:
    point = phantom_services.plans.get(SAMPLE_PLAN).content.points[3]
    snapped = phantom_services.planning.snap(phantom_services.cases.embedded_case(), point.position)
    assert snapped == SnapResult(point.position, 0.0, "", "air_inside")
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    assert (
        phantom_services.planning.snap(phantom_services.cases.embedded_case(), point.position, plan).position
        == point.position
    )


def test_a_click_on_the_teeth_is_offered_with_a_word_about_the_flesh(
    trial_data: Path, store: Store, cases: CaseService, plans: PlanService
) -> None:
    """HAZ-04: the nearest place clear of the upper jaw of a real head lies in the lip."""
    volume, _ = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")
    surfaces = {"bone": head_mesh(trial_data)}
    case = cases.create("Real", frame=CaseFrame("LPS", assumed=False), surfaces=surfaces, volume=volume)
    instruments = Instruments(store.files)
    planning = Planning(cases, instruments)
    services = SimpleNamespace(store=store, cases=cases, plans=plans, instruments=instruments, planning=planning)
    desk = EditedPlan(cast(Services, services), plans.create(case.id, "Clicks").id)
    front = cases.tree(case).point_distance(np.array([[-21.5, -100.0, -26.3]]))[1][0]
    desk.pick(front)
    assert desk.ghost is not None
    assert re.fullmatch(r"Moved \d\.\d mm, clear of bone\.", desk.ghost.words)
    assert desk.section().build()["ghost"]["words"].endswith("In soft tissue, not in air.")
    desk.confirm()
    (point,) = desk.plan.content.points
    desk.drag(point.id, (-29.5, -97.5, -25.0))
    assert desk.drop(point.id) == "In soft tissue, not in air."
    desk.drag(point.id, (-22.7, -93.7, -8.1))
    assert desk.drop(point.id) == ""


def test_a_click_that_fits_is_not_asked_twice(phantom_services: Services) -> None:
    """In the airway it adds at once, as a target does everywhere; undo takes it back."""
    sample = phantom_services.plans.get(SAMPLE_PLAN)
    desk = EditedPlan(phantom_services, phantom_services.plans.create(sample.case_id, "At once").id)
    desk.pick(np.array(sample.content.points[3].position))
    assert desk.ghost is None
    assert [point.position for point in desk.plan.content.points] == [sample.content.points[3].position]
    desk.add_mode = "target"
    desk.pick(np.array([10.0, 0.0, 5.0]))
    assert len(desk.plan.content.targets) == 1
    desk.perform(UndoPlan())
    desk.perform(UndoPlan())
    assert (desk.plan.content.points, desk.plan.content.targets) == ((), ())


def test_without_a_ct_a_point_moves_out_of_the_bone(store: Store, cases: CaseService, plans: PlanService) -> None:
    """HAZ-04: in the middle of a thick bone there is room for the tool, but no air."""
    made = trimesh.creation.box((16, 16, 16))
    bone = TriangleMesh(made.vertices, made.faces)
    case = cases.create("Block", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": bone})
    for wanted in ([0.0, 0.5, 1.0], [7.9, 0.0, 0.0]):
        snapped = Planning(cases, Instruments(store.files)).snap(case, wanted)
        assert max(map(abs, snapped.position)) > 8.0
        assert snapped.lies_in == "not_known"
        assert snapped.moved_mm < 12.0


def test_the_sample_plan_can_be_driven_and_is_driven_once(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    evaluation = phantom_services.planning.evaluate(plan)
    assert phantom_services.planning.evaluate(phantom_services.plans.get(SAMPLE_PLAN)).run is evaluation.run
    assert evaluation.completed, evaluation.reason
    assert not np.isnan(evaluation.clearance).any()
    assert evaluation.clearance.min() == pytest.approx(evaluation.min_clearance_mm)
    assert evaluation.min_clearance_mm >= 0.3
    assert evaluation.degree == 5
    passed = evaluation.soft_tissue  # at the nostril; through the tip of the nose it would be more than 20 mm
    assert passed.length_mm is not None
    assert 0.0 < passed.length_mm < 10.0
    assert passed.complete
    samples, remark = phantom_services.planning.curve(plan)
    assert (len(samples), remark) == (len(evaluation.s), "")


def test_a_path_into_bone_is_exported_with_the_reason(phantom_services: Services) -> None:
    bone = phantom_services.cases.case_surface(HEAD_PHANTOM).vertices[5000].tolist()
    plan = phantom_services.plans.create(HEAD_PHANTOM, "Into bone")
    editor = PlanEditor(phantom_services.plans, plan.id)
    editor.do(AddPoint(position=bone))
    with pytest.raises(PlanError, match="two points"):
        phantom_services.planning.evaluate(editor.plan)
    assert phantom_services.planning.curve(editor.plan) == ((), "")
    editor.do(AddPoint(position=[bone[0], bone[1], bone[2] + 10.0]))
    samples, remark = phantom_services.planning.curve(editor.plan)
    assert remark.startswith("No clearances:")
    assert all(sample.clearance_mm is None for sample in samples)
    assert remark in export_text(editor.plan, "mrk.json", samples, remark)
    phantom_services.plans.documents.delete(plan.id)


def test_cases_and_plans_are_found_by_id_name_and_file(phantom_services: Services, tmp_path: Path) -> None:
    name = phantom_services.cases.embedded_case().name
    by_name, by_id = resolve_case(phantom_services, name), resolve_case(phantom_services, HEAD_PHANTOM)
    assert (by_name.id, by_name.mesh) == (HEAD_PHANTOM, by_id.mesh)
    plan = resolve_plan(phantom_services, by_id, SAMPLE_PLAN).plan
    file = tmp_path / "sample.mrk.json"
    file.write_text(export_text(plan, "mrk.json"), encoding="utf-8")
    read = resolve_plan(phantom_services, by_id, str(file)).plan
    assert [p.position for p in read.content.points] == [p.position for p in plan.content.points]
    assert [t.label for t in resolve_targets(file)] == [t.label for t in plan.content.targets]
    with pytest.raises(NotFound):
        resolve_case(phantom_services, "nobody")
    with pytest.raises(NotFound):
        resolve_plan(phantom_services, by_id, "none")
