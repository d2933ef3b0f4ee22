"""A study in a lumen that is led on the page: a person's trials by the Study and Drive tabs, to the same results."""

from __future__ import annotations

import csv
import io
import time
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from lumen_cases import TUBE_MM, route_in, tube
from lumen_driving import INSERT, Driving, stored
from rest_client import opened_client
from session_doubles import sections_of, send

from app.cli import main
from app.commands import study_own
from app.drives.shared_drives import SharedDrives
from app.drives.stored_run import StoredRun
from app.kit.errors import NotFound
from app.lumen.document import StoredRoute
from app.lumen.drive_options import LumenDriveOptions
from app.lumen.marks import RouteMark
from app.lumen.tasks import TaskChoice
from app.services import Services
from app.studies.driven import DrivenRoute
from app.tabs.study.tab import StudyTab
from vfix_engine.errors import ControlError, InputError
from vfix_engine.study.own.file import conditions, parse_study

EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "examples" / "lumen_study.toml"
STUDY = """
name = "Two arms"
trials = 1
arms = ["guided", "certified"]
metrics = ["time_s", "completed", "polyps_missed", "beyond_bound_mm"]
[[routes]]
case = "Tube"
route = "Along"
task = "kwok1"
places = "route"
hold_s = 0.5
[subjects]
codes = ["P01"]
"""


def text_of(route: StoredRoute) -> str:
    """The study of a route, by ids."""
    return STUDY.replace("Tube", route.case_id).replace("Along", route.id)


MARKS = (RouteMark("p1", "polyp", "Polyp 1", (0.0, 0.0, TUBE_MM)),)


@pytest.fixture
def route(phantom_services: Services) -> StoredRoute:
    return route_in(phantom_services, tube(phantom_services), links=10, length_mm=14.0, radius_mm=4.0, marks=MARKS)


@pytest.fixture
def shared() -> Iterator[SharedDrives[Any, Any]]:
    made: SharedDrives[Any, Any] = SharedDrives()
    yield made
    made.close()


def test_a_person_is_led_through_both_arms(
    phantom_services: Services,
    shared: SharedDrives[Any, Any],
    route: StoredRoute,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client = Driving(phantom_services, shared)
    study, drive = StudyTab(client.workspace), client.tab
    client.open(route)
    send(study, "study.new", text=text_of(route))
    first = sections_of(study)["study"]["trial"]
    assert (first["tab"], first["document_id"], first["view"], first["plan"]) == ("drive", route.id, "endoscope", None)
    send(drive, "drive.arm", arm="manual")

    send(study, "study.begin", subject="P01")
    assert drive.options == LumenDriveOptions(first["lumen"]["arm"], task=TaskChoice("polyps", "route", hold_s=0.5)), (
        "whatever was chosen before"
    )
    shown = client.shown()
    assert (shown["drive_options"]["arm"], shown["drive_options"]["open"]) == (first["lumen"]["arm"], False)
    assert (shown["drive_task"]["task"], shown["drive_task"]["open"]) == ("polyps", False)
    assert study.hint() == "The trial goes on in Drive."
    send(drive, "rehearsal.start")
    client.until(lambda shown: shown["rehearsal"]["state"] == "running")
    for kind, fields in (
        ("drive.arm", {"arm": "manual"}),
        ("drive.preset", {"preset": "kwok2013"}),
        ("drive.task", {"task": None}),
        ("rehearsal.settings", {"values": {"insertion_mm_per_s": 5.0}}),
        ("rehearsal.reset", {}),
    ):
        with pytest.raises(ControlError, match="a trial of the study fixes"):
            send(drive, kind, **fields)
    client.until(lambda shown: shown["drive_task"]["now"]["completed"], INSERT)
    send(drive, "rehearsal.end")
    (run,) = stored(phantom_services, route)
    _until_attached(study)
    view = sections_of(study)["study"]
    assert (view["attached"], view["trial"]["lumen"]["arm"]) == ([1], {"guided": "certified"}.get(run.arm, "guided"))
    assert client.workspace.fixed is None
    send(study, "study.skip", subject="P01", reason="ill")
    file = tmp_path / "two.toml"
    file.write_text(text_of(route), encoding="utf-8")
    monkeypatch.setattr(study_own, "optional_services", lambda: phantom_services)
    _check_results(phantom_services, sections_of(study)["study"]["id"], run.id, file)


def _until_attached(study: StudyTab) -> None:
    deadline = time.monotonic() + 60.0
    while not study.tick():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _check_results(services: Services, study_id: str, run_id: str, file: Path) -> None:
    """The files of the page are those of `vfix study collect` and `run`."""
    client = opened_client(services)
    data = client.get(f"/api/v1/studies/{study_id}/results").raise_for_status().content
    client.close()
    files = zipfile.ZipFile(io.BytesIO(data))
    (row,) = csv.DictReader(files.read("trials.csv").decode().splitlines()[1:])
    score = services.run_scores.of(run_id)
    missed = next(one["value"] for one in score["task"]["rows"] if one["name"] == "Polyps missed")
    assert (row["subject"], row["mode"], row["arm"]) == ("P01", "kwok1", score["arm"])
    assert [float(row[name]) for name in ("time_s", "completed", "polyps_missed")] == [score["time_s"], 1.0, missed]
    assert b"ill" in files.read("missing.csv")
    for verb in ("collect", "run"):
        assert main(["study", verb, str(file)]) == 0
    for name in ("trials.csv", "missing.csv", "statistics.json", "report.html"):
        assert (file.with_suffix(".results") / name).read_bytes() == files.read(name), name


METRICS = 'metrics = ["time_s", "completed", "polyps_missed", "beyond_bound_mm"]\n'
TASK = 'task = "kwok1"\nplaces = "route"\nhold_s = 0.5\n'


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"kwok1": "kwok2"}, InputError, "are of polyps"),
        ({METRICS: "", TASK: 'task = "kwok2"\n'}, InputError, "has no task kwok2: labels are traced in the body"),
        ({'route = "': 'route = "other-'}, NotFound, "the route 'other-route-.*' of the study is not here"),
        (
            {METRICS: "", TASK: "", 'arms = ["guided", "certified"]\n': "", "routes": "plans", "route =": "plan ="},
            InputError,
            "is a lumen, which has routes; name it in",
        ),
        ({"polyps_missed": "labels_traced"}, InputError, "is of kwok2, a task that no route"),
    ],
)
def test_a_file_that_the_page_cannot_follow_is_refused(
    phantom_services: Services, route: StoredRoute, changes: dict[str, str], error: type[Exception], words: str
) -> None:
    text = text_of(route)
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(error, match=words):
        phantom_services.studies.open(route.case_id, text)


def test_the_example_is_of_lumens_that_come_along(phantom_services: Services) -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    phantom_services.studies.open("colon-phantom", text)
    cavity = text.replace("colon-phantom", "cavity-phantom").replace('"kwok1"', '"kwok2"', 1)
    metrics = next(line for line in cavity.splitlines() if line.startswith("metrics"))
    assert phantom_services.studies.open("cavity-phantom", cavity.replace(metrics, "")).case_id == "cavity-phantom"


def test_a_run_that_was_driven_otherwise_is_none_of_the_trial(phantom_services: Services, route: StoredRoute) -> None:
    text = text_of(route)
    driven = phantom_services.studies.driven(text, conditions(parse_study(text))[0])
    assert isinstance(driven, DrivenRoute)
    manifest = {"world": "snake", "spec": {"drive": {"arm": "guided"}}, "preset": None}
    run = StoredRun("run-1", route.case_id, route.id, "page", "", 1, manifest, None, {})
    assert driven.differences(run, list) == ["its task is another one"]
    other = {**manifest, "spec": {"drive": {"arm": "manual"}}, "preset": "kwok2013"}
    found = driven.differences(replace(run, manifest=other, origin="command line", plan_id="route-2"), list)
    assert found == [
        "it is of another plan or route", "it was driven manual, not guided", "it has other parameters",
        "its task is another one", "nobody drove it on the page",
    ]  # fmt: skip
