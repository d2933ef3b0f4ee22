"""A run is recorded, read back and driven again bit by bit, background work included (HAZ-13, HAZ-26)."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.engine.tiny import Jump, TinySettings, TinySpec, halved
from vfix_engine.errors import ControlError, InputError
from vfix_engine.runtime import Command, Control, Master, Reset, SetControl, SetSettings, Straighten
from vfix_engine.runtime.background import InlineWorker
from vfix_engine.runtime.command import COMMAND_SIZE, command_from_row, command_to_row
from vfix_engine.runtime.control_mode import run_mode
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import PART, SIDEWAYS, Run, RunWriter

SPEC = TinySpec(0.7)


def drive(folder: Path, steps: int = 60, close: bool = True) -> list[float]:
    """Pushes at random, with every kind of event on the way; the numbers x after each step."""
    random, system = np.random.default_rng(4), SPEC.build()
    writer = RunWriter(folder, SPEC, system.row_layout, seed=4)
    driver = Driver(system, InlineWorker(halved, 7), writer)
    xs = []
    for step in range(steps):
        if step == 20:
            driver.apply(SetSettings(TinySettings(1.3, 0.004)))
        if step == 30:
            driver.apply(Jump(random.normal()))
            with pytest.raises(ControlError, match="no Straighten here"):
                driver.apply(Straighten())
        if step == 45:
            driver.apply(Reset())
        xs.append(driver.step(Command(random.normal(size=3), axes=(0.0, 0.0, random.normal()))).x)
    if close:
        writer.close()
    else:
        writer.abandon()
    return xs


def test_a_run_comes_back_as_it_was(tmp_path: Path) -> None:
    xs = drive(tmp_path / "one.run")
    run = Run.read(tmp_path / "one.run")
    assert run.whole
    assert run.column("x").tolist() == xs
    assert [event.kind for event in run.events if event.kind != "adopt"] == ["request"] * 3
    assert [(event.at, event.content["steps"]) for event in run.events if event.kind == "adopt"][:2] == [
        (17, 10),
        (27, 20),
    ]
    assert run.manifest["seed"] == 4
    assert run.manifest["world"] == "tiny"
    assert TinySpec.from_parts(run.manifest["spec"], run.arrays) == SPEC
    with pytest.raises(InputError, match="no column 'y'"):
        run.column("y")
    with pytest.raises(InputError, match="exists already"):
        drive(tmp_path / "one.run")


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ((), ("hands-on", None)),
        (((0, Control("teleoperated", "rate")),), ("teleoperated", "rate")),
        (((0, Control("teleoperated")), (3, Control("teleoperated", "rate"))), ("mixed", None)),
        (((2, Control("hands-on", "rate")),), ("hands-on", None)),
        (((2, Control("teleoperated")), (3, Control("hands-on"))), ("mixed", None)),
    ],
)
def test_the_manifest_says_the_mode_that_was_driven(
    tmp_path: Path, changes: tuple[tuple[int, Control], ...], told: tuple[str, str | None]
) -> None:
    writer = RunWriter(tmp_path / "run", SPEC, SPEC.build().row_layout, control=Control(), preset="li2004")
    for at, control in changes:
        writer.event_at(at, "request", SetControl(control))
    writer.close()
    run = Run.read(tmp_path / "run")
    assert (run.mode, run.manifest["device"], run.manifest["preset"]) == (*told, "li2004")


def test_runs_of_before_have_the_mode_of_their_world() -> None:
    assert [run_mode({"world": world}) for world in ("rigid", "freehand", "snake")] == ["hands-on", "freehand", None]
    with pytest.raises(InputError, match="the control mode 'by wire' is not one of"):
        Control("by wire")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the device 'voice' is not one of"):
        Control("teleoperated", "voice")  # type: ignore[arg-type]


def test_a_replay_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    drive(tmp_path / "one.run")
    again = replay(Run.read(tmp_path / "one.run"), SPEC)
    assert again.same
    assert again.largest_difference == 0.0
    assert again.sha256 == json.loads((tmp_path / "one.run" / "end.json").read_text())["sha256"]
    assert again.other_arithmetic == {}
    assert len(again.states) == 61
    assert any(state.half for state in again.states), "the worker took part"


def test_a_reading_beside_the_rows_is_read_and_changes_no_replay(tmp_path: Path) -> None:
    folder = tmp_path / "one.run"
    drive(folder)
    assert Run.read(folder).sideways_mm is None
    told = np.linspace(0.0, 5.9, 60)
    told[7:9] = np.inf, np.nan
    told.astype("<f8").tofile(folder / SIDEWAYS)
    run = Run.read(folder)
    np.testing.assert_array_equal(run.sideways_mm, told)
    assert replay(run, SPEC).same
    told[:-1].astype("<f8").tofile(folder / SIDEWAYS)
    with pytest.raises(InputError, match=r"damaged: sideways\.f64 has 59 of 60 values"):
        Run.read(folder)


def test_a_replay_names_the_first_difference(tmp_path: Path) -> None:
    """Of a command by one last bit, and of an adoption that is missing."""
    drive(tmp_path / "one.run")
    run = Run.read(tmp_path / "one.run")
    ticks = run.ticks.copy()
    ticks[12, 0] = np.nextafter(ticks[12, 0], 10.0)
    assert replay(replace(run, ticks=ticks), SPEC).first_difference == 12
    without = tuple(event for event in run.events if event.kind != "adopt")
    assert replay(replace(run, events=without), SPEC).first_difference == 17
    for value in (np.nan, np.inf):
        ticks = run.ticks.copy()
        ticks[12, -1] = value
        assert replay(replace(run, ticks=ticks), SPEC).largest_difference == np.inf, "only one of two is finite"
    with pytest.raises(InputError, match="lost 3 steps"):
        replay(replace(run, lost=3), SPEC)


def test_a_run_that_was_cut_off_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    """HAZ-26: the last tick is lost, and the last event, a reset before step 45."""
    xs = drive(tmp_path / "one.run", close=False)
    part = tmp_path / ("one.run" + PART)
    for name, cut in (("ticks.f64", 11), ("events.jsonl", 5)):
        data = (part / name).read_bytes()
        (part / name).write_bytes(data[:-cut])
    run = Run.read(part)
    assert not run.whole
    assert run.column("x").tolist() == xs[:-1]
    assert replay(run, SPEC).first_difference == 45
    with pytest.raises(InputError, match="not a run"):
        Run.read(tmp_path)


@pytest.mark.parametrize("name", ["ticks.f64", "events.jsonl", "end.json", "spec.npz", "manifest.json"])
def test_a_run_that_was_changed_after_its_end_is_refused(tmp_path: Path, name: str) -> None:
    drive(tmp_path / "one.run", close=True)
    file = tmp_path / "one.run" / name
    whole = file.read_bytes()
    file.write_bytes(b"{" + whole[len(whole) // 2 :])
    with pytest.raises(InputError, match=r"damaged|not a run"):
        Run.read(tmp_path / "one.run")


@pytest.mark.parametrize("name", ["ticks.f64", "events.jsonl", "end.json", "spec.npz", "manifest.json", "sideways.f64"])
def test_a_named_pipe_is_refused_and_not_waited_for(tmp_path: Path, name: str) -> None:
    drive(tmp_path / "one.run", close=True)
    file = tmp_path / "one.run" / name
    file.unlink(missing_ok=True)
    os.mkfifo(file)
    with pytest.raises(InputError, match=f"{name} is no ordinary file"):
        Run.read(tmp_path / "one.run")


def test_a_command_comes_back_bit_by_bit() -> None:
    row = np.empty(COMMAND_SIZE)
    random = np.random.default_rng(0)
    for master in (None, Master(random.normal(size=3), False), Master(random.normal(size=3))):
        command = Command(random.normal(size=3), -0.25, 1.0, master, (0.1, -0.2, 0.3), 5)
        command_to_row(command, row)
        again = command_from_row(row)
        assert np.array_equal(again.force, command.force)
        assert (again.drive, again.twist, again.axes, again.buttons) == (-0.25, 1.0, (0.1, -0.2, 0.3), 5)
        assert (again.master is None) == (master is None)
        if master is not None and again.master is not None:
            assert np.array_equal(again.master.increment, master.increment)
            assert again.master.clutch == master.clutch
