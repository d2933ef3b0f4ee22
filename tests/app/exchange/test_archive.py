"""Archives: a case is restored with everything in it, and a refused archive leaves nothing behind."""

import argparse
import asyncio
import errno
import hashlib
import io
import json
import os
import shutil
import subprocess
import time
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI
from plan_editor import PlanEditor
from rest_client import Client, opened_client

from app.api import archives as routes
from app.api import router
from app.cases.model import CAVITY_PHANTOM, COLON_PHANTOM, HEAD_PHANTOM
from app.cases.service import Case, CaseBead, CaseFrame
from app.cli import main
from app.commands import case_archive
from app.exchange.archive import ArchiveWriter
from app.exchange.archive import checking as module
from app.gateway.error_answers import install_error_answers
from app.imaging.label_operations import SPEC as LABELS
from app.imaging.label_operations import DrawStroke
from app.kit import zip_directory
from app.kit.errors import JobCancelled, TooLarge
from app.plans.model import PlanContent, PlanPoint
from app.plans.operations.document import LockPlan, SetPlanSettings
from app.plans.operations.instruments import UseRegistration
from app.plans.operations.points import MovePoint
from app.plans.operations.versions import GoBack
from app.plans.paths import PlanPath
from app.plans.zones import PlanZone
from app.registration.document import FiducialPair, RegistrationContent
from app.services import Services, build_services
from app.settings import Settings
from app.store.errors import StorageError
from app.store.models import DocumentStateRow
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

POINTS = (
    PlanPoint("a", "entry", (-29.512345678901, 1 / 3, -14.0), (0.6, 0.0, -0.8), 12.5),
    PlanPoint("b", "end", (1.5, -2.25, 7.0)),
)
SPHERE = {"kind": "sphere", "centre": [1.0, 2.0, 3.0], "radius": 2.0}


def services_in(folder: Path) -> Services:
    return build_services(Settings(home=folder, port=0))


@pytest.fixture
def services(tmp_path: Path) -> Iterator[Services]:
    made = services_in(tmp_path / "home")
    yield made
    made.close()


@pytest.fixture
def other(tmp_path: Path) -> Iterator[Services]:
    """Another planner with a data folder of its own."""
    made = services_in(tmp_path / "other")
    yield made
    made.close()


@pytest.fixture
def head(services: Services) -> Case:
    """A case with a volume, plans, versions, a registration and a painted label."""
    corners = np.array([[0.1, 0, 0], [10, 0, 1 / 3], [0, 10, 0], [0, 0, 10]])
    mesh = TriangleMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    hu = np.random.default_rng(5).integers(-1000, 3000, (8, 9, 10)).astype(np.int16)
    volume = Volume(hu, np.zeros(3), np.ones(3), np.eye(3), slice_thickness_mm=1.5)
    case = services.cases.create(
        "Head", frame=CaseFrame("RAS", True), surfaces={"bone": mesh}, volume=volume,
        beads=(CaseBead("m", (1.0, 2.0, 3.0)),), notes=("doubtful",),
    )  # fmt: skip
    plan = services.plans.create(
        case.id, "Way ü", PlanContent(paths=(PlanPath(points=POINTS),), zones=(PlanZone("z", "Eye", SPHERE),))
    )
    services.versions.save(plan.id, "First")
    editor = PlanEditor(services.plans, plan.id)
    editor.do(MovePoint(point_id="b", position=(4.0, 5.0, 6.0)))
    editor.do(SetPlanSettings(settings={"margin_mm": 0.4}))
    services.plans.documents.delete(services.plans.create(case.id, "Deleted").id)
    pairs = (FiducialPair("A", (0.0, 0.0, 0.0), (5.0, 6.0, 7.0)),)
    content = RegistrationContent("patient", tuple(np.eye(4).ravel().tolist()), pairs, made_from="given")
    registration = services.registrations.create(case.id, "R", content)
    services.plans.do(plan.id, UseRegistration(registration=registration.id))
    editor.do(LockPlan(locked=True))
    label = services.labels.create(case.id, "Tumour")
    DrawStroke(radius_mm=2.0, points=((4.0, 4.0, 4.0),)).run(LABELS.context(services), label.id)
    return services.cases.get(case.id)


def archive_of(services: Services, case_id: str, **options: Any) -> bytes:
    target = io.BytesIO()
    services.archive_writer.write(case_id, target, **options)
    return target.getvalue()


@pytest.fixture
def archive(services: Services, head: Case, tmp_path: Path) -> Path:
    path = tmp_path / "case.zip"
    path.write_bytes(archive_of(services, head.id))
    return path


def content_of(services: Services, case_id: str) -> dict[str, Any]:
    """All that a case is, without what an import gives anew."""
    case = services.cases.get(case_id)
    (plan,) = services.plans.list(case_id)
    (version,) = services.versions.list(plan.id)
    (registration,) = services.registrations.list(case_id)
    assert plan.content.registration == registration.id
    (label,) = services.labels.documents.list(case_id)
    return {
        "case": (case.frame, case.surfaces, case.volumes, case.beads, case.notes, case.structures, case.created),
        "hash": (case.content_hash, services.cases.volume_revision(case)),
        "mesh": services.cases.case_surface(case_id).content_hash,
        "plan": (
            plan.name,
            replace(plan.content, registration=None),
            plan.locked,
            plan.revision,
            plan.case_hash,
            plan.created,
            plan.modified,
        ),
        "version": (version.name, version.content, version.revision),
        "registration": (registration.name, registration.content),
        "label": (label.name, label.content, services.labels.mask(case, label.content).sum()),
    }


def left_of(services: Services) -> tuple[Any, ...]:
    """Everything that an import could leave behind."""
    return (
        [case.id for case in services.cases.list(include_deleted=True)],
        [plan.id for plan in services.plans.titles(include_deleted=True)],
        services.store.files.keys(),
        [path.name for path in services.store.scratch.open().iterdir()],
        [path.name for path in services.store.files.scratch.open().iterdir()],
    )


def test_a_case_comes_back_in_another_store(services: Services, other: Services, head: Case, archive: Path) -> None:
    made = other.archive_reader.read(archive)
    assert made.id == head.id
    assert made.name == "Head"
    assert content_of(other, head.id) == content_of(services, head.id)
    (plan,) = other.plans.list(head.id)
    assert plan == services.plans.list(head.id)[0]


def test_a_copy_beside_the_case_gets_identifiers_of_its_own(services: Services, head: Case, archive: Path) -> None:
    before = content_of(services, head.id)
    made = services.archive_reader.read(archive)
    assert made.id != head.id
    assert made.name == "Head 2"
    assert content_of(services, made.id) == before == content_of(services, head.id)
    (plan,), (own,) = services.plans.list(made.id), services.plans.list(head.id)
    assert plan.id != own.id
    services.plans.do(plan.id, LockPlan(locked=False))
    services.plans.do(plan.id, GoBack(version_id="First"))
    assert services.plans.get(plan.id).content.points == POINTS
    assert services.plans.get(own.id) == own


def test_documents_of_one_name_come_in_with_a_number(
    services: Services, other: Services, head: Case, tmp_path: Path
) -> None:
    for _ in range(2):
        services.plans.create(head.id, "Way ü")
        services.registrations.create(head.id, "R")
    services.labels.create(head.id, "Tumour")
    packed = tmp_path / "case.zip"
    packed.write_bytes(archive_of(services, head.id))
    made = other.archive_reader.read(packed)
    assert sorted(one.name for one in other.plans.titles(made.id)) == ["Way ü", "Way ü 2", "Way ü 3"]
    assert sorted(one.name for one in other.registrations.titles(made.id)) == ["R", "R 2", "R 3"]
    assert [one.name for one in other.labels.documents.titles(made.id)] == ["Tumour", "Tumour"]


def test_the_case_that_travels_with_vfix_is_carried_whole(services: Services, tmp_path: Path) -> None:
    path = tmp_path / "phantom.zip"
    path.write_bytes(archive_of(services, HEAD_PHANTOM))
    made = services.archive_reader.read(path)
    source = services.cases.get(HEAD_PHANTOM)
    assert made.content_hash == source.content_hash
    assert all(info.source.startswith("sha256:") for info in (*made.surfaces, *made.volumes))
    for info in source.surfaces:
        own, copy = (services.cases.case_surface(one.id, info.name) for one in (source, made))
        assert own.content_hash == copy.content_hash
    assert services.cases.volume_revision(made, "nose") == services.cases.volume_revision(source, "nose")
    assert services.plans.list(made.id)[0].content == services.plans.list(HEAD_PHANTOM)[0].content


@pytest.mark.parametrize("lumen", [COLON_PHANTOM, CAVITY_PHANTOM])
def test_a_lumen_comes_back_with_its_routes(services: Services, other: Services, tmp_path: Path, lumen: str) -> None:
    (path := tmp_path / "lumen.zip").write_bytes(archive_of(services, lumen))
    with zipfile.ZipFile(path) as packed:
        assert json.loads(packed.read("manifest.json"))["left_out"] == []
    case = other.archive_reader.read(path)
    routes = [(one.name, one.content) for one in other.lumen_routes.documents.list(case.id)]
    assert routes == [(one.name, one.content) for one in services.lumen_routes.documents.list(lumen)] != []
    assert other.cases.get(case.id).landmarks == services.cases.get(lumen).landmarks


def test_equal_cases_give_equal_archives(services: Services, other: Services, head: Case, archive: Path) -> None:
    assert archive_of(services, head.id) == archive.read_bytes()
    other.archive_reader.read(archive)
    assert archive_of(other, head.id) == archive.read_bytes()


def test_the_checksums_are_those_of_sha256sum(archive: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(tmp_path / "out")
        assert packed.namelist()[0] == "manifest.json"
        assert packed.namelist()[-1] == "SHA256SUMS"
    for line in (tmp_path / "out" / "SHA256SUMS").read_text().splitlines():
        digest, name = line.split("  ")
        assert hashlib.sha256((tmp_path / "out" / name).read_bytes()).hexdigest() == digest
    if shutil.which("sha256sum"):
        done = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=tmp_path / "out", capture_output=True, check=False)
        assert done.returncode == 0


def test_the_manifest_says_what_is_in_it(services: Services, head: Case, archive: Path) -> None:
    with zipfile.ZipFile(archive) as packed:
        manifest = json.loads(packed.read("manifest.json"))
        plan = json.loads(packed.read(f"plans/{services.plans.list(head.id)[0].id}.json"))
    assert manifest["schema"] == "vfix-archive/1"
    assert manifest["notice"] == "Not for clinical use"
    assert manifest["versions"]["vfix"]
    assert sorted(one["kind"] for one in manifest["documents"]) == ["label", "plan", "plan-version", "registration"]
    assert manifest["left_out"] == []
    assert plan["schema"] == "vfix-plan/1"


def test_a_document_that_cannot_be_read_is_left_out_and_told(
    services: Services, head: Case, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan_id = services.plans.create(head.id, "Broken").id
    with services.store.writing() as session:
        state = session.get_one(DocumentStateRow, (plan_id, 0))
        state.content = {"points": "none"}
    with zipfile.ZipFile(io.BytesIO(archive_of(services, head.id))) as packed:
        (left,) = json.loads(packed.read("manifest.json"))["left_out"]
    assert (left["id"], left["name"]) == (plan_id, "Broken")
    assert "points" in left["why"]
    args = argparse.Namespace(file=tmp_path / "head.zip", with_images=True, runs=False, json=False)
    assert case_archive.write(args, services, head) == 0
    assert "left out, since it cannot be read: plan 'Broken': " in capsys.readouterr().err


def test_a_damaged_file_of_the_store_is_never_packed(services: Services, head: Case) -> None:
    key = head.surfaces[0].source.removeprefix("sha256:")
    path = services.store.files.path(key)
    path.write_bytes(path.read_bytes()[:-1] + b"X")
    with pytest.raises(StorageError, match="damaged"):
        archive_of(services, head.id)


# -- what is refused

Change = Callable[[dict[str, bytes]], None]


def repacked(archive: Path, change: Change, *, sums: bool = True) -> Path:
    """The archive with other entries, its checksums made anew where that is wanted."""
    with zipfile.ZipFile(archive) as packed:
        entries = {name: packed.read(name) for name in packed.namelist()}
    change(entries)
    if sums:
        entries["SHA256SUMS"] = "".join(
            f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in entries.items() if name != "SHA256SUMS"
        ).encode()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in entries.items():
            packed.writestr(name, data)
    return archive


def adds(name: str) -> Change:
    return lambda entries: entries.update({name: b"x"})


def edits(name: str, /, **values: Any) -> Change:
    def change(entries: dict[str, bytes]) -> None:
        entries[name] = json.dumps(json.loads(entries[name]) | values).encode()

    return change


def of_kind(entries: dict[str, bytes], kind: str) -> str:
    return next(name for name in entries if name.startswith(f"documents/{kind}/"))


def newer_plan(entries: dict[str, bytes]) -> None:
    edits(of_kind(entries, "plan"), schema="vfix-plan/9")(entries)


def without_a_file(entries: dict[str, bytes]) -> None:
    del entries[next(name for name in entries if name.startswith("files/"))]


def another_file(entries: dict[str, bytes]) -> None:
    name = next(name for name in entries if name.startswith("files/"))
    entries[name] = entries[name][:-1] + b"X"


def pickled(entries: dict[str, bytes]) -> None:
    """A surface whose arrays are pickles, under the hash that it has."""
    with_pickle = io.BytesIO()
    np.savez(with_pickle, vertices=np.array([object()]), faces=np.zeros((1, 3), np.int32))
    replaced_surface(entries, with_pickle.getvalue())


def replaced_surface(entries: dict[str, bytes], data: bytes) -> None:
    old = json.loads(entries["case.json"])["content"]["surfaces"][0]["source"].removeprefix("sha256:")
    new = hashlib.sha256(data).hexdigest()
    del entries[f"files/{old[:2]}/{old}"]
    entries[f"files/{new[:2]}/{new}"] = data
    entries["case.json"] = entries["case.json"].replace(old.encode(), new.encode())


def wrong_frame(entries: dict[str, bytes]) -> None:
    content = json.loads(entries["case.json"])["content"]
    edits("case.json", content=content | {"frame": 5})(entries)


REFUSED: dict[str, tuple[Change, str]] = {
    "an id that leaves its folder": (edits("case.json", id="../../work/settings"), "identifier"),
    "an id of dots": (edits("case.json", id=".."), "identifier"),
    "a hash that is none": (edits("case.json", content_hash="0"), "hash of its content"),
    "traversal": (adds("../evil.json"), "no part of a case"),
    "traversal within": (adds("files/../../evil"), "no part of a case"),
    "absolute": (adds("/etc/passwd"), "no part of a case"),
    "drive": (adds("C:\\evil"), "no part of a case"),
    "backslash": (adds("documents\\plan\\x.json"), "no part of a case"),
    "other file": (adds("run.py"), "no part of a case"),
    "folder": (adds("files/"), "no part of a case"),
    "a file nobody names": (adds(f"files/ab/{'ab' * 32}"), "nothing in the archive names"),
    "newer archive": (edits("manifest.json", schema="vfix-archive/2"), "newer vfix"),
    "newer plan": (newer_plan, "Install a newer vfix"),
    "newer case": (edits("case.json", more=1), "newer vfix"),
    "no case": (lambda entries: entries.pop("case.json") and None, "no case.json"),
    "no manifest": (lambda entries: entries.pop("manifest.json") and None, "no manifest.json"),
    "a file is missing": (without_a_file, "no file of"),
    "a file is another": (another_file, "not what its name says"),
    "pickle": (pickled, "something else than numbers"),
    "no surface": (lambda entries: replaced_surface(entries, b"no numpy"), "damaged"),
    "bad name": (edits("case.json", name="a\u202eb"), "control character"),
    "wrong content": (wrong_frame, "cannot be read"),
}


@pytest.mark.parametrize("name", list(REFUSED))
def test_what_is_no_archive_of_ours_is_refused_and_leaves_nothing(other: Services, archive: Path, name: str) -> None:
    change, words = REFUSED[name]
    path = repacked(archive, change)
    before = left_of(other)
    with pytest.raises(InputError, match=words):
        other.archive_reader.read(path)
    assert left_of(other) == before
    assert not list(path.parent.glob("**/evil*"))


def test_a_list_of_entries_that_would_fill_the_memory_is_refused_unread(other: Services, archive: Path) -> None:
    """Its size stands in the zip's end record."""
    whole, huge = archive.read_bytes(), (module.MAX_ENTRIES * zip_directory.ENTRY_BYTES + 1).to_bytes(4, "little")
    at = whole.rindex(b"PK\x05\x06") + 12
    archive.write_bytes(whole[:at] + huge + whole[at + 4 :])
    before = left_of(other)
    with pytest.raises(TooLarge, match="list of entries"):
        other.archive_reader.read(archive)
    assert not module.is_archive(archive)
    assert left_of(other) == before


def test_what_an_archive_lists_as_referred_to_is_not_believed(other: Services, archive: Path) -> None:
    """A plan refers to what its content names."""

    def change(entries: dict[str, bytes]) -> None:
        edits(of_kind(entries, "plan"), refs=[{}] * 1000)(entries)

    made = other.archive_reader.read(repacked(archive, change))
    with other.store.reading() as session:
        kept = [row.refs for row in session.query(DocumentStateRow)]
    assert kept
    assert all(set(ref) == {"kind", "id"} for refs in kept for ref in refs)
    assert other.plans.list(made.id)


@pytest.mark.parametrize("change", [adds("runs/r.json"), edits("case.json", name="Another"), without_a_file])
def test_an_archive_that_its_checksums_do_not_fit_is_refused(other: Services, archive: Path, change: Change) -> None:
    path, before = repacked(archive, change, sums=False), left_of(other)
    with pytest.raises(InputError, match="checksum"):
        other.archive_reader.read(path)
    assert left_of(other) == before


def test_every_cut_and_a_flipped_byte_are_noticed(other: Services, archive: Path) -> None:
    whole, before = archive.read_bytes(), left_of(other)
    for length in (0, 1, 100, len(whole) // 2, len(whole) - 30, len(whole) - 1):
        archive.write_bytes(whole[:length])
        with pytest.raises(InputError):
            other.archive_reader.read(archive)
    random = np.random.default_rng(3)
    refused = 0
    for at in random.integers(0, len(whole), 40).tolist():
        archive.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
        try:
            made = other.archive_reader.read(archive)
        except InputError:
            refused += 1
            assert left_of(other) == before
            continue
        # A byte that no reader looks at, such as one of a time: then the case is whole.
        assert content_of(other, made.id)["hash"]
        other.purge.run(made.id)
    assert refused > 25


def with_info(archive: Path, change: Callable[[zipfile.ZipInfo], None], name: str = "runs/link.json") -> None:
    info = zipfile.ZipInfo(name)
    change(info)
    with zipfile.ZipFile(archive, "a") as packed:
        packed.writestr(info, b"/etc/passwd")


def test_a_symbolic_link_is_refused(other: Services, archive: Path) -> None:
    with_info(archive, lambda info: setattr(info, "external_attr", 0o120777 << 16))
    with pytest.raises(InputError, match="symbolic link"):
        other.archive_reader.read(archive)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_entry_that_is_there_twice_is_refused(other: Services, archive: Path) -> None:
    with_info(archive, lambda info: None, "case.json")
    with pytest.raises(InputError, match="twice"):
        other.archive_reader.read(archive)


def test_a_bomb_is_refused_before_it_is_unpacked(
    other: Services, archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with zipfile.ZipFile(archive, "a", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("runs/bomb.json", b"0" * (100 << 20))
    read: list[object] = []
    monkeypatch.setattr(module, "_piece", lambda *args: read.append(args) or b"")
    with pytest.raises(TooLarge, match="times its size"):
        other.archive_reader.read(archive)
    assert not read


def test_more_than_the_limit_is_refused(other: Services, archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_TOTAL_BYTES", 1000)
    with pytest.raises(TooLarge, match="1,000 are allowed"):
        other.archive_reader.read(archive)
    monkeypatch.setattr(module, "MAX_ENTRIES", 4)
    with pytest.raises(TooLarge, match="4 are allowed"):
        other.archive_reader.read(archive)


def test_a_stored_file_that_unpacks_to_too_much_is_refused(
    other: Services, archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.exchange.archive.reading.MAX_UNPACKED_BYTES", 1000)
    before = left_of(other)
    with pytest.raises(TooLarge, match="too much"):
        other.archive_reader.read(archive)
    assert left_of(other) == before


def test_an_import_that_is_cancelled_leaves_nothing(other: Services, archive: Path) -> None:
    before = left_of(other)
    for limit in (0.1, 0.5, 0.85, 0.9, 0.95):

        def tell(stage: str, fraction: float, limit: float = limit) -> None:
            if fraction >= limit:
                raise JobCancelled

        with pytest.raises(JobCancelled):
            other.archive_reader.read(archive, tell)
        assert left_of(other) == before


def test_a_full_disk_leaves_nothing(other: Services, archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, put, calls = left_of(other), other.store.files.put_with, []

    def full(write: Callable[[Any], object]) -> str:
        calls.append(write)
        if len(calls) == 2:
            raise StorageError("a file could not be stored: No space left on device.")
        return put(write)

    monkeypatch.setattr(other.store.files, "put_with", full)
    with pytest.raises(StorageError, match="No space left"):
        other.archive_reader.read(archive)
    assert left_of(other) == before


def test_the_target_being_full_is_told(services: Services, head: Case) -> None:
    class Full(io.BytesIO):
        def write(self, data: Any) -> int:
            raise OSError(28, "No space left on device")

    with pytest.raises(StorageError, match="No space left"):
        services.archive_writer.write(head.id, Full())


# -- the command line and REST


def test_the_command_line_goes_there_and_back(
    services: Services, head: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(services.settings.home))
    path = tmp_path / "out.zip"
    assert main(["case", "export", "Head", str(path), "--json"]) == 2
    assert "can identify the patient" in json.loads(capsys.readouterr().out)["error"]["message"]
    assert not path.exists()
    assert main(["case", "export", "Head", str(path), "--with-images", "--runs", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["size_bytes"] == path.stat().st_size
    assert main(["case", "import-archive", str(path), "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["name"] == "Head 2"
    assert main(["case", "import-archive", str(tmp_path / "none.zip")]) == 2
    assert "No such file" in capsys.readouterr().err
    path.write_bytes(b"no zip")
    assert main(["case", "import-archive", str(path)]) == 2
    assert "no zip" in capsys.readouterr().err
    assert [file.name for file in tmp_path.glob(".vfix-*")] == []


@pytest.fixture
def rest(services: Services) -> Iterator[Client]:
    opened = opened_client(services)
    yield opened
    opened.close()


def test_rest_goes_there_and_back(services: Services, head: Case, archive: Path, rest: Client) -> None:
    """HAZ-34: what holds images is asked about."""
    before = left_of(services)
    refused = rest.get(f"/api/v1/cases/{head.id}/archive")
    assert (refused.status_code, "with_images=true" in refused.text) == (422, True)  # HAZ-34
    answer = rest.get(f"/api/v1/cases/{head.id}/archive?with_images=true")
    assert answer.status_code == 200
    assert answer.content == archive.read_bytes()
    assert 'filename="Head.zip"' in answer.headers["content-disposition"]
    assert left_of(services) == before
    for address in ("/api/v1/cases/archive", "/api/v1/cases"):  # the second is where the page sends every file
        job = rest.post(address, files={"file": ("Head.zip", answer.content)}).json()
        ended = services.jobs.wait(job["id"], 60)
        assert ended.state == "done"
        assert content_of(services, str(ended.result)) == content_of(services, head.id)
    assert rest.get("/api/v1/cases/none/archive").status_code == 404


def test_an_archive_that_is_refused_fails_its_job(services: Services, rest: Client) -> None:
    before = left_of(services)
    job = rest.post("/api/v1/cases/archive", files={"file": ("a.zip", b"no zip")}).json()
    ended = services.jobs.wait(job["id"], 60)
    assert ended.state == "failed"
    assert "no zip" in str(ended.error)
    assert left_of(services) == before


def test_a_client_that_goes_away_ends_the_work_and_leaves_nothing(
    services: Services, head: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client leaves while the archive is made, and while it is sent."""
    before = left_of(services)
    monkeypatch.setattr(routes, "_LOOK_S", 0.01)
    for place in ("made", "sent"):
        asyncio.run(_left_by_client(services, head.id, place, monkeypatch))
        assert left_of(services) == before


async def _left_by_client(services: Services, case_id: str, place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    app = FastAPI()
    app.state.services = services
    install_error_answers(app)
    app.include_router(router)
    ended: list[str] = []
    own = ArchiveWriter.write

    def slow(self: ArchiveWriter, case_id: str, target: Any, **options: Any) -> None:
        try:
            own(self, case_id, target, **options)
            for _ in range(500):
                options["go_on"]()
                time.sleep(0.01)
        except JobCancelled:
            ended.append("cancelled")
            raise

    with monkeypatch.context() as patch:
        if place == "made":
            patch.setattr(ArchiveWriter, "write", slow)
        asked = False

        async def receive() -> dict[str, Any]:
            nonlocal asked
            if not asked:
                asked = True
                return {"type": "http.request", "body": b"", "more_body": False}
            if place == "sent":
                await asyncio.sleep(10)
            return {"type": "http.disconnect"}

        async def send(message: Any) -> None:
            if place == "sent" and message["type"] == "http.response.body":
                raise OSError("the client is gone")

        scope = {
            "type": "http", "method": "GET", "path": f"/api/v1/cases/{case_id}/archive", "raw_path": b"", "headers": [],
            "query_string": b"with_images=true", "scheme": "http", "server": ("127.0.0.1", 80), "client": None,
            "http_version": "1.1", "root_path": "", "asgi": {"version": "3.0", "spec_version": "2.4"},
        }  # fmt: skip
        try:
            await app(scope, receive, send)
        except Exception as error:
            ended.append(type(error).__name__)
    assert ended


@pytest.mark.parametrize("fails_at", [1, 3])
def test_an_export_that_finds_no_room_leaves_nothing_unpacked(
    services: Services, monkeypatch: pytest.MonkeyPatch, fails_at: int
) -> None:
    """Each retry would leave more otherwise, and fill the disk."""
    savez, made = np.savez, [0]

    def full(target: Any, **arrays: Any) -> None:
        made[0] += 1
        target.write(b"a part of it")
        if made[0] == fails_at:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        savez(target, **{name: values[:10] for name, values in arrays.items() if np.ndim(values)})

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(StorageError, match="could not be written"):
        archive_of(services, HEAD_PHANTOM)
    assert made == [fails_at]
    assert list(services.store.scratch.open().iterdir()) == []
