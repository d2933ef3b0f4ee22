"""Simulated people of Kwok 2013: they see the picture alone, feel forces, repeat with their seed, and do both tasks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.operator import Act
from vfix_engine.runtime.run import Run
from vfix_engine.study.diathermy.task import first_state
from vfix_engine.study.endoscopy import label_run, polyp_run
from vfix_engine.study.endoscopy.cavity_picture import LabelEye
from vfix_engine.study.endoscopy.endoscopist import Endoscopist
from vfix_engine.study.endoscopy.label_person import LabelPerson
from vfix_engine.study.endoscopy.picture import PolypEye
from vfix_engine.study.endoscopy.polyp_person import PolypPerson
from vfix_engine.study.endoscopy.polyp_run import Colon, run_trial
from vfix_engine.study.endoscopy.stylus_hand import StylusHand
from vfix_engine.study.experiment.cavity import cavity_of, stored_labels
from vfix_engine.study.polyps.progress import PolypProgress
from vfix_engine.study.polyps.series import PolypSeries, polyp_series
from vfix_engine.study.polyps.sight import LumenSight
from vfix_engine.study.polyps.task import Polyp, PolypTask
from vfix_engine.worlds.snake.offline.script import DriveSpec
from vfix_engine.worlds.snake.settings import Arm, DriveSettings
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot
from vfix_engine.worlds.snake.spec import LumenContours

RADIUS_MM, LENGTH_MM, TIP_MM = 18.0, 300.0, 150.0


def tube() -> TriangleMesh:
    """A closed cylinder along z, whose triangles face outwards."""
    angle, z = 2.0 * np.pi * np.arange(24) / 24, np.linspace(-20.0, LENGTH_MM, 33)
    rim = RADIUS_MM * np.column_stack([np.cos(angle), np.sin(angle)])
    rings = np.concatenate([np.column_stack([rim, np.full(24, height)]) for height in z])
    faces = []
    for ring in range(len(z) - 1):
        for k in range(24):
            a, b = 24 * ring + k, 24 * ring + (k + 1) % 24
            faces += [(a, b, b + 24), (a, b + 24, a + 24)]
    low, high = len(rings), len(rings) + 1
    last = 24 * (len(z) - 1)
    faces += [(low, (k + 1) % 24, k) for k in range(24)]
    faces += [(high, last + k, last + (k + 1) % 24) for k in range(24)]
    ends = np.array([[0.0, 0.0, z[0]], [0.0, 0.0, z[-1]]])
    return TriangleMesh(np.concatenate([rings, ends]), np.array(faces, dtype=np.int32))


def polyp(s_mm: float, angle: float) -> Polyp:
    x, y = (RADIUS_MM * np.array([np.cos(angle), np.sin(angle)])).tolist()
    return Polyp(s_mm, (x, y, s_mm), (-x / RADIUS_MM, -y / RADIUS_MM, 0.0), (0.0, 0.0, s_mm))


@pytest.fixture(scope="module")
def mesh() -> TriangleMesh:
    return tube()


def colon(mesh: TriangleMesh, arm: Arm) -> Colon:
    """A straight tube with two polyps, and seven links that are inside."""
    z = np.linspace(0.0, 260.0, 9)
    path = Pathway(np.column_stack([np.zeros((9, 2)), z]), np.full((9, 1), RADIUS_MM), 40)
    settings = DriveSettings(arm=arm, step_s=0.01, vertices_per_link=30, bends=4, yield_mm_per_s_per_n=0.0)
    contours = LumenContours(path.centre, path.radius, path.count)
    spec = DriveSpec(contours, SnakeModel(8), drive=settings, tip_s=TIP_MM)
    return Colon(mesh, PolypTask((polyp(185.0, 0.4), polyp(205.0, 2.9)), TIP_MM, 215.0, "ascending"), spec)


@pytest.mark.parametrize("arm", ["guided", "manual"])
def test_a_person_clears_two_polyps_and_repeats(mesh: TriangleMesh, arm: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[tuple[PolypSeries, PolypSeries]] = []

    def series(run: Run, sight: LumenSight, steps: list[PolypProgress]) -> PolypSeries:
        read.append((polyp_series(run, sight, steps), polyp_series(run, sight)))
        return read[-1][0]

    monkeypatch.setattr(polyp_run, "polyp_series", series)
    place, who = colon(mesh, arm), Endoscopist().drawn(np.random.default_rng(1))
    found = run_trial(place, who, 3, longest_s=90.0)
    kept, anew = read[0]
    assert (kept.progress, kept.t[-1]) == (anew.progress, anew.t[-1])
    assert np.array_equal(kept.marker, anew.marker)
    assert kept.marker.any()
    assert found.table.polyps_missed == 0
    assert found.table.completion_time_s is not None
    assert 2 * 7.0 < found.table.completion_time_s < 90.0
    assert found.table.angle_error_deg is not None
    assert 0.5 < found.table.angle_error_deg < 15.0
    if arm == "guided":
        assert run_trial(place, who, 3, longest_s=6.0) == run_trial(place, who, 3, longest_s=6.0)
        assert run_trial(place, who, 3, longest_s=6.0).table != run_trial(place, who, 4, longest_s=6.0).table


def scrambled(snapshot: SnakeSnapshot, random: np.random.Generator) -> SnakeSnapshot:
    """With other values of all that is not in the picture and not on the hand."""
    links = len(snapshot.deviations)
    hidden: dict[str, Any] = {
        "q": random.normal(size=snapshot.q.shape), "capsules": random.normal(size=snapshot.capsules.shape),
        "tip": random.normal(size=3), "progress_mm": float(random.normal()), "length_mm": float(random.normal()),
        "outcome": "held", "blockers": (), "deviations": random.normal(size=links), "bounds": random.normal(size=links),
        "bend": float(random.normal()), "straight": bool(random.integers(2)), "can_look": bool(random.integers(2)),
        "links_inside": int(random.integers(9)), "resistance": random.normal(size=2), "guidance": random.normal(size=2),
        "control_bends": random.normal(size=(4, 6, 3)), "looked_deg": random.normal(size=8),
        "certified": bool(random.integers(2)), "mode": "looking", "hand_joint": int(random.integers(1, 3)),
    }  # fmt: skip
    return replace(snapshot, **hidden)


def done(act: Act) -> tuple[Any, ...]:
    """All that an act changes."""
    return act.command.axes, act.command.buttons, act.requests


def test_in_study_i_joints_depth_and_clearances_are_not_seen(mesh: TriangleMesh) -> None:
    """Scrambling what no picture shows changes no act; and the picture, or the force, does."""
    place, random = colon(mesh, "guided"), np.random.default_rng(0)
    sight, wall, who = LumenSight(mesh, place.task), Wall(mesh), Endoscopist()
    one, other, pushed = (PolypPerson(PolypEye(place.task, wall, sight), who, "guided", 0.01, 5) for _ in range(3))
    system = place.spec.build()
    state, progress, differs = system.start(), PolypProgress.at_start(place.task), False
    for _ in range(400):
        snapshot = system.snapshot(state)
        act = one(system.at_hand(state), progress)
        assert done(other(scrambled(snapshot, random), progress)) == done(act)
        differs = differs or done(pushed(replace(snapshot, forces=np.ones(3)), progress)) != done(act)
        for request in act.requests:
            state = system.apply(state, request)
        state = system.step(state, act.command)
        camera, s = system.snapshot(state).camera, state.tip_s
        progress = progress.step(place.task, camera, s, state.t, place.task.targets(), sight)
    assert state.tip_s > TIP_MM
    assert differs


def test_in_study_ii_joints_and_clearances_are_not_seen() -> None:
    place, random = cavity_of("certified"), np.random.default_rng(0)
    system, labels, who = place.spec.build(), stored_labels().labels, Endoscopist()
    wall = Wall(place.mesh)
    one, other = (LabelPerson(LabelEye(labels, wall), who, "certified", 5, 0.01, 2) for _ in range(2))
    state, task = system.start(), first_state(labels)
    for _ in range(120):
        snapshot = system.snapshot(state)
        act = one(system.at_hand(state), task)
        assert done(other(scrambled(snapshot, random), task)) == done(act)
        state = system.step(state, act.command)
    assert float(np.abs(state.q).max()) > 0.0


def test_a_hand_yields_to_a_force_where_there_is_one_on_the_stylus() -> None:
    still = replace(Endoscopist(), person=replace(Endoscopist().person, tremor_mm=0.0, motion_noise=0.0))
    push = np.array([1.5, -0.5])
    feels, not_ = (StylusHand(still, np.random.default_rng(0), 0.01, feels) for feels in (True, False))
    np.testing.assert_allclose(feels.moved(np.zeros(2), push), still.yield_mm_per_s_per_n * push)
    np.testing.assert_array_equal(not_.moved(np.zeros(2), push), np.zeros(2))
    for _ in range(300):
        moved = not_.moved(np.array([10.0, 0.0]), push)
    np.testing.assert_allclose(moved, [10.0, 0.0], atol=1e-6)


def test_the_axes_of_a_manual_joint_may_be_turned_against_the_picture() -> None:
    """Nothing else does: with forces on the stylus the hand moves the camera in its picture."""
    quiet = replace(Endoscopist().person, tremor_mm=0.0, motion_noise=0.0)
    who = replace(Endoscopist(), person=quiet, hand_turn_deg=90.0)
    manual, guided = (StylusHand(who, np.random.default_rng(0), 0.01, feels) for feels in (False, True))
    for _ in range(300):
        turned, straight = (hand.moved(np.array([10.0, 0.0]), np.zeros(2)) for hand in (manual, guided))
    np.testing.assert_allclose(turned, [0.0, 10.0], atol=1e-6)
    np.testing.assert_allclose(straight, [10.0, 0.0], atol=1e-6)


def test_a_person_of_the_cavity_cuts_a_line() -> None:
    found = label_run.run_trial(cavity_of("guided"), Endoscopist(), 1, longest_s=40.0)
    assert found.task.traced >= 1
    row = next(one.row() for one in found.task.labels if one.done_s is not None)
    assert row["time_s"] is not None
    assert row["line_error_mm"] is not None
    assert row["time_s"] > 2.0
    assert 0.01 < row["line_error_mm"] < 1.5


def test_people_differ_practise_and_are_checked() -> None:
    median = Endoscopist()
    drawn = [median.drawn(np.random.default_rng(seed)).insert_mm_per_s for seed in range(3000)]
    assert np.median(drawn) == pytest.approx(median.insert_mm_per_s, rel=0.03)
    later = median.practised(2)
    assert later.camera_mm_per_s > median.camera_mm_per_s
    assert later.see_deg < median.see_deg
    with pytest.raises(InputError, match="patience_s"):
        Endoscopist(patience_s=0.0)
    with pytest.raises(InputError, match="see_deg"):
        Endoscopist(see_deg=-1.0)
