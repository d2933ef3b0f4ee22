"""Data folders that cannot be used, at all or now: reported by the store and the command line; none is overwritten."""

import errno
import logging
import os
import shutil
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from app.cases.model import HEAD_PHANTOM, SHIPPED
from app.cases.service import Case, CaseFrame, CaseService
from app.cli import main
from app.commands.doctor import examine
from app.exchange.archive import is_archive
from app.plans.service import PlanService
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import build_services
from app.settings import Settings
from app.store import Store, database, schema
from app.store.errors import StorageError, StoreBusy, StoreDamaged, StoreUnusable

VERSION = schema.NEWEST
posix = pytest.mark.skipif(os.name == "nt", reason="these are the rights of POSIX")


@pytest.fixture
def used(settings: Settings, cases: CaseService, case: Case, store: Store) -> Settings:
    """A home with a case in it, at rest."""
    store.close()
    return settings


def execute(settings: Settings, *statements: str) -> None:
    with closing(sqlite3.connect(settings.database_path)) as connection:
        for statement in statements:
            connection.execute(statement)
        connection.commit()


def make_newer(settings: Settings) -> None:
    execute(settings, "update alembic_version set version_num = '9999'")


def make_noise(settings: Settings) -> None:
    settings.database_path.write_bytes(b"no database at all" * 1000)


def damage_inside(settings: Settings) -> None:
    data = bytearray(settings.database_path.read_bytes())
    data[4096:] = b"\xff" * (len(data) - 4096)
    settings.database_path.write_bytes(data)


def make_foreign(settings: Settings) -> None:
    settings.database_path.unlink()
    execute(settings, "create table recipes (name text)")


def make_empty(settings: Settings) -> None:
    settings.database_path.write_bytes(b"")


def remove(settings: Settings) -> None:
    settings.database_path.unlink()


def tables(settings: Settings) -> list[str] | None:
    """What is in the database; None where that cannot be read."""
    with suppress(sqlite3.DatabaseError), closing(sqlite3.connect(settings.database_path)) as connection:
        return [row[0] for row in connection.execute("select name from sqlite_master order by name")]
    return None


@pytest.mark.parametrize(
    ("spoil", "kind", "words"),
    [
        (make_newer, StoreUnusable, "newer vfix"),
        (make_noise, StoreDamaged, "damaged"),
        (damage_inside, StoreDamaged, "damaged"),
        (make_foreign, StoreUnusable, "recipes"),
        (make_empty, StoreUnusable, "was lost"),
        (remove, StoreUnusable, "was lost"),
    ],
)
def test_what_is_no_store_of_ours_is_told_and_left_alone(
    used: Settings,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    spoil: Callable[[Settings], None],
    kind: type[StorageError],
    words: str,
) -> None:
    spoil(used)
    before = tables(used)
    with pytest.raises(kind, match=words):
        Store(used)
    monkeypatch.setenv("VFIX_HOME", str(used.home))
    assert main(["case", "list"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert words in said
    health = examine(used)
    assert len(health.problems) == 1
    assert words in health.problems[0]
    assert tables(used) == before


def test_a_home_that_is_a_file_is_told(settings: Settings) -> None:
    settings.home.write_bytes(b"x")
    with pytest.raises(StorageError, match="VFIX_HOME"):
        Store(settings)


@posix
def test_a_home_that_may_not_be_written_is_told(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(StorageError, match="Read-only"):
        Store(settings)


@pytest.mark.parametrize("why", ["full", "read-only"])
def test_a_home_that_takes_nothing_can_be_read_and_says_why_it_cannot_be_changed(
    used: Settings, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, why: str
) -> None:
    """As it is on a disk that is full, or mounted for reading: the planner starts, and every change is refused."""
    build_services(used).close()
    code = {"full": errno.ENOSPC, "read-only": errno.EROFS}[why]

    def refuse(*_: object, **__: object) -> None:
        raise OSError(code, os.strerror(code))

    before = used.database_path.read_bytes()
    monkeypatch.setattr(database, "private_file", refuse)
    services = build_services(used)
    services.store.sweep()
    head, *_ = services.cases.list()
    plans = PlanService(services.store)
    with ThreadPoolExecutor(8) as pool:
        assert {plan.id for plan in pool.map(plans.get, [SAMPLE_PLAN] * 50)} == {SAMPLE_PLAN}
    with pytest.raises(StorageError, match=os.strerror(code)):
        plans.documents.rename(SAMPLE_PLAN, "other")
    with pytest.raises(StorageError, match=os.strerror(code)):
        services.cases.delete(head.id)
    services.close()
    assert "nothing be changed" in caplog.text
    assert used.database_path.read_bytes() == before
    assert not list(used.home.glob("*-wal"))


def test_edits_that_only_the_log_holds_are_not_passed_over(used: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    """A planner was killed, and then the disk became full: the file alone would be an older state."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    Path(f"{used.database_path}-wal").write_bytes(b"edits")
    monkeypatch.setattr(database, "private_file", refuse)
    with pytest.raises(StorageError, match="No space"):
        Store(used)


@pytest.mark.parametrize(
    ("name", "words"), [("SQLITE_FULL", "full"), ("SQLITE_READONLY", "rights"), ("SQLITE_IOERR_WRITE", "disk")]
)
def test_a_disk_that_refuses_is_told(store: Store, name: str, words: str) -> None:
    failure = sqlite3.OperationalError("says something")
    failure.sqlite_errorname = name
    with pytest.raises(StorageError, match=words), store.writing():
        raise failure


def test_a_full_database_is_told_and_can_be_read(store: Store, cases: CaseService, case: Case) -> None:
    """The very error of SQLite: a database that may not grow stands for a disk that is full."""
    with store.reading() as session:
        pages = session.connection().exec_driver_sql("pragma page_count").scalar_one()

    def fill() -> None:
        with store.writing() as session:
            session.connection().exec_driver_sql(f"pragma max_page_count = {pages}")
            session.connection().exec_driver_sql("update cases set name = :long", {"long": "x" * 1_000_000})

    with pytest.raises(StorageError, match="disk is full"):
        fill()
    assert cases.get(case.id).name == case.name


def test_an_older_database_is_copied_before_it_is_brought_up(
    used: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    migrations = tmp_path / "migrations"
    shutil.copytree(schema._MIGRATIONS, migrations)
    (migrations / "versions" / "v9999.py").write_text(
        f"from alembic import op\nrevision, down_revision = '9999', '{VERSION}'\n"
        "def upgrade(): op.execute('alter table cases add column colour text')\n",
        encoding="utf-8",
    )
    monkeypatch.setattr(schema, "_MIGRATIONS", migrations)
    monkeypatch.setattr(schema, "NEWEST", "9999")
    Store(used).close()
    copy = used.home / f"vfix-{VERSION}.sqlite3"
    assert columns(used.database_path) - columns(copy) == {"colour"}
    assert os.name == "nt" or copy.stat().st_mode & 0o777 == 0o600
    assert sorted(path.name for path in used.home.iterdir() if path.is_file()) == [copy.name, "vfix.sqlite3"]


def columns(path: Path) -> set[str]:
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("pragma integrity_check").fetchone() == ("ok",)
        assert connection.execute("select count(*) from cases").fetchone() == (1,)
        return {row[1] for row in connection.execute("pragma table_info(cases)")}


def test_a_migration_that_cannot_be_copied_first_is_not_begun(used: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(schema, "NEWEST", "9999")
    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(StorageError, match="no copy"):
        Store(used)
    assert not list(used.home.glob("*.half"))


def test_only_the_newest_copies_are_kept_and_they_are_listed(
    used: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for age, name in enumerate(("0004", "0003", "0002x", "0001x"), start=1):
        copy = used.home / f"vfix-{name}.sqlite3"
        copy.write_bytes(b"older")
        os.utime(copy, (1e9 - age, 1e9 - age))
    migrations = tmp_path / "migrations"
    shutil.copytree(schema._MIGRATIONS, migrations)
    (migrations / "versions" / "v9999.py").write_text(
        f"revision, down_revision = '9999', '{VERSION}'\ndef upgrade(): pass\n", encoding="utf-8"
    )
    monkeypatch.setattr(schema, "_MIGRATIONS", migrations)
    monkeypatch.setattr(schema, "NEWEST", "9999")
    Store(used).close()
    kept = ["vfix-0003.sqlite3", "vfix-0004.sqlite3", f"vfix-{VERSION}.sqlite3"]
    assert [copy.name for copy in used.database_copies] == kept
    listed = examine(used).database_copies
    assert list(listed) == kept
    assert listed["vfix-0004.sqlite3"] == 5


def test_bad_rows_stop_neither_the_start_nor_the_lists(
    settings: Settings, cases: CaseService, case: Case, store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    build_services(settings).close()
    frame, bone = CaseFrame("LPS", assumed=False), {"bone": cases.case_surface(case.id)}
    documents = ["'{}'", "'no json'", "'[[['", "'null'", "cast(x'ff' as text)"]
    bad = [cases.create("Canary^Patient", frame=frame, surfaces=bone).id for _ in documents]
    store.close()
    for case_id, document in zip([*bad, HEAD_PHANTOM], [*documents, "'no json'"], strict=True):
        execute(settings, f"update cases set document = {document} where id = '{case_id}'")
    execute(settings, f"update document_states set content = 'null' where document_id = '{SAMPLE_PLAN}'")
    services = build_services(settings)
    listed = services.cases.list()
    assert {each.id for each in listed if not each.unreadable} == {*SHIPPED, case.id}  # the head is back
    assert {each.id for each in listed if each.unreadable} == set(bad)
    for case_id in bad:
        with pytest.raises(StoreDamaged):
            services.cases.get(case_id)
        assert case_id in caplog.text
    services.close()
    assert "Canary" not in caplog.text


@contextmanager
def write_lock(settings: Settings) -> Iterator[None]:
    """Another program that writes and does not end."""
    with closing(sqlite3.connect(settings.database_path, check_same_thread=False)) as connection:
        connection.execute("begin immediate")
        yield
        connection.rollback()


def test_while_another_program_writes_all_can_be_read_and_no_edit_waits_for_ever(
    store: Store, settings: Settings, cases: CaseService, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many more writers wait than there are connections, and nobody who reads waits for them."""
    monkeypatch.setattr(database, "BUSY_SECONDS", 2.0)
    impatient = Store(settings)
    plans, told = PlanService(impatient), []
    plan = PlanService(store).create(case.id, "one")

    def rename() -> None:
        try:
            plans.documents.rename(plan.id, "two")
        except StoreBusy as error:
            told.append(str(error))

    with write_lock(settings):
        threads = [threading.Thread(target=rename) for _ in range(40)]
        for thread in threads:
            thread.start()
        read = 0
        while any(thread.is_alive() for thread in threads):
            assert plans.get(plan.id).name == "one"
            assert [c.id for c in CaseService(impatient).list()] == [case.id]
            read += 1
            time.sleep(0.01)
    assert len(told) == 40
    assert all("try again" in words for words in told)
    assert read > 20
    plans.documents.rename(plan.id, "two")
    assert plans.get(plan.id).name == "two"
    impatient.close()


def test_a_start_while_another_program_writes(used: Settings) -> None:
    build_services(used).close()
    with write_lock(used):
        services = build_services(used)
        assert services.cases.get(HEAD_PHANTOM).id == HEAD_PHANTOM
        services.close()


def test_no_error_of_the_database_tells_a_name(store: Store, case: Case, caplog: pytest.LogCaptureFixture) -> None:
    """HAZ-33."""
    failed: list[BaseException] = []
    try:
        with store.writing() as session:
            values: dict[str, Any] = {"id": case.id, "name": "Canary^Patient"}
            session.connection().exec_driver_sql("insert into cases (id, name) values (:id, :name)", values)
    except StorageError as error:
        failed.append(error)
        logging.getLogger("test").exception("met")
    assert len(failed) == 1
    assert "Canary" not in caplog.text


def test_what_two_planners_make_at_the_same_first_start_is_there_once(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another one may make the sample plan after this one has seen that it is missing."""
    create = PlanService.create

    def second(*args: Any, **options: Any) -> Any:
        create(*args, **options)
        return create(*args, **options)

    monkeypatch.setattr(PlanService, "create", second)
    services = build_services(settings)
    assert [plan.id for plan in services.plans.list(HEAD_PHANTOM)] == [SAMPLE_PLAN]
    services.close()


def test_a_head_is_saved_from_a_home_that_takes_nothing(
    used: Settings, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What an export unpacks goes to the system's folder, and is removed from there."""
    build_services(used).close()
    places: list[Path] = []

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(database, "private_file", refuse)
    services = build_services(used)
    monkeypatch.setattr(services.store.scratch, "_create", refuse)
    with pytest.raises(StorageError, match="takes no temporary files"):
        services.store.scratch.open()
    places.append(services.store.exports.open())
    assert used.home not in places[0].parents
    with (tmp_path / "head.zip").open("xb") as target:
        services.archive_writer.write(HEAD_PHANTOM, target)
    assert is_archive(tmp_path / "head.zip")
    assert list(places[0].iterdir()) == []
    services.close()
    assert not places[0].parent.exists()


def test_doctor_finds_nothing_wrong_with_a_store_that_is_new_or_in_use(settings: Settings) -> None:
    """And it leaves no file of its own beside the database."""
    assert examine(settings).problems == ()
    services = build_services(settings)
    assert examine(settings).problems == ()
    services.close()
    before = sorted(path.name for path in settings.home.iterdir())
    assert examine(settings).problems == ()
    assert sorted(path.name for path in settings.home.iterdir()) == before


def test_doctor_does_not_wait_for_a_store_that_stays_locked(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    Store(settings).close()
    monkeypatch.setattr("app.store.looking._BUSY_S", 0.1)
    with closing(sqlite3.connect(settings.database_path, isolation_level=None)) as holder:
        holder.execute("PRAGMA locking_mode=EXCLUSIVE")
        holder.execute("BEGIN EXCLUSIVE")
        assert any("another program" in words for words in examine(settings).problems)
    assert examine(settings).problems == ()


def test_a_home_that_is_a_file_is_a_problem(settings: Settings) -> None:
    settings.home.write_bytes(b"x")
    assert any("cannot be written" in words for words in examine(settings).problems)
