"""Exports of runs, read back by other programs' readers: every value is the run's."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

from app.cli import main
from app.exchange.runs import export
from app.exchange.runs.export import export_run
from app.services import build_services
from app.settings import Settings
from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.runtime.command import Command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.rigid.spec import SceneSpec

WORLDS = ("rigid", "snake", "snake drive")


def recorded(run_id: str) -> Run:
    services = build_services(Settings.from_environment())
    with services.runs.laid_out(run_id) as place:
        run = Run.read(place)
    services.close()
    return run


def units(run: Run) -> list[str]:
    """The headings that a table of the run begins with."""
    names = [(f"command_{name}", unit) for name, unit in run.manifest["columns"][:14]]
    return [f"{name} [{unit}]" if unit else name for name, unit in [*names, *run.manifest["columns"][14:]]]


@pytest.mark.parametrize("world", WORLDS)
def test_a_table_holds_the_run_bit_by_bit(
    old_runs: dict[str, str], world: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, files = recorded(old_runs[world]), {suffix: tmp_path / f"run{suffix}" for suffix in (".csv", ".parquet")}
    for file in files.values():
        assert main(["run", "export", old_runs[world], str(file), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["ticks"] == len(run.ticks)
    with files[".csv"].open(newline="") as lines:
        heading, *rows = csv.reader(lines)
    from_csv = np.array([[float(cell) for cell in row] for row in rows])
    table = pq.read_table(files[".parquet"])
    width = run.ticks.shape[1]
    assert heading[:width] == units(run)
    assert heading == table.column_names
    assert {"t [s]", "tip_x [mm]", "command_force_x [N]"} <= set(heading)
    assert from_csv[:, :width].tobytes() == run.ticks.tobytes()
    assert np.column_stack([column.to_numpy() for column in table.columns]).tobytes() == from_csv.tobytes()
    assert heading[-2:] == ["certified", "not_for_clinical_use"]
    assert (from_csv[:, -2:] == 1.0).all()
    about = json.loads((tmp_path / "run.csv.about.json").read_text())
    metadata = {key.decode(): value.decode() for key, value in table.schema.metadata.items()}
    assert (about["notice"], about["frame"], about["run"]) == ("Not for clinical use", "LPS", old_runs[world])
    assert (metadata["notice"], metadata["frame"]) == ("Not for clinical use", "LPS")
    assert json.loads(metadata["recorded_by"]) == about["recorded_by"] == run.manifest["versions"]
    assert table.schema.field("tip_x [mm]").metadata == {b"unit": b"mm"}
    if world == "rigid":
        tool = run.manifest["spec"]["tool"]["parts"]
        assert [from_csv[7, heading.index(f"s{i}_r [mm]")] for i in range(len(tool))] == [p["radius"] for p in tool]
        assert about["mode"] == "hands-on"
        assert about["certified"] is True
        assert about["certificate"] == "every motion was certified"


def test_a_table_of_a_free_hand_says_so_in_every_row(tmp_path: Path) -> None:
    """HAZ-41: the file beside a table is lost in a copy of the table."""
    spec = FreehandSpec(SceneSpec.of(straight_scene(wall(4.0))), ControlSettings(dt_s=0.02))
    system = spec.build()
    writer = RunWriter(tmp_path / "one", spec, system.row_layout)
    driver = Driver(system, log=writer)
    for _ in range(3):
        driver.step(Command(np.array([0.3, 6.0, 0.0])))
    writer.close()
    export_run(Run.read(tmp_path / "one"), tmp_path / "one.csv")
    with (tmp_path / "one.csv").open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert [(row["certified"], row["not_for_clinical_use"]) for row in rows] == [("0.0", "1.0")] * 3


def test_an_export_that_fails_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = FreehandSpec(SceneSpec.of(straight_scene(wall(4.0))), ControlSettings(dt_s=0.02))
    system = spec.build()
    writer = RunWriter(tmp_path / "one", spec, system.row_layout)
    Driver(system, log=writer).step(Command(np.zeros(3)))
    writer.close()
    for name in ("one.csv", "one.csv.about.json"):
        (tmp_path / name).write_text("of before")

    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        export_run(Run.read(tmp_path / "one"), tmp_path / "one.csv")
    assert {one.name: one.read_text() for one in tmp_path.glob("one.*")} == {
        "one.csv": "of before",
        "one.csv.about.json": "of before",
    }


def messages(file: Path) -> Iterator[tuple[str, str, int, Any]]:
    """Topic, type, time and message of each, by the schemas in the file alone."""
    types: dict[int, Any] = {}
    with file.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if schema.id not in types:
                pool = DescriptorPool()
                for one in FileDescriptorSet.FromString(schema.data).file:
                    pool.Add(one)
                types[schema.id] = GetMessageClass(pool.FindMessageTypeByName(schema.name))
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            yield channel.topic, schema.name, message.log_time, types[schema.id].FromString(message.data)


@pytest.mark.parametrize("world", WORLDS)
def test_an_mcap_holds_every_step_and_what_foxglove_draws(old_runs: dict[str, str], world: str, tmp_path: Path) -> None:
    run, file = recorded(old_runs[world]), tmp_path / "run.mcap"
    assert main(["run", "export", old_runs[world], str(file)]) == 0
    found: dict[str, list[tuple[str, int, Any]]] = {}
    for topic, kind, at, message in messages(file):
        found.setdefault(topic, []).append((kind, at, message))
    steps = [message for _, _, message in found["/step"]]
    fields = [field.name for field in steps[0].DESCRIPTOR.fields]
    assert {"t_s", "tip_x_mm", "command_force_x_N"} <= set(fields)
    values = np.array([[getattr(step, name) for name in fields[: run.ticks.shape[1]]] for step in steps])
    np.testing.assert_array_equal(values, run.ticks)
    times = np.array([at for _, at, _ in found["/step"]])
    assert (np.diff(times) > 0).all(), "also where the tool went back to its start"
    with file.open("rb") as stream:
        (told,) = make_reader(stream).iter_metadata()
    assert (told.name, told.metadata["notice"], told.metadata["frame"]) == ("vfix", "Not for clinical use", "LPS")
    if world != "rigid":
        assert list(found) == ["/step"]
        return
    assert {topic: kind for topic, ((kind, *_), *_) in found.items()} == {
        "/bone": "foxglove.SceneUpdate", "/plan": "foxglove.SceneUpdate", "/tool": "foxglove.SceneUpdate",
        "/bone_points": "foxglove.PointCloud", "/tf": "foxglove.FrameTransforms", "/tip": "foxglove.PoseInFrame",
        "/step": "vfix.Step",
    }  # fmt: skip
    (mesh,) = found["/bone"][0][2].entities[0].triangles
    vertices = np.array([[p.x, p.y, p.z] for p in mesh.points])
    np.testing.assert_allclose(vertices * 1e3, run.arrays["vertices"], atol=1e-9)
    np.testing.assert_array_equal(np.array(mesh.indices).reshape(-1, 3), run.arrays["faces"])
    cloud = found["/bone_points"][0][2]
    assert [(field.name, field.offset, field.type) for field in cloud.fields] == [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]
    np.testing.assert_allclose(np.frombuffer(cloud.data, "<f4").reshape(-1, 3), vertices, rtol=1e-6, atol=1e-6)
    check_poses(run, times, found)


def check_poses(run: Run, times: Any, found: dict[str, list[tuple[str, int, Any]]]) -> None:
    """Transform and pose are those of the step of their time, and carry the tool's parts to where the run has them."""
    assert len(found["/tf"]) == len(found["/tip"]) == pytest.approx(times[-1] / 1e7, abs=1)
    (tool,) = found["/tool"][0][2].entities
    assert tool.frame_id == "tip"
    for (_, at, transforms), (_, _, pose) in list(zip(found["/tf"], found["/tip"], strict=True))[::10]:
        (one,) = transforms.transforms
        (row,) = np.flatnonzero(times == at)
        assert (one.parent_frame_id, one.child_frame_id, pose.frame_id) == ("patient_lps", "tip", "patient_lps")
        assert one.timestamp.seconds * 10**9 + one.timestamp.nanos == at
        place, turn = vector(one.translation), Rotation.from_quat([*vector(one.rotation), one.rotation.w])
        np.testing.assert_allclose(place * 1e3, [run.column(f"tip_{axis}")[row] for axis in "xyz"], atol=1e-9)
        np.testing.assert_allclose(vector(pose.pose.position), place)
        np.testing.assert_allclose(vector(pose.pose.orientation), vector(one.rotation))
        for part, cylinder in enumerate(tool.cylinders):
            own = Rotation.from_quat([*vector(cylinder.pose.orientation), cylinder.pose.orientation.w])
            half = own.apply([0.0, 0.0, cylinder.size.z / 2.0])
            ends = [turn.apply(vector(cylinder.pose.position) + sign * half) + place for sign in (-1, 1)]
            expected = [[run.column(f"s{part}_{end}{axis}")[row] for axis in "xyz"] for end in "ab"]
            np.testing.assert_allclose(np.array(ends) * 1e3, expected, atol=1e-6)


def vector(value: Any) -> np.ndarray:
    return np.array([value.x, value.y, value.z])


def test_what_cannot_be_exported_is_refused(
    old_runs: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = old_runs["snake"]
    assert main(["run", "export", run, str(tmp_path / "run.xlsx")]) == 2
    assert "ends in .csv, .parquet, .mcap" in capsys.readouterr().err
    assert main(["run", "export", run, "/no/such/folder/run.csv"]) == 2
    assert "cannot be written" in capsys.readouterr().err
    monkeypatch.setattr(export, "find_spec", lambda name: None)
    for suffix, extra in (("parquet", "tables"), ("mcap", "mcap")):
        assert main(["run", "export", run, str(tmp_path / f"run.{suffix}"), "--json"]) == 2
        error = json.loads(capsys.readouterr().out)["error"]
        assert (error["code"], f"vfix[{extra}]" in error["message"]) == ("extra_missing", True)
    assert main(["run", "export", run, str(tmp_path / "run.csv")]) == 0, "which needs no extra"
    assert {file.name for file in tmp_path.iterdir()} == {"home", "run.csv", "run.csv.about.json"}
