"""The Study tab of one client: a stored run becomes the trial, whoever stored it, and the trial fixes its drive."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest
from session_doubles import Heard, sections_of, send, workspace_of

from app.clock import utc_now
from app.drives.plan_drive import PlanDrive
from app.drives.runs import row_of
from app.services import Services
from app.tabs.study.tab import StudyTab
from app.workspace.fixed_drive import FixedDrive
from vfix_engine.errors import InputError, VfixError
from vfix_engine.runtime.control_mode import Control

STUDY = """
name = "One mode"
trials = 2
modes = ["hands-on"]
[[plans]]
case = "Made-up head"
plan = "Through the tube"
[subjects]
codes = ["P01", "P02"]
"""


class Leader:
    """A page with the tab, and the one stored run of a rigid tool."""

    def __init__(self, services: Services, text: str = STUDY) -> None:
        (self.run,) = [one for one in services.runs.list() if one.world == "rigid"]
        self.services, self.heard = services, Heard()
        self.tab = StudyTab(workspace_of(services, self.heard))
        self.tab.workspace.open_case(str(self.run.case_id))
        send(self.tab, "study.new", text=text)

    def store(self, **manifest: Any) -> None:
        """The run is one that begins now."""
        with self.services.store.writing() as session:
            row = row_of(session, self.run.id)
            row.manifest = row.manifest | {"began": utc_now(), "manifest": row.manifest["manifest"] | manifest}

    def job(self, work: Callable[[Any], str]) -> None:
        """A job of a run, until it has ended."""
        job = self.services.jobs.submit(work, kind="run", lane="a run")
        deadline = time.monotonic() + 60.0
        while self.services.jobs.get(job.id).state in ("queued", "running") and time.monotonic() < deadline:
            time.sleep(0.005)

    @property
    def view(self) -> Any:
        return sections_of(self.tab)["study"]


@pytest.fixture
def leader(old_home: Services) -> Leader:
    return Leader(old_home)


def failed(progress: Any) -> str:
    raise VfixError("the disk is full")


def test_a_stored_run_is_the_trial_and_a_failed_job_is_none(leader: Leader) -> None:
    tab = leader.tab
    assert tab.tick() is False, "nothing goes on"
    send(tab, "study.begin", subject="P01")
    assert tab.tick() is False
    leader.job(failed)
    assert tab.tick() is False
    assert (leader.view["trial"]["running"], leader.heard.words) == (True, [])
    leader.store()
    leader.job(lambda progress: leader.run.id)
    assert tab.tick() is True
    assert (leader.view["attached"], leader.view["trial"]["position"], leader.view["trial"]["running"]) == (
        [1],
        2,
        False,
    )
    assert tab.tick() is False


def test_a_run_that_was_stored_while_no_page_was_there_is_the_trial(leader: Leader) -> None:
    send(leader.tab, "study.begin", subject="P01")
    study = leader.view["id"]
    leader.tab.close()
    leader.store()
    anew = StudyTab(workspace_of(leader.services))
    send(anew, "study.show", study_id=study)
    assert anew.tick() is True
    assert sections_of(anew)["study"]["attached"] == [1]


def test_a_run_of_another_mode_is_told_once_and_the_trial_goes_on(leader: Leader) -> None:
    send(leader.tab, "study.begin", subject="P01")
    leader.store(mode="teleoperated", device="rate")
    for _ in range(2):
        leader.job(lambda progress: "")
        assert leader.tab.tick() is False
    (words,) = leader.heard.words
    assert "driven teleoperated, not hands-on. Drive it again" in words
    assert leader.view["trial"]["running"]
    leader.store(mode="hands-on", device=None)
    leader.job(lambda progress: "")
    assert leader.tab.tick() is True


def test_a_trial_fixes_the_drive_of_its_plan_until_it_ends(leader: Leader) -> None:
    def fixed_after(kind: str, **fields: Any) -> FixedDrive | None:
        send(leader.tab, kind, **fields)
        return leader.tab.workspace.fixed

    expected = FixedDrive(str(leader.run.plan_id), PlanDrive(Control("hands-on"), None))
    ends: list[tuple[str, dict[str, Any]]] = [
        ("study.repeat", {"subject": "P01", "position": 1}),
        ("study.skip", {"subject": "P01", "reason": "ill"}),
        ("study.show", {"study_id": None}),
    ]
    for kind, fields in ends:
        assert fixed_after("study.begin", subject="P01") == expected
        assert fixed_after(kind, **fields) is None, kind
    assert not leader.tab.offered


def test_a_teleoperated_trial_is_driven_with_a_rate_device(old_home: Services) -> None:
    leader = Leader(old_home, STUDY.replace("hands-on", "teleoperated"))
    send(leader.tab, "study.begin", subject="P01")
    fixed = leader.tab.workspace.fixed
    assert fixed is not None
    assert fixed.how == PlanDrive(Control("teleoperated", "rate"), None)
    trial = leader.view["trial"]["plan"]
    assert (trial["mode"], trial["device"]) == ("teleoperated", "rate")


def test_who_is_done_is_shown_with_who_follows(leader: Leader) -> None:
    for _ in range(2):
        assert leader.tab.hint() == "P01 drives hands-on next: Begin trial."
        send(leader.tab, "study.begin", subject="P01")
        assert leader.tab.hint() == "The trial goes on in Rehearse."
        send(leader.tab, "study.skip", subject="P01", reason="ill")
    view = leader.view
    assert (view["subject"], view["next"], view["following"]) == ("P01", "done", "P02")
    assert [one["position"] for one in view["missing"]] == [1, 2], "who is done can repeat what is missing"
    assert leader.tab.hint() == "P02 is next."
    send(leader.tab, "study.subject", subject="P02")
    assert leader.view["next"] == "trial"


def test_nothing_is_done_where_no_study_is_open(old_home: Services) -> None:
    tab = StudyTab(workspace_of(old_home))
    with pytest.raises(InputError, match="no study is open"):
        send(tab, "study.begin", subject="P01")
