"""Lumens that are narrower than the robot or its bounds: refused, bounds by place, steps that end, depths told."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from lumen_shapes import arc, straight
from snake_runs import hand, judged, made_spec, rows

from benchmarks.attack.snake.judge import Judge, bounds_by_place
from vfix_engine.anatomy.lumen.free_radius import free_radius
from vfix_engine.errors import InputError, PathwayError
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.curve import Curve
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.limits.limits import Configuration, HardLimits, LinksAt
from vfix_engine.pathway.limits.limits_kernel import MOST_POSES
from vfix_engine.pathway.limits.link_bounds import BOUND_SHARE, LinkBounds, inscribed_radii, known_within
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.pathway_surface import pathway_surface
from vfix_engine.pathway.query.query import Query
from vfix_engine.pathway.tissue_motion import peristalsis
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import no_command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.operator import Act
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import END, Run, RunWriter
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.snake import LumenContours, LumenSurface, SnakeSettings, SnakeSystemSpec
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.narrow import narrowest
from vfix_engine.worlds.snake.offline.drive_lumen import _drawn_back, drive_lumen
from vfix_engine.worlds.snake.offline.drive_run import STALLED, DriveRun
from vfix_engine.worlds.snake.offline.look_round import Order, Stop, look_round
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.offline.wall_depth import WallDepth
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.command import SnakeCommand
from vfix_engine.worlds.snake.stepping.state import SnakeState

COARSE = DriveSettings(vertices_per_link=30, bends=4, step_s=0.01)


def bottle(wide: float = 16.0, narrow: float = 7.0, length: float = 400.0) -> Pathway:
    """A bend that is wide first and narrow behind it."""
    at = np.linspace(0.0, length, 41)
    turn = at / 90.0
    centre = 90.0 * np.column_stack([1.0 - np.cos(turn), 0.3 * turn, np.sin(turn)])
    return Pathway(centre, np.interp(at, [0.0, 0.5 * length, 0.75 * length], [wide, wide, narrow]), 81)


def waist(least: float) -> Pathway:
    """A straight lumen of 14 mm with a narrow place from 140 to 160 mm."""
    at = np.linspace(0.0, 300.0, 31)
    radius = np.where(np.abs(at - 150.0) < 15.0, least, 14.0)
    return Pathway(np.column_stack([np.zeros((31, 2)), at]), radius, 31)


def test_a_bound_that_nobody_has_set_is_a_share_of_the_radius_where_the_link_is() -> None:
    """HAZ-39: the least over the window of the smaller of 8 mm, 4 mm for the last link, and half the radius there."""
    path, links = bottle(), 6
    for settings in (DriveSettings(), DriveSettings(tip_bound_mm=6.0), DriveSettings(bound_mm=7.5)):
        inscribed, bounds = inscribed_radii(path), settings.bounds(links)
        random = np.random.default_rng(3)
        for _ in range(50):
            first = random.integers(0, len(inscribed) - 2, links)
            windows = np.column_stack([first, first + 1 + random.integers(0, len(inscribed) - 1 - first)])
            wanted = bounds_by_place(path, settings, windows)
            np.testing.assert_allclose(bounds.at(inscribed, windows), wanted, rtol=1e-9)
    given = LinkBounds.of(7.5, None, links)
    assert given.at(inscribed, windows).tolist() == [7.5] * (links - 1) + [3.75]


def test_bounds_are_those_of_the_lumen_at_rest() -> None:
    """A wave moves the wall that links are measured against, and no bound: it would shrink where nothing is asked."""
    still, waved = bottle(), bottle().moved(peristalsis(0.6))
    np.testing.assert_array_equal(inscribed_radii(still), inscribed_radii(waved))
    assert not np.array_equal(still.packed().rows, waved.packed().rows)


@pytest.mark.parametrize("back", [False, True])
def test_into_the_narrow_no_link_is_ever_beyond_the_bound_of_its_place(back: bool) -> None:
    """HAZ-39: every pose is measured as printed, against bounds that are computed here."""
    drive = SnakeDrive(SnakeModel(6), bottle(), COARSE, tip_s=330.0 if back else 190.0)
    judge, least, far = Judge(drive.snake, drive.query.vertices), math.inf, 0.0
    for step in range(300):
        phase, turn = step % 50, 2.0 * (step // 50)
        camera = (40.0 * math.cos(turn), 40.0 * math.sin(turn)) if phase >= 40 else (0.0, 0.0)
        straighten = phase < 15 and not drive.straight
        insert = 0.0 if any(camera) or straighten else -20.0 if back else 20.0
        state = drive.step(SnakeCommand(insert, camera, straighten), 0.025)
        bound = bounds_by_place(drive.pathway, drive.settings, state.windows)
        np.testing.assert_allclose(state.bound, bound, rtol=1e-9)
        depth = judge.depth(state.packed, state.windows, state.measured, state.q, state.base)
        assert (depth <= bound + 1e-9)[state.measured].all()
        least, far = min(least, float(bound[state.measured].min())), max(far, float(depth.max()))
    assert least == pytest.approx(BOUND_SHARE * 7.0, rel=0.02)
    assert far > 0.3
    assert drive.tip_s < 270.0 if back else drive.tip_s > 250.0


def test_a_link_that_is_deeper_than_the_bound_ahead_does_not_come_to_count_there() -> None:
    """A smaller bound is one that the link has to keep from the start of the motion on."""
    depth, was, bound = np.array([6.0, 3.0, 6.0, 9.0]), np.array([8.0, 8.0, 8.0, 8.0]), np.array([5.0, 5.0, 8.0, 5.0])
    known = known_within(depth, was, bound)
    assert known.tolist() == pytest.approx([5.0, 3.0, 6.0, 9.0], abs=1e-8)
    path, snake = straight(300.0, 12.0), SnakeModel(2)
    limits = HardLimits(Query(snake.vertices(60)), snake, [8.0, 8.0])
    base = np.eye(4)
    base[:3, 3] = 12.0, 0.0, 120.0  # 6 mm outside
    there = base.copy()
    there[2, 3] += 1.0
    windows = np.array([[1, 25], [1, 25]])
    start, end = Configuration(base, np.zeros(4)), Configuration(there, np.zeros(4))
    deep = limits.certify(LinksAt(path.packed(), windows, start), end).deviation.depth
    assert deep == pytest.approx(6.0, abs=1e-6)
    five = np.full(2, 5.0)
    known = known_within(deep, np.full(2, 8.0), five)
    held = limits.certify(LinksAt(path.packed(), windows, start, five, known), end)
    assert not held.taken
    assert "its bound is 5 mm" in str(held.held_by)


def test_a_place_that_is_narrower_than_the_robot_is_refused_with_how_far_it_could_go() -> None:
    """HAZ-39: place in LPS, mm along the lumen, both radii, and the nearer end."""
    path, snake = waist(4.0), SnakeModel(10)
    found = narrowest(path, snake, None, 280.0)
    assert found.first is not None
    assert found.free is not None
    assert (found.first.at_mm, found.first.radius_mm) == pytest.approx((140.0, 4.0))
    assert found.first.at_lps == pytest.approx((0.0, 0.0, 140.0))
    assert found.free.at_mm == pytest.approx(138.0 - 6.0)  # 14 to 4 mm over 10 mm, and the robot's round end
    with pytest.raises(PathwayError) as refused:
        found.refuse(snake)
    for words in ("4.0 mm at 140 mm, (0.0, 0.0, 140.0) in LPS mm", "the robot's 6 mm", "could go 132 mm",
                  "end at 0.0,0.0,132.0", "4 links of 28 mm at most"):  # fmt: skip
        assert words in str(refused.value)
    assert narrowest(path, snake, None, 132.0).first is None
    narrowest(path, snake, None, 132.0).refuse(snake)
    narrowest(path, SnakeModel(10, radius_mm=3.9), None, 280.0).refuse(SnakeModel(10, radius_mm=3.9))
    everywhere = narrowest(straight(200.0, 3.0), snake, None, 200.0)
    assert everywhere.free is None
    with pytest.raises(PathwayError, match="another start"):
        everywhere.refuse(snake)
    assert narrowest(waist(6.0), snake, None, 280.0).first is None


def test_each_link_is_told_what_it_comes_through() -> None:
    found = narrowest(waist(7.0), SnakeModel(10), None, 280.0)
    far = [280.0 - 28.0 * (9 - link) for link in range(10)]
    assert found.per_link_mm == pytest.approx([14.0 if end < 130.0 else 7.0 for end in far], abs=1e-6)
    assert narrowest(waist(7.0), SnakeModel(12), None, 280.0).per_link_mm[:2] == (None, None)


def test_a_system_in_a_lumen_that_is_too_narrow_is_not_built() -> None:
    path = waist(4.0)
    spec = SnakeSystemSpec(LumenContours(path.centre, path.radius, 31), SnakeModel(8), drive=COARSE, tip_s=100.0)
    with pytest.raises(PathwayError, match="narrower than the robot"):
        spec.build()
    values, arrays = spec.to_parts()
    assert SnakeSystemSpec.from_parts(values, arrays).anyway is False
    values.pop("anyway")  # as manifests of before have none
    before = SnakeSystemSpec.from_parts(values, arrays)
    assert before.anyway is True
    before.build()


def driven(path: Pathway, robot: float, **more: Any) -> Any:
    """A drive through a pathway's own surface, without a look-round."""
    curve = path.curve()
    ends = curve.position(10.0), curve.position(curve.length - 10.0)
    settings = DriveSettings(contours=12, interpolated=45, vertices_per_link=30, bends=4, step_s=0.01)
    nowhere = {"elsewhere": (900.0, 0.0, 0.0)}
    mesh, snake = pathway_surface(path), SnakeModel(1, radius_mm=robot)
    return drive_lumen(mesh, *ends, 6, nowhere, settings=settings, snake=snake, **more)


def test_a_tube_narrower_than_the_robot_is_refused_before_anything_moves() -> None:
    """HAZ-39: 3 mm of lumen, 6 mm of robot; anyway it goes, is told per link, and ends."""
    moved: list[Any] = []
    with pytest.raises(PathwayError, match="narrower than the robot"):
        driven(straight(200.0, 3.0, contours=41), 6.0, record=moved.append)
    assert moved == []
    report = driven(straight(200.0, 3.0, contours=41), 6.0, anyway=True)
    told = report.to_dict()
    assert told["narrowest"]["first"]["radius_mm"] < 3.0
    assert told["narrowest"]["free"] is None
    assert not told["reached"]
    assert told["stopped_by"]
    assert told["outside_pathway"]["mm"] <= BOUND_SHARE * 3.0


def test_a_bend_is_left_by_no_more_than_the_share_and_every_link_is_told() -> None:
    """HAZ-39: `within_bounds` never stands alone."""
    told = driven(arc(90.0, 2.2, 11.0, contours=41), 10.0).to_dict()
    assert told["reached"] is told["within_bounds"] is True
    assert (told["bound_mm"], told["bound_share"]) == ({"body": 8.0, "last": 4.0}, BOUND_SHARE)
    outside, behind, narrow = told["outside_pathway"], told["behind_wall"], told["narrowest"]
    assert outside["mm"] == told["deviation_mm"]["max"] <= BOUND_SHARE * 11.0
    assert outside["per_link_mm"][outside["link"] - 1] == outside["mm"] == max(outside["per_link_mm"])
    assert behind["per_link_mm"][behind["link"] - 1] == behind["mm"] == max(behind["per_link_mm"])
    assert behind["mm"] <= BOUND_SHARE * 11.0 + 1.0
    assert [len(of) for of in (outside["per_link_mm"], behind["per_link_mm"], narrow["per_link_mm"])] == [6, 6, 6]
    assert all(mm <= 8.0 for mm in told["least_bound_mm"])
    assert told["slowest_step"]["s"] > 0.0


def test_a_certificate_measures_a_limited_number_of_poses() -> None:
    """A bound of 20 mm in a lumen of 3 mm: what is not certified by then is held, and soon."""
    path, snake = straight(120.0, 3.0), SnakeModel(3)
    limits, random = HardLimits(Query(snake.vertices(90)), snake, [20.0] * 3), np.random.default_rng(1)
    windows = np.tile([1, len(path.packed().rows)], (3, 1))
    base, exhausted = np.eye(4), 0
    base[2, 3] = 40.0
    for _ in range(60):
        q, to = random.uniform(-0.7, 0.7, (2, 6))
        found = limits.certify(LinksAt(path.packed(), windows, Configuration(base, q)), Configuration(base, to))
        assert found.poses <= MOST_POSES
        exhausted += found.exhausted
        assert not found.exhausted or "too large" in str(found.held_by)
    assert exhausted > 0


def test_a_drive_that_gets_nowhere_ends_and_says_why() -> None:
    state = SimpleNamespace(
        deviation=SimpleNamespace(depth=np.zeros(1)), measured=np.zeros(1, dtype=bool), bound=np.ones(1), q=np.zeros(2),
        outcome="held", held_by="link 1 at its bound", mode="looking", tip_s=5.0,
        bounds=LinkBounds.of(1.0, None, 1),
    )  # fmt: skip
    drive: Any = SimpleNamespace(
        q=np.zeros(2), tip_s=5.0, state=state, snake=SnakeModel(1), offset_mm=np.zeros(0), act=lambda _: None,
        step_s=0.0, query_s=0.0,
    )  # fmt: skip
    run = DriveRun(drive, [], None, lambda _: None)
    for _ in range(STALLED):
        assert run.stalled is None
        run.carry_out(Act(no_command(), note=Order(SnakeCommand(camera_mm_per_s=(1.0, 0.0)), 0.001)))
    assert run.finish(10.0) == run.stalled == f"{STALLED:,} steps in a row moved nothing: link 1 at its bound"


def test_a_robot_that_got_nowhere_is_drawn_back_all_the_same() -> None:
    drive, said = SnakeDrive(SnakeModel(3), straight(200.0, 15.0), COARSE, tip_s=20.0), list[str]()
    run = DriveRun(drive, [], None, said.append)
    for _ in range(STALLED):
        run.carry_out(Act(no_command(), note=Order(SnakeCommand(), 0.001)))
    assert run.stalled is not None
    _drawn_back(run, said.append)
    assert drive.tip_s == pytest.approx(0.0, abs=1e-6)
    assert said[-1] == "drawn back to 0 mm"


def test_a_thin_robot_in_a_thin_lumen_ends_its_look_round() -> None:
    """1.5 mm in 3 mm: the hand and the plans come to an end."""
    settings = DriveSettings(vertices_per_link=10, bends=4, step_s=0.02)
    drive, steps = SnakeDrive(SnakeModel(3, radius_mm=1.5), straight(200.0, 3.0), settings, tip_s=150.0), 0
    for order in look_round(drive, Stop("here", 150.0)):
        state: SnakeState = drive.step(order.command, order.dt)
        assert (state.deviation.depth <= BOUND_SHARE * 3.0 + 1e-9).all()
        steps += 1
    assert steps < 4000
    assert order.event in ("looked", "gave up")


def test_rows_have_the_depth_of_each_distal_link() -> None:
    """HAZ-39: how deep outside the pathway, not only how much beyond a bound."""
    spec = made_spec()
    system = spec.build()
    names = [column.name for column in system.row_layout]
    first = names.index("outside_link3")
    assert names[first : first + 5] == [f"outside_link{n}" for n in range(3, 8)]
    state = system.start()
    states = [state := system.step(state, hand(0.5)) for _ in range(3)]
    found = rows(system, states)
    np.testing.assert_array_equal(found[-1, first : first + 5], states[-1].deviation.depth[-5:])
    assert judged(system, system.start(), states).violations == 0


def test_a_recording_of_before_is_read_and_driven_again(tmp_path: Path) -> None:
    """Without the depths of links, with 8 mm and 4 mm everywhere: the same columns come again, bit by bit."""
    given = replace(made_spec(), settings=SnakeSettings(bound_mm=8.0, tip_bound_mm=4.0))
    system, file = given.build(), tmp_path / "before.run"
    writer = RunWriter(file, given, system.row_layout)
    driver = Driver(system, log=writer)
    for _ in range(30):
        driver.step(hand(insert=-1.0))
    writer.close()
    (file / END).unlink()  # its hash is of the ticks as they are now
    manifest = json.loads((file / "manifest.json").read_text(encoding="utf-8"))
    width = len(manifest["columns"])
    kept = [name for name, _ in manifest["columns"]].index("outside_link3")
    manifest["columns"] = manifest["columns"][:kept]
    del manifest["spec"]["anyway"]
    (file / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    ticks = np.fromfile(file / "ticks.f64").reshape(-1, width)
    ticks[:, :kept].tofile(file / "ticks.f64")
    run = Run.read(file)
    again = replay(run, spec_of(run), keep_states=False)
    assert again.same
    assert again.rows.shape == (30, len(system.row_layout))
    assert run.column("beyond_bound")[-1] <= 0.0
    with pytest.raises(InputError, match="no column 'outside_link7'"):
        run.column("outside_link7")
    manifest["columns"][-1] = ["other", "mm"]
    (file / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    other = Run.read(file)
    with pytest.raises(InputError, match="other columns"):
        replay(other, spec_of(other))


Z = np.union1d(np.arange(0.0, 201.0, 5.0), np.arange(90.0, 116.0, 0.5))
PROFILES = {
    "membrane": np.where(np.abs(Z - 103.0) <= 0.5, 3.0, 16.0),
    "needle": 16.0 - 11.5 * np.exp(-(((Z - 100.0) / 1.5) ** 2)),
    "stenosis": 16.0 - 10.5 * np.exp(-(((Z - 103.0) / 4.0) ** 2)),
}
LEAST = {"membrane": 3.0, "needle": 4.5, "stenosis": 5.5}
SIDES = 48


def turned(profile: np.ndarray, flat: float = 1.0) -> TriangleMesh:
    """The closed tube about +z with those radii at ``Z``; ``flat``: so much of them in y."""
    around = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ellipse = flat / np.hypot(flat * np.cos(around), np.sin(around))
    centre = np.column_stack([np.zeros((len(Z), 2)), Z])
    first = np.array([1.0, 0.0, 0.0])
    return pathway_surface(Pathway(centre, profile[:, None] * ellipse, len(Z), first=first))


def along_z(x: float) -> Curve:
    return Curve.through(np.column_stack([np.full(21, x), np.zeros(21), np.linspace(10.0, 190.0, 21)]))


def few_contours() -> DriveSettings:
    """Six contours over 180 mm: none of them lies where it is narrow."""
    return DriveSettings(contours=6, interpolated=11, vertices_per_link=30, bends=4, step_s=0.01)


@pytest.mark.parametrize("name", PROFILES)
def test_the_radius_is_that_of_the_surface_also_between_contours(name: str) -> None:
    """HAZ-39: against the distance to the profile itself, densely sampled."""
    s = np.linspace(0.0, 180.0, 451)
    found = free_radius(turned(PROFILES[name]), along_z(0.0), s, 7.0)
    dense = np.linspace(0.0, 200.0, 20_001)
    radius = np.interp(dense, Z, PROFILES[name])
    wanted = np.array([np.hypot(radius, dense - at).min() for at in 10.0 + s])
    wide = wanted > 7.0 / math.cos(math.pi / SIDES) + 0.01
    assert np.isinf(found[wide]).all()
    narrow = wanted < 6.95
    np.testing.assert_allclose(found[narrow], wanted[narrow], atol=0.03)
    assert found.min() == pytest.approx(LEAST[name], abs=0.02)
    assert 5 < narrow.sum() < 60


def test_a_line_off_the_middle_does_not_make_a_wide_lumen_narrow() -> None:
    """Near the wall, and behind it by as much as a soft wall lets a curve be; whichever way triangles are wound."""
    wide = turned(np.full(len(Z), 16.0))
    flipped = TriangleMesh(wide.vertices, wide.faces[:, ::-1])
    for mesh, x in ((wide, 9.5), (wide, 14.0), (wide, 17.0), (flipped, 15.8), (flipped, 17.0)):
        assert np.isinf(free_radius(mesh, along_z(x), np.linspace(0.0, 180.0, 181), 7.0)).all()


def test_the_ends_of_a_closed_lumen_do_not_narrow_it() -> None:
    near = Curve.through(np.column_stack([np.zeros((21, 2)), np.linspace(1.0, 199.0, 21)]))
    s = np.linspace(0.0, near.length, 199)
    assert np.isinf(free_radius(turned(np.full(len(Z), 16.0)), near, s, 7.0)).all()
    slit = free_radius(turned(np.full(len(Z), 16.0), 0.25), near, s, 7.0)
    np.testing.assert_allclose(slit, 4.0, atol=0.05)


def test_bounds_go_by_the_surface_where_that_is_narrower_than_the_contours() -> None:
    """HAZ-39: the least of all places of the surface that a segment meets, also in a window that is closed there."""
    random, path = np.random.default_rng(4), waist(11.0)
    wall = np.where(random.random(751) < 0.3, random.uniform(2.0, 20.0, 751), np.inf)
    at = np.linspace(0.0, path.length, 751)
    for ends in (False, True):
        plain = replace(path, closed_ends=ends)
        one = inscribed_radii(replace(plain, wall_radius=wall))
        wanted = inscribed_radii(plain)
        for j in range(len(path.s) - 1):
            # knots lie on places of the surface, up to the rounding of the machine
            low = np.searchsorted(at, path.s[j] + 1e-6, "right") - 1
            high = np.searchsorted(at, path.s[j + 1] - 1e-6)
            wanted[j + (0 if ends else 1)] = min(wanted[j + (0 if ends else 1)], wall[low : high + 1].min())
        np.testing.assert_array_equal(one, wanted)
    path = replace(bottle(), wall_radius=np.where(random.random(900) < 0.1, random.uniform(1.0, 7.0, 900), np.inf))
    first = random.integers(1, 60, 6)
    windows = np.column_stack([first, first + random.integers(1, 20, 6)])
    bounds = DriveSettings().bounds(6).at(inscribed_radii(path), windows)
    np.testing.assert_allclose(bounds, bounds_by_place(path, DriveSettings(), windows), rtol=1e-9)
    assert (bounds < bounds_by_place(bottle(), DriveSettings(), windows)).any()
    with pytest.raises(PathwayError, match="by its surface"):
        replace(path, wall_radius=np.array([3.0, np.nan]))


@pytest.mark.parametrize("name", PROFILES)
def test_what_is_narrow_between_contours_is_refused_before_anything_moves(name: str) -> None:
    """HAZ-39: by a drive and by a system, also one that is read back; a robot that fits through goes."""
    mesh, ends, settings = turned(PROFILES[name]), ((0.0, 0.0, 10.0), (0.0, 0.0, 190.0)), few_contours()
    moved: list[Any] = []
    with pytest.raises(PathwayError, match="narrower than the robot"):
        drive_lumen(mesh, *ends, 6, settings=settings, record=moved.append)
    assert moved == []
    surface = LumenSurface(mesh.vertices, mesh.faces, *(np.array(end) for end in ends))
    spec = SnakeSystemSpec(surface, SnakeModel(6), drive=settings).with_contours()
    for one in (spec, SnakeSystemSpec.from_parts(*spec.to_parts())):
        with pytest.raises(PathwayError, match="narrower than the robot"):
            one.build()


def test_a_fold_between_two_vertices_of_a_link_is_told_as_deep_as_it_is() -> None:
    """HAZ-39: a membrane of 1 mm round a hole of 3 mm is 3 mm deep in a robot of 6 mm, wherever its vertices are."""
    mesh, model = turned(PROFILES["membrane"]), SnakeModel(6)
    lumen = lumen_between(mesh, (0.0, 0.0, 10.0), (0.0, 0.0, 190.0), model, few_contours())
    drive = SnakeDrive(model, lumen.pathway, few_contours(), lumen.curve, lumen.slack, tip_s=140.0)
    depth = WallDepth(mesh, lumen.pathway, lumen.curve, model.links)
    depth.look(drive, True)
    frames = model.frames(drive.state.q, drive.state.base)
    axes = Segments(frames[-5:-1, :3, 3], frames[-4:, :3, 3], np.full(4, model.radius_mm))  # wholly in the lumen
    assert depth.deepest["mm"] == pytest.approx(-ProximityTree(mesh).clearance(axes), abs=0.02)
    assert 2.9 < depth.deepest["mm"] < 3.6
    assert depth.deepest["at_lps"][2] == pytest.approx(103.0, abs=1.0)
    assert depth.per_link[depth.deepest["link"] - 1] == depth.deepest["mm"]
