"""Table III of study I from a run made by hand, whose answers are known."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.pathway_surface import pathway_surface
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import COMMAND_SIZE
from vfix_engine.runtime.requests import Reset
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.lumen import TaskItem, score_lumen_run, task_replay
from vfix_engine.study.lumen.deviation import deviation_of, episodes
from vfix_engine.study.polyps.figures import polyp_figures
from vfix_engine.study.polyps.live import PolypMoment
from vfix_engine.study.polyps.placing import WallPlaces
from vfix_engine.study.polyps.printed import PROUD_MM
from vfix_engine.study.polyps.progress import PolypProgress
from vfix_engine.study.polyps.seen import FAR_MM, seen_share
from vfix_engine.study.polyps.series import PolypSeries, polyp_series, task_note
from vfix_engine.study.polyps.sight import LumenSight
from vfix_engine.study.polyps.table import PRINTED, beyond_bound_mm, polyp_table, table_iii
from vfix_engine.study.polyps.task import Polyp, PolypTask, surface_hash
from vfix_engine.worlds.snake import DriveSpec
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.spec import LumenContours

DT = 0.5
# Places of the camera on the z axis, and depths in mm of the two links outside the pathway, after each step.
EYE = [60.0, *[88.0] * 6, 70.0, *[88.0] * 15, 88.0, 140.0, 150.0, 120.0]
DEEP = {1: (2.0, 0.0), 2: (4.0, 1.0), 10: (0.0, 3.0), 24: (0.0, 5.0)}
END_MM = 150.0


def free(eye: Array, index: int, t: float) -> bool:
    return True


def polyp(z: float) -> Polyp:
    return Polyp(z, (0.0, -PROUD_MM, z), (0.0, 1.0, 0.0), (0.0, 0.0, z))


TASK = PolypTask((polyp(100.0), polyp(400.0)), 50.0, END_MM, "ascending", 3, 0.75)


def written(folder: Path, before: int = 0, reset: bool = False, after: bool = True, task: PolypTask = TASK) -> Run:
    """A run of a straight robot of two links that goes along the z axis.

    before: steps before the task begins. after: with the step after its end.
    """
    line = np.column_stack([np.zeros((9, 2)), np.linspace(0.0, 400.0, 9)])
    spec = DriveSpec(LumenContours(line, np.full((9, 1), 15.0)), SnakeModel(2), drive=DriveSettings(manipulated=2))
    names = [column.name for column in spec.columns]
    writer = RunWriter(folder, spec, spec.columns, 3)
    for step in range(-before, len(EYE) - (not after)):
        if step == 0:
            if reset:
                writer.event("request", Reset())
            writer.event("request", task_note(task))
        eye = EYE[step] if step >= 0 else 10.0
        row = dict.fromkeys(names, 0.0)
        row |= {"t": DT * (step + 1 + (0 if reset else before)), "tip_s": eye, "tip_z": eye - 6.0, "beyond_bound": -1.0}
        row |= {"base_00": 1.0, "base_11": 1.0, "base_22": 1.0, "base_23": eye - 62.0}
        first, last = DEEP.get(step, (0.0, 0.0))
        row |= {"outside_link1": first, "outside_link2": last, "beyond_bound": max(first, last) - 4.0}
        writer.tick(np.concatenate([np.zeros(COMMAND_SIZE), [row[name] for name in names]]))
    writer.close()
    return Run.read(folder)


@pytest.fixture(scope="module")
def series(tmp_path_factory: pytest.TempPathFactory) -> PolypSeries:
    return polyp_series(written(tmp_path_factory.mktemp("runs") / "run"), free)


def test_the_twelve_rows(series: PolypSeries) -> None:
    found = table_iii(series).to_dict()
    assert list(found) == list(PRINTED)
    assert found["completion_time_s"] == pytest.approx(13.0)  # the 26th step is at 150 mm
    assert found["travelled_mm"] == pytest.approx((28.0 + 18.0 + 18.0 + 62.0) / 2.0)
    assert found["polyps_missed"] == 1
    assert found["distance_error_mm"] == pytest.approx(3.0)  # 12 mm away
    assert found["angle_error_deg"] == pytest.approx(0.0)
    assert found["times_missed"] == pytest.approx(0.5)  # once, of the first
    assert found["deviations"] == 3
    assert found["deviation_max_mm"] == pytest.approx(5.0)
    assert found["deviation_mean_mm"] == pytest.approx((2.0 + 4.0 + 3.0 + 5.0) / 4.0)
    assert found["deviation_time_mean_s"] == pytest.approx(2.0 / 3.0)
    assert found["deviation_time_max_s"] == pytest.approx(1.0)
    assert found["deviation_length_mm"] == pytest.approx(52.0)  # of steps 2, 10 and 24 only the last moves the tip


def test_figures_beside_the_table(series: PolypSeries) -> None:
    assert beyond_bound_mm(series) == pytest.approx(1.0)
    first, second = polyp_table(series)
    assert first["cleared_s"] == pytest.approx(4.5 + 7.0)  # from the first step that views it again
    assert first["viewed_s"] == pytest.approx(2.5 + 7.0)
    assert (first["times_missed"], second["cleared"], second["distance_error_mm"]) == (1, False, None)


def test_target_marker_and_camera_follow_from_the_rows(series: PolypSeries) -> None:
    assert len(series.t) == 26  # the task is over, and the rest of the run is not read
    assert series.target[0] == 0
    assert series.target[-1] == 1
    assert series.viewed.sum() == 6 + 15
    assert series.marker[1] == pytest.approx(1.0 - 3.0 / 7.0)
    assert series.camera[3, :3, 3] == pytest.approx([0.0, 0.0, 88.0])


@pytest.mark.parametrize("reset", [False, True])
def test_a_task_may_begin_within_a_run(reset: bool, series: PolypSeries, tmp_path: Path) -> None:
    later = polyp_series(written(tmp_path / "run", before=5, reset=reset), free)
    assert later.start_t == pytest.approx(0.0 if reset else 5 * DT)
    assert table_iii(later).to_dict() == pytest.approx(table_iii(series).to_dict())


@pytest.mark.parametrize(("before", "reset"), [(0, False), (5, False), (5, True)])
def test_a_task_is_replayed_at_every_moment_as_the_run_says(before: int, reset: bool, tmp_path: Path) -> None:
    run, wall = written(tmp_path / "run", before=before, reset=reset), _tube()
    series, replay = polyp_series(run, LumenSight(wall, TASK)), task_replay(run, 20.0, wall)
    assert len(replay.t) == 1 + len(EYE)  # steps of 0.5 s, of which none is left out
    begin, *after = replay.moments
    assert isinstance(begin, PolypMoment)
    assert begin.progress == PolypProgress.at_start(TASK)
    assert (replay.t[0], replay.at(series.start_t)) == (pytest.approx(series.start_t), begin)
    assert replay.at(series.start_t - 0.1) is None  # it had not begun
    for step, moment in enumerate(after):
        assert isinstance(moment, PolypMoment)
        known = min(step, len(series.t) - 1)  # nothing changes after its end
        assert (moment.progress.viewed, moment.progress.marker) == (series.viewed[known], series.marker[known])
        assert replay.at(float(replay.t[1 + step]) + 0.01) is moment
    assert [series.viewed.sum(), series.progress.cleared] == [6 + 15, 1]
    last = replay.moments[-1]
    assert isinstance(last, PolypMoment)
    assert last.progress == series.progress


def test_between_two_moments_every_step_counts(tmp_path: Path) -> None:
    run, wall = written(tmp_path / "run"), _tube()
    coarse = task_replay(run, 1.0, wall)
    assert len(coarse.t) == 1 + math.ceil(len(EYE) * DT)
    last = coarse.moments[-1]
    assert isinstance(last, PolypMoment)
    assert last.progress == polyp_series(run, LumenSight(wall, TASK)).progress


def test_a_replay_without_the_wall_of_its_task_is_refused_and_a_run_of_none_has_no_moment(tmp_path: Path) -> None:
    run = written(tmp_path / "run", task=replace(TASK, surface="sha256:of-no-colon"))
    with pytest.raises(InputError, match="surface is missing"):
        task_replay(run, 20.0, _tube())
    assert task_replay(replace(run, events=()), 20.0, _tube()).at(1.0) is None


def test_a_score_lists_each_polyp_by_its_number(tmp_path: Path) -> None:
    run = written(tmp_path / "run")
    seen, unseen = (score_lumen_run(run, wall=wall).task for wall in (_tube(), None))
    assert seen is not None
    assert unseen is not None
    series = polyp_series(run, LumenSight(_tube(), TASK))
    assert seen.items == (
        TaskItem("Polyp 1", series.progress.viewings[0].cleared_t, 1.0),
        TaskItem("Polyp 2", None, 0.0),
    )
    assert seen.items[0].done_s is not None
    assert unseen.items == ()


def _tube() -> TriangleMesh:
    """A surface about the z axis, in which every line of sight is free."""
    line = np.column_stack([np.zeros((9, 2)), np.linspace(0.0, 240.0, 9)])
    return pathway_surface(Pathway(line, np.full(9, 16.0), 121))


def test_a_run_without_a_task_is_refused(tmp_path: Path) -> None:
    run = written(tmp_path / "run")
    with pytest.raises(InputError, match="no polyps were looked for"):
        polyp_series(replace(run, events=()), free)


def test_steps_of_another_run_are_refused(tmp_path: Path, series: PolypSeries) -> None:
    run = written(tmp_path / "run")
    for steps in ([series.progress], [PolypProgress.at_start(TASK, DT)], []):
        with pytest.raises(InputError, match="not those of the run"):
            polyp_series(run, free, steps)


def test_an_episode_is_a_time_in_one_piece() -> None:
    true = np.array([True, True, False, True, False, False, True])
    assert episodes(true, np.full(7, 0.1)) == pytest.approx([0.2, 0.1, 0.1])
    assert len(episodes(np.zeros(3, dtype=bool), np.ones(3))) == 0
    assert math.fsum(episodes(np.ones(3, dtype=bool), np.array([1.0, 2.0, 3.0]))) == 6.0


def test_the_deviation_of_a_step_counts_for_its_time() -> None:
    """The last link's way, the deepest link's depth; a step of 3 s weighs three times one of 1 s."""
    outside = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 1.0], [0.0, 0.0], [0.0, 3.0]])
    found = deviation_of(outside, np.array([1.0, 1.0, 3.0, 0.1, 2.0]), np.array([5.0, 7.0, 11.0, 13.0, 17.0]))
    assert (found.episodes, found.longest_s, found.length_mm) == (2, 4.0, 28.0)  # 0.1 s end an episode
    assert found.time_s == pytest.approx(6.0)
    assert found.depth_mm is not None
    assert found.depth_mm.mean == pytest.approx((2.0 + 3.0 * 4.0 + 2.0 * 3.0) / 6.0)
    assert found.depth_mm.max == 4.0
    assert deviation_of(np.zeros((2, 2)), np.ones(2), np.ones(2)).depth_mm is None


def test_the_score_of_a_run_and_table_iii_have_the_same_deviation(tmp_path: Path) -> None:
    """Of a run that is its task alone: the score counts the whole run, Table III from the task's start to its end."""
    run = written(tmp_path / "run", after=False)
    off, table = score_lumen_run(run).deviation, table_iii(polyp_series(run, free))
    assert off is not None
    assert off.depth_mm is not None
    assert (table.deviations, table.deviation_length_mm) == (off.episodes, off.length_mm)
    assert (table.deviation_max_mm, table.deviation_mean_mm) == (off.depth_mm.max, off.depth_mm.mean)
    assert table.deviation_time_max_s == off.longest_s
    assert table.deviation_time_mean_s * off.episodes == pytest.approx(off.time_s)
    assert off.episodes == 3


def test_without_its_surface_a_task_is_completed_and_its_views_are_not_scored(tmp_path: Path) -> None:
    run = written(tmp_path / "run", task=replace(TASK, surface="sha256:of-no-colon"))
    other = _tube()
    for wall in (None, other):  # another surface than that of the task is none either
        score = score_lumen_run(run, wall=wall)
        assert score.task is not None
        assert score.completed
        assert score.task.completed
        assert "surface is missing" in score.task.lacking
        rows = {row.name: row for row in score.task.rows}
        assert {name for name, row in rows.items() if row.value is None} == {
            "Polyps missed", "Distance error", "Angle error", "Views lost per polyp",
        }  # fmt: skip
        assert rows["Completed in"].value == pytest.approx(13.0)
        assert not rows["Polyps missed"].worse
    known = written(tmp_path / "known", task=replace(TASK, surface=surface_hash(other)))
    task = score_lumen_run(known, wall=other).task
    assert task is not None
    assert task.lacking == ""
    assert all(row.value is not None for row in task.rows)


def test_the_synthetic_colons_are_made_again_to_score_a_task(tmp_path: Path) -> None:
    colon = colon_case(hard=True).mesh
    task = score_lumen_run(written(tmp_path / "run", task=replace(TASK, surface=surface_hash(colon)))).task
    assert task is not None
    assert task.lacking == ""
    assert task.rows[2].value == 2.0  # both polyps of this run are outside of the colon: no line of sight is free


@pytest.fixture(scope="module")
def places() -> WallPlaces:
    tube = Pathway(np.column_stack([np.zeros((9, 2)), np.linspace(0.0, 240.0, 9)]), np.full(9, 16.0), 121)
    return WallPlaces.of(pathway_surface(tube), tube.curve())


def test_the_figures_of_a_score_card_are_those_of_its_run(series: PolypSeries, places: WallPlaces) -> None:
    card = polyp_figures(series, places)
    assert (card["completed"], card["polyps_cleared"], card["of"], card["seed"]) == (True, 1, 2, 3)
    assert card["table_iii"] == table_iii(series).to_dict()
    assert card["ends_at"] == "the landmark 'ascending'"
    assert 0.0 < card["seen_share"] <= 1.0
    assert json.loads(json.dumps(card, allow_nan=False)) == card
    deep = replace(series, task=replace(TASK, end_name=None))
    assert "the depth that the robot reaches" in polyp_figures(deep, places)["ends_at"]


def test_the_share_of_the_wall_that_was_seen(series: PolypSeries, places: WallPlaces) -> None:
    camera = np.tile(np.eye(4), (2, 1, 1))
    camera[:, 2, 3] = 50.0, 52.0  # the second is too near to the first to show more
    looked = replace(series, camera=camera, t=series.t[:2], tip_mm=series.tip_mm[:2])
    edge = 16.0 / math.tan(math.radians(35.0)) * (4.0 / math.pi) * math.sin(math.pi / 4.0)  # mean over the square's rim
    far = math.sqrt(FAR_MM**2 - 16.0**2)
    assert seen_share(looked, places) == pytest.approx((far - edge) / 100.0, abs=0.03)  # of 50 to 150 mm
    back = looked.camera.copy()
    back[:, :3, 2] *= -1.0
    assert seen_share(replace(looked, camera=back), places) < 0.01
