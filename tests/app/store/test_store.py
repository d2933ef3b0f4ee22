"""The store: migrated at start, durable after a commit, files complete or absent."""

import argparse
import contextlib
import errno
import json
import os
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import inspect

from app.cases.service import Case
from app.cli import main
from app.plans.service import PlanService
from app.settings import Settings
from app.store import Store, write_atomically
from app.store.errors import StorageError
from app.store.models import Base
from app.store.schema import NEWEST
from benchmarks import durability
from benchmarks.report import BenchmarkRefused

KILLS = 100
ROOT = Path(__file__).resolve().parents[3]
kills = pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no kill -9 here")
posix = pytest.mark.skipif(os.name == "nt", reason="these are the rights of POSIX")


def test_the_tables_are_those_of_the_models(store: Store) -> None:
    with store.reading() as session:
        inspector = inspect(session.connection())
        for table in Base.metadata.sorted_tables:
            assert {c["name"] for c in inspector.get_columns(table.name)} == {c.name for c in table.columns}


def test_opening_twice_migrates_once(settings: Settings) -> None:
    for _ in range(2):
        Store(settings).close()
    with sqlite3.connect(settings.database_path) as connection:
        assert connection.execute("select version_num from alembic_version").fetchall() == [(NEWEST,)]
        assert connection.execute("pragma journal_mode").fetchone() == ("wal",)
    connection.close()


@posix
@pytest.mark.parametrize("found", [False, True])
def test_only_the_owner_can_read_the_home(settings: Settings, found: bool) -> None:
    """HAZ-33: whether it is made or found, and whatever the umask."""
    umask = os.umask(0)
    try:
        if found:
            settings.home.mkdir()
            for ending in ("", "-wal", "-shm"):
                Path(f"{settings.database_path}{ending}").touch()
        store = Store(settings)
        with store.reading() as session:  # a WAL is there while a connection is open
            session.connection().exec_driver_sql("select 1 from cases").all()
            database = sorted(settings.home.glob("vfix.sqlite3*"))
            rights = {path.name: path.stat().st_mode & 0o777 for path in (settings.home, *database)}
        store.close()
    finally:
        os.umask(umask)
    assert rights.pop("home") == 0o700
    assert len(rights) == 3
    assert set(rights.values()) == {0o600}


@posix
def test_rights_that_cannot_be_changed_are_told(
    settings: Settings, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    settings.home.mkdir(mode=0o755)
    monkeypatch.setattr(Path, "chmod", refuse)
    Store(settings).close()
    assert "other users" in caplog.text


def test_every_connection_syncs_fully(store: Store) -> None:
    with store.reading() as session:
        assert session.connection().exec_driver_sql("pragma synchronous").scalar() == 2


def test_an_edit_that_failed_leaves_nothing(store: Store, plans: PlanService, case: Case) -> None:
    plan = plans.create(case.id, "one")
    with contextlib.suppress(RuntimeError), store.writing() as session:
        session.connection().exec_driver_sql("update documents set name = 'torn'")
        raise RuntimeError
    assert plans.get(plan.id).name == "one"


@kills
def test_no_acknowledged_edit_is_lost_when_the_process_is_killed(capsys: pytest.CaptureFixture[str]) -> None:
    """HAZ-24: each time nobody else has the database open, so that the next one has to repair it."""
    assert main(["bench", "durability", "--kills", str(KILLS), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["correct"]
    assert (told["kills"], told["edits_lost"], told["failed_checks"]) == (KILLS, 0, [])
    assert told["edits_acknowledged"] > KILLS
    assert 0 < told["kills_before_an_edit"] < KILLS


@kills
def test_an_edit_that_is_acknowledged_too_early_would_be_found() -> None:
    found = durability.campaign(20, seed=1, early=True)
    assert found["edits_lost"] > 0
    assert not found["correct"]


def test_a_number_of_kills_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(BenchmarkRefused, match="--kills 0"):
        durability.run(argparse.Namespace(kills=0, seed=0))


@pytest.mark.parametrize("call", ["write", "fsync", "replace"])
@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO])
def test_a_full_disk_leaves_the_old_export_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, code: int
) -> None:
    """HAZ-25."""
    target = tmp_path / "plan.csv"
    write_atomically(target, b"old")

    def fail(*_: object, **__: object) -> None:
        raise OSError(code, os.strerror(code))

    with monkeypatch.context() as patch:
        if call == "write":
            real = os.fdopen

            def full(descriptor: int, mode: str) -> object:
                file = real(descriptor, mode, buffering=0)

                class Full:
                    def __enter__(self) -> "Full":
                        return self

                    def __exit__(self, *_: object) -> None:
                        file.close()

                    def write(self, data: bytes) -> None:
                        file.write(data[: len(data) // 2])
                        fail()

                return Full()

            patch.setattr(os, "fdopen", full)
        else:
            patch.setattr(os, call, fail)
        with pytest.raises(StorageError, match=os.strerror(code)):
            write_atomically(target, b"new and longer")
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_equal_files_are_stored_once_and_their_name_is_their_hash(store: Store, settings: Settings) -> None:
    first, second = (store.files.put_with(lambda file: file.write(b"skull")) for _ in range(2))
    assert first == second
    assert store.files.path(first).read_bytes() == b"skull"
    assert len(list(settings.files_dir.glob("??/*"))) == 1


def test_what_is_half_written_when_a_planner_is_killed_is_removed_at_the_next_start(
    store: Store, settings: Settings
) -> None:
    """HAZ-33: half a file of a case is half a patient's head."""
    program = (
        "import os, sys; from pathlib import Path; from app.settings import Settings; from app.store import Store\n"
        "Store(Settings(home=Path(sys.argv[1]))).files.put_with(lambda f: (f.write(b'voxels'), f.flush(), os._exit(9)))"
    )
    subprocess.run([sys.executable, "-c", program, settings.home], cwd=ROOT, check=False)
    (settings.files_dir / ".vfix-former").write_bytes(b"voxels")
    (settings.home / "uploads" / "former").mkdir(parents=True)
    assert [path for path in settings.files_dir.rglob("*") if path.is_file() and path.stat().st_size]
    store.sweep()
    assert not [path for path in settings.files_dir.rglob("*") if path.is_file() and path.stat().st_size]
    assert not (settings.home / "uploads").exists()


@pytest.mark.parametrize("key", ["../../etc/passwd", "ab", "0" * 64])
def test_a_file_that_is_not_there_is_refused(store: Store, key: str) -> None:
    with pytest.raises(StorageError):
        store.files.path(key)


def test_archives_hold_no_pickle(store: Store, cases: object, case: Case) -> None:
    """HAZ-22."""
    key = case.surfaces[0].source.removeprefix("sha256:")
    with np.load(store.files.path(key), allow_pickle=False) as archive:
        assert set(archive.files) == {"vertices", "faces"}
