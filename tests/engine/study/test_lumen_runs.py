"""A run of a snake in a lumen: what it is worth and what is plotted, against the states of its replay."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import trimesh
from scipy.ndimage import label

from vfix_engine.errors import InputError
from vfix_engine.geometry.curve import Curve
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.tissue_motion import breathing, peristalsis, together
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.background import InlineWorker
from vfix_engine.runtime.command import BUTTON_STRAIGHTEN, Command, no_command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.replay import Replay, replay
from vfix_engine.runtime.requests import Reset
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.lumen import (
    TaskRow,
    TaskScore,
    lumen_holds_of,
    lumen_samples_of,
    lumen_series_of,
    score_lumen_run,
    task_rows,
)
from vfix_engine.worlds.registry import arm_of, is_certified, spec_of
from vfix_engine.worlds.snake import LumenContours, SnakeSettings, SnakeState, SnakeSystemSpec
from vfix_engine.worlds.snake.requests import ChooseJoint
from vfix_engine.worlds.snake.row import LIMITS
from vfix_engine.worlds.snake.settings import ARMS, Arm, DriveSettings

STEP_S, SPEED, LINKS, START_MM = 0.005, 40.0, 6, 100.0
MOTION = together(breathing((0.0, 0.3, 1.0), 4.0, 4.0, 60.0), peristalsis(0.1))


def made_spec(arm: Arm) -> SnakeSystemSpec:
    """Six links in a bend of 130 mm that breathes and squeezes."""
    turn = np.linspace(0.0, 1.9, 27)
    centre = 130.0 * np.column_stack([1.0 - np.cos(turn), np.zeros(len(turn)), np.sin(turn)])
    drive = DriveSettings(bends=4, arm=arm, vertices_per_link=30)
    contours = LumenContours(centre, np.full((len(turn), 1), 13.0), 53)
    return SnakeSystemSpec(contours, SnakeModel(LINKS), SnakeSettings(STEP_S, SPEED), drive, MOTION, START_MM)


def commands() -> Iterator[tuple[Command, int]]:
    """In to the end, against a wall, straight, and out again: a command, and for how many steps."""
    for axes, count in (((0.0, 0.0, 1.0), 500), ((1.0, 0.3, 0.0), 200), ((0.0, -1.0, 0.0), 200)):
        yield replace(no_command(), axes=axes), count
    yield replace(no_command(), buttons=BUTTON_STRAIGHTEN), 60
    yield replace(no_command(), axes=(0.0, 0.0, -1.0)), 1100


def recorded(folder: Path, arm: Arm) -> Run:
    """A drive with one return to the start, whose plans come three steps after they were asked for."""
    spec = made_spec(arm)
    system = spec.build()
    writer = RunWriter(folder / arm, spec, system.row_layout)
    driver = Driver(system, InlineWorker(system.planner, 3), writer)
    for _ in range(30):
        driver.step(replace(no_command(), axes=(0.0, 0.0, 1.0)))
    driver.apply(Reset())
    if arm == "manual":
        driver.apply(ChooseJoint(2))
    for command, count in commands():
        for _ in range(count):
            driver.step(command)
    writer.close()
    return Run.read(folder / arm)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Run]:
    folder = tmp_path_factory.mktemp("runs")
    return {arm: recorded(folder, arm) for arm in ARMS}


@pytest.fixture(scope="module")
def again(runs: dict[str, Run]) -> dict[str, Replay[SnakeState]]:
    return {arm: replay(run, spec_of(run)) for arm, run in runs.items()}


@pytest.fixture(scope="module")
def states(runs: dict[str, Run], again: dict[str, Replay[SnakeState]]) -> dict[str, list[SnakeState]]:
    """Since the return to the start."""
    return {arm: list(again[arm].states[31:]) for arm in runs}


def test_every_arm_is_replayed_bit_by_bit_in_tissue_that_breathes_and_squeezes(
    runs: dict[str, Run], again: dict[str, Replay[SnakeState]]
) -> None:
    for arm, run in runs.items():
        assert again[arm].first_difference is None, arm
        assert (arm_of(run.manifest), is_certified(run.manifest)) == (arm, arm == "certified")
    assert len({run.ticks[-1].tobytes() for run in runs.values()}) == len(ARMS)  # the arms are not one


def test_samples_are_the_states(runs: dict[str, Run], states: dict[str, list[SnakeState]]) -> None:
    for arm, run in runs.items():
        samples, seen = lumen_samples_of(run), states[arm]
        assert samples.first == 30
        assert len(samples.t) == len(seen)
        for row in range(0, len(seen), 37):
            state = seen[row]
            inside = state.measured
            assert samples.depth[row] == state.tip_s
            assert samples.t[row] == state.t
            assert np.array_equal(samples.force[row], state.forces.total)
            assert np.array_equal(samples.guidance[row], state.forces.guidance)
            assert LIMITS[samples.limit[row]] == state.limit
            assert samples.bend[row] == state.control.bent(state.q[2:], state.q_nominal[2:])
            assert np.array_equal(samples.outside[row], state.deviation.depth[-5:])
            if not inside.any():
                assert samples.link[row] == 0
                assert np.isnan(samples.deviation[row])
                continue
            used = np.where(inside, state.deviation.depth / state.bound, -1.0)
            link = samples.link[row] - 1
            assert used[link] == used.max()
            assert (samples.deviation[row], samples.bound[row]) == (state.deviation.depth[link], state.bound[link])


def test_the_score_is_what_was_driven(runs: dict[str, Run], states: dict[str, list[SnakeState]]) -> None:
    for arm, run in runs.items():
        score, seen = score_lumen_run(run), states[arm]
        spec = made_spec("certified")
        depth, t = np.array([one.tip_s for one in seen]), np.array([one.t for one in seen])
        assert (score.arm, score.certified, score.whole) == (arm, arm == "certified", True)
        assert score.time_s == pytest.approx(len(seen) * STEP_S)
        assert score.depth_mm == depth.max()
        assert score.reach_mm == pytest.approx(LINKS * 28.0)
        assert score.completed == (depth.max() > LINKS * 28.0 - 2.0)
        assert score.share == pytest.approx(depth.max() / 247.0, abs=0.02)  # 130 mm times 1.9 rad
        there = t[depth == depth.max()][0]
        assert score.insertion_s == there
        back = t[(t > there) & (depth <= 10.0)]
        assert score.withdrawal_s == (pytest.approx(back[0] - there) if len(back) else None)
        tips = np.array([spec.snake.tip(one.q, one.base)[:3, 3] for one in seen])
        assert score.path_length_mm == pytest.approx(np.linalg.norm(np.diff(tips, axis=0), axis=1).sum(), rel=1e-9)
        force = np.array([np.linalg.norm(one.forces.total) for one in seen])
        assert score.force_n.mean == pytest.approx(force.mean())
        assert score.force_n.max == pytest.approx(force.max())
        over = np.array([(one.deviation.depth - one.bound)[one.measured].max(initial=0.0) for one in seen])
        assert score.beyond_bound_mm == max(over.max(), 0.0)
        assert score.held_s == pytest.approx(sum(one.outcome == "held" for one in seen) * STEP_S)
        assert sum(one.time_s for one in score.held_by) == pytest.approx(score.held_s)


def test_deviation_counts_what_scipy_labels(runs: dict[str, Run], states: dict[str, list[SnakeState]]) -> None:
    """Kwok 2013, Table III, a_i = 0: episodes of the last links outside of the pathway, their time, way and depth."""
    seen = states["manual"]
    tips = np.array([made_spec("manual").snake.tip(one.q, one.base)[:3, 3] for one in seen])
    steps = np.append(0.0, np.linalg.norm(np.diff(tips, axis=0), axis=1))
    found = score_lumen_run(runs["manual"]).deviation
    depth = np.array([one.deviation.depth[-5:].max() for one in seen])
    outside = depth > 0.0
    assert found is not None
    assert found.depth_mm is not None
    assert found.episodes >= 1
    assert found.depth_mm.max == depth.max()
    assert found.depth_mm.mean == pytest.approx(depth[outside].mean())
    assert found.time_s == pytest.approx(outside.sum() * STEP_S)
    pieces, count = label(outside)
    assert found.episodes == count
    assert found.longest_s == pytest.approx(np.bincount(pieces)[1:].max() * STEP_S)
    last = np.array([one.deviation.depth[-1] for one in seen]) > 0.0
    assert found.length_mm == pytest.approx(steps[last].sum(), rel=1e-9)


def test_a_certified_arm_is_never_beyond_its_bound_and_a_manual_one_is(runs: dict[str, Run]) -> None:
    scores = {arm: score_lumen_run(run) for arm, run in runs.items()}
    assert scores["certified"].beyond_bound_mm == 0.0 == scores["certified"].beyond_bound_s
    assert scores["manual"].beyond_bound_mm > 0.2
    assert scores["manual"].beyond_bound_s > 0.0


def test_holds_have_their_reason(runs: dict[str, Run]) -> None:
    holds = lumen_holds_of(runs["certified"])
    assert {one.kind for one in holds} >= {"end"}
    bound = [one for one in holds if one.kind == "bound"]
    for one in bound:
        assert one.part
        assert one.reason == f"{one.part} at its bound"
        assert one.structure == "lumen"
    assert sum(one.held_s for one in holds) == pytest.approx(score_lumen_run(runs["certified"]).held_s)
    assert all(0.0 < one.held_s <= one.duration_s + 1e-9 for one in holds)
    assert all(a.t_s + a.duration_s <= b.t_s + 1e-9 for a, b in itertools.pairwise(holds))


def test_the_series_has_the_robot_and_the_extremes(runs: dict[str, Run], states: dict[str, list[SnakeState]]) -> None:
    run, seen = runs["guided"], states["guided"]
    series, samples = lumen_series_of(run, 20.0), lumen_samples_of(run)
    assert np.diff(series.t).min() >= 1.0 / 20.0 - 2 * STEP_S
    assert series.t[-1] == seen[-1].t
    snake = samples.snake
    for number in range(0, len(series.t), 41):
        row = int(np.flatnonzero(samples.t == series.t[number])[0])
        frames = snake.frames(seen[row].q, seen[row].base)
        camera = snake.camera(seen[row].q, seen[row].base)
        assert series.chain[number] == pytest.approx(frames[:, :3, 3], abs=1e-9)
        assert series.eye[number] == pytest.approx(camera[:3, 3], abs=1e-9)
        assert series.shaft[number] == pytest.approx(camera[:3, 2])
        assert series.side[number] == pytest.approx(-camera[:3, 1])
        assert series.guidance_xy[number] + series.resistance_xy[number] == pytest.approx(samples.force[row])
        assert series.guidance_xy[number] == pytest.approx(samples.guidance[row])
    assert series.beyond.max() == samples.beyond.max()
    assert series.force.max() == np.linalg.norm(samples.force, axis=1).max()
    assert series.distal.max() == samples.outside.max()
    assert series.bend.max() == samples.bend.max()
    used = samples.deviation / samples.bound
    assert np.nanmax(series.deviation / series.bound) == np.nanmax(used)
    assert series.held.sum() > 0
    assert (series.limit[~series.held] == 0).all()
    assert series.speed.max() == pytest.approx(SPEED, rel=0.05)
    with pytest.raises(InputError, match="positive rate"):
        lumen_series_of(run, 0.0)


def test_a_run_without_the_later_columns_is_read(runs: dict[str, Run]) -> None:
    """One that was recorded before rows had them: what they say is not known, all else is."""
    run = runs["certified"]
    names = [name for name, _ in run.manifest["columns"]]
    kept = names.index("outside_link2")
    old = replace(run, ticks=run.ticks[:, :kept], manifest=run.manifest | {"columns": run.manifest["columns"][:kept]})
    score = score_lumen_run(old)
    assert (score.deviation, score.nearest_mm) == (None, None)
    assert score.depth_mm == score_lumen_run(run).depth_mm
    assert {one.kind for one in lumen_holds_of(old)} == {""}
    assert np.isnan(lumen_series_of(old, 20.0).guidance).all()
    assert replay(old, spec_of(old), keep_states=False).same


def test_damage_and_other_worlds_are_refused(runs: dict[str, Run]) -> None:
    run = runs["certified"]
    ticks = run.ticks.copy()
    ticks[50, -2] = np.nan
    with pytest.raises(InputError, match="'arm' is nan in its sample 21"):
        lumen_samples_of(replace(run, ticks=ticks))
    ticks = run.ticks.copy()
    place = [name for name, _ in run.manifest["columns"]].index("outcome")
    ticks[:, place] = 7.0
    with pytest.raises(InputError, match="'outcome' is not a number from 0 to 3"):
        lumen_samples_of(replace(run, ticks=ticks))
    with pytest.raises(InputError, match="no samples"):
        lumen_samples_of(replace(run, ticks=run.ticks[:0]))


def test_a_task_adds_its_rows(runs: dict[str, Run], monkeypatch: pytest.MonkeyPatch) -> None:
    def polyps(run: Run, wall: TriangleMesh | None) -> TaskScore | None:
        seen = lumen_samples_of(run)
        if run.manifest["spec"]["drive"]["arm"] != "guided":
            return None
        triangles = None if wall is None else len(wall.faces)
        rows = TaskRow("Triangles", triangles), TaskRow("Samples", len(seen.t))
        return TaskScore("Ten polyps", False, rows)

    module = ModuleType("polyps_of_a_test")
    module.task_score = polyps  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(f"{task_rows.__name__}.TASKS", [module.__name__])
    assert score_lumen_run(runs["manual"]).task is None
    assert score_lumen_run(runs["guided"]).task == TaskScore(
        "Ten polyps", False, (TaskRow("Triangles", None), TaskRow("Samples", 2060))
    )
    mesh = TriangleMesh(np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
    task = score_lumen_run(runs["guided"], wall=mesh).to_dict()["task"]
    assert task["title"] == "Ten polyps"
    assert task["rows"][0]["value"] == 1


def test_the_way_is_that_of_the_curve() -> None:
    spec = made_spec("certified")
    length, reach = spec.way_mm()
    centre = spec.lumen.centre if isinstance(spec.lumen, LumenContours) else np.empty((0, 3))
    assert length == pytest.approx(Curve.through(centre).length, rel=0.01)
    assert reach == pytest.approx(LINKS * 28.0)


def test_a_score_says_how_much_is_behind_the_wall(tmp_path: Path) -> None:
    """A straight pathway of 13 mm radius in a square tube 24 mm wide is behind the middle of each wall."""
    line = np.column_stack([np.zeros((21, 2)), np.linspace(0.0, 200.0, 21)])
    contours = LumenContours(line, np.full((21, 1), 13.0), 41)
    drive = DriveSettings(bends=4, arm="manual", vertices_per_link=30)
    spec = SnakeSystemSpec(contours, SnakeModel(LINKS), SnakeSettings(STEP_S, SPEED), drive, None, START_MM)
    system = spec.build()
    writer = RunWriter(tmp_path / "run", spec, system.row_layout)
    driver = Driver(system, InlineWorker(system.planner, 3), writer)
    for axes, count in (((0.0, 0.0, 1.0), 300), ((1.0, 0.0, 0.0), 400)):
        for _ in range(count):
            driver.step(replace(no_command(), axes=axes))
    writer.close()
    run, box = Run.read(tmp_path / "run"), trimesh.creation.box((24.0, 24.0, 400.0))
    wall = TriangleMesh(np.asarray(box.vertices), np.asarray(box.faces))
    score = score_lumen_run(run, wall=wall)
    found, samples = score.behind_wall, lumen_samples_of(run)
    assert found is not None
    angle = np.arccos(12.0 / 13.0)  # of a rim to either side of the middle of a wall
    assert found.share == pytest.approx(8.0 * angle / (2.0 * np.pi), abs=0.1)  # by 48 rays
    assert found.depth_mm == pytest.approx(1.0, abs=0.01)
    assert score.bound_mm == pytest.approx(6.5)  # half the radius of 13 mm, of a link that is not the last one
    assert np.nanmax(samples.bound) <= score.bound_mm
    bases = [np.vstack([base, np.eye(4)[3:]]) for base in samples.base]
    ends = np.array([spec.snake.frames(q, base)[1:, :2, 3] for q, base in zip(samples.q, bases, strict=True)])
    deepest = np.abs(ends).max() + spec.snake.radius_mm - 12.0  # of a ball about a joint or the tip
    assert deepest > 1.0
    assert found.links_mm == pytest.approx(deepest, abs=0.3)
    assert score_lumen_run(run).behind_wall is None
