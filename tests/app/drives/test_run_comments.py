"""Comments on runs: at a time, on a drive and on what was stored, of any world, and not lost with the planner."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from run_folder import write_run

from app.cases.service import Case
from app.drives import live_comments as of_drives
from app.drives.live_comments import MAX_CHARACTERS, LiveComments, beside
from app.drives.recordings import Recording, Recordings
from app.drives.run_comments import RunComments
from app.drives.runs import RunService
from app.drives.stored_run import StoredRun
from app.kit.errors import NotFound, TooMany
from app.kit.jobs import Jobs
from app.plans.service import PlanService
from app.settings import Settings
from app.store import Store
from app.store.errors import StorageError
from tests.engine.tiny import TinySpec
from vfix_engine.errors import ControlError, InputError, PlanError
from vfix_engine.runtime.command import no_command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.requests import Reset
from vfix_engine.runtime.run import RunWriter


@pytest.fixture
def runs(store: Store) -> RunService:
    return RunService(store)


@pytest.fixture
def comments(store: Store, runs: RunService) -> RunComments:
    return RunComments(store, runs)


def driven(folder: Path, before: int, after: int) -> None:
    """A run of a world of its own, with a return to the start after some of its steps of 2 ms."""
    system = TinySpec().build()
    writer = RunWriter(folder, TinySpec(), system.row_layout)
    driver = Driver(system, log=writer)
    for steps in (before, after):
        for _ in range(steps):
            driver.step(no_command())
        if steps is before and after:
            driver.apply(Reset())
    writer.close()


def kept(runs: RunService, before: int = 500, after: int = 0) -> StoredRun:
    folder = runs.new_folder()
    driven(folder, before, after)
    return runs.keep(folder, origin="page")


def test_a_comment_is_written_changed_and_deleted(runs: RunService, comments: RunComments) -> None:
    run = kept(runs)
    late = comments.add(run.id, 0.5, "  Too fast here  ")
    early = comments.add(run.id, 0.1, "<b>Well</b> begun")
    assert (late.text, late.t_s, late.step, early.step) == ("Too fast here", 0.5, 250, 50)
    assert runs.get(run.id).comments == (early, late), "in the order of time, with the text as it was written"
    moved = comments.edit(run.id, late.id, at_s=1.0)
    assert (moved.text, moved.t_s, moved.step, moved.id) == ("Too fast here", 1.0, 500, late.id)
    said = comments.edit(run.id, early.id, "Well begun")
    assert runs.get(run.id).comments == (said, moved)
    comments.delete(run.id, moved.id)
    comments.delete(run.id, said.id)
    assert runs.get(run.id) == run, "as it was"
    for gone in (lambda: comments.delete(run.id, said.id), lambda: comments.edit(run.id, said.id, "x")):
        with pytest.raises(NotFound):
            gone()
    with pytest.raises(NotFound):
        comments.add("nobody", 0.0, "x")


def test_what_is_no_comment_is_refused(
    runs: RunService, comments: RunComments, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = kept(runs)
    for text in ("", "  ", "a\nb", "a\x1b[31mb", "\u202eabc", "\ud800", "\ufdd0", "x" * (MAX_CHARACTERS + 1), 7, None):
        with pytest.raises(InputError):
            comments.add(run.id, 0.0, text)
    for at in (-0.1, 1.2, 1e300):
        with pytest.raises(InputError, match=r"from 0 to 1\.0 s"):
            comments.add(run.id, at, "late")
    for odd in (float("nan"), float("inf")):
        with pytest.raises(PlanError, match="finite"):
            comments.add(run.id, odd, "never")
    monkeypatch.setattr(of_drives, "MOST", 1)
    comments.add(run.id, 0.0, "x" * MAX_CHARACTERS)
    with pytest.raises(TooMany, match="delete one"):
        comments.add(run.id, 0.0, "one more")


def test_times_count_from_the_last_return_to_the_start(
    runs: RunService, comments: RunComments, plans: PlanService, case: Case
) -> None:
    jobs, plan = Jobs(), plans.create(case.id, "Plan")
    recording = Recordings(jobs, runs).new(case.id, plan.id, plan.name)
    driven(recording.folder, 100, 200)
    for step in (40, 100, 250, 300):
        recording.comments.add(f"after {step}", 9.9, step)
    recording.keep()
    done = jobs.wait(jobs.list(case.id)[-1].id, 10)
    jobs.close()
    (run,) = runs.list(case.id)
    assert (done.state, run.id) == ("done", done.result)
    assert [(one.step, one.t_s) for one in run.comments] == [(40, None), (100, 0.0), (250, 0.3), (300, 0.4)]
    assert comments.add(run.id, 0.3, "there too").step == 250
    assert not beside(recording.folder, "comments").exists()
    with pytest.raises(ControlError, match="in Review"):
        recording.comments.add("too late", 0.0, 0)


def test_a_comment_that_cannot_be_stored_is_not_shown(tmp_path: Path) -> None:
    live = LiveComments(tmp_path / "gone" / "run-1")
    with pytest.raises(StorageError, match="No such file"):
        live.add("lost", 0.0, 0)
    assert live.all == ()


def test_a_recording_that_nobody_can_read_keeps_its_comments(runs: RunService) -> None:
    folder = write_run(runs.new_folder())
    LiveComments(folder).add("what was that", 1.0, 50)
    assert [(one.text, one.t_s) for one in runs.keep(folder, origin="page").comments] == [("what was that", None)]
    folder = write_run(runs.new_folder())
    beside(folder, "comments").write_text('[{"id": 1}]', encoding="utf-8")
    assert runs.keep(folder, origin="page").comments == ()
    assert not beside(folder, "comments").exists()


KILLED = """
import os, sys
from pathlib import Path
from app.drives.live_comments import LiveComments
from app.drives.runs import RunService
from app.settings import Settings
from app.store import Store
from test_run_comments import driven
home, case, plan = sys.argv[1:]
runs = RunService(Store(Settings(home=Path(home), port=0)))
folder = runs.new_folder("page", case_id=case, plan_id=plan)
driven(folder, 500, 0)
LiveComments(folder).add("Slower past the artery", 0.2, 100)
os.kill(os.getpid(), 9)
"""


def test_a_planner_that_is_killed_loses_no_comment(
    store: Store, runs: RunService, plans: PlanService, case: Case, settings: Settings
) -> None:
    plan, here = plans.create(case.id, "Plan"), Path(__file__).parent
    paths = [str(here), str(here.parent), str(here.parents[2])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, settings.home, case.id, plan.id], env=environment, check=False
    )
    assert ended.returncode == -9
    runs.new_folder()  # the next start
    (run,) = runs.list(case.id, plan.id)
    assert [(one.text, one.t_s, one.step) for one in run.comments] == [("Slower past the artery", 0.2, 100)]
    assert not list(settings.drives_dir.rglob("*.comments"))


def test_recordings_of_other_drives_have_their_own_comments(runs: RunService, plans: PlanService, case: Case) -> None:
    jobs, plan = Jobs(), plans.create(case.id, "Plan")
    made = Recordings(jobs, runs)
    one, other = (made.new(case.id, plan.id, plan.name) for _ in range(2))
    assert isinstance(one, Recording)
    one.comments.add("here", 0.0, 0)
    assert (len(one.comments.all), other.comments.all) == (1, ())
    jobs.close()
