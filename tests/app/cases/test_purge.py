"""`vfix case purge`: of a head nothing is left in the data folder; what others use stays (HAZ-33)."""

import io
import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from app.cases.model import HEAD_PHANTOM, SHIPPED
from app.cases.service import Case, CaseFrame
from app.cli import main
from app.kit.errors import NotFound
from app.plans.model import PlanContent, PlanPoint
from app.plans.paths import PlanPath
from app.services import Services, build_services
from app.settings import Settings
from app.store.models import RunRow
from vfix_engine.anatomy.labels.reading import Segmentation
from vfix_engine.anatomy.labels.surfaces import LabelSurface
from vfix_engine.errors import InputError
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.geometry.mesh import TriangleMesh

NAME, LABEL, STRUCTURE, NOTE = "CanaryHead", "CanaryPoint", "CanaryNerve", "CanaryNote"
FRAME = CaseFrame("LPS", assumed=False)


def sphere(radius: float) -> TriangleMesh:
    made = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    return TriangleMesh(np.array(made.vertices), np.array(made.faces))


@pytest.fixture
def services(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Services:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    return build_services(Settings.from_environment())


def head(services: Services, name: str = NAME, radius: float = 50.0) -> Case:
    """A case with a structure, a plan that was edited, and a run."""
    made = services.cases.create(name, frame=FRAME, surfaces={"bone": sphere(radius)}, notes=[NOTE])
    label = LabelSurface(1, STRUCTURE, None, sphere(5.0), 1.0, np.ones(3))
    services.structures.add(made.id, Segmentation((label,), FrameReport("LPS", False), ()))
    points = tuple(PlanPoint(f"p-{n}", f"{LABEL}{n}", (float(n), 0.0, 0.0)) for n in range(3))
    plan = services.plans.create(made.id, "CanaryPlan", PlanContent(paths=(PlanPath(points=points),)))
    services.plans.documents.rename(plan.id, "CanaryOther")
    key = services.store.run_files.put_with(lambda file: file.write(f"Canary ticks of {name}".encode()))
    with services.store.writing() as session:
        session.add(
            RunRow(
                id=f"run-{made.id[5:]}", case_id=made.id, plan_id=plan.id, recorded="2026-01-01", size_bytes=1,
                manifest={"manifest": {"note": "CanaryManifest"}, "end": None, "origin": "page"},
                files={"ticks.f64": {"sha256": key, "size_bytes": 1}},
            )
        )  # fmt: skip
    return services.cases.get(made.id)


def found(home: Path, text: bytes) -> list[str]:
    return [str(file.relative_to(home)) for file in home.rglob("*") if file.is_file() and text in file.read_bytes()]


@pytest.mark.parametrize("deleted", [False, True])
def test_nothing_of_a_head_is_left(services: Services, capsys: pytest.CaptureFixture[str], deleted: bool) -> None:
    """Neither in the database's pages and log, nor in files, temporary folders or copies from before an upgrade."""
    home = services.settings.home
    gone, other = head(services), head(services, "Another", 60.0)
    if deleted:
        services.cases.delete(gone.id)
    copy = home / "vfix-0001.sqlite3"
    with sqlite3.connect(services.settings.database_path) as source, sqlite3.connect(copy) as target:
        source.backup(target)
    left = services.settings.temporary_dir / "0123456789abcdef"  # of a planner that was killed
    left.mkdir(parents=True)
    (left / "CT.nrrd").write_bytes(b"CanaryUpload")
    own = [item.source.removeprefix("sha256:") for item in gone.surfaces]
    assert found(home, NAME.encode())
    assert found(home, b"CanaryUpload")
    assert main(["case", "purge", gone.id, "--yes", "--json"]) == 0
    done = json.loads(capsys.readouterr().out)
    assert (done["case"], done["documents"], done["runs"], done["copies"]) == (gone.id, 1, 1, ["vfix-0001.sqlite3"])
    assert done["files"] == 2  # the bone and the run's; the structure is another head's too
    for text in (NAME, gone.id, f"run-{gone.id[5:]}", "CanaryUpload", f"ticks of {NAME}", *own[:1]):
        assert found(home, text.encode()) == [], text
    assert not [path for path in home.rglob("*") if own[0] in path.name]
    assert services.cases.get(other.id).name == "Another"
    assert len(services.plans.list(other.id)) == 1
    for item in other.structures:
        assert len(services.cases.structure_mesh(other.id, item.id).faces) > 100
    assert [case.id for case in services.cases.list(include_deleted=True)] == [*SHIPPED, other.id]
    assert main(["case", "purge", other.id, "--yes"]) == 0
    for text in ("Canary", "Another"):
        assert found(home, text.encode()) == []
    assert not list(services.settings.files_dir.glob("??/*"))
    assert not list(services.settings.runs_dir.glob("??/*"))


def test_it_asks_first(services: Services, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    case = head(services)

    class Typed(io.StringIO):
        def isatty(self) -> bool:
            return True

    assert main(["case", "purge", NAME]) == 2  # nobody can be asked
    assert "say --yes" in capsys.readouterr().err
    monkeypatch.setattr("sys.stdin", Typed("no\n"))
    assert main(["case", "purge", NAME]) == 1
    assert services.cases.get(case.id).name == NAME
    asked = capsys.readouterr().err
    assert "1 plans and other documents, 1 runs" in asked
    monkeypatch.setattr("sys.stdin", Typed(f"{NAME}\n"))
    assert main(["case", "purge", NAME]) == 0
    assert found(services.settings.home, NAME.encode()) == []


def test_the_phantom_stays(services: Services) -> None:
    with pytest.raises(InputError, match="travels with vfix"):
        services.purge.run(HEAD_PHANTOM)
    assert main(["case", "purge", "nobody", "--yes"]) == 2


def test_files_that_no_row_names_go_with_it_after_an_hour(services: Services) -> None:
    """Of an import that was cut off; one of a moment ago may be another planner's."""
    case = head(services)
    old, new = (services.store.files.put_with(lambda file, n=n: file.write(bytes([n]) * 9)) for n in (1, 2))
    long_ago = time.time() - 2 * 3600
    os.utime(services.store.files.path(old), (long_ago, long_ago))
    services.purge.run(case.id)
    assert not services.store.files.has(old)
    assert services.store.files.has(new)


def test_a_drive_that_ends_after_its_head_is_gone_leaves_no_file(services: Services) -> None:
    """Its run has the bone of the head; what runs of others have too stays."""
    gone, other = head(services), head(services, "Another", 60.0)
    shared = b"Canary ticks of Another"
    folder = services.runs.new_folder("command line", case_id=gone.id)
    folder.mkdir()
    (folder / "manifest.json").write_text('{"world": "rigid"}')
    (folder / "spec.npz").write_bytes(b"bone of " + NAME.encode())
    (folder / "ticks.f64").write_bytes(shared)
    services.purge.run(gone.id)
    with pytest.raises(NotFound):
        services.runs.keep(folder, origin="command line", case_id=gone.id)
    services.runs.discard(folder)
    assert found(services.settings.home, NAME.encode()) == []
    (run,) = services.runs.list(other.id)
    assert services.runs.file(run.id, "ticks.f64").read_bytes() == shared


def test_a_deleted_structure_leaves_no_file(services: Services) -> None:
    case = head(services)
    structure = case.protectable[0]
    services.structures.delete(case.id, structure.id)
    assert not services.store.files.has(structure.geometry.removeprefix("sha256:"))


KILLED = """
import os, signal, sys
from app.services import build_services
from app.cases.purge import Purge
from app.settings import Settings

def die(*_, **__):
    os.kill(os.getpid(), signal.SIGKILL)

services = build_services(Settings.from_environment())
setattr(Purge, sys.argv[2], die)
services.purge.run(sys.argv[1])
"""


@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
@pytest.mark.parametrize("where", ["_remove_files", "_remove_copies"])
def test_a_planner_that_is_killed_at_it_leaves_nothing_half_there(services: Services, where: str) -> None:
    """kill -9 after the rows are gone, and after the files are; the next start ends what was begun."""
    gone, other = head(services), head(services, "Another", 60.0)
    services.close()
    done = subprocess.run([sys.executable, "-c", KILLED, gone.id, where], capture_output=True, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr.decode()
    again = build_services(Settings.from_environment())
    try:
        assert [case.id for case in again.cases.list()] == [*SHIPPED, other.id]
        left = [item.source.removeprefix("sha256:") for item in gone.surfaces]
        shared = {item.source.removeprefix("sha256:") for item in other.surfaces}
        again.sweep()
        assert not (set(left) - shared) & set(again.store.files.keys())
        assert not list((again.settings.home / "purges").iterdir())
        assert again.cases.get(other.id).name == "Another"
    finally:
        again.close()
    assert found(again.settings.home, NAME.encode()) == []


@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
def test_asking_again_ends_a_purge_that_was_killed(services: Services, capsys: pytest.CaptureFixture[str]) -> None:
    """Its case is not found any more, but its files must not wait for the next start of the planner."""
    gone = head(services)
    services.close()
    done = subprocess.run([sys.executable, "-c", KILLED, gone.id, "_remove_files"], capture_output=True, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr.decode()
    bone = gone.surfaces[0].source.removeprefix("sha256:")
    assert services.store.files.has(bone)
    assert main(["case", "purge", gone.id, "--yes"]) == 2
    assert "there is no case" in capsys.readouterr().err
    assert not services.store.files.has(bone)
    assert found(services.settings.home, NAME.encode()) == []


def test_what_a_killed_import_left_is_removed_at_a_later_start(services: Services) -> None:
    """Files of no case, older than a day; those of a case stay, and those of an import that may still go on."""
    case = head(services)
    files, kept = services.store.files, set(services.store.files.keys())
    old, young = (files.put_with(lambda file, data=data: file.write(data)) for data in (b"old", b"young"))  # type: ignore[misc]
    before = time.time() - 2 * 86400.0
    for key in (*kept, old):
        os.utime(files.path(key), (before, before))
    services.sweep()
    assert set(files.keys()) == {*kept, young}
    assert len(services.cases.case_surface(case.id).faces)
