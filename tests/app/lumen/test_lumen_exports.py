"""A run in a lumen goes out with what belongs to its own world: arm, task with polyps or labels, names of its codes."""

from __future__ import annotations

import csv
import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from lumen_cases import route_in, tube, tube_mesh

from app.cases.model import CAVITY_PHANTOM
from app.exchange.run_report.report import report_html
from app.exchange.run_report.reported import RunToReport
from app.exchange.runs.export import export_run
from app.services import Services
from vfix_engine.errors import InputError
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import no_command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.requests import Request
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.diathermy.labels import Label
from vfix_engine.study.diathermy.table import task_note as label_note
from vfix_engine.study.diathermy.table import task_of as labels_of
from vfix_engine.study.polyps.by_hand import polyps_at
from vfix_engine.study.polyps.series import task_note as polyp_note
from vfix_engine.study.polyps.series import task_of as polyps_of
from vfix_engine.study.polyps.task import PolypTask, surface_hash
from vfix_engine.worlds.snake.cavity import cavity_case
from vfix_engine.worlds.snake.offline.script import DriveSpec
from vfix_engine.worlds.snake.row import CODES
from vfix_engine.worlds.snake.settings import Arm, DriveSettings
from vfix_engine.worlds.snake.spec import LumenContours

LABEL = Label(np.array([40.0, 0.0, 90.0]), np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), "liver")


def driven(folder: Path, spec: DriveSpec, note: Request, steps: int = 6) -> Run:
    """A few steps of a scripted drive, whose task begins after the second one."""
    driver: Driver[Any] = Driver(spec.build(), log=(writer := RunWriter(folder, spec, spec.columns, 4)))
    for step in range(steps):
        if step == 2:
            driver.apply(note)
        driver.step(replace(no_command(), axes=(2.0, 0.0, 10.0)))
    writer.close()
    return Run.read(folder)


def in_tube(folder: Path, arm: Arm = "guided") -> tuple[Run, PolypTask]:
    """Study I in the tube of the other tests, with two polyps."""
    z = np.linspace(0.0, 150.0, 6)
    path = Pathway(np.column_stack([np.zeros((6, 2)), z]), np.full((6, 1), 15.0), 24)
    settings = DriveSettings(arm=arm, step_s=0.01, vertices_per_link=24, bends=4)
    spec = DriveSpec(LumenContours(path.centre, path.radius, path.count), SnakeModel(4), drive=settings, tip_s=60.0)
    at = np.array([[15.0, 0.0, 90.0], [0.0, 15.0, 110.0]])
    task = polyps_at(at, tube_mesh(), path.curve(), {}, 150.0)
    return driven(folder, spec, polyp_note(task)), task


def in_cavity(folder: Path) -> Run:
    """Study II with one label."""
    case = cavity_case()
    return driven(folder, case.script("certified"), label_note([LABEL], 3, surface_hash(case.mesh)))


def test_a_table_of_study_one_has_its_arm_its_polyps_and_the_codes_of_the_snake(tmp_path: Path) -> None:
    run, task = in_tube(tmp_path / "run")
    assert polyps_of(run) == (task, 2)  # the folder itself has them
    export_run(run, file := tmp_path / "run.csv")
    told = json.loads((tmp_path / "run.csv.about.json").read_text(encoding="utf-8"))
    assert (told["world"], told["arm"], told["certified"]) == ("snake drive", "guided", False)
    assert "phases" not in told  # of the rigid tool: no row of a snake has one
    assert "bone" not in told["certificate"]
    assert {f"{name}s": list(names) for name, names in CODES.items()}.items() <= told.items()
    assert (told["task"]["study"], told["task"]["title"], told["task"]["from_step"]) == ("kwok1", "Polyps", 2)
    assert told["task"]["from_s"] == pytest.approx(float(run.column("t")[1]))
    assert PolypTask.from_dict(told["task"]) == task
    with file.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert {told["arms"][int(float(row["arm"]))] for row in rows} == {"guided"}
    assert {told["outcomes"][int(float(row["outcome"]))] for row in rows} <= {"moved", "idle", "shrunk", "held"}


def test_a_table_of_study_two_has_its_labels(tmp_path: Path) -> None:
    run = in_cavity(tmp_path / "run")
    (label,), step = labels_of(run)
    assert (label.to_dict(), step) == (LABEL.to_dict(), 2)
    export_run(run, file := tmp_path / "run.parquet")
    metadata = {key.decode(): value.decode() for key, value in pq.read_schema(file).metadata.items()}
    task = json.loads(metadata["task"])
    assert (metadata["arm"], task["study"], task["title"], task["seed"]) == ("certified", "kwok2", "Labels", 3)
    assert task["labels"] == [LABEL.to_dict()]
    assert task["surface"] == surface_hash(cavity_case().mesh)
    assert json.loads(metadata["outcomes"]) == list(CODES["outcome"])


def test_a_report_on_runs_in_a_lumen_has_task_arm_and_marks_and_none_of_a_head(tmp_path: Path) -> None:
    one, task = in_tube(tmp_path / "one")
    other, _ = in_tube(tmp_path / "other", "certified")
    page = report_html([RunToReport(one, "one", wall=tube_mesh()), RunToReport(other, "other", wall=tube_mesh())])
    told = (
        "guided, without the certificate",
        "certified",
        "Polyps of run A",
        "Polyps missed",
        "Bound used by the link",
    )
    for words in (*told, f"{task.polyps[0].s_mm:.0f} mm", "4 links of 28 mm, 12 mm across"):
        assert words in page, words
    assert page.count("<tr><td>") >= 2 * len(task.polyps)
    assert "bone" not in page.lower()
    assert "surface is missing" in report_html([RunToReport(one, "one")])
    cavity = report_html([RunToReport(in_cavity(tmp_path / "cavity"), "cavity")])
    assert "liver" in cavity
    assert "Labels traced" in cavity
    assert "Depth of the tip" not in cavity  # nothing is inserted on a fixed base


def test_a_tool_and_a_robot_in_a_lumen_are_not_compared(tmp_path: Path) -> None:
    run, _ = in_tube(tmp_path / "run")
    rigid = replace(run, manifest=run.manifest | {"world": "rigid"})
    with pytest.raises(InputError, match="one kind of runs"):
        report_html([RunToReport(run, "one"), RunToReport(rigid, "two")])


@pytest.fixture
def stored(phantom_services: Services, tmp_path: Path) -> Callable[[], tuple[str, str]]:
    """Stores a run of the tube; returns the ids of its case and of itself."""

    def store() -> tuple[str, str]:
        case = tube(phantom_services)
        route = route_in(phantom_services, case)
        in_tube(folder := phantom_services.runs.new_folder())
        run = phantom_services.runs.keep(folder, origin="command line", case_id=case.id, plan_id=route.id)
        return case.id, run.id

    return store


def test_an_archive_with_runs_has_their_arm_and_task(
    phantom_services: Services, stored: Callable[[], tuple[str, str]], tmp_path: Path
) -> None:
    case_id, run_id = stored()
    with (tmp_path / "tube.zip").open("w+b") as file:
        phantom_services.archive_writer.write(case_id, file, with_runs=True)
    with zipfile.ZipFile(tmp_path / "tube.zip") as packed:
        run = json.loads(packed.read(f"runs/{run_id}.json"))
    assert (run["arm"], run["task"]["title"], len(run["task"]["polyps"])) == ("guided", "Polyps", 2)


def test_a_stored_run_is_reported_with_its_route_and_its_wall(
    client: Any, stored: Callable[[], tuple[str, str]]
) -> None:
    _, run_id = stored()
    answer = client.get(f"/api/v1/runs/{run_id}/report")
    assert answer.status_code == 200, answer.text
    assert "Run of Along" in answer.text
    assert "surface is missing" not in answer.text
    told = client.get(f"/api/v1/runs/{run_id}/export?format=about.json").json()
    assert (told["arm"], told["task"]["study"]) == ("guided", "kwok1")


@pytest.mark.parametrize("moved_mm", [0.0, 1e-9])
def test_the_cavity_of_an_archive_is_the_cavity_again(
    phantom_services: Services, tmp_path: Path, moved_mm: float
) -> None:
    """Its base and its labels with it, on a machine that rounds otherwise too; a copy is kept of no surface."""
    from app.cases.kinds import is_cavity
    from app.lumen.shipped_lumens import LUMENS, shipped_hash
    from app.lumen.tasks import tasks_in

    services = phantom_services
    with (path := tmp_path / "cavity.zip").open("w+b") as file:
        services.archive_writer.write(CAVITY_PHANTOM, file)
    if moved_mm:
        path = _with_moved_surface(path, moved_mm)
    before = len(list(services.store.files.keys()))
    case = services.archive_reader.read(path)
    assert case.id != CAVITY_PHANTOM
    assert is_cavity(case)
    assert tasks_in(case) == ("labels",)
    assert case.content_hash == shipped_hash(LUMENS[2])
    (route,) = services.lumen_routes.documents.list(case.id)
    made = services.lumen_routes.paths.wait(route)
    assert made.base is not None
    assert len(list(services.store.files.keys())) == before


def test_a_cavity_of_another_version_is_told_to_be_a_lumen_as_any_other(
    phantom_services: Services, tmp_path: Path
) -> None:
    services = phantom_services
    with (path := tmp_path / "cavity.zip").open("w+b") as file:
        services.archive_writer.write(CAVITY_PHANTOM, file)
    with pytest.raises(InputError, match="not those that its content_hash names"):
        services.archive_reader.read(_with_moved_surface(path, 0.5))
    other = _with_moved_surface(path, 0.5, "ab" * 32)
    case = services.archive_reader.read(other)
    assert "came along with another version of vfix" in case.notes[-1]


def _with_moved_surface(path: Path, by_mm: float, content_hash: str = "") -> Path:
    """The archive with its surface moved, under the hash of the new file, and with another hash of its content."""
    import hashlib
    import io

    with zipfile.ZipFile(path) as packed:
        entries = {name: packed.read(name) for name in packed.namelist() if name != "SHA256SUMS"}
    case = json.loads(entries["case.json"])
    info = case["content"]["surfaces"][0]
    old = info["source"].removeprefix("sha256:")
    with np.load(io.BytesIO(entries.pop(f"files/{old[:2]}/{old}"))) as arrays:
        vertices, faces = arrays["vertices"] + by_mm, arrays["faces"]
    np.savez(target := io.BytesIO(), vertices=vertices, faces=faces)
    new = hashlib.sha256(target.getvalue()).hexdigest()
    info["bounds_lps_mm"] = [vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()]
    entries["case.json"] = json.dumps(case).replace(old, new).encode()
    entries[f"files/{new[:2]}/{new}"] = target.getvalue()
    if content_hash:
        was = case["content_hash"].encode()
        entries = {name: data.replace(was, content_hash.encode()) if name.endswith(".json") else data
                   for name, data in entries.items()}  # fmt: skip
    sums = "".join(f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in entries.items())
    made = path.with_name(f"moved-{by_mm:g}-{content_hash[:4]}.zip")
    with zipfile.ZipFile(made, "w") as file:
        for name, data in {**entries, "SHA256SUMS": sums.encode()}.items():
            file.writestr(name, data)
    return made
