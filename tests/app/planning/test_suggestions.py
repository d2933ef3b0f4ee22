"""Suggested paths and tool comparisons in the shipped head: REST, the edit that uses one, the command line."""

from __future__ import annotations

import json
import math
import re
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, replace
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from rest_client import Client

from app.cases.model import HEAD_PHANTOM as PHANTOM_ID
from app.cases.model import SurfaceInfo
from app.commands import plan_suggest
from app.planning import suggestions as suggestions_module
from app.planning.shaft import point_stations, shaft_at
from app.planning.suggestion_ends import check_ends
from app.planning.suggestions import SuggestedPaths, described
from app.planning.verdict import Level, Reason, Verdict
from app.planning.verdict_figures import verdict_figures
from app.plans.model import PlanContent, PlanPoint
from app.plans.paths import PlanPath
from app.plans.service import Plan
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services
from benchmarks.piercing import pierced_by
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shaft_directions import rolled_frame
from vfix_engine.suggestion import Alternative, Suggestion

ENTRY, TARGET = (7.5, -14.0, -6.0), (3.0, 65.0, -3.5)
ENDED = ("done", "failed", "cancelled")


def waited(client: Client, job: dict[str, Any]) -> dict[str, Any]:
    for _ in range(6000):
        now: dict[str, Any] = client.get(f"/api/v1/jobs/{job['id']}").json()
        if now["state"] in ENDED:
            return now
        time.sleep(0.1)
    raise AssertionError("the job has not ended")


@pytest.fixture(autouse=True, scope="module")
def searched_once() -> Iterator[None]:
    """The same search is not made twice: the page's and the command's differ in what is done with its answer."""
    search, found = suggestions_module.suggest_path, dict[Any, Suggestion]()

    def once(around: Any, robot: Any, tool: Any, entry: Any, target: Any, settings: Any, *given: Any) -> Suggestion:
        key = tool.name, tuple(entry), tuple(target), repr(settings)
        if key not in found:
            found[key] = search(around, robot, tool, entry, target, settings, *given)
        return found[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(suggestions_module, "suggest_path", once)
        yield


@pytest.fixture
def plan(phantom_services: Services) -> Plan:
    content = PlanContent(
        paths=(PlanPath(points=(PlanPoint("p-1", "P1", ENTRY),), tool="straight_pointer"),),
        targets=(PlanPoint("t-1", "T1", TARGET),),
    )
    return phantom_services.plans.create(PHANTOM_ID, "To be suggested", content)


def test_a_suggestion_is_found_used_and_undone(client: Client, phantom_services: Services, plan: Plan) -> None:
    phantom_case = phantom_services.cases.get(PHANTOM_ID)
    job = client.post(f"/api/v1/plans/{plan.id}/suggestions", json={}).json()
    assert job["kind"] == "suggestion"
    done = waited(client, job)
    assert done["state"] == "done", done
    found = client.get(f"/api/v1/suggestions/{done['result']}").json()
    assert found["none"] is None
    assert (found["plan_id"], found["revision"]) == (plan.id, plan.revision)
    best = found["alternatives"][0]
    assert best["least_clearance_mm"] > 0.8  # ways with more of it pierce the rim of the nostril
    assert 8.0 < best["tissue_mm"] < 20.0
    assert 0.0 <= best["sideways_mm"] < 8.0
    looked, volume = phantom_services.suggestions.paths(found["id"]), phantom_services.cases.volume(phantom_case)
    assert volume is not None
    ways = phantom_services.planning.ways(plan)
    assert ways is not None
    for one in looked.found.alternatives[:2]:
        assert not one.pierces
        for start, end in zip(one.run.segments_start[::10], one.run.segments_end[::10], strict=True):
            assert not any(run.pierced for run in ways.of_pose(start, end).runs)  # in none, judged or passed over
        assert pierced_by(volume, one, np.array(ENTRY), 40.0) == []  # by another code
    assert best["points"][0]["position"] == pytest.approx(ENTRY)
    assert best["points"][-1]["position"] == pytest.approx(TARGET)
    tails = np.array([point["direction"] for point in best["points"]])
    assert np.linalg.norm(tails, axis=1) == pytest.approx(1.0)
    assert (tails[:, 1] < 0.0).all()  # the tool comes from in front of the face
    pictures = f"/api/v1/suggestions/{found['id']}/pictures"
    assert client.get(f"{pictures}/0").status_code == 404  # not drawn yet
    assert waited(client, client.post(pictures).json())["state"] == "done"
    drawn = [client.get(f"{pictures}/{number}") for number in range(len(found["alternatives"]))]
    assert {one.headers["content-type"] for one in drawn} == {"image/svg+xml"}
    assert len({one.text for one in drawn}) == len(drawn)  # each can be told from the others
    for one in drawn:
        at_target(one.text)
    assert client.get(f"{pictures}/{len(drawn)}").status_code == 404
    wanted = {"alternative": 0, "revision": plan.revision}
    used = client.post(f"/api/v1/suggestions/{found['id']}/use", json=wanted).json()
    assert len(used["points"]) == len(best["points"])
    assert used["points"][3]["direction"] == pytest.approx(best["points"][3]["direction"])
    driven = phantom_services.dry_runs.evaluate(phantom_services.plans.get(plan.id))
    assert driven.completed
    assert best["figures"] == [asdict(figure) for figure in verdict_figures(driven)]  # those of the verdict card
    # Judged in the list already as the plan is, which nothing drives anew.
    report = phantom_services.path_evaluations.of_plan(phantom_services.plans.get(plan.id)).chosen
    assert (best["verdict"], best["short"], best["words"]) == (report.verdict, report.short, report.words)
    assert (best["nearest"], best["margin_mm"]) == (report.nearest, report.margin_mm)
    assert driven.min_clearance_mm == pytest.approx(best["least_clearance_mm"], abs=0.02)  # driven as suggested
    undone = client.post(f"/api/v1/plans/{plan.id}/undo", json={}).json()
    assert [point["id"] for point in undone["points"]] == ["p-1"]
    assert best["short_of_target_mm"] == pytest.approx(0.0, abs=1e-6)
    other = client.patch(f"/api/v1/plans/{plan.id}", json={"tool": {"name": "bent_30"}})
    assert other.status_code == 200, other.text
    refused = client.post(f"/api/v1/suggestions/{found['id']}/use", json={})
    assert refused.status_code == 409
    assert "'straight_pointer'" in refused.json()["error"]["message"]
    client.post(f"/api/v1/plans/{plan.id}/undo", json={})
    stale = client.post(f"/api/v1/suggestions/{found['id']}/use", json={"revision": plan.revision})
    assert stale.status_code == 409
    assert client.post(f"/api/v1/suggestions/{found['id']}/use", json={"alternative": 99}).status_code == 404
    assert client.get("/api/v1/suggestions/nobody").status_code == 404


def at_target(svg: str) -> None:
    """Checks that the drawn path ends at the drawn target, and that bone is drawn within the picture."""
    drawn = {one.get("class"): one for one in ElementTree.fromstring(svg)}
    x, y = (float(drawn["target"].attrib[name]) for name in ("cx", "cy"))
    path = drawn["path"].attrib["d"].split("L")[-1]
    assert [float(value) for value in path.split()] == pytest.approx([x, y], abs=0.02)
    left, top, width, height = (float(value) for value in ElementTree.fromstring(svg).attrib["viewBox"].split())
    bone = np.array(re.findall(r"[-\d.]+", drawn["bone"].attrib["d"]), dtype=float).reshape(-1, 2)
    inside = (bone >= [left, top]) & (bone <= [left + width, top + height])
    assert inside.all(axis=1).sum() > 50


def an_alternative() -> Alternative:
    run = SimpleNamespace(completed=True, reached_mm=9.0, length_mm=9.0, clearance=np.ones(2), s=np.arange(2.0))
    run.tip = np.array([[0.0, 0.0, 0.0], [0.0, 9.0, 0.0]])
    passage = SimpleNamespace(tissue_mm=None, tissue_depth_mm=None)
    points, tails = np.array([[0.0, 0.0, 0.0], [0.0, 9.0, 0.0]]), np.array([[0.0, -1.0, 0.0]] * 2)
    return Alternative(points, tails, None, np.eye(4), np.zeros(7), run, passage)  # type: ignore[arg-type]


def test_what_the_plan_s_verdict_calls_blocked_or_pierced_is_not_suggested(
    phantom_services: Services, plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the search itself found of it: the verdict on the plan is the last word (HAZ-36)."""
    found, suggestions = [an_alternative() for _ in range(4)], phantom_services.suggestions
    levels: list[Level] = ["pierces", "tight", "blocked", "fits"]
    by_way = {id(one): a_verdict(level) for one, level in zip(found, levels, strict=True)}
    monkeypatch.setattr(suggestions, "_judged", lambda plan, one, tell: (by_way[id(one)], ()))
    monkeypatch.setattr(suggestions_module, "suggest_path", lambda *given: Suggestion(tuple(found)))
    monkeypatch.setattr(suggestions, "_around", lambda *given: None)
    told = suggestions.look(plan, ENTRY, TARGET, lambda stage, share: None)
    assert [one.level for one in told.verdicts] == ["fits", "tight"]
    assert told.found.alternatives == (found[3], found[1])
    found.pop()
    found.pop(1)
    told = suggestions.look(plan, ENTRY, TARGET, lambda stage, share: None)
    assert told.found.alternatives == ()
    assert told.found.none is not None
    assert "every way that was found is blocked. Blocked: the tool pierces a wall" in told.found.none.reason


def a_verdict(level: Level) -> Verdict:
    reason: Reason = "wall" if level == "pierces" else "clear"
    return Verdict(level, "none", 1.5, "bone", "tip", 3.0, None, None, None, None, (), reason=reason)


def test_a_suggestion_can_be_cancelled(client: Client, plan: Plan) -> None:
    job = client.post(f"/api/v1/plans/{plan.id}/suggestions", json={"target": (3.0, 64.0, -3.5)}).json()
    client.delete(f"/api/v1/jobs/{job['id']}")
    assert waited(client, job)["state"] == "cancelled"


def test_no_search_keeps_the_verdict_on_a_path_waiting(
    phantom_services: Services, plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, go = threading.Event(), threading.Event()

    def held(
        around: Any, robot: Any, tool: Any, entry: Any, target: Any, settings: Any, tell: Any, *_: Any
    ) -> Suggestion:
        begun.set()
        while not go.wait(0.005):
            tell("Searching", 0.5)
        return Suggestion((), None)

    monkeypatch.setattr(suggestions_module, "suggest_path", held)
    jobs, shown = phantom_services.jobs, phantom_services.plans.get(SAMPLE_PLAN)
    search = phantom_services.suggestions.start(plan)
    tools = phantom_services.suggestions.start_tools(shown)
    other = replace(shown, content=shown.content.with_points(shown.content.points[:2]))  # not evaluated before
    assert begun.wait(400)
    verdict = phantom_services.dry_runs.start(other)
    try:
        assert jobs.wait(verdict.id, 400).state == "done"
        assert (jobs.get(search.id).state, jobs.get(tools.id).state) == ("running", "queued"), (
            "one search after another"
        )
    finally:
        go.set()
        jobs.cancel(tools.id)
        jobs.wait(search.id)


def test_both_ends_are_needed(client: Client, phantom_services: Services) -> None:
    empty = phantom_services.plans.create(PHANTOM_ID, "Empty")
    for wish, words in (({}, "entry"), ({"entry": ENTRY}, "target")):
        answer = client.post(f"/api/v1/plans/{empty.id}/suggestions", json=wish)
        assert answer.status_code == 422
        assert words in answer.json()["error"]["message"]


@pytest.mark.parametrize(
    ("entry", "target", "words"),
    [
        (ENTRY, ENTRY, "entry and target are 0.0 mm apart; a path needs 2 mm"),
        (ENTRY, (7.5, -14.0, -7.0), "1.0 mm apart"),
        ((0.0, -900.0, 0.0), TARGET, "the entry lies outside of the scan, which spans x"),
        (ENTRY, (0.0, 65.0, 7000.0), "the target lies outside of the scan"),
    ],
)
def test_ends_that_cannot_be_used_are_refused_before_anything_is_measured(
    client: Client, phantom_services: Services, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    entry: Any, target: Any, words: str,
) -> None:  # fmt: skip
    from app import cli
    from app.commands import plan as plan_command

    def measured(*given: object) -> None:
        raise AssertionError("measured before it was refused")

    monkeypatch.setattr(phantom_services.distance_fields, "around", measured)
    empty = phantom_services.plans.create(PHANTOM_ID, "Ends")
    answer = client.post(f"/api/v1/plans/{empty.id}/suggestions", json={"entry": entry, "target": target})
    assert answer.status_code == 422
    assert words in answer.json()["error"]["message"]
    monkeypatch.setattr(plan_command, "build_services", lambda settings: phantom_services)
    ends = [f"--entry={','.join(map(str, entry))}", f"--target={','.join(map(str, target))}"]
    assert cli.main(["plan", "suggest", "--case", PHANTOM_ID, "--name", "Ends", *ends]) == 2
    assert words in capsys.readouterr().err


def test_ends_too_far_apart_or_from_a_surface_are_refused() -> None:
    """A head of 900 mm stands for a scan of the body; a surface is known 60 mm around."""
    corners = ((-200.0, -200.0, -700.0), (200.0, 200.0, 200.0))
    surface = SurfaceInfo("bone", 1, corners, "")
    case = SimpleNamespace(has_volume=False, surfaces=(surface,), volumes=())
    with pytest.raises(PlanError, match="a way is up to 350 mm long"):
        check_ends(case, ENTRY, (0.0, 0.0, -600.0))  # type: ignore[arg-type]
    with pytest.raises(PlanError, match="the target lies more than 60 mm from the surface"):
        check_ends(case, ENTRY, (0.0, 265.0, 0.0))  # type: ignore[arg-type]
    check_ends(case, ENTRY, (0.0, 255.0, 0.0))  # type: ignore[arg-type]


def test_a_path_that_ends_before_its_target_says_so() -> None:
    assert plan_suggest._ends({"short_of_target_mm": 2.4}) == " Ends 2.4 mm before the target."
    assert plan_suggest._ends({"short_of_target_mm": 0.4}) == ""
    ends = ((0.0, 0.0, 0.0), (0.0, 9.0, 2.4))
    looked = SuggestedPaths(
        "s", "p", *ends, "bent_30", 0.3, Suggestion((an_alternative(),)), verdicts=(a_verdict("fits"),), figures=((),)
    )
    assert described(looked)[0]["short_of_target_mm"] == pytest.approx(2.4)


def test_tools_are_compared_along_a_path(client: Client, phantom_services: Services) -> None:
    sample = phantom_services.plans.list(PHANTOM_ID)[0]
    job = client.post(f"/api/v1/plans/{sample.id}/tools")
    assert job.status_code == 202
    table = phantom_services.suggestions.table(waited(client, job.json())["result"])
    by_name = {row.tool: row for row in table.rows}
    assert len(by_name) >= 7
    assert by_name[sample.content.tool].chosen
    card = phantom_services.dry_runs.evaluate(sample)
    own = by_name[sample.content.tool]
    told = card.verdict.level, card.verdict.obstacles[0].least_mm, card.verdict.tissue_mm
    assert (own.verdict, own.least_clearance_mm, own.tissue_mm) == told
    shown = client.get(f"/api/v1/tool_tables/{table.id}").json()["tools"]
    bent = next(row for row in shown if row["tool"] == "bent_30")
    assert bent["parts"][0]["end"] == [0.0, 0.0]  # the tip
    assert bent["parts"][0]["start"][1] < -1.0  # bent away from the shaft's axis
    other = next(row for row in table.rows if row.tool != sample.content.tool and row.least_clearance_mm is not None)
    used = client.post(f"/api/v1/tool_tables/{table.id}/use", json={"tool": other.tool}).json()
    assert used["tool"] == other.tool
    assert [point["label"] for point in used["points"]] == [point.label for point in sample.content.points]
    again = phantom_services.dry_runs.evaluate(phantom_services.plans.get(sample.id)).verdict
    assert (again.level, again.obstacles[0].least_mm) == (other.verdict, other.least_clearance_mm)
    eye = {"name": "eye", "shape": {"kind": "sphere", "centre": [40.0, 20.0, 40.0], "radius": 5.0}}
    client.post(f"/api/v1/plans/{sample.id}/zones", json=eye).raise_for_status()
    assert client.post(f"/api/v1/tool_tables/{table.id}/use", json={"tool": other.tool}).status_code == 409
    client.post(f"/api/v1/plans/{sample.id}/undo").raise_for_status()
    assert client.post(f"/api/v1/tool_tables/{table.id}/use", json={"tool": other.tool}).status_code == 200
    client.delete(f"/api/v1/plans/{sample.id}/points/{sample.content.points[-1].id}")
    assert client.post(f"/api/v1/tool_tables/{table.id}/use", json={"tool": other.tool}).status_code == 409
    assert client.post(f"/api/v1/tool_tables/{table.id}/use", json={"tool": "spoon"}).status_code == 404
    reaching = [row for row in table.rows if row.reaches]
    assert reaching
    assert table.rows[: len(reaching)] == tuple(reaching)  # those that get to the end come first
    for row in reaching:
        assert row.least_clearance_mm is not None
        assert row.least_clearance_mm >= 0.299
        assert row.tissue_mm is not None
        assert row.reached_mm == pytest.approx(row.length_mm, abs=0.1)
    assert all(row.reason for row in table.rows if not row.reaches)


def test_the_commands_print_what_was_found(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from app import cli
    from app.commands import plan as plan_command

    monkeypatch.setattr(plan_command, "build_services", lambda settings: phantom_services)
    ends = ["--case", PHANTOM_ID, "--entry", "7.5,-14,-6", "--tool", "straight_pointer", "--json"]
    assert cli.main(["plan", "suggest", *ends, "--target", "3,65,-3.5", "--name", "Suggested"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["least_clearance_mm"] == report["alternatives"][0]["least_clearance_mm"]
    assert report["tissue_mm"] == report["alternatives"][0]["tissue_mm"]
    stored = phantom_services.plans.get(report["id"])
    assert stored.name == "Suggested"
    assert all(point.direction is not None for point in stored.content.points)
    # Into the bone above the nose there is no way; the place where it ends is told, and no plan is stored.
    count = len(phantom_services.plans.list(PHANTOM_ID))
    assert cli.main(["plan", "suggest", *ends, "--target", "0,25,60", "--name", "Nowhere"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["found"] is False
    assert report["reason"]
    assert report["searched"]
    assert report["gap_mm"] > 4.0
    assert report["short"] == "the target lies in bone"
    assert len(report["ends_at"]) == 3
    assert len(phantom_services.plans.list(PHANTOM_ID)) == count


@pytest.mark.parametrize("text", ["1,2", "a,b,c", "1,2,nan", ""])
def test_a_place_is_three_numbers(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Exception, match="three numbers"):
        plan_suggest._place(text)


def test_a_place_may_begin_with_a_minus() -> None:
    from app import cli

    parser, _ = cli._build_parser("plan")
    words = ["plan", "suggest", "--case", "c", "--entry", "-1,2,3", "--target", "-4.5,-5,-6", "--name", "n"]
    args = parser.parse_args(words)
    assert args.entry == (-1.0, 2.0, 3.0)
    assert args.target == (-4.5, -5.0, -6.0)


def test_directions_of_a_plan_become_those_of_the_engine() -> None:
    back, up = (0.0, -1.0, 0.0), (0.0, -0.8, 0.6)
    points = (
        PlanPoint("a", "P1", (0.0, 0.0, 0.0), back, 90.0),
        PlanPoint("b", "P2", (0.0, 20.0, 0.0)),
        PlanPoint("c", "P3", (0.0, 40.0, 0.0), up),
    )
    path = SplinePath([point.position for point in points])
    assert point_stations(points, path) == pytest.approx([0.0, 20.0, 40.0])
    shaft = shaft_at(points, path)
    assert shaft is not None
    assert shaft.stations == pytest.approx([0.0, 40.0])
    assert shaft.frame(0.0) == pytest.approx(rolled_frame(back, math.pi / 2))
    assert shaft.direction(40.0) == pytest.approx(up)
    assert shaft_at(points[1:2], path) is None
    with pytest.raises(PlanError, match="P1 and P3"):
        shaft_at((points[0], PlanPoint("c", "P3", (0.0, 40.0, 0.0), (0.0, 1.0, 0.0))), path)
