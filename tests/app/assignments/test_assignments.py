"""Assignments: read strictly from files, stored once, and the results of their runs by each criterion."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from rest_client import Client, opened_client

from app.assignments.content import Criteria
from app.assignments.file import MAX_BYTES, read_assignment
from app.assignments.kind import ASSIGNMENT
from app.assignments.results import CRITERIA, Results, asked, judged, results_csv, results_lines
from app.cli import main
from app.drives.run_scores import RunScores
from app.drives.runs import row_of
from app.kit.errors import NotFound, TooLarge
from app.plans.model import driven_hash
from app.plans.operations.document import SetPlanSettings
from app.services import Services
from app.store.errors import StorageError
from vfix_engine.errors import InputError

FILE: dict[str, Any] = {
    "schema": "vfix-assignment/1",
    "name": "Twice through the tube",
    "plan": {"name": "Through the tube", "case": "Made-up head"},
    "mode": "hands-on",
    "criteria": {"max_time_s": 60, "max_contacts": 0, "min_clearance_mm": 0.0},
    "runs": 2,
    "since": "2020-01-01",
}
SCORE: dict[str, Any] = {
    "completed": True,
    "time_s": 12.5,
    "path_error_mm": {"robot_frame": {"mean": 0.2, "max": 0.6}},
    "target_error_mm": None,
    "least_clearance_mm": {"bone": 1.5, "artery": 0.75},
    "contacts": 1,
    "max_depth_mm": 0.1,
    "held_s": 0.5,
    "holds": [
        {"kind": "bone", "duration_s": 0.4},
        {"kind": "bone", "duration_s": 0.01},
        {"kind": "contact", "duration_s": 1},
    ],
    "spectral_arc_length": -2.0,
}


def data(**changes: Any) -> bytes:
    return json.dumps({**FILE, **changes}).encode()


def without(key: str) -> bytes:
    return json.dumps({name: value for name, value in FILE.items() if name != key}).encode()


def test_every_criterion_is_a_metric_with_a_limit() -> None:
    assert set(CRITERIA) == set(Criteria.__struct_fields__)
    values = {name: of(SCORE) for name, (_, _, of) in CRITERIA.items()}
    assert values == {
        "completed": True, "max_time_s": 12.5, "max_mean_tip_error_mm": 0.2, "max_tip_error_mm": 0.6,
        "max_mean_target_error_mm": None, "min_clearance_mm": 0.75, "max_contacts": 1, "max_contact_depth_mm": 0.1,
        "max_held_s": 0.5, "max_holds": 1, "min_smoothness": -2.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("criteria", "passed"),
    [
        ({"max_time_s": 12.5}, True), ({"max_time_s": 12.4}, False), ({"min_clearance_mm": 0.75}, True),
        ({"min_clearance_mm": 0.8}, False), ({"max_contacts": 1}, True), ({"max_contacts": 0}, False),
        ({"completed": True}, True), ({"min_smoothness": -2.5}, True), ({"min_smoothness": -1.5}, False),
        ({"max_mean_target_error_mm": 9.0}, False), ({"max_time_s": 20, "max_contacts": 0}, False),
    ],
)  # fmt: skip
def test_a_run_passes_where_every_limit_holds(criteria: dict[str, Any], passed: bool) -> None:
    result = judged(Criteria(**criteria), "run-1", "2026-01-01T00:00:00", SCORE)
    assert (result.passed, [one.name for one in result.criteria]) == (passed, list(criteria))
    assert not judged(Criteria(**criteria), "run-1", "", None, "it has no score").passed


def test_the_table_has_a_line_for_each_run() -> None:
    criteria = Criteria(max_time_s=10.0, max_contacts=1)
    runs = (
        judged(criteria, "run-1", "2026-01-01T10:00:00", SCORE),
        judged(criteria, "run-2", "2026-01-02", None, "gone"),
    )
    results = Results("A", "plan", "hands-on", "", 1, asked(criteria), runs)
    assert (results.passed, results.complete) == (0, False)
    assert replace(results, wanted=0).complete
    head, one, two = csv.reader(io.StringIO(results_csv(results)))
    assert head == [
        "run", "recorded", "max_time_s value", "max_time_s limit", "max_time_s passed", "max_contacts value",
        "max_contacts limit", "max_contacts passed", "passed", "trouble",
    ]  # fmt: skip
    assert one == ["run-1", "2026-01-01T10:00:00", "12.5", "10.0", "0", "1", "1", "1", "0", ""]
    assert (two[2], two[-1]) == ("", "gone")
    lines = results_lines(results)
    assert "12.5 ≤ 10 !" in lines[1]
    assert lines[2].endswith("gone")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "JSON"), (b"[]", "no assignment"), (b"\xff\xfe\x00", "no assignment|JSON"), (b'{"a": NaN}', "JSON"),
        (b'{"name": 1, "name": 2}', "twice"), (b"[" * 5000, "JSON"), (without("schema"), "schema"),
        (without("plan"), "plan"), (data(schema="vfix-assignment/2"), "schema"),
        (data(mode="by foot"), "mode"),
        (data(runs=0), "runs"), (data(runs="2"), "runs"), (data(runs=1e9), "runs"), (data(name="a\nb"), "control"),
        (data(name=""), "empty"), (data(name="x" * 121), "121"), (data(plan={}), "'id'"),
        (data(plan={"id": "p", "name": "x", "case": "y"}), "'id'"), (data(plan={"name": "x"}), "'case'"),
        (data(criteria={}), "no criteria"), (data(criteria={"max_fun": 1}), "max_fun"), (data(extra=1), "extra"),
        (data(criteria={"max_time_s": -1}), "max_time_s"), (data(criteria={"max_time_s": True}), "max_time_s"),
        (data(criteria={"completed": False}), "left out"), (data(preset="li2004", mode="freehand"), "preset"),
        (data(preset="li1999"), "preset"), (data(since="yesterday"), "'since'"),
        (data(plan={"id": "\u202e"}), "control"), (data(since="0001-01-01T00:00:00+14:00"), "'since' is no time"),
        (data(since="9999-12-31T23:00:00-12:00"), "'since' is no time"),
        (data(**{"\x1b[31m\u202e": 1}), r"\\x1b\[31m\\u202e"),
    ],
)  # fmt: skip
def test_what_is_no_assignment_is_refused_in_words(content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        read_assignment(content)
    assert str(refused.value).isprintable()


def test_a_huge_file_is_refused() -> None:
    with pytest.raises(TooLarge, match="65,536"):
        read_assignment(b" " * (MAX_BYTES + 1))


@pytest.fixture
def client(old_home: Services) -> Iterator[Client]:
    opened = opened_client(old_home)
    yield opened
    opened.close()


def test_an_assignment_is_opened_once_and_its_runs_are_judged(client: Client, old_home: Services) -> None:
    opened = client.post("/api/v1/assignments", files={"file": ("a.json", data())})
    assert opened.status_code == 201, opened.text
    (run,) = [one for one in old_home.runs.list() if one.world == "rigid"]
    told = opened.json()
    assert (told["plan_id"], told["case_id"], told["mode"]) == (run.plan_id, run.case_id, "hands-on")
    again = client.post("/api/v1/assignments", files={"file": ("a.json", data(plan={"id": run.plan_id}))}).json()
    assert again["id"] == told["id"], "the same again keeps its runs"
    address = f"/api/v1/assignments/{told['id']}"
    results = client.get(f"{address}/results").json()
    score = client.get(f"/api/v1/runs/{run.id}/score").json()
    (one,) = results["runs"]
    values = {each["name"]: each["value"] for each in one["criteria"]}
    assert one["run"] == run.id
    assert (values["max_time_s"], values["max_contacts"]) == (score["time_s"], score["contacts"])
    assert (results["wanted"], results["complete"]) == (2, False)
    assert results["passed"] == int(one["passed"])
    assert client.get(f"{address}/results", params={"format": "csv"}).text.startswith("run,recorded,max_time_s value")
    listed = client.get(f"/api/v1/cases/{run.case_id}/assignments").json()
    assert [(each["id"], each["criteria"]["max_contacts"]) for each in listed] == [(told["id"], 0)]
    later = client.post("/api/v1/assignments", files={"file": ("a.json", without("since"))}).json()
    assert client.get(f"/api/v1/assignments/{later['id']}/results").json()["runs"] == [], "driven before it was opened"
    other = client.post("/api/v1/assignments", files={"file": ("a.json", data(mode="freehand"))}).json()
    assert client.get(f"/api/v1/assignments/{other['id']}/results").json()["runs"] == [], "driven in another mode"
    assert client.delete(address).status_code == 200
    assert told["id"] not in [each["id"] for each in client.get(f"/api/v1/cases/{run.case_id}/assignments").json()]
    for wrong in (b"", data(runs=0)):
        assert client.post("/api/v1/assignments", files={"file": ("a.json", wrong)}).status_code == 422
    missing = client.post("/api/v1/assignments", files={"file": ("a.json", data(plan={"id": "nobody"}))})
    assert missing.status_code == 404
    with pytest.raises(NotFound):
        old_home.assignments.results("nobody")


def test_runs_that_nobody_drove_and_those_of_a_changed_plan_do_not_pass(old_home: Services) -> None:
    (run,) = [one for one in old_home.runs.list() if one.world == "rigid"]
    plan = old_home.plans.get(str(run.plan_id))

    def stored(**told: Any) -> None:
        with old_home.store.writing() as session:
            row = row_of(session, run.id)
            row.manifest = {**row.manifest, **told}

    assignment = old_home.assignments.open(data(criteria={"max_time_s": 1e6}))
    results = partial(old_home.assignments.results, assignment.id)
    assert (results().passed, results().runs[0].trouble) == (1, ""), "of an earlier version, which did not say its plan"
    for origin in ("command line", "replay", "study"):
        stored(origin=origin)
        assert results().runs == ()
    stored(origin="page", plan_sha256=driven_hash(plan.content))
    assert results().passed == 1
    old_home.plans.do(plan.id, SetPlanSettings(settings={"margin_mm": 0.4}))
    assert driven_hash(old_home.plans.get(plan.id).content) == driven_hash(plan.content), "of hand and margin"
    stored(plan_sha256=driven_hash(replace(plan.content, paths=())))
    (one,) = results().runs
    assert ([each.passed for each in one.criteria], one.passed, one.trouble) == ([True], False, "plan changed")
    assert results_lines(results())[1].endswith("plan changed")
    assert old_home.assignments.results_of_file(data(criteria={"max_time_s": 1e6})).passed == 0
    assert old_home.assignments.results_of_file(data(criteria={"max_time_s": 1e5})).passed == 0, "of the plan as it is"


@pytest.mark.parametrize("error", [StorageError("ticks.f64 is gone."), ValueError("not a number"), InputError("empty")])
def test_a_run_that_cannot_be_read_leaves_the_others_their_results(
    old_home: Services, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    assignment = old_home.assignments.open(data())

    def broken(self: RunScores, run_id: str) -> dict[str, Any]:
        raise error

    monkeypatch.setattr(RunScores, "of", broken)
    (one,) = old_home.assignments.results(assignment.id).runs
    assert (one.passed, one.trouble) == (False, f"unreadable: {error}")


def test_on_the_command_line(
    old_home: Services, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(old_home.settings.home))
    file, table = tmp_path / "a.json", tmp_path / "table.csv"
    file.write_bytes(data())
    assert main(["assignment", "check", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["criteria"] == {
        "max_time_s": 60.0,
        "max_contacts": 0,
        "min_clearance_mm": 0.0,
    }
    assert main(["assignment", "results", str(file), "--json", "--csv", str(table)]) == 0
    (run,) = json.loads(capsys.readouterr().out)["runs"]
    assert table.read_text().splitlines()[1].startswith(f"{run['run']},")
    assert main(["assignment", "results", str(file)]) == 0
    assert "of 2 runs passed: not complete" in capsys.readouterr().out
    assert main(["assignment", "check", str(file)]) == 0
    file.write_bytes(data(criteria={}))
    for wrong in (file, tmp_path, tmp_path / "none.json"):
        assert main(["assignment", "check", str(wrong)]) == 2


def test_what_is_stored_is_refused_in_words_that_a_terminal_does_not_obey() -> None:
    with pytest.raises(InputError, match=r"\\x1b\[31m"):
        ASSIGNMENT.content("vfix-assignment/1", {"\x1b[31m": 1}, None)
