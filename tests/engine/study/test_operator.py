"""The simulated person: sees the picture alone, repeats with its seed, contacts bone by what it sees wrongly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vfix_engine.anatomy.phantom import load_bone_surface, load_landmarks
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.runtime.snapshot import Snapshot
from vfix_engine.study.drive import DriveResult, drive
from vfix_engine.study.metrics import score_run
from vfix_engine.study.operator import Guide, PursuitOperator, as_operator, shaft_and_side
from vfix_engine.study.person import DriftNoise, Person, Tremor
from vfix_engine.worlds.freehand.snapshot import Contact, FreehandSnapshot
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.freehand.system import FreehandSystem
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.placing import place_robot
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.spec import SceneSpec
from vfix_engine.worlds.rigid.system import RigidSystem

SETTINGS = ControlSettings(dt_s=0.02)  # a person does not need a millisecond


@pytest.fixture(scope="module")
def shipped() -> tuple[Scene, Guide]:
    """The plan of the head that comes along."""
    path = SplinePath([point.position for point in load_landmarks().corridor])
    tree, robot, tool = ProximityTree(load_bone_surface()), RobotModel.load("steady_hand"), Tool.load("bent_30")
    placed = place_robot(tree, robot, tool, path, SETTINGS)
    scene = Scene(tree, robot, tool, placed.base, placed.q_start, path)
    return scene, Guide.of(path, placed.run)


def person(shipped: tuple[Scene, Guide], who: Person, seed: int = 0) -> PursuitOperator:
    scene, guide = shipped
    return PursuitOperator(guide, who, scene.tool, SETTINGS, seed)


def freehand(
    shipped: tuple[Scene, Guide], who: Person, seed: int = 0
) -> tuple[DriveResult, FreehandSnapshot, list[Snapshot]]:
    found: list[Snapshot] = []
    done = drive(FreehandSystem(shipped[0], SETTINGS), person(shipped, who, seed), found.append)
    assert isinstance(done.last, FreehandSnapshot)
    return done, done.last, found


def test_without_errors_a_free_hand_touches_nothing_on_the_shipped_plan(shipped: tuple[Scene, Guide]) -> None:
    done, last, found = freehand(shipped, Person.exact())
    assert done.finished
    assert not last.contacts
    assert last.length_mm - last.progress_mm < 1.0
    errors = [one.tip_error_mm for one in found if isinstance(one, FreehandSnapshot)]
    assert max(errors) < 0.3


def test_with_errors_of_vision_it_contacts_bone(shipped: tuple[Scene, Guide]) -> None:
    """The same hand with the same tremor and delay, but exact eyes, keeps nearer to the path."""
    done, last, found = freehand(shipped, Person())
    assert done.finished
    assert sum(one.count for one in last.contacts) > 0
    assert {one.structure for one in last.contacts} == {"bone"}
    eyes, _, seen_right = freehand(shipped, replace(Person(), see_across_mm=0.0, see_depth_mm=0.0))
    assert eyes.finished
    errors = [
        np.mean([one.tip_error_mm for one in run if isinstance(one, FreehandSnapshot)]) for run in (found, seen_right)
    ]
    assert errors[0] > 2.0 * errors[1]
    assert 15.0 < last.t < 45.0


def test_the_same_seed_is_the_same_drive_and_the_run_repeats(shipped: tuple[Scene, Guide], tmp_path: Path) -> None:
    spec = FreehandSpec(SceneSpec.of(shipped[0]), SETTINGS)
    ticks = []
    for name, seed in (("one", 4), ("two", 4), ("three", 5)):
        system = FreehandSystem(shipped[0], SETTINGS)
        writer = RunWriter(tmp_path / name, spec, system.row_layout, seed)
        drive(system, person(shipped, Person(), seed), log=writer, longest_s=4.0)
        writer.close()
        ticks.append(Run.read(tmp_path / name).ticks)
    assert np.array_equal(ticks[0], ticks[1])
    assert not np.array_equal(ticks[0], ticks[2])
    run = Run.read(tmp_path / "one")
    assert replay(run, spec_of(run)).same
    score = score_run(run)
    assert (score.mode, score.certified, score.samples) == ("freehand", False, 200)


def test_it_leads_a_robot_as_well(shipped: tuple[Scene, Guide]) -> None:
    """Through the protocol of operators: the robot keeps to the path whatever the person sees."""
    system, operator = RigidSystem(shipped[0], SETTINGS), as_operator(person(shipped, Person()))
    driver = Driver(system)
    errors, least = [], np.inf
    while (act := operator(system, driver.state)) is not None:
        snapshot = system.snapshot(driver.act(act))
        errors.append(snapshot.tip_error_mm)
        least = min(least, snapshot.clearance_mm)
        assert snapshot.certified
    assert system.snapshot(driver.state).phase == "done"
    assert np.mean(errors) < 0.02
    assert least >= SETTINGS.margin_mm
    assert 10.0 < driver.state.steps * SETTINGS.dt_s < 25.0


def test_joints_clearances_and_contacts_are_not_seen(shipped: tuple[Scene, Guide]) -> None:
    """Scrambling what no picture shows changes no command; in free hand also while the tool is in bone."""
    scene, random = shipped[0], np.random.default_rng(1)
    for system in (FreehandSystem(scene, SETTINGS), RigidSystem(scene, SETTINGS)):
        one, other = person(shipped, Person()), person(shipped, Person())
        driver: Driver = Driver(system)  # type: ignore[type-arg]
        touched, left = isinstance(system, RigidSystem), 40
        while left:
            snapshot = system.snapshot(driver.state)
            touched = touched or snapshot.clearance_mm < 0.0
            left -= touched
            hidden = {"q": random.normal(size=7), "clearance_mm": random.normal(), "blockers": (), "outcome": "held",
                      "tip_error_mm": random.normal(), "forces": random.normal(size=3)}  # fmt: skip
            if isinstance(snapshot, FreehandSnapshot):
                count, depth = int(random.integers(9)), float(random.normal())
                hidden |= {"contacts": (Contact("nerve", "shaft", count, depth, depth),) * count, "held": count > 4}
            scrambled = type(snapshot)(**{**{n: getattr(snapshot, n) for n in snapshot.__dataclass_fields__}, **hidden})
            a, b = one(snapshot), other(scrambled)
            assert a is not None
            assert b is not None
            np.testing.assert_array_equal(a.force, b.force)
            assert (a.axes, a.twist) == (b.axes, b.twist)
            driver.step(a)


def test_it_waits_for_its_delay(shipped: tuple[Scene, Guide]) -> None:
    operator = person(shipped, Person())
    snapshot = FreehandSystem(shipped[0], SETTINGS).snapshot(FreehandSystem(shipped[0], SETTINGS).start())
    moved = [bool(np.any(command.force)) for command in (operator(snapshot) for _ in range(15)) if command is not None]
    assert moved.index(True) == round(Person().delay_s / SETTINGS.dt_s)


def test_noise_has_the_size_and_the_rhythm_that_it_says() -> None:
    random, dt = np.random.default_rng(2), 1e-3
    drift = DriftNoise(random, dt, 0.05)
    values = np.array([drift.next() for _ in range(100_000)])
    np.testing.assert_allclose(values.std(axis=0), 1.0, atol=0.1)
    lag = round(0.05 / dt)
    correlation = [np.corrcoef(values[:-lag, k], values[lag:, k])[0, 1] for k in range(3)]
    np.testing.assert_allclose(correlation, np.exp(-1.0), atol=0.08)
    tremor = Tremor(random, dt)
    places = dt * np.cumsum([tremor.next() for _ in range(60_000)], axis=0)
    places -= places.mean(axis=0)
    power = np.abs(np.fft.rfft(places, axis=0)) ** 2
    frequency = np.fft.rfftfreq(len(places), dt)
    band = (frequency > 7.0) & (frequency < 13.0)
    rms = np.sqrt(2.0 * power[band].sum()) / len(places)
    assert rms == pytest.approx(1.0, abs=0.3)
    assert power[band].sum() > 0.7 * power[1:][frequency[1:] > 2.0].sum()


def test_shaft_and_side_of_tools() -> None:
    for name, bent in (("bent_30", True), ("straight_pointer", False)):
        segments = Tool.load(name).segments(np.eye(3), np.zeros(3))
        shaft, side = shaft_and_side(segments.start, segments.end)
        np.testing.assert_allclose(shaft, [0.0, 1.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(side, [0.0, 0.0, 1.0] if bent else np.zeros(3), atol=1e-12)
    with pytest.raises(InputError, match="tremor_mm"):
        Person(tremor_mm=-1.0)
    with pytest.raises(InputError, match="must not be 0"):
        Person(look_ahead_mm=0.0)
