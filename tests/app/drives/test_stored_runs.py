"""Runs: what a drive wrote comes back byte for byte, is listed, deleted with its files, and bounded."""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from run_folder import write_run

from app.cases.service import Case
from app.drives.recordings import Recordings
from app.drives.runs import FILES, RunService
from app.drives.stored_run import StoredRun
from app.kit.errors import NotFound, TooLarge
from app.kit.jobs import Job, Jobs
from app.plans.service import PlanService
from app.settings import Settings
from app.store import Store
from app.store.errors import StorageError
from vfix_engine.errors import InputError


@pytest.fixture
def runs(store: Store) -> RunService:
    return RunService(store)


def written(runs: RunService, ticks: int = 100, whole: bool = True) -> Path:
    """A run where a drive writes it."""
    return write_run(runs.new_folder(), ticks, whole)


def kept(runs: RunService, ticks: int = 100, **told: Any) -> StoredRun:
    return runs.keep(written(runs, ticks), origin="page", **told)


def stored(settings: Settings) -> list[str]:
    return sorted(path.name for path in settings.runs_dir.glob("??/*"))


def test_a_run_comes_back_byte_for_byte(
    runs: RunService, plans: PlanService, case: Case, store: Store, settings: Settings
) -> None:
    plan = plans.create(case.id, "Plan")
    folder = written(runs)
    before = {name: (folder / name).read_bytes() for name in FILES}
    run = runs.keep(folder, origin="command line", case_id=case.id, plan_id=plan.id)
    assert not folder.exists()
    assert (run.case_id, run.plan_id, run.origin, run.world, run.whole) == (
        case.id,
        plan.id,
        "command line",
        "rigid",
        True,
    )
    assert run.mode == "hands-on", "as every rigid run before there were modes"
    assert (run.manifest["seed"], run.end) == (7, {"ticks": 100, "sha256": "ab", "lost": 2})
    assert run.size_bytes == sum(len(data) for data in before.values())
    again = RunService(store)
    assert again.get(run.id) == run
    with again.laid_out(run.id) as place:
        assert {path.name: path.read_bytes() for path in place.iterdir()} == before
    assert not place.exists()
    assert len(stored(settings)) == 6


@pytest.mark.parametrize("name", FILES)
def test_a_stored_run_whose_file_has_changed_is_refused(runs: RunService, name: str) -> None:
    run = kept(runs)
    path = runs.file(run.id, name)
    path.chmod(0o600)
    path.write_bytes(path.read_bytes() + b" ")
    changed = f"{name} of the run has changed since it was recorded"
    with pytest.raises(InputError, match=changed), runs.laid_out(run.id):
        pass
    with pytest.raises(InputError, match=changed):
        runs.file(run.id, name)


def test_a_run_that_was_cut_off_is_kept_as_such(runs: RunService) -> None:
    run = runs.keep(written(runs, whole=False), origin="page")
    assert (run.whole, run.case_id, set(run.files)) == (False, None, set(FILES) - {"end.json"})


def test_runs_are_listed_by_case_and_plan_newest_first(runs: RunService, plans: PlanService, case: Case) -> None:
    plan = plans.create(case.id, "Plan")
    first, second = kept(runs, case_id=case.id), kept(runs, case_id=case.id, plan_id=plan.id)
    loose = kept(runs)
    assert {run.id for run in runs.list()} == {first.id, second.id, loose.id}
    assert [run.recorded for run in runs.list()] == sorted((run.recorded for run in runs.list()), reverse=True)
    assert {run.id for run in runs.list(case.id)} == {first.id, second.id}
    assert [run.id for run in runs.list(plan_id=plan.id)] == [second.id]
    for unknown in ({"case_id": "nobody"}, {"plan_id": "nobody"}):
        with pytest.raises(NotFound):
            kept(runs, **unknown)


def test_deleting_a_run_leaves_what_another_one_has(runs: RunService, settings: Settings) -> None:
    first, second = kept(runs, 100), kept(runs, 200)
    shared = first.files["spec.npz"].sha256
    assert shared == second.files["spec.npz"].sha256
    runs.delete(first.id)
    assert stored(settings) == sorted({file.sha256 for file in second.files.values()})
    with runs.laid_out(second.id) as place:
        assert len((place / "ticks.f64").read_bytes()) == 1600
    runs.delete(second.id)
    assert (stored(settings), runs.list()) == ([], ())
    with pytest.raises(NotFound):
        runs.delete(first.id)


def test_the_oldest_runs_give_way(store: Store, settings: Settings) -> None:
    runs = RunService(store, max_bytes=10_000)
    ids = [kept(runs, ticks).id for ticks in (300, 301, 302, 303)]
    left = runs.list()
    assert [run.id for run in left] == ids[:0:-1]
    assert sum(run.size_bytes for run in left) <= 10_000
    assert stored(settings) == sorted({file.sha256 for run in left for file in run.files.values()})
    folder = written(runs, 2000)
    with pytest.raises(TooLarge, match=r"10,000"):
        runs.keep(folder, origin="page")
    assert [run.id for run in runs.list()] == ids[:0:-1]


def test_a_teachers_run_does_not_give_way(store: Store, plans: PlanService, case: Case) -> None:
    runs, plan = RunService(store, max_bytes=10_000), plans.create(case.id, "Plan")
    first = kept(runs, 300, case_id=case.id, plan_id=plan.id)
    runs.mark_teacher(first.id)
    others = [kept(runs, ticks).id for ticks in (301, 302, 303)]
    assert [run.id for run in runs.list()] == [others[2], others[1], first.id]


@pytest.mark.parametrize("manifest", [None, "no json", "[]", '{"seed": NaN}', " " * (5 << 20)])
def test_a_folder_without_a_run_is_refused(runs: RunService, settings: Settings, manifest: str | None) -> None:
    folder = written(runs)
    (folder / "manifest.json").unlink()
    if manifest is not None:
        (folder / "manifest.json").write_text(manifest, encoding="utf-8")
    with pytest.raises(InputError):
        runs.keep(folder, origin="page")
    assert (runs.list(), stored(settings)) == ((), [])


def test_files_of_no_run_are_swept_once_they_are_old(runs: RunService, store: Store, settings: Settings) -> None:
    """A planner was killed between the files and the row; another one may be just there, so what is new stays."""
    run = kept(runs)
    lost = store.run_files.put_with(lambda file: file.write(b"half a run"))
    fresh = store.run_files.put_with(lambda file: file.write(b"another half"))
    long_ago = time.time() - 7200
    for key in (lost, *(file.sha256 for file in run.files.values())):
        os.utime(store.run_files.path(key), (long_ago, long_ago))
    runs.sweep()
    assert set(stored(settings)) == {fresh, *(file.sha256 for file in run.files.values())}


def test_a_file_that_a_deleted_run_took_along_is_stored_again(
    runs: RunService, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two planners: one deletes a run while the other stores one with the same spec."""
    first = kept(runs, 100)
    spec = first.files["spec.npz"].sha256
    bound = RunService._bound

    def meanwhile(service: RunService, session: Any) -> set[str]:
        store.run_files.remove(spec)
        return bound(service, session)

    monkeypatch.setattr(RunService, "_bound", meanwhile)
    second = kept(runs, 200)
    assert store.run_files.has(spec)
    assert second.files["spec.npz"].sha256 == spec


@pytest.mark.parametrize("error", [StorageError("the disk is full."), ValueError("Out of range float values"), None])
def test_a_run_that_cannot_be_scored_is_stored_all_the_same(
    runs: RunService, plans: PlanService, case: Case, error: Exception | None
) -> None:
    class Scores:
        def of(self, run_id: str) -> None:
            if error is not None:
                raise error

    jobs, scores = Jobs(), Scores()  # type: Jobs, Any
    plan = plans.create(case.id, "Plan")
    recording = Recordings(jobs, runs, scores).new(case.id, plan.id, plan.name)
    write_run(recording.folder)
    recording.keep()
    (job,) = jobs.list(case.id)
    done = jobs.wait(job.id, 10)
    assert (done.state, done.document_id) == ("done", plan.id)
    assert [run.id for run in runs.list(case.id, plan.id)] == [done.result]
    jobs.close()


def test_a_recording_is_stored_by_a_job_once_its_drive_has_ended(
    runs: RunService, plans: PlanService, case: Case, settings: Settings
) -> None:
    jobs = Jobs()
    plan = plans.create(case.id, "Plan")
    recording = Recordings(jobs, runs).new(case.id, plan.id, plan.name)
    assert recording is not None
    part = write_run(recording.folder.with_name(recording.folder.name + ".part"), whole=False)  # its writer was cut off
    recording.keep()
    (job,) = jobs.list(case.id)
    done = jobs.wait(job.id, 10)
    assert (done.kind, done.state, done.subject) == ("run", "done", "Plan")
    (run,) = runs.list(case.id, plan.id)
    assert (run.id, run.origin, run.whole) == (done.result, "page", False)
    assert not list(part.parent.iterdir())
    jobs.close()


@pytest.mark.parametrize("fails", ["store", "measure"])
def test_what_a_full_disk_does_not_take_is_stored_when_the_next_drive_begins_or_ends(
    store: Store, runs: RunService, plans: PlanService, case: Case, monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    """HAZ-26: what was recorded before the disk was full is not lost at the end of the drive."""

    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    jobs, plan = Jobs(), plans.create(case.id, "Plan")
    recordings = Recordings(jobs, runs)

    def driven() -> Job:
        measure = full if fails == "measure" and not jobs.list(case.id) else None
        recording = recordings.new(case.id, plan.id, plan.name, lambda progress: measure, "ab" * 32)
        write_run(recording.folder)
        recording.keep()
        return jobs.wait(jobs.list(case.id)[-1].id, 10)

    with monkeypatch.context() as disk:
        if fails == "store":
            disk.setattr(RunService, "_put", full)
        failed = driven()
    assert (failed.state, runs.list()) == ("failed", ())
    assert "No space left on device; it is kept" in str(failed.error)
    store.drives.close()  # the planner ends
    (run,) = runs.list(case.id, plan.id)
    assert (run.origin, run.whole, run.plan_sha256) == ("page", True, "ab" * 32), "of the note of a rescued one"
    jobs.close()


def test_a_drive_that_was_not_stored_is_stored_by_the_next_one(
    runs: RunService, plans: PlanService, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs, plan = Jobs(), plans.create(case.id, "Plan")
    recordings = Recordings(jobs, runs)
    first = recordings.new(case.id, plan.id, plan.name)
    write_run(first.folder)
    with monkeypatch.context() as disk:
        disk.setattr(RunService, "_put", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
        first.keep()
        assert jobs.wait(jobs.list(case.id)[-1].id, 10).state == "failed"
    assert first.folder.is_dir()
    recordings.new(case.id, plan.id, plan.name)
    assert jobs.wait(jobs.list(case.id)[-1].id, 10).state == "done"
    assert (len(runs.list(case.id, plan.id)), first.folder.exists()) == (1, False)
    jobs.close()


KILLED = """
import os, sys
from pathlib import Path
from app.drives.runs import RunService
from app.settings import Settings
from app.store import Store
from run_folder import write_run
home, case, plan = sys.argv[1:]
runs = RunService(Store(Settings(home=Path(home), port=0)))
for plan_id, ticks in ((plan, 50), (plan, 0), ("plan-gone", 50)):
    folder = runs.new_folder("page", case_id=case, plan_id=plan_id)
    write_run(folder.with_name(folder.name + ".part"), ticks, whole=False)
os.kill(os.getpid(), 9)
"""


def test_what_a_killed_planner_recorded_of_a_drive_is_kept_at_the_next_start(
    store: Store, runs: RunService, plans: PlanService, case: Case, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-30: a drive that nobody can look at any more is the one that one wants to look at."""
    plan, here = plans.create(case.id, "Plan"), Path(__file__).parents[1]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(here), str(here.parents[1])])}
    subprocess.run([sys.executable, "-c", KILLED, settings.home, case.id, plan.id], env=environment, check=False)
    with monkeypatch.context() as full:
        full.setattr(RunService, "_put", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
        runs.new_folder()
        assert runs.list() == ()
    store.drives.close()
    runs.new_folder()  # as a command does, without a sweep
    (run,) = runs.list(case.id, plan.id)
    assert (run.origin, run.whole) == ("page", False)
    assert runs.file(run.id, "ticks.f64").stat().st_size == 8 * 50
    assert not list(settings.drives_dir.rglob("run-*"))


def test_a_drive_without_a_step_leaves_no_run(runs: RunService, plans: PlanService, case: Case) -> None:
    jobs = Jobs()
    for ticks in (0, None):
        plan = plans.create(case.id, "Plan")
        recording = Recordings(jobs, runs).new(case.id, plan.id, plan.name)
        assert recording is not None
        if ticks is not None:
            write_run(recording.folder, ticks)
        recording.keep()
        assert not list(recording.folder.parent.iterdir())
    jobs.close()
    assert (jobs.list(), runs.list()) == ((), ())


def test_where_nothing_can_be_written_there_is_no_recording(
    store: Store, plans: PlanService, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plans.create(case.id, "Plan")
    monkeypatch.setattr(store, "_refusal", StorageError("full"))
    recordings = Recordings(Jobs(), RunService(store))
    with pytest.raises(StorageError, match="only read"):
        recordings.new(case.id, plan.id, plan.name)
    assert recordings.attempt(case.id, plan.id, plan.name) == (None, "the data folder is only read.")


def test_a_plan_has_one_teacher_at_most(runs: RunService, plans: PlanService, case: Case) -> None:
    plan, other = (plans.create(case.id, name) for name in ("Plan", "Other"))
    first, second = (kept(runs, number, case_id=case.id, plan_id=plan.id) for number in (100, 90))
    elsewhere, loose = kept(runs, 80, case_id=case.id, plan_id=other.id), kept(runs, 70)
    assert not first.teacher
    assert runs.mark_teacher(first.id).teacher
    assert runs.mark_teacher(first.id).teacher, "again"
    assert runs.mark_teacher(elsewhere.id).teacher
    assert runs.mark_teacher(second.id).teacher
    taught = {run.id for run in runs.list() if run.teacher}
    assert taught == {second.id, elsewhere.id}, "the other plan keeps its own"
    assert runs.mark_teacher(second.id, False) == second, "as it was"
    assert runs.get(first.id) == first
    assert runs.mark_teacher(loose.id, False) == loose
    with pytest.raises(InputError, match="run of a rigid tool"):
        runs.mark_teacher(loose.id)
    with pytest.raises(NotFound):
        runs.mark_teacher("nobody")
