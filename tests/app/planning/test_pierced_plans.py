"""Plans on the head phantom whose tool pierces the nose: blocked, or at the level of a wall, or unchanged (HAZ-36)."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rest_client import Client

from app.planning.piercing import Pierced, PiercedReport, pierced_along
from app.planning.run_sideways import measure_sideways
from app.planning.verdict import verdict_of
from app.plans.model import Plan
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from app.tabs.plan.clearance import verdict_view
from app.tabs.rehearse.drive_figures import DriveFigures, DryRunFigures
from benchmarks.piercing import SLACK_MM
from benchmarks.piercing_judge import pierced_runs
from vfix_engine.anatomy.piercing import PoseWays, Ways
from vfix_engine.robots import Tool
from vfix_engine.runtime.command import COMMAND_COLUMNS
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.rigid.dry_run import DryRun

TIP = np.array([4.5, 36.5, 0.5])
DORSUM = (0.0, -12.0, 22.0)
# Places that a straight shaft to TIP passes, what it pierces there, and how far round air leads, between two bounds.
SHAFTS: dict[str, tuple[tuple[float, float, float], str, float, float]] = {
    "dorsum, 12 mm above": ((0.0, -18.0, 15.0), "room", 13.0, np.inf),
    "dorsum, 20 mm above": (DORSUM, "room", 13.0, np.inf),
    "dorsum, 27 mm above": ((0.0, -6.0, 28.0), "room", 13.0, np.inf),
    "ala": ((16.0, -8.0, 6.0), "room", 9.5, 12.0),
    "columella and tip": ((0.0, -22.0, 6.0), "room", 8.0, 9.5),
    "cheek": ((40.0, 0.0, 10.0), "room", np.inf, np.inf),
    "septum": ((-6.0, -11.0, 3.5), "wall", 9.0, 15.0),
}


@pytest.fixture(scope="module")
def plan(phantom_services: Services) -> Plan:
    return phantom_services.plans.get(SAMPLE_PLAN)


@pytest.fixture(scope="module")
def ways(phantom_services: Services, plan: Plan) -> Ways:
    found = phantom_services.planning.ways(plan)
    assert found is not None
    return found


def pose(ways: Ways, through: tuple[float, float, float]) -> PoseWays:
    ahead = np.array(through) - TIP
    return ways.of_pose((TIP + 150.0 * ahead / np.linalg.norm(ahead))[None], TIP[None])


@pytest.mark.parametrize("shaft", SHAFTS)
def test_a_shaft_through_each_part_of_the_nose_is_told(ways: Ways, shaft: str) -> None:
    through, state, least, most = SHAFTS[shaft]
    found = pose(ways, through)
    assert found.known
    assert found.worst is not None
    assert found.worst.pierced
    assert found.worst.from_room == (state == "room")
    assert found.worst.sideways_mm is not None
    assert least <= found.worst.sideways_mm <= most


@pytest.mark.parametrize("shaft", ["dorsum, 20 mm above", "ala", "septum"])
def test_the_judge_that_finds_no_piercing_elsewhere_finds_these(
    phantom_services: Services, plan: Plan, shaft: str
) -> None:
    ahead = np.array(SHAFTS[shaft][0]) - TIP
    tail, volume = (
        TIP + 150.0 * ahead / np.linalg.norm(ahead),
        phantom_services.cases.volume(phantom_services.cases.get(plan.case_id)),
    )
    assert volume is not None
    assert pierced_runs(volume, tail[None], TIP[None], np.array(plan.content.points[0].position), SLACK_MM) != []


def test_the_shipped_plan_passes_by_both_codes(phantom_services: Services, plan: Plan) -> None:
    evaluation = phantom_services.planning.evaluate(plan)
    pierced, run = evaluation.verdict.pierced, evaluation.run
    assert (pierced.state, evaluation.verdict.level) == ("none", "fits")
    assert pierced.sideways_mm is not None
    assert pierced.gives_mm is not None
    assert 1.0 < pierced.sideways_mm < pierced.gives_mm
    assert verdict_view(evaluation)["pierced"] is None
    plotted = verdict_view(evaluation)["profile"]["sideways_mm"]
    assert plotted is not None
    assert len(plotted) == len(evaluation.profile.s)
    assert max(plotted) == pytest.approx(np.nanmax(pierced.along_mm), abs=0.06)
    volume = phantom_services.cases.volume(phantom_services.cases.get(plan.case_id))
    assert volume is not None
    for row in range(0, len(run.s), 300):
        entry = np.array(plan.content.points[0].position)
        assert pierced_runs(volume, run.segments_start[row], run.segments_end[row], entry) == []


def straight_run(run: DryRun, through: tuple[float, float, float]) -> DryRun:
    """The dry run, in its last pose with a straight shaft through a place."""
    start, end = np.array(run.segments_start), np.array(run.segments_end)
    ahead = (np.array(through) - TIP) / np.linalg.norm(np.array(through) - TIP)
    length = np.linalg.norm(end[-1] - start[-1], axis=1)
    end[-1], start[-1] = TIP + np.r_[0.0, length.cumsum()[:-1]][:, None] * ahead, TIP + length.cumsum()[:, None] * ahead
    return dataclasses.replace(run, segments_start=start, segments_end=end)


@pytest.mark.parametrize(
    ("shaft", "level", "words"),
    [
        ("dorsum, 12 mm above", "blocked", "Blocked: the tool pierces skin. Pierces skin in the middle, "),
        ("ala", "blocked", "on the left, "),
        ("septum", "pierces", "Pierces a wall between two air spaces of the body "),
    ],
)
def test_the_verdict_names_place_side_and_height(
    phantom_services: Services, plan: Plan, ways: Ways, shaft: str, level: str, words: str
) -> None:
    evaluation, case = phantom_services.planning.evaluate(plan), phantom_services.cases.get(plan.case_id)
    run = straight_run(evaluation.run, SHAFTS[shaft][0])
    pierced, tree = pierced_along(ways, run, lambda stage, share: None), phantom_services.cases.tree(case)
    found = verdict_of(run, evaluation.profile, Tool.load("bent_30"), tree, case, 0.3, True, pierced)
    assert found.level == level
    assert words in found.words
    assert re.search(r"the entry \([LR] \d+ [PA] \d+ [SI] \d+\)", found.words)
    assert found.short.lower().startswith("blocked: the tool pierces")
    assert pierced.s_mm == pytest.approx(float(run.s[-1]))
    view = verdict_view(dataclasses.replace(evaluation, verdict=found))
    assert view["pierced"] is not None
    assert view["show_mm"] == pytest.approx(pierced.s_mm)
    blocked = dataclasses.replace(run, completed=False, reason="bone on the shaft")
    held = verdict_of(blocked, evaluation.profile, Tool.load("bent_30"), tree, case, 0.3, True, pierced)
    assert (held.level, held.reason) == ("blocked", "pierced" if level == "blocked" else "held")
    assert "bone on the shaft" in held.words


def test_without_knowledge_the_level_is_what_it_was(phantom_services: Services, plan: Plan) -> None:
    evaluation, case = phantom_services.planning.evaluate(plan), phantom_services.cases.get(plan.case_id)
    tree = phantom_services.cases.tree(case)
    found = verdict_of(evaluation.run, evaluation.profile, Tool.load("bent_30"), tree, case, 0.3, True)
    assert found.level == "fits"
    assert "Whether the tool pierces tissue is not known" in found.words
    assert pierced_along(None, evaluation.run, lambda stage, share: None).state == "unknown"
    told = PiercedReport.of(Pierced("room", np.inf, 5.0, (0.0, 1.0, 2.0), (0.0, 3.0, 2.0), 4.0, "on the left"))
    assert told.sideways_mm is None
    assert "no air leads round it within 15 mm" in told.words


def test_a_report_tells_it(client: Client, plan: Plan) -> None:
    chosen = json.loads(client.get(f"/api/v1/plans/{plan.id}/report").text)["chosen"]
    assert chosen["pierced"]["state"] == "none"
    assert 1.0 < chosen["pierced"]["sideways_mm"] < 8.0


def write_drive(folder: Path, runs: list[DryRun]) -> int:
    """The run of a drive whose steps are every fifth row of dry runs, the last one among them; how many they are."""
    rows = [(run.s[i], *run.segments_start[i].ravel(), *run.segments_end[i].ravel()) for run in runs
            for i in range((len(run.s) - 1) % 5, len(run.s), 5)]  # fmt: skip
    parts = runs[0].segments_start.shape[1]
    names = [f"s{part}_{end}{axis}" for end in "ab" for part in range(parts) for axis in "xyz"]
    columns = [*COMMAND_COLUMNS, ("path_s", "mm"), *((name, "mm") for name in names)]
    folder.mkdir()
    manifest = {"schema": "vfix-run/1", "world": "rigid", "columns": columns}
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    np.savez(folder / "spec.npz")
    (folder / "events.jsonl").write_text("", encoding="utf-8")
    ticks = np.hstack([np.zeros((len(rows), len(COMMAND_COLUMNS))), rows])
    ticks.astype("<f8").tofile(folder / "ticks.f64")
    return len(rows)


def test_a_stored_run_has_how_far_air_leads_round_what_was_passed(
    phantom_services: Services, plan: Plan, ways: Ways, client: Client
) -> None:
    run, runs = phantom_services.planning.evaluate(plan).run, phantom_services.runs
    folders = [runs.new_folder() for _ in range(3)]
    count = write_drive(folders[0], [run])
    write_drive(folders[1], [run, straight_run(run, DORSUM)])
    write_drive(folders[2], [run])
    passes, pierces = (runs.keep(folder, origin="page", measure=measure_sideways(ways)) for folder in folders[:2])
    with runs.laid_out(passes.id) as place:
        told = Run.read(place).sideways_mm
    assert told is not None
    assert len(told) == count
    row = (len(run.s) - 1) % 5
    first = ways.of_pose(run.segments_start[row], run.segments_end[row]).worst
    assert told[0] == (0.0 if first is None else first.sideways_mm)
    assert passes.pierced is not None
    assert 1.0 < passes.pierced["sideways_mm"] == told.max() < 8.0
    with runs.laid_out(pierces.id) as place:
        assert Run.read(place).sideways_mm[-1] == np.inf
    old = runs.keep(folders[2], origin="page")
    assert (old.pierced, "sideways.f64" in old.files) == (None, False)
    listed = {one["id"]: one["pierced"] for one in json.loads(client.get("/api/v1/runs").text)}
    assert [listed[one.id] and listed[one.id]["state"] for one in (passes, pierces, old)] == ["none", "room", None]


def test_a_drive_tells_how_far_air_leads_round_what_it_passes(
    phantom_services: Services, plan: Plan, ways: Ways
) -> None:
    evaluation = phantom_services.planning.evaluate(plan)
    tissue = phantom_services.distance_fields.of_plan(plan).tissue
    planned, so_far = DryRunFigures.of(evaluation, tissue, ways), DriveFigures()
    radius = Tool.load("bent_30").radius

    def taken(steps: int, run: DryRun) -> str:
        values = {"reason": "", "held": False, "force": np.zeros(3), "threshold_mm": 5.0, "clearance_mm": 1.0}
        start, end = run.segments_start[-1], run.segments_end[-1]
        pose: Any = SimpleNamespace(
            steps=steps, segments_start=start, segments_end=end, tip=TIP, radius=radius, **values
        )
        so_far.take(pose, planned)
        return so_far.words

    words = taken(1, evaluation.run)
    assert f"air {evaluation.verdict.pierced.sideways_mm:.1f} mm round tissue." in words
    assert "pierced" not in words
    assert "no air round tissue within 15 mm: tissue is pierced." in taken(2, straight_run(evaluation.run, DORSUM))
