"""Studies led on the page: order, consent, missing trials, runs, questionnaires; all of it survives a restart."""

from __future__ import annotations

import csv
import io
import json
import re
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rest_client import Client, opened_client

from app.cli import main
from app.clock import utc_now
from app.commands import study_own
from app.drives.runs import row_of
from app.kit.errors import NotFound
from app.operations import spec_named
from app.services import Services, build_services
from app.store.models import RunRow
from app.studies import operations as o
from app.studies.content import LedStudy
from app.studies.course import chosen_of, course_of, following_of, next_of, running_of
from vfix_engine.errors import InputError
from vfix_engine.study.own.file import parse_study
from vfix_engine.study.own.order import order_of
from vfix_engine.study.own.results import StudyResults

STUDY = """
name = "Two modes"
trials = 2
modes = ["hands-on", "freehand"]
consent = "I take part of my own will."
break_min = 5
questionnaire = "nasa-tlx"
views = { freehand = "endoscope", hands-on = "outside" }
[[plans]]
case = "Made-up head"
plan = "Through the tube"
[subjects]
codes = ["P01", "P02"]
"""
MANY = ", ".join(f'"Q{number}"' for number in range(6))
RATINGS = (0, 5, 50, 95, 100, 20)


class Led:
    """A study that is led, by operations in the store."""

    def __init__(self, services: Services, text: str = STUDY) -> None:
        (self.run,) = [one for one in services.runs.list() if one.world == "rigid"]
        self.services, self.spec = services, spec_named("study")
        context = self.spec.context(services)
        self.id = o.OpenStudy(text=text).perform(context, str(self.run.case_id), "").id

    def do(self, operation: Any) -> LedStudy:
        found: LedStudy = operation.perform(self.spec.context(self.services), "", self.id).content
        return found

    @property
    def content(self) -> LedStudy:
        return self.services.studies.documents.get(self.id).content

    def store(self, **changes: Any) -> None:
        """Change the row of the run: what it was driven with."""
        with self.services.store.writing() as session:
            row = row_of(session, self.run.id)
            manifest = {**row.manifest["manifest"], **changes.pop("manifest", {})}
            row.recorded = changes.pop("recorded", row.recorded)
            row.manifest = {**row.manifest, **changes, "manifest": manifest}

    def another_run(self, **changes: Any) -> str:
        """The id of a copy of the run with these changes."""
        with self.services.store.writing() as session:
            row = row_of(session, self.run.id)
            manifest = {**row.manifest, **changes, "manifest": {**row.manifest["manifest"], **changes["manifest"]}}
            copy = RunRow(id="run-copy", case_id=row.case_id, plan_id=row.plan_id, recorded=utc_now(), size_bytes=1)
            copy.manifest, copy.files = manifest, row.files
            session.add(copy)
        return "run-copy"


@pytest.fixture
def led(old_home: Services) -> Led:
    return Led(old_home)


def test_the_order_is_that_of_the_command_line(led: Led) -> None:
    turns = order_of(parse_study(STUDY))
    for code in ("P01", "P02"):
        course = course_of(led.content, code)
        assert [place.turn for place in course] == turns[code]
        assert [place.block for place in course] == [1, 1, 2, 2]
    firsts = {course_of(led.content, code)[0].label for code in ("P01", "P02")}
    assert firsts == {"hands-on", "freehand"}, "counterbalanced"
    with pytest.raises(InputError, match="P03"):
        course_of(led.content, "P03")


def test_a_consent_beside_a_trial_of_another_leaves_the_session_to_it(led: Led) -> None:
    led.do(o.ConfirmConsent(subject="P01"))
    led.do(o.BeginTrial(subject="P01"))
    led.do(o.ConfirmConsent(subject="P02"))
    assert (led.content.subject, led.content.consents) == ("P01", ("P01", "P02"))


def test_a_subject_consents_before_the_first_trial(led: Led) -> None:
    assert next_of(led.content, "P01").what == "consent"
    for early in (o.BeginTrial(subject="P01"), o.SkipTrial(subject="P01", reason="ill")):
        with pytest.raises(InputError, match="confirm the consent first"):
            led.do(early)
    led.do(o.ConfirmConsent(subject="P01"))
    assert (next_of(led.content, "P01").what, next_of(led.content, "P02").what) == ("trial", "consent")
    with pytest.raises(InputError, match="no consent to confirm"):
        led.do(o.ConfirmConsent(subject="P01"))
    led.do(o.UndoStudy())
    assert next_of(led.content, "P01").what == "consent"


def test_a_whole_session_with_breaks_questionnaires_and_missing_trials(led: Led) -> None:
    led.do(o.ConfirmConsent(subject="P01"))
    seen = []
    while (now := next_of(led.content, "P01")).what != "done":
        assert now.place is not None
        seen.append((now.what, now.place.turn.position, now.rest))
        assert (chosen_of(led.content), following_of(led.content)) == ("P01", "P01")
        if now.what == "trial":
            with pytest.raises(InputError, match="no questionnaire"):
                led.do(o.AnswerQuestionnaire(subject="P01", ratings=RATINGS))
            led.do(o.SkipTrial(subject="P01", reason="out of time"))
        else:
            with pytest.raises(InputError, match="answer the questionnaire first"):
                led.do(o.BeginTrial(subject="P01"))
            led.do(o.AnswerQuestionnaire(subject="P01", ratings=RATINGS))
    assert seen == [
        ("trial", 1, False), ("trial", 2, False), ("questionnaire", 2, False),
        ("trial", 3, True), ("trial", 4, False), ("questionnaire", 4, False),
    ]  # fmt: skip
    assert [(one.block, one.ratings) for one in led.content.answers] == [(1, RATINGS), (2, RATINGS)]
    assert (chosen_of(led.content), following_of(led.content)) == ("P01", "P02"), "who is done can still repeat"
    led.do(o.RepeatTrial(subject="P01", position=3))
    again = next_of(led.content, "P01")
    assert again.what == "trial"
    assert again.place is not None
    assert again.place.turn.position == 3
    with pytest.raises(InputError, match="has not begun trial 3"):
        led.do(o.RepeatTrial(subject="P01", position=3))


def to_hands_on(led: Led) -> None:
    """Go to the first trial with the hand on the robot."""
    led.do(o.ConfirmConsent(subject="P01"))
    while True:
        now = next_of(led.content, "P01")
        assert now.place is not None
        if now.what == "questionnaire":
            led.do(o.AnswerQuestionnaire(subject="P01", ratings=RATINGS))
        elif now.place.condition.mode == "hands-on":
            return
        else:
            led.do(o.SkipTrial(subject="P01", reason="not now"))


def test_the_newest_run_that_began_since_then_is_the_trial(led: Led) -> None:
    to_hands_on(led)
    with pytest.raises(InputError, match="begin it first"):
        led.do(o.AttachRun(subject="P01"))
    led.store(began=utc_now())
    time.sleep(0.002)  # the stored time has milliseconds
    led.do(o.BeginTrial(subject="P01"))
    for began in ("", led.services.runs.get(led.run.id).began):  # one of before, stored only now
        led.store(began=began, recorded=utc_now())
        with pytest.raises(NotFound, match="no recorded run of it has begun"):
            led.do(o.AttachRun(subject="P01"))
    led.store(began=utc_now())
    content = led.do(o.AttachRun(subject="P01"))
    assert content.trials[-1].run == led.run.id
    led.do(o.BeginTrial(subject="P01"))
    with pytest.raises(InputError, match="another trial already"):
        led.do(o.AttachRun(subject="P01", run_id=led.run.id))


def test_one_trial_goes_on_at_a_time(led: Led) -> None:
    to_hands_on(led)
    led.do(o.ConfirmConsent(subject="P02"))
    led.do(o.ChooseSubject(subject="P01"))
    content = led.do(o.BeginTrial(subject="P01"))
    begun = running_of(content)
    assert begun is not None
    for other in (
        o.ChooseSubject(subject="P02"),
        o.BeginTrial(subject="P02"),
        o.RepeatTrial(subject="P02", position=1),
    ):
        with pytest.raises(InputError, match="a trial of P01 goes on"):
            led.do(other)
    content = led.do(o.RepeatTrial(subject="P01", position=begun.position))
    assert running_of(content) is None, "cancelled"
    led.do(o.BeginTrial(subject="P02"))


def test_plan_and_settings_stay_those_of_the_first_trial(led: Led) -> None:
    to_hands_on(led)
    led.store(plan_sha256="a" * 64, manifest={"spec": {"settings": {"margin_mm": 1.0}}})
    led.do(o.BeginTrial(subject="P01"))
    led.do(o.AttachRun(subject="P01", run_id=led.run.id))
    other = led.another_run(plan_sha256="b" * 64, manifest={"spec": {"settings": {"margin_mm": 2.0}}})
    led.do(o.BeginTrial(subject="P01"))
    with pytest.raises(InputError, match=r"the plan or route was changed since.*; its settings are not those"):
        led.do(o.AttachRun(subject="P01", run_id=other))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"origin": "command line"}, "nobody drove it"),
        ({"manifest": {"preset": "li2007"}}, "other parameters"),
        ({"manifest": {"mode": "teleoperated"}}, "driven teleoperated, not hands-on"),
    ],
)
def test_a_run_that_was_driven_otherwise_is_refused(led: Led, changes: dict[str, Any], words: str) -> None:
    to_hands_on(led)
    led.do(o.BeginTrial(subject="P01"))
    led.store(**changes)
    with pytest.raises(InputError, match=words):
        led.do(o.AttachRun(subject="P01", run_id=led.run.id))
    with pytest.raises(NotFound):
        led.do(o.AttachRun(subject="P01", run_id="nobody"))


def test_what_is_noted_survives_a_restart(led: Led) -> None:
    to_hands_on(led)
    led.do(o.BeginTrial(subject="P01"))
    before = led.content
    settings = led.services.settings
    led.services.close()
    again = build_services(settings)
    try:
        assert again.studies.documents.get(led.id).content == before
        assert again.studies.open(str(led.run.case_id), STUDY).id == led.id, "opened once"
    finally:
        again.close()


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda text: text.replace('["P01", "P02"]', "[]\nsimulated = 2"), InputError, "no codes"),
        (lambda text: text.replace("Through the tube", "Nowhere"), NotFound, "import its case and plan"),
        (lambda text: 'tools = ["hook"]' + text, InputError, "plan's own tool"),
        (lambda text: 'arms = ["stiff"]' + text, InputError, "no arm"),
        (lambda text: text + "[", InputError, "TOML"),
        (
            lambda text: text.replace("trials = 2", "trials = 1000").replace('"P02"', MANY),
            InputError,
            "up to 10,000 trials",
        ),
        (lambda text: 'metrics = ["luck"]' + text, InputError, "luck"),
        (lambda text: text.replace("endoscope", "inside"), InputError, "views"),
        (lambda text: text.replace("nasa-tlx", "sus"), InputError, "questionnaire"),
    ],
)
def test_a_file_that_the_page_cannot_follow_is_refused(
    old_home: Services, change: Callable[[str], str], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        Led(old_home, change(STUDY))


@pytest.fixture
def client(old_home: Services) -> Iterator[Client]:
    opened = opened_client(old_home)
    yield opened
    opened.close()


def test_over_rest(client: Client, old_home: Services) -> None:
    case = next(one.case_id for one in old_home.runs.list() if one.world == "rigid")
    opened = client.post(f"/api/v1/cases/{case}/studies", json={"text": STUDY})
    assert opened.status_code == 201, opened.text
    address = f"/api/v1/studies/{opened.json()['id']}"
    assert client.post(f"{address}/consents", json={"subject": "P01"}).json()["consents"] == ["P01"]
    for wrong in ([50] * 5, [50] * 5 + [51], [50] * 5 + [105]):
        answer = client.post(f"{address}/answers", json={"subject": "P01", "ratings": wrong})
        assert answer.status_code == 422
    hostile = [
        ("subject", "PUT", {"subject": "P03"}), ("consents", "POST", {"subject": "P03"}),
        ("trials", "POST", {"subject": "../P01"}), ("trials", "POST", {"subject": 1}),
        ("runs", "POST", {"subject": "P01", "run_id": "../../etc"}),
        ("repeats", "POST", {"subject": "P01", "position": 10**9}),
        ("repeats", "POST", {"subject": "P01", "position": 4}),
        ("skips", "POST", {"subject": "P01", "reason": "x" * 201}),
        ("skips", "POST", {"subject": "P01", "reason": ""}),
    ]  # fmt: skip
    for path, method, body in hostile:
        assert client.request(method, f"{address}/{path}", json=body).status_code == 422, (path, body)
    studies = f"/api/v1/cases/{case}/studies"
    for text in ("x = [" * 5000, "\x00", "name = 1", "#" * (65 << 10)):
        assert client.post(studies, json={"text": text}).status_code in (413, 422), text[:20]
    assert client.post(f"{address}/skips", json={"subject": "Ann Example", "reason": "ill"}).status_code == 422


def test_the_results_are_those_of_the_command_line(
    client: Client, led: Led, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scored run, a skipped trial with its reason, and answers; the same by the page and `vfix study collect`."""
    led.do(o.ConfirmConsent(subject="P01"))
    while (now := next_of(led.content, "P01")).what != "done":
        assert now.place is not None
        if now.what == "questionnaire":
            led.do(o.AnswerQuestionnaire(subject="P01", ratings=RATINGS))
        elif now.place.condition.mode == "hands-on" and not any(one.run for one in led.content.trials):
            led.do(o.BeginTrial(subject="P01"))
            led.do(o.AttachRun(subject="P01", run_id=led.run.id))
        else:
            led.do(o.SkipTrial(subject="P01", reason="out of time"))
    answer = client.get(f"/api/v1/studies/{led.id}/results")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "application/zip")
    files = zipfile.ZipFile(io.BytesIO(answer.content))
    assert {"trials.csv", "answers.csv", "missing.csv", "statistics.json", "report.html"} <= set(files.namelist())

    def rows(name: str) -> list[dict[str, str]]:
        return list(csv.DictReader(files.read(name).decode().splitlines()[1:]))

    (trial,) = rows("trials.csv")
    score = led.services.run_scores.of(led.run.id)
    assert (trial["subject"], trial["mode"], float(trial["time_s"])) == ("P01", "hands-on", score["time_s"])
    assert [(row["mental"], row["nasa_tlx"]) for row in _scales(rows("answers.csv"))] == [("0.0", "45.0")] * 2
    missing = rows("missing.csv")
    assert [row["reason"] for row in missing if row["subject"] == "P01"] == ["out of time"] * 3
    assert {row["reason"] for row in missing if row["subject"] == "P02"} == {""}
    people = json.loads(files.read("statistics.json"))["groups"]["people"]
    assert (people["done"], people["planned"]) == (1, 8)
    assert client.get("/api/v1/studies/nobody/results").status_code == 404

    file = tmp_path / "two.toml"
    file.write_text(STUDY, encoding="utf-8")
    monkeypatch.setattr(study_own, "optional_services", lambda: led.services)
    for verb in ("collect", "run"):
        assert main(["study", verb, str(file)]) == 0
    written = tmp_path / "two.results"
    for name in ("trials.csv", "answers.csv", "missing.csv", "statistics.json", "report.html"):
        assert (written / name).read_bytes() == files.read(name), name


def _scales(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    return [{name.removeprefix("nasa_tlx_"): value for name, value in row.items()} for row in rows]


def test_what_cannot_be_collected_is_told(led: Led, tmp_path: Path) -> None:
    study, results = parse_study(STUDY), StudyResults(tmp_path / "results")
    to_hands_on(led)
    led.do(o.BeginTrial(subject="P01"))
    content = led.do(o.AttachRun(subject="P01", run_id=led.run.id))
    names = [place.turn.name for place in course_of(content, "P01")]
    assert led.services.studies.collect(content, study, results) == []
    assert [one.run for one in results.read(names).values()] == [led.run.id]
    led.services.runs.delete(led.run.id)
    (note,) = led.services.studies.collect(content, study, results)
    assert re.match(r"P01, trial \d: there is no run", note)
    assert results.read(names) == {}, "a run that is gone is no trial"
    assert any("there is no run" in reason for reason in results.read_reasons(names).values())


def test_a_stored_study_is_found_by_its_file(led: Led) -> None:
    studies = led.services.studies
    more = STUDY.replace("trials = 2", 'trials = 2\nmetrics = ["time_s", "smoothness"]')
    assert studies.stored(parse_study(more)).id == led.id, "other metrics are the same study"
    with pytest.raises(NotFound, match="people and order; was it changed"):
        studies.stored(parse_study(STUDY.replace("trials = 2", "trials = 3")))
    other = Led(led.services, more)
    with pytest.raises(InputError, match="several studies are of this file; say --session"):
        studies.stored(parse_study(STUDY))
    assert studies.stored(parse_study(STUDY), other.id).id == other.id
