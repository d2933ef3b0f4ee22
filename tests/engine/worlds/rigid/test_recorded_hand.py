"""A recorded hand drives again: the same plan to the last bit, another one by its own forces at its own times."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.runtime import Command, Control, Master, Reset, SetTask
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.operators import RecordedOperator
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

SETTINGS = ControlSettings()
SLOWEST = replace(SETTINGS, dt_s=5e-3)
STEPS = 400
PATH = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.3], [0.0, 6.0, 0.0]])
HAND, MASTER, RATE = Control(), Control("teleoperated"), Control("teleoperated", "rate")


def command(step: int, control: Control) -> Command:
    """What the hand does: a push that turns, of a master a motion that is twice let go."""
    wave = np.array([np.sin(step / 60.0), 1.0, 0.4 * np.cos(step / 35.0)])
    if control == MASTER:
        return Command(np.zeros(3), master=Master(0.01 * wave, clutch=step % 100 < 90))
    return Command(2.5 * wave, twist=float(step % 150 > 120), rate=control == RATE)


def recorded(folder: Path, control: Control = HAND, settings: ControlSettings = SETTINGS) -> Run:
    """A drive along a path, with a false start and a task of its own before it."""
    spec = RigidSpec(SceneSpec.of(straight_scene(wall(9.0), PATH)), settings)
    system = spec.build()
    writer = RunWriter(folder, spec, system.row_layout, control=control)
    driver = Driver(system, log=writer)
    driver.apply(SetTask("free"))
    for _ in range(30):
        driver.step(Command(np.array([0.0, -3.0, 1.0])))
    driver.apply(Reset())
    for step in range(STEPS):
        driver.step(command(step, control))
    writer.close()
    return Run.read(folder)


def repeated(run: Run, folder: Path, control: Control, settings: ControlSettings = SETTINGS, y: float = 9.0) -> Run:
    scene = straight_scene(wall(y), PATH)
    rehearsal = Rehearsal(scene, settings)
    spec = RigidSpec(SceneSpec.of(scene), settings)
    writer = RunWriter(folder, spec, rehearsal.system.row_layout, control=control)
    HeadlessRun(rehearsal, lambda snapshot: None, writer, control=control).repeat(RecordedOperator(run))
    writer.close()
    return Run.read(folder)


@pytest.mark.parametrize("control", [HAND, MASTER, RATE], ids=["hand", "master", "rate"])
def test_on_the_same_plan_it_is_the_same_drive_to_the_last_bit(tmp_path: Path, control: Control) -> None:
    run = recorded(tmp_path / "hand", control)
    again = repeated(run, tmp_path / "again", control)
    assert len(again.ticks) == STEPS
    np.testing.assert_array_equal(again.ticks[:, :14], run.ticks[-STEPS:, :14])
    moved = np.linalg.norm(again.rows[-1] - again.rows[0])
    assert moved > 0.5
    np.testing.assert_array_equal(again.rows, run.rows[-STEPS:])


def test_another_head_is_met_by_the_same_forces_and_stays_certified(tmp_path: Path) -> None:
    run = recorded(tmp_path / "hand")
    again = repeated(run, tmp_path / "again", HAND, y=2.0)
    np.testing.assert_array_equal(again.ticks[:, :14], run.ticks[-STEPS:, :14])
    distance = [column.name for column in again.columns].index("d0_0")
    assert again.rows[:, distance].min() >= SETTINGS.margin_mm
    assert again.rows[-1, distance] < run.rows[-1, distance]


@pytest.mark.parametrize("times", [0.05, 0.2, 0.3, 5, 20])
def test_at_another_rate_forces_keep_their_time_and_a_master_its_way(tmp_path: Path, times: float) -> None:
    """A finer period leads a part of each recorded one: not all of it again in every step."""
    own = replace(SETTINGS, dt_s=SLOWEST.dt_s if times < 1 else SETTINGS.dt_s)
    other = replace(own, dt_s=own.dt_s * times)
    hand, master = recorded(tmp_path / "hand", HAND, own), recorded(tmp_path / "master", MASTER, own)
    again = repeated(hand, tmp_path / "again", HAND, other)
    assert len(again.ticks) == math.ceil(STEPS / times)
    places = (np.arange(len(again.ticks)) * times + 1e-6).astype(int)
    np.testing.assert_array_equal(again.ticks[:, :14], hand.ticks[-STEPS:][places, :14])
    moved = repeated(master, tmp_path / "moved", MASTER, other)
    names = [name for name, _ in master.manifest["columns"][:14]]
    way = [names.index(f"master_{axis}") for axis in "xyz"]
    coupled = master.ticks[-STEPS:][master.ticks[-STEPS:, names.index("clutch")] == 1.0]
    np.testing.assert_allclose(
        moved.ticks[moved.ticks[:, names.index("clutch")] == 1.0][:, way].sum(axis=0), coupled[:, way].sum(axis=0)
    )


def test_a_hand_without_a_device_leads_any_and_one_with_a_device_no_other(tmp_path: Path) -> None:
    hand, master = recorded(tmp_path / "hand"), recorded(tmp_path / "master", MASTER)
    led = repeated(hand, tmp_path / "led", MASTER)
    assert (led.ticks[:, 5] == 1.0).all()
    rehearsal = Rehearsal(straight_scene(wall(9.0), PATH), SETTINGS)
    for control in (HAND, RATE):
        with pytest.raises(InputError, match="led a position device"):
            HeadlessRun(rehearsal, lambda snapshot: None, control=control).repeat(RecordedOperator(master))
    mixed = replace(hand, manifest=hand.manifest | {"mode": "mixed"})
    with pytest.raises(InputError, match="mixed modes"):
        RecordedOperator(mixed)
    with pytest.raises(InputError, match="no samples"):
        RecordedOperator(replace(hand, ticks=hand.ticks[:0]))
