"""What no lumen, robot or drive can be made of is refused in words, never by an exception of somebody else's."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from lumen_shapes import straight

from vfix_engine.anatomy.lumen.centreline import centreline_between
from vfix_engine.errors import InputError, VfixError
from vfix_engine.pathway.fit import fit_pathway
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.pathway_surface import pathway_surface
from vfix_engine.pathway.query.query import Query, deviation_of_points
from vfix_engine.pathway.tissue_motion import breathing, peristalsis
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.bending.bending import BendProblem
from vfix_engine.snake.bending.hermite import PolarHermite
from vfix_engine.snake.bending.optimise import control_bends
from vfix_engine.snake.bending.visual_motor import BendDirection, VisualMotor
from vfix_engine.worlds.snake.narrow import narrowest
from vfix_engine.worlds.snake.offline.drive_lumen import drive_lumen
from vfix_engine.worlds.snake.offline.drive_report import Visit
from vfix_engine.worlds.snake.offline.look_round import look_round
from vfix_engine.worlds.snake.offline.operators import Stop, _scripted
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.command import SnakeCommand

LANE = straight(contours=16)
RADII = np.full(16, 12.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"radius": ["a"] * 16}, {"radius": None}, {"centre": [[0, 0], [1, 2, 3]]}, {"centre": LANE.centre + 1j},
        {"centre": "abc"}, {"centre": LANE.centre * 1e300}, {"tangent": "z"}, {"first": "x"}, {"knots": ["a"] * 16},
        {"count": math.nan}, {"count": "61"}, {"count": 61.5}, {"count": True}, {"count": 10**9}, {"motion": 3},
    ],
    ids=lambda wrong: " ".join(wrong),
)  # fmt: skip
def test_a_pathway_of_other_things_than_numbers_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(VfixError):
        Pathway(**{"centre": LANE.centre, "radius": RADII, "count": 31} | wrong)


@pytest.mark.parametrize(
    "motion",
    [lambda s, t: None, lambda s, t: ("a", "b"), lambda s, t: 1.0, lambda s, t: ([[1], [1, 2]], np.ones(len(s)))],
)
def test_a_motion_that_gives_no_numbers_is_refused(motion: Callable[..., Any]) -> None:
    with pytest.raises(VfixError, match="motion"):
        LANE.moved(motion)


def test_tissue_is_asked_for_at_finite_times() -> None:
    lane = LANE.moved(breathing((0.0, 0.0, 1.0)))
    for t in (math.inf, math.nan, "soon"):
        with pytest.raises(VfixError, match="time"):
            lane.packed(t)
    for wrong in ({"amplitude_mm": 1e9}, {"amplitude_mm": "8"}, {"period_s": None}):
        with pytest.raises(VfixError, match="breathing"):
            breathing((0.0, 0.0, 1.0), **wrong)
    with pytest.raises(VfixError, match="peristalsis"):
        peristalsis(math.nan)


@pytest.mark.parametrize(
    "made",
    [
        lambda: Pathway(LANE.centre / 1000.0, RADII / 1000.0),
        lambda: Pathway(LANE.centre, RADII / 1000.0),
        lambda: Pathway(LANE.centre / 1000.0, RADII),
        lambda: SnakeModel(5, length_mm=0.028, radius_mm=0.006),
        lambda: SnakeModel(5, radius_mm=0.006),
    ],
)
def test_metres_are_no_millimetres(made: Callable[[], object]) -> None:
    with pytest.raises(VfixError, match="in millimetres"):
        made()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("reoptimise_below", math.nan), ("reoptimise_below", 1e9), ("reoptimise_below", -1.0), ("r_max", 0.5),
        ("manipulated", 2.5), ("manipulated", True), ("vertices_per_link", 1.5), ("vertices_per_link", 10**9),
        ("contours", 0), ("contours", 2.7), ("contours", 100_000), ("interpolated", 0), ("interpolated", 10**9),
        ("angles", 2), ("angles", 0), ("quantile", 5.0), ("quantile", math.nan), ("waypoint_mm", 1e-9),
        ("insertion_step_mm", 1e-9), ("step_s", 1e-12), ("bound_mm", "8"), ("step_s", None), ("speed_max", True),
        ("tip_bound_mm", "4"),
    ],
)  # fmt: skip
def test_every_drive_setting_is_looked_at(name: str, value: object) -> None:
    """HAZ-02, HAZ-05: one that is not a number may not let a bent tip be inserted."""
    with pytest.raises(InputError, match=name):
        DriveSettings(**{name: value})


def test_a_fit_has_as_many_contours_as_memory_can_hold() -> None:
    for wrong in ({"contours": 100_000}, {"interpolated": 0}, {"interpolated": 10**9}, {"angles": 10**6}):
        with pytest.raises(VfixError, match="number of"):
            fit_pathway(None, LANE.curve(), **wrong)


def test_a_place_that_is_none_and_vertices_that_are_not_counted_are_refused() -> None:
    for start in ("abc", (1.0, 2.0), (1.0, 2.0, 3j), None):
        with pytest.raises(InputError, match="start"):
            centreline_between(None, start, (0.0, 0.0, 0.0))
    for count in (500.5, "500", True):
        with pytest.raises(InputError, match="vertices"):
            SnakeModel(5).vertices(count)


def damaged(kind: str) -> Any:
    """A sound pathway's arrays with one fault."""
    rows, polar = (array.copy() for array in LANE.packed())
    if kind == "a stretch of NaN":
        rows[8:12, 0] = math.nan
    elif kind == "all NaN":
        rows[:] = math.nan
    elif kind == "beyond all places":
        rows[8, 3] = 1e200
    elif kind == "radii of NaN":
        polar[3] = math.nan
    elif kind == "too few radii":
        polar = polar[:3].copy()
    elif kind == "narrow rows":
        rows = rows[:, :5].copy()
    elif kind == "no rows":
        return LANE
    return PackedPathway(rows, polar)


FAULTS = "a stretch of NaN", "all NaN", "beyond all places", "radii of NaN", "too few radii", "narrow rows", "no rows"


@pytest.mark.parametrize("kind", FAULTS)
def test_a_damaged_pathway_is_never_one_that_all_is_inside_of(kind: str) -> None:
    """HAZ-05 for the snake: whoever asks, and with which face."""
    snake, packed = SnakeModel(5), damaged(kind)
    query = Query(snake.vertices(50))
    base = np.eye(4)
    base[:3, 3] = 100.0, 0.0, 60.0
    frames, window = snake.frames(np.zeros(10), base), (0, 5)
    for ask in (
        lambda: query.deviations(packed, frames, window),
        lambda: query.every_vertex(packed, frames, window),
        lambda: query.checked(packed, frames, window),  # what a GPU's query asks first
        lambda: deviation_of_points(frames[:, :3, 3], packed, *window),
        lambda: BendProblem(snake, query, packed, np.array(window), base, np.zeros(10), np.full(5, 8.0)),
    ):
        with pytest.raises(InputError, match="pathway"):
            ask()


def test_a_pathway_that_may_be_written_to_is_looked_at_every_time() -> None:
    packed, query = PackedPathway(*(array.copy() for array in LANE.packed())), Query(SnakeModel(5).vertices(50))
    query.check(packed)
    packed.rows[2, 0] = math.nan
    with pytest.raises(InputError, match="not finite"):
        query.check(packed)


def test_nan_goes_into_no_control() -> None:
    snake = SnakeModel(5)
    surface = PolarHermite(np.zeros(10), [0.0, 2.0, 4.0], 0.1 * np.arange(30.0).reshape(3, 10) / 30.0)
    motor = VisualMotor(snake, surface, np.eye(4))
    for wrong in (math.nan, math.inf):
        for ask in (surface.value, surface.partials, surface.second, surface.cartesian):
            with pytest.raises(InputError, match="place"):
                ask(wrong, 0.0)
            with pytest.raises(InputError, match="place"):
                ask(0.5, wrong)
        with pytest.raises(InputError, match="place"):
            motor.step(BendDirection(wrong, 0.0), (1.0, 1.0))
        with pytest.raises(InputError, match="finite"):
            motor.step(BendDirection(0.0, 0.0), (wrong, 1.0))
    far, farther = (motor.step(BendDirection(0.1, 0.0), (size, 0.0)) for size in (1e5, 1e300))
    assert math.dist(far, (0.1, 0.0)) > 0.1
    assert math.dist(far, farther) < 0.05  # as near as can be: in that direction
    base = np.eye(4)
    base[2, 3] = 60.0
    problem = BendProblem(
        snake, snake.vertices(50), LANE.packed(), np.array((0, 10)), base, np.zeros(10), np.full(5, 8.0)
    )
    for evaluations in (math.nan, 99.5, 39, "100"):
        with pytest.raises(InputError, match="evaluations"):
            control_bends(problem, 4, evaluations)


@pytest.fixture(scope="module")
def drive() -> SnakeDrive:
    return SnakeDrive(SnakeModel(5), LANE, DriveSettings(vertices_per_link=20, bends=4), tip_s=170.0)


def test_a_drive_starts_with_what_fits_together(drive: SnakeDrive) -> None:
    for wrong, words in (
        ({"snake": SnakeModel(30)}, "11 links reach its end"),
        ({"tip_s": -1e9}, "tip starts"),
        ({"tip_s": math.nan}, "tip starts"),
        ({"tip_s": "in"}, "tip starts"),
        ({"slack": np.ones(3)}, "give the curve"),
        ({"slack": np.ones(3), "curve": LANE.curve()}, "slack"),
        ({"slack": "wide", "curve": LANE.curve()}, "slack"),
    ):
        with pytest.raises(InputError, match=words):
            SnakeDrive(**{"snake": drive.snake, "pathway": LANE, "settings": drive.settings, "tip_s": 170.0} | wrong)
    assert SnakeDrive(SnakeModel(12), LANE, drive.settings, longer_allowed=True).state.outcome == "rest"
    for command, dt in (((1, 2), 0.001), (SnakeCommand(), "a"), (SnakeCommand(), math.nan)):
        with pytest.raises(InputError):
            drive.step(command, dt)


def test_a_job_that_is_none_is_refused_before_it_begins() -> None:
    ends = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    for wrong in ({"seed": -1}, {"seed": 1.5}, {"landmarks": [ends[0]]}, {"operator": "evil"}):
        with pytest.raises(InputError):
            drive_lumen(**{"mesh": None, "start": ends[0], "end": ends[1], "links": 5} | wrong)


def test_tissue_that_leaves_no_pathway_holds_the_robot_until_there_is_one() -> None:
    """HAZ-01, HAZ-05: what was seen last is older than it may be, and nothing moves by it."""

    def folds(s: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        shift = np.zeros((len(s), 3))
        shift[8, 2] = 45.0 if 0.05 < t < 0.15 else 0.0
        return shift, np.ones(len(s))

    drive = SnakeDrive(
        SnakeModel(6), straight(300.0, 20.0, contours=16).moved(folds), DriveSettings(vertices_per_link=20, bends=4),
        tip_s=170.0,
    )  # fmt: skip
    held, reasons, q = 0, set(), drive.q.copy()
    for _ in range(200):
        lost = drive.lost
        state = drive.step(SnakeCommand(camera_mm_per_s=(30.0, 0.0)), 0.001)
        if drive.lost is not None:
            held += 1
            reasons.add(state.held_by)
            assert state.outcome == "held"
            if lost is not None:
                np.testing.assert_array_equal(state.q, q)
        q = state.q
    assert 60 <= held <= 110
    assert len(reasons) == 1
    assert "leaves no pathway" in str(reasons)
    assert drive.lost is None
    assert state.outcome in ("moved", "shrunk")  # by the joints' speed


def test_a_lumen_that_is_narrower_than_the_robot_is_told_with_its_place() -> None:
    at = np.linspace(0.0, 300.0, 31)
    waist = Pathway(np.column_stack([np.zeros((31, 2)), at]), np.where(np.abs(at - 150.0) < 15.0, 4.0, 14.0), 61)
    found = narrowest(waist, SnakeModel(12), 8.0, 300.0)
    assert (found.radius_mm, found.at_mm) == pytest.approx((4.0, 140.0))
    assert found.below_robot_mm == found.below_bound_mm == pytest.approx(25.0, abs=5.0)
    wide, bound = found.warnings(8.0)
    assert (
        "the robot is wider than the pathway: the pathway's radius is 4.0 mm at 140 mm, (0.0, 0.0, 140.0) in LPS"
        in wide
    )
    assert "smaller bound" in bound
    assert narrowest(waist, SnakeModel(12), 8.0, 100.0).warnings(8.0) == []


def test_the_pathway_as_a_surface_is_closed_and_as_wide_as_it_is() -> None:
    made = pathway_surface(straight(100.0, 12.0, contours=11))
    closed = trimesh.Trimesh(made.vertices, made.faces, process=False)
    assert closed.is_watertight
    assert closed.volume == pytest.approx(math.pi * 12.0**2 * 100.0, rel=0.02)


def test_where_nothing_is_steered_the_turn_is_the_views() -> None:
    steered, watched = Visit("here", 0.0), Visit("here", 0.0)
    for angle in np.linspace(0.0, 2.0 * math.pi, 41):
        where = (math.cos(angle), math.sin(angle))
        steered.turned(where, (0.0, 0.0))
        watched.turned(None, (0.1 * where[0], 0.1 * where[1]))
    assert steered.to_dict()["turn_deg"] == pytest.approx(360.0)
    assert steered.to_dict()["r_max"] == pytest.approx(1.0)
    assert watched.to_dict()["turn_deg"] == pytest.approx(360.0)
    assert watched.to_dict()["r_max"] is None


def test_an_operator_whose_steps_lead_nowhere_gives_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every order is 'shrunk', none brings the robot anywhere: that is no reason to go on for ever."""
    stuck = SimpleNamespace(
        tip_s=100.0, length_mm=300.0, settings=DriveSettings(), can_look=True, straight=False, bend=np.full(10, 0.2),
        state=SimpleNamespace(outcome="shrunk", held_by="link 5 would be 4.10 mm outside", held_at=np.zeros(3)),
        plan_anew=lambda _: None, pathway=SimpleNamespace(motion=None),
    )  # fmt: skip
    assert sum(1 for _ in _scripted(stuck, [], 200.0)) < 1000
    stuck.state.outcome = "held"  # the same numbers would refuse the same step again and again
    assert sum(1 for _ in _scripted(stuck, [], 200.0)) < 30
    stuck.state.outcome = "shrunk"
    monkeypatch.setattr("vfix_engine.worlds.snake.offline.look_round._by_hand", lambda *_: iter(()))
    orders = list(look_round(stuck, Stop("here", 100.0)))
    assert len(orders) < 200
    assert orders[-1].event == "gave up"
