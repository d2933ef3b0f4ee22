"""A data folder and an archive of an earlier version: all of it is read, undone, driven again, and kept as it was.

`tests/data/old_home` says what is in them and how they were made.
"""

import hashlib
import json
import os
import shutil
import sqlite3
import subprocess
import sys
import tarfile
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from app.cases.model import HEAD_PHANTOM
from app.documents import DocumentKind
from app.documents.documents import Documents
from app.plans.operations.document import SetPlanSettings
from app.plans.operations.points import AddPoint
from app.services import Services, build_services
from app.settings import Settings
from app.store import Store, schema
from app.store.errors import StoreUnusable
from app.store.models import DocumentRow, DocumentStateRow
from vfix_engine.errors import InputError
from vfix_engine.moved import current_class
from vfix_engine.runtime.plain import to_plain
from vfix_engine.runtime.run import Run, digest
from vfix_engine.worlds.registry import spec_of

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT / "tests" / "data" / "old_home"
HEAD, PLAN = "Made-up head", "Through the tube"
STEPS = {"rigid": 750, "snake": 380, "snake drive": 1781}
LAST_BITS = 1e-9  # [mm, rad, N]
ADDED = {"second_volume": {"other_head": False}}  # keys that contents have since, with what an older one has there


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder as the earlier version left it; nobody writes into it."""
    place = tmp_path_factory.mktemp("kept")
    with tarfile.open(DATA / "home.tar.xz") as archive:
        archive.extractall(place, filter="data")
    return place / "home"


@pytest.fixture
def old(kept: Path, tmp_path: Path) -> Settings:
    """A copy of it."""
    return Settings(home=shutil.copytree(kept, tmp_path / "old"), port=0)


@pytest.fixture(scope="module")
def read(kept: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Services]:
    """Services over a copy, which tests only read."""
    home = shutil.copytree(kept, tmp_path_factory.mktemp("read") / "home")
    services = build_services(Settings(home=home, port=0))
    yield services
    services.close()


def every(services: Services) -> tuple[Documents[Any], ...]:
    """The documents of each kind."""
    return (
        services.plans.documents,
        services.versions.documents,
        services.registrations,
        services.labels.documents,
    )


def states_of(services: Services, document_id: str) -> dict[int, DocumentStateRow]:
    """The stored states of a document by their position."""
    with services.store.reading() as session:
        found = select(DocumentStateRow).where(DocumentStateRow.document_id == document_id)
        return {state.position: state for state in session.scalars(found)}


def grown(content: dict[str, Any]) -> dict[str, Any]:
    """A stored content with the keys that this version adds, in a plan that it holds too."""
    more = {key: {**content[key], **added} for key, added in ADDED.items() if content.get(key)}
    return {**content, **more, **({"plan": grown(content["plan"])} if "plan" in content else {})}


def written(kind: DocumentKind[Any], content: Any) -> Any:
    """What is stored of a content in the history, as JSON reads it."""
    values = kind.write(content)
    values.pop("settings", None)
    return json.loads(json.dumps(values))


def cursor_of(services: Services, document_id: str) -> int:
    with services.store.reading() as session:
        row = session.get(DocumentRow, document_id)
        assert row is not None
        return row.cursor


def test_every_document_and_every_state_of_its_history_is_read_and_written_the_same(read: Services) -> None:
    counts = {}
    for documents in every(read):
        kind, found = documents.kind, documents.list(include_deleted=True)
        counts[kind.name] = len(found)
        for document in found:
            assert not document.unreadable, document.unreadable
            settings = kind.write(document.content).get("settings", {})
            for state in states_of(read, document.id).values():
                again = written(kind, kind.content(state.schema, state.content, settings))
                assert again == grown(state.content), (kind.name, document.name, state.position)
    assert counts == {"plan": 8, "plan-version": 2, "registration": 5, "label": 2}
    for case in read.cases.list(include_deleted=True):
        assert not case.unreadable
        for info in case.surfaces:
            assert len(read.cases.case_surface(case.id, info.name).faces) == info.triangles
        assert len(read.cases.volumes(case)) == len(case.volumes)


def test_what_is_in_it_is_not_less_than_it_was(read: Services) -> None:
    """The folder has of everything: what is read is compared with what was stored, so nothing of it may be missing."""
    head = next(case for case in read.cases.list() if case.name == HEAD)
    plan = next(plan for plan in read.plans.list(head.id) if plan.name == PLAN)
    assert [point.label for point in plan.content.points] == ["Entry", "P1", "Middle", "End"]
    assert len(plan.content.paths) == len(plan.content.targets) == len(plan.content.removed_bone) == 2
    assert {zone.shape["kind"] for zone in plan.content.zones} == {
        "sphere",
        "capsules",
        "box",
        "half_space",
        "structure",
    }
    assert (plan.content.settings["margin_mm"], plan.content.second_volume is not None, "ü" in plan.content.notes) == (
        0.4,
        True,
        True,
    )
    registrations = {one.name: one.content for one in read.registrations.list()}
    assert {name: one.made_from for name, one in registrations.items()} == {
        "Beads": "surface", "Table": "pairs", "Given": "given", "File": "given",
    }  # fmt: skip
    beads = registrations["Beads"]
    assert None not in (beads.search, beads.surface, beads.pointer, beads.robot)
    assert registrations["File"].said is not None
    assert read.cases.get(HEAD_PHANTOM).id == HEAD_PHANTOM
    masks = [read.labels.mask(head, label.content) for label in read.labels.documents.list(head.id)]
    assert all(mask.any() for mask in masks)


def test_undo_to_the_first_state_and_redo_to_the_last_give_what_was_stored(old: Settings) -> None:
    services = build_services(old)
    walked = 0
    for documents in every(services):
        for document in documents.list():
            if document.locked:
                continue
            states, editor = states_of(services, document.id), documents.editor(document.id)
            at = cursor_of(services, document.id)
            seen = {at: document.content}
            while editor.history()[0]:
                content, at = editor.undo().content, at - 1
                seen[at] = content
            assert at == min(states)
            while editor.history()[1]:
                content, at = editor.redo().content, at + 1
                assert seen.setdefault(at, content) == content
            assert at == max(states)
            assert seen.keys() == states.keys()
            for position, content in seen.items():
                assert written(documents.kind, content) == grown(states[position].content)
            walked += len(states)
    services.close()
    assert walked > 60


def test_its_archive_comes_in_and_goes_out_again_with_the_same_content(old: Settings, tmp_path: Path) -> None:
    services = build_services(old)
    case = services.archive_reader.read(DATA / "case.zip")
    again = tmp_path / "again.zip"
    with again.open("xb") as target:
        services.archive_writer.write(case.id, target)
    back = services.archive_reader.read(again)
    first, second = (contents(services, one.id) for one in (case, back))
    original = contents(services, next(one.id for one in services.cases.list() if one.name == HEAD))
    services.close()
    assert first == second == original


def renamed(value: Any) -> Any:
    """A recording's events with their records' classes named as they are today."""
    if isinstance(value, dict):
        named = {key: renamed(inner) for key, inner in value.items()}
        return {**named, "§class": ".".join(current_class(named["§class"]))} if "§class" in named else named
    return [renamed(inner) for inner in value] if isinstance(value, list) else value


def contents(services: Services, case_id: str) -> dict[str, Any]:
    """What the documents of a case hold, by kind and name, with the ids that an import gives anew replaced by names."""
    named = [(documents.kind, document) for documents in every(services) for document in documents.list(case_id)]
    names = {document.id: document.name for _, document in named} | {case_id: HEAD}
    texts = {
        f"{kind.name} {document.name}": json.dumps(kind.write(document.content), sort_keys=True)
        for kind, document in named
    }
    for key, text in texts.items():
        for identifier, name in names.items():
            text = text.replace(f'"{identifier}"', json.dumps(name))
        texts[key] = text
    return {**texts, "hash": services.cases.get(case_id).content_hash}


def test_a_copy_of_the_database_is_kept_before_it_is_brought_up(
    old: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = old.database_path.read_bytes()
    (version,) = rows(old.database_path, "select version_num from alembic_version")[0]
    migrations = shutil.copytree(schema._MIGRATIONS, tmp_path / "migrations")
    (migrations / "versions" / "v9999.py").write_text(
        f"from alembic import op\nrevision, down_revision = '9999', '{schema.NEWEST}'\n"
        "def upgrade(): op.execute('alter table cases add column colour text')\n",
        encoding="utf-8",
    )
    monkeypatch.setattr(schema, "_MIGRATIONS", migrations)
    monkeypatch.setattr(schema, "NEWEST", "9999")
    services = build_services(old)
    assert PLAN in [plan.name for plan in services.plans.list()]
    services.close()
    assert rows(old.database_path, "select version_num from alembic_version") == [("9999",)]
    copy, original = old.home / f"vfix-{version}.sqlite3", tmp_path / "original.sqlite3"
    original.write_bytes(before)
    assert dump(copy) == dump(original)


def rows(database: Path, query: str) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(database)) as connection:
        return connection.execute(query).fetchall()


def dump(database: Path) -> list[str]:
    with closing(sqlite3.connect(database)) as connection:
        return list(connection.iterdump())


def files_of(home: Path) -> dict[str, str]:
    """Digests of all files of a folder by their place."""
    files = (path for path in sorted(home.rglob("*")) if path.is_file())
    return {str(path.relative_to(home)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def change(settings: Settings, statement: str) -> None:
    with closing(sqlite3.connect(settings.database_path)) as connection:
        connection.execute(statement)
        connection.commit()


def test_a_folder_of_a_newer_version_is_refused_and_left_as_it_is(old: Settings) -> None:
    change(old, "update alembic_version set version_num = '9999'")
    before = files_of(old.home)
    ways: tuple[Callable[[Settings], object], ...] = (Store, build_services)
    for opened in ways:
        with pytest.raises(StoreUnusable, match="newer vfix"):
            opened(old)
    assert files_of(old.home) == before


@pytest.mark.parametrize(
    "statement",
    ["update document_states set schema = 'vfix-plan/9999' where document_id = '{id}'",
     "update documents set kind = 'study' where id = '{id}'"],
    ids=["schema", "kind"],
)  # fmt: skip
def test_a_document_of_a_newer_schema_or_kind_is_refused_and_left_as_it_is(old: Settings, statement: str) -> None:
    """Whatever is done with it: what is stored of it is what was stored."""
    services = build_services(old)
    plan = next(one for one in services.plans.list() if one.name == PLAN)
    change(old, statement.format(id=plan.id))
    document = f"select * from documents where id = '{plan.id}'"
    states = f"select * from document_states where document_id = '{plan.id}' order by position"
    before = [rows(old.database_path, query) for query in (document, states)]
    tries: tuple[Callable[[], object], ...] = (
        lambda: services.plans.get(plan.id),
        lambda: services.plans.do(plan.id, AddPoint(position=(1.0, 2.0, 3.0))),
        lambda: services.plans.do(plan.id, SetPlanSettings(settings={"margin_mm": 0.7})),
        lambda: services.plans.documents.duplicate(plan.id),
        lambda: services.versions.save(plan.id, "Now"),
    )
    for one in tries:
        with pytest.raises(InputError):
            one()
    unreadable = [one.name for one in services.plans.list() if one.unreadable]
    assert unreadable == ([PLAN] if "schema" in statement else [])
    services.close()
    build_services(old).close()
    assert [rows(old.database_path, query) for query in (document, states)] == before


def test_runs_of_both_worlds_are_driven_again_bit_by_bit(old: Settings) -> None:
    """Every row is computed anew from the stored scene, commands, requests and adoptions.

    A second time where the first process had to compile kernels. On another processor or with other libraries, which
    the replay names, the last bits may differ.
    """
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    for _ in range(2):
        line = [sys.executable, str(Path(__file__).parents[1] / "old_replay.py"), str(old.home)]
        done = subprocess.run(line, capture_output=True, text=True, env=environment, check=True)
        found = json.loads(done.stdout)
        if all(one["first_difference"] is None for one in found.values()):
            break
    assert {world: one["steps"] for world, one in found.items()} == STEPS
    for world, one in found.items():
        if one["other_arithmetic"]:
            assert one["largest_difference"] < LAST_BITS, (world, one)
        else:
            assert one["first_difference"] is None, (world, one)


def within(now: Any, before: Any) -> Any:
    """What now holds under the names that there were before."""
    if isinstance(now, dict) and isinstance(before, dict):
        return {name: within(value, before[name]) for name, value in now.items() if name in before}
    if isinstance(now, list) and isinstance(before, list) and len(now) == len(before):
        return [within(one, other) for one, other in zip(now, before, strict=True)]
    return now


def test_runs_are_read_as_they_were_written(read: Services) -> None:
    """Each number of the recording, and the requests and plans between its steps, are those of the stored files."""
    for stored in read.runs.list():
        with read.runs.laid_out(stored.id) as folder:
            run = Run.read(folder)
        assert run.whole
        assert (read.runs.file(stored.id, "ticks.f64")).read_bytes() == run.ticks.tobytes()
        lines = read.runs.file(stored.id, "events.jsonl").read_text(encoding="utf-8").splitlines()
        events = [{"at": event.at, "kind": event.kind, "content": to_plain(event.content)} for event in run.events]
        written = renamed([json.loads(line) for line in lines])
        assert within(renamed(events), written) == written, "fields that came since have their defaults"
        values, arrays = spec_of(run).to_parts()
        kept = run.manifest["spec"]
        assert within(json.loads(json.dumps(values)), kept) == kept
        assert {name: digest(array) for name, array in arrays.items()} == run.manifest["hashes"]
