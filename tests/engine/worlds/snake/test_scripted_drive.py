"""Operators without a hand drive the snake: to the end, round at every landmark, and again where it is held."""

from __future__ import annotations

import json
import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from lumen_shapes import arc, helix, straight
from snake_runs import acts

from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.limits.limits import MOTION_TOLERANCE_MM
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.query.query import deviation_of_points
from vfix_engine.pathway.tissue_motion import breathing, peristalsis
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.operator import after
from vfix_engine.worlds.snake.offline.drive_lumen import Shot, drive_lumen, lumen_between
from vfix_engine.worlds.snake.offline.drive_report import DeviationTally
from vfix_engine.worlds.snake.offline.drive_run import why_it_ended
from vfix_engine.worlds.snake.offline.operators import Stop, _come_again, adversarial, scripted
from vfix_engine.worlds.snake.offline.script import ScriptSystem
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.offline.wall_depth import WallDepth
from vfix_engine.worlds.snake.requests import GetReady
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.constants import Start
from vfix_engine.worlds.snake.stepping.state import SnakeState

QUICK = DriveSettings(vertices_per_link=40, bends=4, step_s=0.008)


def judged(
    drive: SnakeDrive, state: SnakeState, q: np.ndarray | None = None, base: np.ndarray | None = None
) -> np.ndarray:
    """Depth (L,) of the links that are inside, each vertex against each segment of its window."""
    frames = drive.snake.frames(state.q if q is None else q, state.base if base is None else base)[1:]
    vertices, depth = drive.query.vertices, np.zeros(drive.snake.links)
    for link in np.flatnonzero(state.measured):
        own = vertices.points[vertices.start[link] : vertices.start[link + 1]]
        placed = own @ frames[link, :3, :3].T + frames[link, :3, 3]
        depth[link] = deviation_of_points(placed, state.packed, *state.windows[link])[0].max()
    return depth


def test_the_scripted_operator_does_the_job() -> None:
    """In, once round at the landmark, straight again and on; the joints are never faster than their motors."""
    drive = SnakeDrive(SnakeModel(6), arc(120.0, 2.0, contours=25), QUICK)
    reached, thetas = [], []
    tally, events = DeviationTally(drive.snake.q_max, drive.bound), []
    for act in acts(drive, scripted([Stop("bend", 180.0), Stop("too far", 900.0)], 200.0)):
        before, order = drive.q.copy(), act.note
        state = drive.act(act)
        tally.add(before, state, order.dt)
        events += [order.event] if order.event else []
        if math.hypot(*state.steering) > 0.5:
            thetas.append(math.atan2(*state.steering[::-1]))
            reached.append(math.hypot(*state.steering))
        if order.event == "looked":
            assert drive.straight
    assert events == ["arrived", "bent", "looked"]
    assert drive.tip_s == pytest.approx(200.0, abs=1e-9)
    assert np.ptp(np.unwrap(thetas)) > math.radians(340.0)
    assert max(reached) > 0.9
    assert tally.beyond == 0
    assert tally.deepest > 2.0  # the look-round does use what the bounds leave
    assert math.degrees(tally.fastest) < 36.0 + 1e-6
    np.testing.assert_allclose(judged(drive, drive.state), drive.state.deviation.depth, rtol=0.0, atol=1e-9)
    # Follow-the-leader: on a path that the joints can follow they lie on it.
    assert drive.offset_mm.max() < 1e-6


@pytest.mark.parametrize("control", ["parameterised", "qp"])
@pytest.mark.parametrize("tissue", [None, "moving"])
def test_no_operator_gets_a_link_beyond_its_bound(control, tissue) -> None:
    """HAZ-01, HAZ-02, HAZ-05 for the snake: judged again, vertex by vertex, with the pathway still and moving."""
    pathway = helix(90.0, 30.0, 2.6, radius=13.0, contours=25)
    if tissue:
        sway, squeeze = breathing([0.0, 1.0, 0.5], 3.0), peristalsis(0.1)
        pathway = pathway.moved(lambda s, t: (sway(s, t)[0], squeeze(s, t)[1]))
    settings = DriveSettings(vertices_per_link=30, bends=4, step_s=0.004, control=control, bound_mm=5.0)
    drive = SnakeDrive(SnakeModel(6), pathway, settings, tip_s=170.0)
    assert (judged(drive, drive.state) <= drive.bound).all()
    deepest, outcomes, replayed = -np.inf, set(), 0
    was = drive.q.copy()
    for number, act in enumerate(acts(drive, adversarial(700, 20261121))):
        state = drive.act(act)
        outcomes.add(state.outcome)
        assert np.isfinite(state.q).all()
        assert np.abs(state.q).max() <= drive.snake.q_max
        assert np.abs(state.q - was).max() <= math.radians(36.0) * act.note.dt * (1.0 + 1e-9)
        near = (state.deviation.depth > drive.bound - 1.0).any()
        if number % 5 == 0 or near:
            depth = judged(drive, state)
            np.testing.assert_allclose(state.deviation.depth, depth, rtol=0.0, atol=1e-9)
            # What moves by itself stays within the reserve that is kept for it, here.
            assert (depth <= drive.bound).all()
            deepest = max(deepest, float((depth - drive.bound).max()))
        if tissue is None and state.mode == "looking" and state.outcome != "held" and near and replayed < 40:
            replayed += 1
            for share in np.linspace(0.0, 1.0, 21)[1:-1]:
                assert (judged(drive, state, was + share * (state.q - was)) <= drive.bound + MOTION_TOLERANCE_MM).all()
        was = state.q
        assert np.linalg.norm(state.forces.total) <= drive.hand.settings.most + 1e-12
    assert drive.state.refused_commands > 5
    assert "moved" in outcomes
    assert outcomes & {"held", "shrunk"}  # a program that slides along the wall is rarely held
    assert deepest > -1.0
    if tissue is None:
        assert replayed > 5


@pytest.mark.parametrize("control", ["parameterised", "qp"])
@pytest.mark.parametrize("bound", [0.001, 8.0])
def test_a_look_round_counts_what_the_camera_did(control, bound) -> None:
    """Where nothing can turn nobody has looked, whatever was commanded."""
    radius = 8.5 if bound < 1.0 else 14.0
    settings = DriveSettings(
        vertices_per_link=30, bends=4, step_s=0.005, control=control, bound_mm=bound, tip_bound_mm=bound
    )
    drive = SnakeDrive(SnakeModel(6), straight(300.0, radius), settings, tip_s=170.0)
    last, turned = None, 0.0
    for act in acts(drive, scripted([Stop("here", 170.0)], 170.0)):
        drive.act(act)
        view = drive.snake.camera(drive.q, drive.state.base)[2, 2]
        turned = max(turned, math.degrees(math.acos(min(view, 1.0))))
        last = act.note if act.note.event else last
    if bound > 1.0:
        assert (last.event, last.reason) == ("looked", None)
        assert turned > 20.0
        assert last.looked.count(20.0) == 8
    else:
        assert last.event == "gave up"
        assert "0 of 8 sides" in last.reason
        assert max(side.turned_deg for side in last.looked.sides) <= turned + 1e-9


def test_an_operator_who_is_held_comes_again_and_says_so() -> None:
    """At a waist that the bound does not let through: four more attempts from ever farther back, all told."""
    at = np.linspace(0.0, 300.0, 31)
    radius = np.where(np.abs(at - 150.0) < 15.0, 4.0, 14.0)
    waist = Pathway(np.column_stack([np.zeros((31, 2)), at]), radius, 61)
    drive = SnakeDrive(SnakeModel(3), waist, DriveSettings(vertices_per_link=30, bends=4, bound_mm=1.0), tip_s=125.0)
    told = []
    for act in acts(drive, scripted([], 300.0)):
        drive.act(act)
        told += [act.note.retry] if act.note.retry else []
    assert drive.tip_s < 150.0
    assert [retry.passed for retry in told] == [False] * 4
    np.testing.assert_allclose([retry.drawn_back_mm for retry in told], [5.0, 10.0, 20.0, 40.0], atol=0.5)
    assert len({retry.waypoint_mm for retry in told}) > 2
    assert all(retry.held_by for retry in told)
    assert all(retry.ended_by and retry.ended_mm == pytest.approx(retry.at_mm, abs=0.5) for retry in told)
    assert drive.state.held_by is None  # it has drawn back since
    stopped = why_it_ended(drive, 300.0, told)
    assert stopped is not None
    assert re.match(r"held at \d+ mm, near \(-?[\d.]+, -?[\d.]+, 1[34]\d\.\d\) in LPS mm: ", stopped)
    assert told[-1].held_by in stopped
    assert "; 4 more attempts failed there; a larger bound, a thinner robot" in stopped
    assert why_it_ended(drive, drive.tip_s, told) is None


def test_an_attempt_that_cannot_draw_back_and_creeps_on_is_told_as_that() -> None:
    """It has drawn back by nothing, not by less; and it did get past the place, though not by 5 mm."""
    drive = SimpleNamespace(
        tip_s=100.0, length_mm=300.0, settings=DriveSettings(), plan_anew=lambda _: None, tip=np.zeros(3), lost=None,
        pathway=SimpleNamespace(motion=object()),
        state=SimpleNamespace(held_by="link 3 at its bound", held_at=None),
    )  # fmt: skip
    told: list[Any] = []
    for order in _come_again(drive, 300.0):  # type: ignore[arg-type]
        on = order.command.insert_mm_per_s > 0.0 and drive.tip_s < 100.7 + 0.7 * len(told)
        drive.tip_s += 0.1 if on else 0.0
        told += [order.retry] if order.retry else []
    assert [retry.drawn_back_mm for retry in told] == [0.0] * 4
    assert {(retry.passed, retry.back_held_by, retry.ended_by) for retry in told} == {
        (False, *["link 3 at its bound"] * 2)
    }
    np.testing.assert_allclose([retry.ended_mm for retry in told], [100.7, 101.4, 102.1, 102.8], atol=0.11)
    stopped = why_it_ended(drive, 300.0, told)  # type: ignore[arg-type]
    assert re.search(
        r"the last one came 2\.\d mm past it and was held again at 103 mm: link 3 .*; 5 mm count as past", stopped or ""
    )


def test_the_wall_is_measured_only_past_the_paths_start() -> None:
    """Before it the robot is outside the organ, behind nothing."""
    mesh, start, end = tube()
    settings = DriveSettings(vertices_per_link=30, bends=4, contours=12, interpolated=36)
    lumen = lumen_between(mesh, start, end, SnakeModel(3), settings)
    drive = SnakeDrive(SnakeModel(3), lumen.pathway, settings, lumen.curve, lumen.slack, tip_s=10.0)
    assert drive.state.measured.any()
    depth = WallDepth(mesh, lumen.pathway, lumen.curve, drive.snake.links)
    depth.look(drive, True)
    assert depth.deepest["mm"] == 0.0
    assert "no part of the robot" in depth.words


def test_the_same_seed_makes_the_same_drive() -> None:
    """HAZ-13."""
    ends = []
    for _ in range(2):
        drive = SnakeDrive(SnakeModel(6), arc(120.0, 2.0, contours=25), QUICK, tip_s=170.0)
        for act in acts(drive, adversarial(150, 7)):
            drive.act(act)
        ends.append(drive.state)
    np.testing.assert_array_equal(ends[0].q, ends[1].q)
    np.testing.assert_array_equal(ends[0].base, ends[1].base)


def test_an_operator_does_the_same_with_the_system_alone() -> None:
    """Its requests, which it has seen carried out before its command, are part of its acts."""
    pathway, stops = arc(120.0, 2.0, contours=25), [Stop("here", 170.0)]
    drive = SnakeDrive(SnakeModel(6), pathway, QUICK, tip_s=170.0)
    system, operator = ScriptSystem(Start(drive.constants, drive.state)), scripted(stops, 170.0)
    state, asked = system.start(), set()
    for _, act in zip(range(300), acts(drive, scripted(stops, 170.0)), strict=False):
        drive.act(act)
        same = operator(system, state)
        assert (same.note, same.requests) == (act.note, act.requests)
        state = after(system, state, same)
        asked |= {type(request) for request in same.requests}
        np.testing.assert_array_equal(state.q, drive.q)
    assert asked == {GetReady}
    assert not state.straight


def tube(radius: float = 14.0, bend: float = 100.0, turn: float = 2.0) -> tuple[TriangleMesh, np.ndarray, np.ndarray]:
    """A closed, bent tube, and its ends' centres a little inside."""
    around, along = 24, 48
    angle = np.linspace(0.0, turn, along)
    psi = 2.0 * np.pi * np.arange(around) / around
    out = np.column_stack([-np.cos(angle), np.zeros(along), np.sin(angle)])
    centre = np.array([bend, 0.0, 0.0]) + bend * out
    side = np.array([0.0, 1.0, 0.0])
    rim = centre[:, None] + radius * (np.cos(psi)[:, None] * out[:, None] + np.sin(psi)[:, None] * side)
    points = np.concatenate([rim.reshape(-1, 3), centre[[0, -1]]])
    faces = []
    for i in range(along - 1):
        for j in range(around):
            a, b, c, d = (
                i * around + j,
                i * around + (j + 1) % around,
                (i + 1) * around + j,
                (i + 1) * around + (j + 1) % around,
            )
            faces += [[a, c, b], [b, c, d]]
    last = (along - 1) * around
    for j in range(around):
        faces += [[len(points) - 2, j, (j + 1) % around], [len(points) - 1, last + (j + 1) % around, last + j]]
    return TriangleMesh(points, np.array(faces)), centre[2], centre[-3]


def test_from_a_surface_to_a_driven_snake() -> None:
    """The whole job on a made-up lumen: every key of the report, landmarks reached and not, pictures asked for."""
    mesh, start, end = tube()
    shots: list[Shot] = []
    marks = {"middle": tube()[0].vertices[24 * 44], "behind the end": end + 500.0, "entrance": start}
    settings = DriveSettings(vertices_per_link=30, bends=4, step_s=0.005, contours=12, interpolated=36)
    report = drive_lumen(mesh, start, end, None, marks, "scripted", settings, shots.append)
    told = report.to_dict()
    assert json.loads(json.dumps(told)) == told
    assert report.reached
    assert report.within_bounds
    assert told["links"] == math.ceil(told["path_mm"] / 28.0)
    for key in ("links", "inserted_mm", "deviation_mm", "bound_mm", "joint_limit_hits", "query_us", "step_us"):
        assert key in told
    assert told["bound_mm"] == {"body": 8.0, "last": 4.0}
    assert told["deviation_mm"]["mean"] <= told["deviation_mm"]["max"] <= 8.0
    by_name = {mark["name"]: mark for mark in told["landmarks"]}
    assert by_name["middle"]["looked"]
    assert by_name["middle"]["turn_deg"] > 340.0
    assert by_name["middle"]["looked_from_mm"] == pytest.approx(by_name["middle"]["s_mm"])
    assert [side["toward_deg"] for side in by_name["middle"]["sides"]] == [45.0 * k for k in range(8)]
    assert all(side["turned_deg"] >= 20.0 for side in by_name["middle"]["sides"])
    assert told["retries"] == []
    for name, asked in (("start", start), ("end", end)):
        place = np.array(told[f"{name}_lps_mm"])
        assert told[f"{name}_moved_mm"] == pytest.approx(np.linalg.norm(place - asked))
        moved = [words for words in told["warnings"] if f"from the {name} that was asked for" in words]
        assert len(moved) == (told[f"{name}_moved_mm"] > 5.0)
    assert all("was asked for" in words for words in told["warnings"])
    assert np.linalg.norm(np.array(told["tip_lps_mm"]) - told["end_lps_mm"]) < 1.0
    assert f"{told['behind_wall']['mm']:.1f} mm, link" in told["behind_wall"]["words"]
    assert told["narrowest"]["radius_mm"] == pytest.approx(14.0, abs=0.7)
    assert 1.0 < told["behind_wall"]["mm"] < 9.0  # it leans against the wall while it looks round, by 8 mm at most
    assert (told["operator"], told["notice"]) == ("scripted", "Not for clinical use.")
    assert not by_name["behind the end"]["reached"]
    assert "from the path" in by_name["behind the end"]["note"]
    assert "too near the entrance" in by_name["entrance"]["note"]
    assert [(shot.name, shot.event) for shot in shots] == [
        ("entrance", "arrived"), ("middle", "arrived"), ("middle", "bent"),
    ]  # fmt: skip
    assert shots[-1].frames.shape == (told["links"] + 1, 4, 4)
    with pytest.raises(InputError, match="operator"):
        drive_lumen(mesh, start, end, 3, operator="careless")
    with pytest.raises(InputError, match="landmark"):
        drive_lumen(mesh, start, end, 3, {"nowhere": [0.0, math.nan, 1.0]}, settings=settings)


def test_the_end_of_a_path_that_breathes_is_reached() -> None:
    """With as many links as it takes: every arc length is of the curve that the robot follows."""
    mesh, start, end = tube()
    settings = DriveSettings(vertices_per_link=30, bends=4, step_s=0.01, contours=12, interpolated=36)
    breath = breathing([0.0, 0.0, 1.0], 3.0, falloff_s=100.0)
    report = drive_lumen(mesh, start, end, None, settings=settings, tissue=breath)
    assert report.reached
    assert report.stopped_by is None
    assert report.within_bounds
    assert report.visits[0].looked
    assert math.degrees(report.tally.fastest) < 36.0 + 1e-6
