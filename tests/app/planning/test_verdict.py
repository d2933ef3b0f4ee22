"""The verdict on a path: bone and protected structures decide its level, soft tissue has a separate level."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from rest_client import Client

from app.cases.model import Case
from app.cli import main
from app.commands import plan as plan_command
from app.exchange.plan_files import to_native_json
from app.planning.remote_centre import path_of
from app.planning.verdict import DEEP_MM, profile_of, tissue_level, verdict_of
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import PlanError
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.robots import Tool
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.worlds.rigid.dry_run import TIGHT_MM


def test_bone_and_soft_tissue_of_the_sample_plan_are_told_apart(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    evaluation = phantom_services.planning.evaluate(plan)
    verdict, profile = evaluation.verdict, evaluation.profile
    assert verdict.least_clearance_mm == pytest.approx(float(evaluation.run.clearance.min()))
    assert (verdict.nearest, verdict.part) == ("bone", "shaft")
    assert profile.tissue is not None
    assert verdict.tissue_mm is not None
    assert verdict.tissue_mm == pytest.approx(profile.tissue.length.max())
    # The bent tool runs through the tip of the nose.
    assert verdict.tissue_mm > 15.0
    assert verdict.tissue_depth_mm is not None
    assert verdict.tissue_depth_mm > DEEP_MM
    assert verdict.tissue_level == "deep"
    assert [part.s_mm for part in verdict.parts if part.s_mm is not None] == [verdict.s_mm, verdict.tissue_s_mm]
    assert verdict.words.startswith(
        f"Fits. {verdict.least_clearance_mm:.2f} mm to bone at {verdict.s_mm:.0f} mm (margin {verdict.margin_mm:.2f})."
    )
    assert " The shaft is nearest" in verdict.words


def test_the_level_follows_margin_reach_scan_and_zones(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    evaluation = phantom_services.planning.evaluate(plan)
    run, profile, tool = evaluation.run, evaluation.profile, Tool.load("bent_30")
    case = phantom_services.cases.get(plan.case_id)
    tree, least = phantom_services.cases.tree(case), evaluation.min_clearance_mm

    def judged(margin: float, complete: bool = True, **changes: object) -> tuple[str, str]:
        other = dataclasses.replace(run, **changes)  # type: ignore[arg-type]
        found = verdict_of(other, profile, tool, tree, case, margin, complete)
        return found.level, found.words

    assert judged(least - TIGHT_MM - 0.01)[0] == "fits"
    level, words = judged(least - TIGHT_MM + 0.01)
    assert level == "tight"
    assert words.startswith("Tight. ")
    assert judged(0.1, complete=False)[0] == "unknown"
    level, words = judged(0.1, completed=False, reason="bone on the shaft, 0.3 mm away")
    assert level == "blocked"
    assert "bone on the shaft, 0.3 mm away" in words

    # A scan that may hide bone tells so of the bone, although a structure is nearer to its margin than bone is.
    row = len(run.s) - 1
    far = Zone("nerve", Sphere(run.segments_end[row, 0] + [0.0, 12.0, 0.0], 3.0), 20.0)
    hidden = profile_of(run, tool, path_of(plan), None, ZoneSet((far,)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Case, "uncertainty", SurfaceUncertainty(0.0, 4.0))
        found = verdict_of(run, hidden, tool, tree, dataclasses.replace(case), 0.05, True)  # nothing of it is kept
    assert (found.nearest, found.reason) == ("nerve", "surface")
    assert f"{least:.2f} mm to bone at" in found.words

    # A structure 0.4 mm beside the tip at the end, with a margin of 0.3 mm, is nearer to its margin than bone.
    ahead = run.segments_end[row, 0] - run.segments_start[row, 0]
    beside = run.segments_end[row, 0] + (3.0 + float(tool.radius[0]) + 0.4) * ahead / np.linalg.norm(ahead)
    zone = Zone("artery", Sphere(beside, 3.0), 0.3)
    protected = profile_of(run, tool, path_of(plan), None, ZoneSet((zone,)))
    found = verdict_of(run, protected, tool, tree, case, 0.05, True)
    assert (found.level, found.nearest, found.part) == ("tight", "artery", "tip")
    assert found.least_clearance_mm == pytest.approx(0.4, abs=0.05)
    assert (found.tissue_mm, found.tissue_level) == (None, "unknown")
    assert "no CT" in found.words


@pytest.mark.parametrize(
    ("off_mm", "level", "reason", "words"),
    [
        (0.05, "fits", "clear", "Fits. "),
        (0.9, "fits", "spent", "less than the margin of 0.50 mm"),
        (1.9, "tight", "registration", "more than the"),
        (None, "unknown", "registration_unknown", "How far the registration may be off is not known."),
    ],
)
def test_a_registration_is_weighed_against_clearance_and_margin(
    phantom_services: Services, off_mm: float | None, level: str, reason: str, words: str
) -> None:
    """The head that the bar shows and the sentence of the panel are of one verdict."""
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    evaluation = phantom_services.planning.evaluate(plan)
    case, tool = phantom_services.cases.get(plan.case_id), Tool.load("bent_30")
    off = None if off_mm is None else np.full_like(evaluation.profile.clearance, off_mm)
    profile = dataclasses.replace(evaluation.profile, off_mm=off, off_unknown=off is None)
    found = verdict_of(evaluation.run, profile, tool, phantom_services.cases.tree(case), case, 0.5, True)
    assert (found.level, found.reason) == (level, reason)
    assert words in found.words
    assert found.words.startswith(f"{found.short}. ")
    assert (found.doubt is not None) == (reason == "registration")
    if reason == "spent":
        left = found.least_clearance_mm - 0.9
        assert f"{left:.2f} mm to bone are left at {found.s_mm:.0f} mm" in found.words


@pytest.mark.parametrize(
    ("length", "depth", "complete", "level"),
    [
        (None, None, False, "unknown"),
        (0.0, 0.0, True, "none"),
        (0.0, 0.0, False, "unknown"),
        (19.0, 2.7, True, "pressed"),
        (19.0, 3.1, False, "deep"),
    ],
)
def test_tissue_has_a_level_of_its_own(length: float | None, depth: float | None, complete: bool, level: str) -> None:
    assert tissue_level(length, depth, complete) == level


def test_a_report_has_every_path_and_the_cones_of_the_targets(phantom_services: Services, client: Client) -> None:
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    answer = client.get(f"/api/v1/plans/{plan.id}/report")
    assert answer.status_code == 200
    report = json.loads(answer.text)
    chosen = report["chosen"]
    assert chosen["verdict"] == "fits"
    assert report["paths"] == [chosen]
    assert (chosen["side_caution"], chosen["soft_structures"]) == ("", [])
    end = plan.content.points[-1].position
    near, label = min(
        (float(np.linalg.norm(np.subtract(end, one.position))), one.label) for one in plan.content.targets
    )
    assert f" The path ends {near:.1f} mm before the nearest target, ‘{label}’." in chosen["words"]
    away = "right" if plan.content.points[0].position[0] > 0 else "left"
    edited = client.patch(f"/api/v1/plans/{plan.id}/paths/{plan.content.path_id}", json={"entry_side": away})
    assert edited.status_code == 200
    told = client.get(f"/api/v1/plans/{plan.id}/report").json()["chosen"]
    assert f"not on the {away}." in told["side_caution"]
    assert (told["verdict"], told["reason"]) == ("unknown", "side")
    assert told["words"].endswith(f"{chosen['words'].removeprefix('Fits.')} {told['side_caution']}")
    client.post(f"/api/v1/plans/{plan.id}/undo", json={})
    cones = {target["label"]: target["cone_deg"] for target in chosen["targets"]}
    assert 5.0 < cones["pharyngeal wall"] < 60.0
    assert set(cones) == {target.label for target in plan.content.targets}
    assert client.get(f"/api/v1/plans/{plan.id}/report?path=nowhere").status_code == 422
    with pytest.raises(PlanError, match="no path 'nowhere'"):
        phantom_services.path_evaluations.of_plan(plan, "nowhere")


def test_the_command_evaluates_stored_plans_and_files(
    phantom_services: Services,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    plan = phantom_services.plans.get(SAMPLE_PLAN)
    file = tmp_path / "plan.json"
    file.write_text(to_native_json(plan), encoding="utf-8")
    monkeypatch.setattr(plan_command, "build_services", lambda settings: phantom_services)
    answers = []
    for wanted in (plan.id, str(file)):
        assert main(["plan", "evaluate", wanted, "--json"]) == 0
        answers.append(json.loads(capsys.readouterr().out))
    for answer in answers:
        assert answer["verdict"] == "fits"
        assert answer["nearest"] == "bone"
        assert answer["tissue_mm"] > 15.0
        assert [path["path"] for path in answer["paths"]] == [answer["path"]]
        assert {target["label"] for target in answer["targets"]} == {target.label for target in plan.content.targets}
    assert answers[0]["s_mm"] == answers[1]["s_mm"]
    assert main(["plan", "evaluate", plan.id, "--path", "nowhere"]) == 2
    assert "no path 'nowhere'" in capsys.readouterr().err
