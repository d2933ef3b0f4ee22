"""Runs that were damaged or written by others: what they claim is checked, and refused in words."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.engine.study.test_series import ASIDE, CALM, recorded, scene
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.requests import Reset, SetControl, SetSettings, SetTask
from vfix_engine.runtime.run import Run, RunEvent, RunWriter
from vfix_engine.study.metrics import score_run
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.registry import is_certified, spec_of
from vfix_engine.worlds.rigid.spec import RigidSpec

WORLDS = (RigidSpec, FreehandSpec)


def pushed(driver: Driver[Any], step: Any) -> None:
    driver.apply(SetTask("free"))
    step(ASIDE, count=60)


@pytest.fixture(scope="module", params=WORLDS, ids=lambda kind: kind.world)
def driven(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of each world."""
    folder, spec = tmp_path_factory.mktemp("driven"), request.param(scene(), CALM)
    recorded(folder, spec, pushed)
    return folder / str(spec.world)


def forged(**changes: Any) -> ControlSettings:
    """Settings as a run is read: without their constructor."""
    one = object.__new__(ControlSettings)
    for field in fields(ControlSettings):
        object.__setattr__(one, field.name, changes.get(field.name, getattr(CALM, field.name)))
    return one


@pytest.mark.parametrize("changes", [{"margin_mm": -3.0}, {"dt_s": float("nan")}, {"force_cap_n": "5"}])
def test_recorded_settings_out_of_their_ranges_drive_nothing(driven: Path, changes: dict[str, Any]) -> None:
    run = Run.read(driven)
    request = SetSettings(forged(**changes))
    driver: Driver[Any] = Driver(spec_of(run).build())
    before = driver.state
    with pytest.raises(InputError, match="allowed is"):
        driver.apply(request)
    assert driver.state is before
    object.__setattr__(run, "events", (RunEvent(0, "request", request), *run.events))
    with pytest.raises(InputError, match="allowed is"):
        replay(run, spec_of(run), keep_states=False)
    with pytest.raises(InputError, match="allowed is"):
        score_run(run)
    driver.apply(SetSettings(forged()))
    assert driver.settings == CALM


def edited(driven: Path, place: Path, change: Callable[[dict[str, Any]], object], keep_end: bool = False) -> Path:
    """A copy of a run with another manifest, without its end, which has the manifest's digest."""
    folder = place / "edited"
    shutil.copytree(driven, folder)
    if not keep_end:
        (folder / "end.json").unlink()
    manifest = json.loads((folder / "manifest.json").read_text())
    change(manifest)
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


def test_no_word_of_a_manifest_certifies_a_free_hand(driven: Path, tmp_path: Path) -> None:
    """HAZ-41: neither world nor mode nor renamed columns do, and no other reader takes the run for one on a robot."""
    own = Run.read(driven)
    other = "rigid" if own.manifest["world"] == "freehand" else "freehand"
    run = Run.read(edited(driven, tmp_path, lambda one: one.update(world=other, mode=None)))
    assert not is_certified(run.manifest)
    for reader in (spec_of, score_run):
        with pytest.raises(InputError, match="columns are not those of the world"):
            reader(run)
    assert is_certified(own.manifest) == (own.manifest["world"] == "rigid")
    assert score_run(own).certified == (own.manifest["world"] == "rigid")


@pytest.mark.parametrize("name", ["manifest.json", "spec.npz", "events.jsonl"])
def test_a_closed_run_is_refused_with_another_file_of_it(driven: Path, tmp_path: Path, name: str) -> None:
    folder = edited(driven, tmp_path, lambda one: None, keep_end=True)
    assert Run.read(driven).whole
    if name != "manifest.json":  # json.dumps has written that one in other words
        shutil.copy(driven / "manifest.json", folder / "manifest.json")
        assert Run.read(folder).whole
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(2 * data if name == "events.jsonl" else data + b"more")
    with pytest.raises(InputError, match=f"{name} has changed since it was recorded|not a run"):
        Run.read(folder)
    end = json.loads((folder / "end.json").read_text())
    (folder / "end.json").write_text(json.dumps({key: end[key] for key in ("ticks", "sha256", "lost")}))
    if name != "spec.npz":
        assert Run.read(folder).whole, "a run of before has no such digests"


def test_a_world_is_driven_in_its_own_modes(driven: Path, tmp_path: Path) -> None:
    spec = spec_of(Run.read(driven))
    wrong = Control("hands-on" if spec.world == "freehand" else "freehand")
    with pytest.raises(InputError, match=f"'{spec.world}' is not driven {wrong.mode}"):
        RunWriter(tmp_path / "one", spec, (), control=wrong)
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="is not driven"):
        ControlProcess(spec, control=wrong)
    writer = RunWriter(tmp_path / "one", spec, ())
    with pytest.raises(InputError, match="is not driven"):
        writer.event("request", SetControl(wrong))
    writer.abandon()
    with pytest.raises(InputError, match="in which the world"):
        Run.read(edited(driven, tmp_path, lambda one: one.update(mode=wrong.mode)))


DAMAGE: dict[str, Callable[[dict[str, Any]], object]] = {
    "no columns": lambda one: one.update(columns=5),
    "columns that are none": lambda one: one.update(columns=[["t"]]),
    "a renamed command": lambda one: one["columns"].__setitem__(5, ["slave", ""]),
    "two of one name": lambda one: one["columns"].__setitem__(-1, one["columns"][-2]),
    "no world": lambda one: one.pop("world"),
    "another schema": lambda one: one.update(schema="vfix-run/9"),
    "a mode that is none": lambda one: one.update(mode=["hands-on"]),
    "a spec that is none": lambda one: one.update(spec=[]),
    "versions that are none": lambda one: one.update(versions=7),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_a_damaged_manifest_is_refused_in_words(driven: Path, tmp_path: Path, kind: str) -> None:
    """HAZ-16."""
    with pytest.raises(InputError):
        Run.read(edited(driven, tmp_path, DAMAGE[kind]))


def test_what_a_manifest_lacks_is_said(driven: Path, tmp_path: Path) -> None:
    run = Run.read(edited(driven, tmp_path, lambda one: [one.pop(name) for name in ("spec", "versions", "seed")]))
    for reader in (spec_of, score_run):
        with pytest.raises(InputError):
            reader(run)
    assert run.manifest["seed"] is None
    assert replay(run, spec_of(Run.read(driven)), keep_states=False).other_arithmetic


@pytest.mark.parametrize("end", [{"lost": None}, {"lost": -1}, {"ticks": 3}, {"sha256": 5}, {"files": []}, 7])
def test_a_damaged_end_is_refused_in_words(driven: Path, tmp_path: Path, end: Any) -> None:
    folder = edited(driven, tmp_path, lambda one: None, keep_end=True)
    known = json.loads((folder / "end.json").read_text())
    del known["files"]
    (folder / "end.json").write_text(json.dumps(known | end if isinstance(end, dict) else end))
    with pytest.raises(InputError, match="damaged"):
        Run.read(folder)


@pytest.mark.parametrize(
    ("name", "value"),
    [("d0_0", np.nan), ("d1_1", np.inf), ("phase", np.nan), ("phase", 17.0), ("phase", 0.5), ("outcome", -1.0),
     ("target", 9.0), ("tip_x", np.nan), ("force_y", np.inf)],
)  # fmt: skip
def test_a_value_that_is_none_is_no_free_way(driven: Path, name: str, value: float) -> None:
    """A NaN is below no bound: all of them were 0 contacts."""
    run = Run.read(driven)
    ticks = run.ticks.copy()
    ticks[-1, 14 + [column.name for column in run.columns].index(name)] = value
    with pytest.raises(InputError, match=f"damaged: '{name}'"):
        score_run(replace(run, ticks=ticks))


def test_a_command_that_is_none_is_refused_in_words(driven: Path) -> None:
    run = Run.read(driven)
    for value in (np.nan, np.inf, 0.5, -1.0):
        ticks = run.ticks.copy()
        ticks[3, 13] = value
        with pytest.raises(InputError, match="no bit mask"):
            replay(replace(run, ticks=ticks), spec_of(run), keep_states=False)


def test_a_run_without_rows_is_not_verified(driven: Path) -> None:
    run = Run.read(driven)
    with pytest.raises(InputError, match="no steps that could be compared"):
        replay(replace(run, ticks=run.ticks[:0]), spec_of(run))
    for kept in (14, len(run.manifest["columns"]) - 1):
        columns = run.manifest["columns"][:kept]
        ticks = np.ascontiguousarray(run.ticks[:, :kept])
        cut = replace(run, ticks=ticks, manifest={**run.manifest, "columns": columns})
        with pytest.raises(InputError, match="other columns"):
            replay(cut, spec_of(run))


def test_a_score_says_what_the_run_lacks(driven: Path) -> None:
    """An interrupted run may end before a contact, and a run that lost steps has no place for its events."""
    run = Run.read(driven)
    assert (score_run(run).whole, score_run(run).lost) == (True, 0)
    cut = replace(run, ticks=run.ticks[:30], whole=False)
    assert (score_run(cut).whole, score_run(cut).samples) == (False, 30)
    holey = replace(run, lost=7)
    assert (score_run(holey).whole, score_run(holey).lost) == (True, 7)
    with pytest.raises(InputError, match="lost 7 steps"):
        score_run(replace(holey, events=(*run.events, RunEvent(20, "request", Reset()))))
