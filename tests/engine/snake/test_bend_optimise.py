"""Control bends within the bounds: Kwok 2013, eq. 14-20, figures 7(c) and 8, against a search everywhere."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from matplotlib.contour import ContourSet
from matplotlib.text import Text

from benchmarks import lumen_bends, lumen_figure_7c, lumen_figure_8
from tests.engine.lumen_shapes import arc, small_bend, straight
from vfix_engine.errors import InputError
from vfix_engine.pathway.cavity import body_cavity
from vfix_engine.pathway.query.query import Query, deviation_of_points
from vfix_engine.robots import SnakeModel
from vfix_engine.snake.bending.bending import (
    DIRECTIONS,
    BendProblem,
    bend_angles,
    tip_displacement,
)
from vfix_engine.snake.bending.optimise import (
    DistalBend,
    control_bends,
    optimise_primary,
    search_globally,
)

SNAKE = SnakeModel(5)
QUERY = Query(SNAKE.vertices(500))
SIDES = [*DIRECTIONS]


def tube(radius: float = 20.0, bound: float = 8.0, rest: float = 0.0, **more) -> BendProblem:
    pathway, base = straight(radius=radius, **more), np.eye(4)
    base[2, 3] = 60.0
    limit = np.append(np.full(4, bound), 0.5 * bound)
    window = np.array(pathway.window(40.0, 240.0))
    return BendProblem(SNAKE, QUERY, pathway.packed(), window, base, rest * np.cos(np.arange(10.0)), limit)


def bent(radius: float = 20.0) -> BendProblem:
    """In an arc that bends towards +x, with the joints that follow it."""
    pathway, turn = arc(bend=150.0, turn=1.6, radius=radius, contours=41), 28.0 / 150.0
    base = np.eye(4)
    base[:3, :3] = [[math.cos(0.3), 0.0, math.sin(0.3)], [0.0, 1.0, 0.0], [-math.sin(0.3), 0.0, math.cos(0.3)]]
    base[:3, 3] = [150.0 * (1.0 - math.cos(0.3)), 0.0, 150.0 * math.sin(0.3)]
    rest = np.tile([0.0, turn], 5)
    rest[1] = 0.5 * turn
    window = np.array(pathway.window(20.0, 220.0))
    return BendProblem(SNAKE, QUERY, pathway.packed(), window, base, rest, np.array([8.0, 8.0, 8.0, 8.0, 4.0]))


def figure_8() -> BendProblem:
    """13 contours of 28 polar radii each, the base inclined by 25° at their lower end, all five links free."""
    packed, base, turn = body_cavity().packed(), np.eye(4), math.radians(-25.0)
    base[1:3, 1:3] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
    base[:3, 3] = [0.0, -15.0, 20.0]
    window = np.array([0, len(packed.rows)])
    return BendProblem(SNAKE, QUERY, packed, window, base, np.zeros(10), np.array([3.0, 3.0, 3.0, 3.0, 1.0]))


def judged(case: BendProblem, bend: DistalBend, share: float = 1.0) -> np.ndarray:
    """Deviation of each link (5,) at a share of a bend, vertex by vertex and segment by segment."""
    frames = SNAKE.frames(SNAKE.clamp(case.q_rest + share * bend.delta), case.base)
    points, start = QUERY.vertices.points, QUERY.vertices.start
    placed = [points[start[k] : start[k + 1]] @ frames[k + 1, :3, :3].T + frames[k + 1, :3, 3] for k in range(5)]
    first, last = case.window[0]
    return np.array([deviation_of_points(link, case.packed, int(first), int(last))[0].max() for link in placed])


@pytest.fixture(scope="module")
def eight() -> dict[str, tuple[BendProblem, tuple[DistalBend, ...]]]:
    cases = {"tube": tube(), "bent": bent(), "figure 8": figure_8()}
    return {name: (case, control_bends(case, 8)) for name, case in cases.items()}


@pytest.mark.parametrize("name", ["tube", "bent", "figure 8"])
def test_eight_bends_are_within_the_bounds_and_take_a_hundred_evaluations(name: str, eight: dict) -> None:
    case, bends = eight[name]
    np.testing.assert_allclose([bend.angle for bend in bends], np.arange(8) * np.pi / 4)
    for bend in bends:
        assert bend.feasible
        assert bend.evaluations <= 100
        assert (judged(case, bend) <= case.bound + 1e-9).all()
        assert np.abs(case.q_rest + bend.delta).max() <= SNAKE.q_max + 1e-15
        assert bend.cost == pytest.approx(SNAKE.tip(bend.delta, np.eye(4))[2, 3] / 140.0, abs=1e-12)
        assert bend.cost < 1.0
        assert not bend.delta.flags.writeable
    for direction, bend in zip(DIRECTIONS, bends[::2], strict=True):
        assert tip_displacement(SNAKE, bend.delta) @ small_bend(direction) > 0.0  # (17)
        planar = bend_angles(*bend.parameters, 5, odd=direction[0] == "o")
        np.testing.assert_allclose(SNAKE.clamp(case.q_rest + planar), case.q_rest + bend.delta, atol=1e-12)


def test_eight_bends_have_the_four_among_them(eight: dict) -> None:
    case, bends = eight["tube"]
    for one, two in zip(control_bends(case, 4), bends[::2], strict=True):
        np.testing.assert_array_equal(one.delta, two.delta)
    for k in (1, 7):
        one, bend, two = bends[k - 1], bends[k], bends[(k + 1) % 8]
        share, (alpha, beta) = np.arange(1, 11) / 10.0, bend.parameters
        assert min(alpha, beta) > 0.0
        scaled = ((beta - alpha) * share + alpha) * 0.5 * (one.delta + two.delta)  # (18)-(19)
        np.testing.assert_allclose(SNAKE.clamp(case.q_rest + scaled), case.q_rest + bend.delta, atol=1e-12)


def test_bends_can_be_grown_into(eight: dict) -> None:
    """From rest along their ray: between the places that were asked a link leaves its bound by little if at all."""
    for case, bends in eight.values():
        for bend in bends[::2]:
            unclamped = bend_angles(*bend.parameters, 5, odd=bend.angle % math.pi > 1.0)
            for share in np.linspace(0.05, 1.0, 20):
                delta = SNAKE.clamp(case.q_rest + share * unclamped) - case.q_rest
                assert (case.deviations(delta) - case.bound).max() < 0.3


@pytest.mark.parametrize(
    ("case", "way"),
    [(tube(12.0), "e+"), (tube(16.0), "o-"), (tube(20.0), "e-"), (tube(30.0), "o+"), (bent(), "e+"), (bent(), "e-")],
    ids=["tube 12", "tube 16", "tube 20", "tube 30", "bend on", "bend back"],
)
def test_the_gap_to_a_search_everywhere_is_small(case: BendProblem, way: str) -> None:
    best = search_globally(case, way, grid=61).reachable
    assert optimise_primary(case, way).cost <= best.cost + 0.02


@pytest.mark.parametrize(("k", "grown", "any_"), [(2, 0.02, 0.25), (3, 0.02, 0.05)], ids=["90°", "135°"])
def test_the_gap_in_the_cavity_is_what_is_told(k: int, grown: float, any_: float, eight: dict) -> None:
    """The worst of a planar bend and of one between two; also to bends that cannot be grown into."""
    case, bends = eight["figure 8"]
    found = search_globally(case, "o+" if k == 2 else (bends[2], bends[4]), grid=61)
    assert -0.01 <= bends[k].cost - found.reachable.cost <= grown
    assert bends[k].cost - found.anywhere.cost <= any_


def test_more_room_is_bent_farther_and_none_is_not_left() -> None:
    costs = [optimise_primary(tube(radius), "e+").cost for radius in (10.0, 14.0, 20.0, 30.0)]
    assert (np.diff(costs) < 0.0).all()
    stuck = optimise_primary(tube(6.0 + 1e-7, bound=0.0), "e+")
    assert stuck.cost > 1.0 - 1e-6
    assert stuck.feasible


def test_without_bounds_a_bend_looks_back() -> None:
    """Then only joints end it: 45° four times and straight on is the least that five links can have, −2 ℓ."""
    case = tube(bound=math.inf)
    for direction in SIDES:
        bend = optimise_primary(case, direction)
        assert -0.4 - 1e-12 <= bend.cost < -0.39


def test_from_beyond_the_bounds_nothing_goes_deeper() -> None:
    """A rest that a moved pathway left outside: its own deviations take the place of the bounds, and it is said."""
    case = tube(12.0, bound=0.0, rest=0.1)
    at_rest = case.deviations(np.zeros(10))
    assert at_rest.max() > 1.0
    for bend in control_bends(case, 8):
        assert not bend.feasible
        assert (case.deviations(bend.delta) <= at_rest + 1e-12).all()


def test_one_link_and_polar_contours() -> None:
    one = SnakeModel(1)
    pathway, base = straight(radius=14.0, angles=28), np.eye(4)
    base[2, 3] = 100.0
    case = BendProblem(one, one.vertices(60), pathway.packed(), (0, 30), base, np.zeros(2), np.array([1.0]))
    for bend in control_bends(case, 4):
        assert 0.0 < bend.cost < 0.99
        assert (case.deviations(bend.delta) <= 1.0).all()
        assert bend.parameters[0] == 0.0


def test_the_map_has_the_bend_in_what_it_can_grow_into() -> None:
    """Figure 7(c): the bend lies in the region as it is drawn, whose corners are where a bound is met first."""
    case = lumen_bends.in_a_tube(SNAKE, QUERY)
    bend = optimise_primary(case, "e+")
    corners = lumen_figure_7c.growable(case, bend)
    excess = [[lumen_figure_7c.ask(case, *share * corner)[1] for corner in corners] for share in (0.5, 0.999, 1.01)]
    assert max(excess[0]) <= 0.0
    assert max(excess[1]) <= 0.0
    towards = np.array([lumen_figure_7c.ask(case, *1.01 * corner)[2] for corner in corners])
    assert ((np.array(excess[2]) > 0.0) | (towards <= 0.0)).all()
    figure = lumen_figure_7c.figure_7c(case, 21)
    (ring,) = figure.findobj(lambda one: one.get_gid() == "found")
    _, region = figure.findobj(lambda one: one.get_gid() == "grown")  # of the whole plane, and of the band
    to_pixels = ring.axes.transData.transform
    drawn, place = to_pixels(region.get_path().vertices), to_pixels(ring.get_xydata()[0])
    assert cv2.pointPolygonTest(drawn.astype(np.float32).reshape(-1, 1, 2), place.tolist(), True) > -1.0  # px
    for panel in figure.axes[:2]:
        bands = panel.findobj(ContourSet)
        assert [len(one.levels) for one in bands[:3]] == [13, 13, 13]


def test_every_bend_is_drawn_from_two_sides() -> None:
    """Figure 8: the same bends as everywhere, a tip for each in both pictures of its row."""
    case, upright = lumen_bends.in_a_cavity(SNAKE, QUERY), lumen_bends.in_a_cavity(SNAKE, QUERY, inclined=0.0)
    four, eight = control_bends(case, 4), control_bends(upright, 8)
    for bend in eight:
        assert (judged(upright, bend) <= upright.bound + 1e-9).all()
    figure = lumen_figure_8.figure_8((case, four), (upright, eight))
    assert len(figure.findobj(lambda one: one.get_gid() == "tip")) == 2 * (4 + 8)
    words = [one.get_text() for one in figure.findobj(Text)]
    assert {f"{angle}°" for angle in range(0, 360, 45)} <= set(words)
    assert {"x, mm", "y, mm", "z, mm"} <= set(words)
    np.testing.assert_array_equal(four[0].delta, optimise_primary(figure_8(), "e+").delta)


def test_what_cannot_be_asked_is_refused() -> None:
    with pytest.raises(InputError, match="directions"):
        optimise_primary(tube(), "up")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="4 or 8"):
        control_bends(tube(), 6)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="40 evaluations"):
        optimise_primary(tube(), "e+", evaluations=10)
