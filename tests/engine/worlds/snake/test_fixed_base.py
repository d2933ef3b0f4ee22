"""A snake on a fixed base: it stands, every link is measured against the whole cavity, and its runs are replayed."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lumen_shapes import straight
from snake_runs import hand

from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.errors import ControlError, InputError
from vfix_engine.pathway.limits.limits import MOTION_TOLERANCE_MM
from vfix_engine.pathway.query.query import deviation_of_points
from vfix_engine.pathway.tissue_motion import breathing
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.background import InlineWorker
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.operator import Act
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.snake.cavity import BOUND_MM, cavity_case
from vfix_engine.worlds.snake.offline.script import DriveSpec
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.requests import ChooseJoint
from vfix_engine.worlds.snake.settings import Arm, DriveSettings
from vfix_engine.worlds.snake.spec import SnakeSystemSpec
from vfix_engine.worlds.snake.stepping.command import SnakeCommand
from vfix_engine.worlds.snake.stepping.state import SnakeState

CASE = cavity_case()
SAME_MM = 2e-10  # as in test_query.py


def by_brute_force(state: SnakeState) -> np.ndarray:
    """(5,) mm: every vertex of a link against every segment between the cavity's first contour and its last."""
    vertices, frames = CASE.snake.vertices(500), CASE.snake.frames(state.q, CASE.base)
    packed = CASE.pathway.packed()
    found = []
    for link in range(CASE.snake.links):
        own = vertices.points[vertices.start[link] : vertices.start[link + 1]]
        points = own @ frames[link + 1, :3, :3].T + frames[link + 1, :3, 3]
        found.append(deviation_of_points(points, packed, 1, len(packed.rows) - 1)[0].max())
    return np.array(found)


INTO_THE_WALL = [(52.0, -30.0, 0.0)] * 160  # where the bends between the control bends leave the bounds


def pushes(seed: int, count: int) -> list[tuple[float, float, float]]:
    """Pushes of the camera in mm/s, each for a while, some with an insertion."""
    random = np.random.default_rng(seed)
    found: list[tuple[float, float, float]] = []
    while len(found) < count:
        x, y = random.normal(size=2) * 60.0
        found += [(float(x), float(y), float(random.choice([0.0, 0.0, 0.0, 20.0, -20.0])))] * 40
    return found[:count]


@pytest.mark.parametrize("arm", ["certified", "guided"])
def test_the_base_stands_and_deviations_are_those_of_every_vertex(arm: Arm) -> None:
    driver = Driver(CASE.script(arm, 0.02).build())
    beyond, turned = -np.inf, 0.0
    for number, axes in enumerate([*INTO_THE_WALL, *pushes(3, 160)]):
        state = driver.act(Act(hand(*axes)))
        np.testing.assert_array_equal(state.base, CASE.base)
        if axes[2]:
            assert (state.outcome, state.limit) == ("held", "end")
            assert "the base is fixed" in (state.held_by or "")
        if number % 40 == 39:
            deep = by_brute_force(state)
            np.testing.assert_allclose(state.deviation.depth, deep, atol=SAME_MM)
            beyond = max(beyond, float((deep - state.bound).max()))
        turned = max(turned, float(np.abs(state.q).max()))
    assert turned > 0.3
    if arm == "certified":
        assert beyond <= 0.0
    else:
        assert beyond > 5.0


def test_a_shape_of_its_own_is_the_rest_that_it_straightens_to() -> None:
    q = np.tile([0.05, 0.1], 5)
    spec = replace(CASE.script("certified", 0.02), q_nominal=q)
    driver = Driver(DriveSpec.from_parts(*spec.to_parts()).build())
    np.testing.assert_array_equal(driver.state.q, q)
    for axes in pushes(5, 40):
        driver.act(Act(hand(axes[0], axes[1])))
    assert not driver.state.straight
    for _ in range(200):
        driver.act(Act(hand(buttons=1)))
    np.testing.assert_allclose(driver.state.q, q, atol=1e-9)


def test_a_control_process_gets_bends_and_nothing_to_insert() -> None:
    system = SnakeSystemSpec.from_parts(*CASE.spec().to_parts()).build()
    driver = Driver(system, InlineWorker(system.planner, 3))
    wanted = system.background(driver.state)
    assert wanted is not None
    assert (wanted.inputs.sign, wanted.inputs.bends is not None) == (0, True)
    for _ in range(300):
        state = driver.step(hand(x=1.0, y=0.3))
    assert state.settled
    assert state.steering[0] != 0.0
    assert system.background(state) is None
    driver.step(hand(insert=1.0))
    shown = system.snapshot(driver.state)
    assert (shown.outcome, shown.links_inside, shown.can_look) == ("held", 5, True)
    assert (shown.bounds == [3.0, 3.0, 3.0, 3.0, 1.0]).all()


@pytest.mark.parametrize("arm", ["certified", "manual"])
def test_a_recorded_run_is_replayed_bit_by_bit_from_its_manifest(tmp_path: Path, arm: Arm) -> None:
    spec = CASE.script(arm, 0.02)
    writer = RunWriter(tmp_path / "run", spec, spec.columns, 1)
    driver = Driver(spec.build(), log=writer)
    for number, axes in enumerate(pushes(1, 200)):
        asked = (ChooseJoint(1 + number // 40),) if arm == "manual" and number % 40 == 0 else ()
        driver.act(Act(hand(axes[0], axes[1], axes[2], buttons=2), asked))
    writer.close()
    run = Run.read(tmp_path / "run")
    again = replay(run, spec_of(run))
    assert again.same
    np.testing.assert_array_equal(again.states[-1].base, CASE.base)
    assert np.abs(again.states[-1].q).max() > 0.1
    assert run.command(0).buttons == 2


def test_a_manual_hand_chooses_from_all_joints_as_no_other_moves_them() -> None:
    driver = Driver(CASE.script("manual", 0.02).build())
    driver.act(Act(hand(30.0), (ChooseJoint(5),)))
    assert driver.state.q[1] > 0.0
    assert (driver.state.q[2:] == 0.0).all()
    with pytest.raises(InputError, match="joint"):
        driver.apply(ChooseJoint(6))
    with pytest.raises(ControlError, match="manual arm"):
        Driver(CASE.script("certified").build()).apply(ChooseJoint(1))


def surface_of_the_pathway() -> np.ndarray:
    """(n, 3) points about 1.5 mm apart: of the pathway's wall, and of the discs of its first contour and its last."""
    of = CASE.pathway.contours()
    angle, known = (2.0 * np.pi * np.arange(count) / count for count in (336, of.radius.shape[1]))
    across = np.cross(of.tangent, of.first)
    way = np.cos(angle)[None, :, None] * of.first[:, None] + np.sin(angle)[None, :, None] * across[:, None]
    radius = np.array([np.interp(angle, known, one, period=2.0 * np.pi) for one in of.radius])
    rim = of.centre[:, None] + radius[..., None] * way
    wall = [(1.0 - share) * rim[:-1] + share * rim[1:] for share in np.linspace(0.0, 1.0, 15)]
    ends = [of.centre[end] + share * (rim[end] - of.centre[end]) for end in (0, -1) for share in np.linspace(0, 1, 40)]
    return np.concatenate([one.reshape(-1, 3) for one in wall + ends])


def test_no_organ_floor_or_dome_is_within_the_bound_of_a_link() -> None:
    """The cavity's whole surface is farther from the pathway than a link may be, in any direction."""
    clearance = Wall(CASE.mesh).clearance(surface_of_the_pathway(), 1)[0]
    assert clearance.min() > BOUND_MM + MOTION_TOLERANCE_MM
    assert set(CASE.organ) == set(range(-1, 17))


def test_below_the_first_contour_a_link_is_outside() -> None:
    """The straight segments before the first contour and behind the last are beyond the cavity's floor and dome."""
    base, q = CASE.base.copy(), np.tile([0.0, 0.75], 5)
    base[0, 3] = -35.0
    lowest = CASE.snake.frames(q, base)[:, :3, 3]
    packed = CASE.pathway.packed()
    assert lowest[:, 2].min() < -25.0
    assert (deviation_of_points(lowest, packed, 0, len(packed.rows))[0] == 0.0).all()  # it would be inside of them
    with pytest.raises(InputError, match="link 5 would start"):
        replace(CASE.script(), base=base, q_nominal=q).build()


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"base": np.diag([1.0, 1.0, 2.0, 1.0])}, "base of a snake is not rigid"),
        ({"q_nominal": np.full(10, 1.0)}, "q_nominal is 10 angles"),
        ({"q_nominal": np.zeros(4)}, "q_nominal is 10 angles"),
        ({"tissue": breathing((0.0, 0.0, 1.0), 5.0)}, "fixed base"),
        ({"tip_s": 20.0}, "tip_s"),
        ({"drive": DriveSettings(manipulated=3)}, "manipulated"),
        ({"base": np.eye(4) + np.eye(4, k=3) * 500.0}, "would start"),
    ],
)
def test_what_a_fixed_base_cannot_be_is_refused(wrong: dict[str, Any], word: str) -> None:
    with pytest.raises(InputError, match=word):
        replace(CASE.script(), **wrong).build()


def test_a_robot_that_is_inserted_is_what_it_was() -> None:
    """The parts of a spec without a base have none, and its start is along the curve."""
    drive = SnakeDrive(SnakeModel(5), straight(300.0, 15.0), DriveSettings(vertices_per_link=20), tip_s=150.0)
    assert not drive.constants.fixed_base
    drive.step(SnakeCommand(insert_mm_per_s=20.0), 0.02)
    assert drive.tip_s == pytest.approx(150.4)
