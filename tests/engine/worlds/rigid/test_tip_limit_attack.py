"""Tube and envelope of the tip under attack: hands as hard as they can, hostile programs, and joint steps past both.

HAZ-01, HAZ-02, HAZ-05: every accepted pose and fifty poses on the way to it are measured again: kinematics as products
of exponentials, the path as scipy's spline, a box by trimesh's planes. The tip is never outside, at any instant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import trimesh
from scipy.interpolate import make_interp_spline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from benchmarks.attack.rigid.arenas import BUILDERS
from benchmarks.attack.rigid.assaults import ASSAULTS, Assault
from benchmarks.attack.rigid.operators import Memory
from benchmarks.attack.rigid.oracle import Screws
from vfix_engine.control import Certified, ControlSettings, HandCommand, certify_step
from vfix_engine.control.step import build_step
from vfix_engine.control.tasks import MoveFreely
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shapes import Box, CapsuleShape, Sphere
from vfix_engine.runtime import SetTask
from vfix_engine.virtual_fixtures import Fixture, PathTube, TipEnvelope
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.state import RehearsalState
from vfix_engine.worlds.rigid.system import RigidSystem

FINE = 50  # poses on the way that are measured
STEPS = 40  # of one assault
RADIUS = 1.2
Judge = Callable[[np.ndarray], np.ndarray]  # distance to the limit's surface (n,) of places (n, 3), negative outside


def tube_of(path: SplinePath) -> Judge:
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path.points, axis=0), axis=1))])
    spline = make_interp_spline(knots, path.points, k=path.degree)
    places = spline(np.linspace(0.0, knots[-1], 40_000))
    dense = cKDTree(places)
    # Between two samples the curve is nearer than to either by less than this.
    slack = float(np.linalg.norm(np.diff(places, axis=0), axis=1).max()) ** 2 / (8.0 * RADIUS) * 1.1
    return lambda tips: RADIUS + slack - dense.query(tips)[0]


def limits_of(scene: Scene) -> tuple[tuple[Fixture, ...], tuple[Judge, ...]]:
    """A tube, a ball and a turned box around the tip's start, a capsule; and their judges."""
    path, tip = scene.path, scene.placed_robot().tip(scene.q_start).position
    assert path is not None
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", (0.4, 0.2, -0.3)).as_matrix()
    pose[:3, 3] = tip + np.array([0.5, 0.5, -0.5])
    box, ball = Box(pose, (4.0, 5.0, 3.0)), Sphere(tip + np.array([0, 1.0, 0]), 3.5)
    line = CapsuleShape(tip - np.array([3.0, 0, 0]), tip + np.array([2.0, 3.0, 0]), 3.0)
    hull = trimesh.creation.box(extents=2 * box.half_size, transform=pose)
    normals, corners = np.asarray(hull.face_normals), np.asarray(hull.triangles)[:, 0]

    def in_box(tips: np.ndarray) -> np.ndarray:
        return -((tips[:, None] - corners) * normals).sum(axis=2).max(axis=1)

    def in_ball(tips: np.ndarray) -> np.ndarray:
        return ball.radius - np.linalg.norm(tips - ball.centre, axis=1)

    at = np.linspace(0, 1, 20_001)[:, None]
    axis = cKDTree((1 - at) * line.start + at * line.end)

    def in_line(tips: np.ndarray) -> np.ndarray:
        return np.asarray(line.radius + 1e-8 - axis.query(tips)[0])

    fixtures = (PathTube(path, RADIUS), TipEnvelope("box", box), TipEnvelope("ball", ball), TipEnvelope("line", line))
    return fixtures, (tube_of(path), in_box, in_ball, in_line)


def past_the_program(memory: Memory, system: RigidSystem, state: RehearsalState) -> RehearsalState:
    """Joint steps of any size, as from a solver that lies: only the verdicts are in the way."""
    random, robot = memory.random, system.scene.robot
    size = robot.speed * state.settings.dt_s * 10.0 ** random.uniform(-1, 1.5)
    step = np.clip(state.tool.q + size * random.normal(size=len(size)), robot.lower, robot.upper) - state.tool.q
    if random.random() < 0.1:
        step[int(random.integers(len(step)))] = random.choice((np.nan, np.inf, 1e300))
    problem = build_step(state.tool, MoveFreely(), system.scene.fixtures, HandCommand(random.normal(size=3)))
    verdict = certify_step(problem, step)
    return replace(state, tool=verdict.next_state, last=None) if isinstance(verdict, Certified) else state


HOSTILE = {name: make for name, make in ASSAULTS.items() if name != "past the program"} | {
    "past the program": partial(partial, past_the_program)
}


@pytest.mark.parametrize("place", ["cavern", "nothing near"])
def test_the_tip_is_never_outside(place: str) -> None:
    random = np.random.default_rng(20261126)
    arena = BUILDERS[place](random)
    assert not isinstance(arena, str)
    poses, least, pressed, held = 0, np.inf, 0, set[str]()
    for which in range(2):  # the tube by itself, then all that is convex
        fixtures, judges = limits_of(arena.scene)
        chosen = slice(0, 1) if which == 0 else slice(1, 4)
        scene, judged = replace(arena.scene, fixtures=fixtures[chosen]), judges[chosen]
        screws = Screws.of(scene.placed_robot(), scene.tool)
        for number, (_, make) in enumerate(HOSTILE.items()):
            dt_s = (1e-3, 5e-3, 2e-2)[number % 3]
            system = RigidSystem(scene, ControlSettings(dt_s=dt_s, margin_mm=0.05))
            memory = Memory(np.random.default_rng(number))
            assault: Assault = make(memory)
            state = system.start("free")
            for k in range(STEPS):
                memory.count = k
                if k == STEPS // 2:
                    state = system.apply(state, SetTask(("path", "free", "inspect")[number % 3]))
                before, state = state.tool, assault(system, state)
                shares = np.linspace(0.0, 1.0, FINE)[1:, None]
                way = before.q + shares * (state.tool.q - before.q)
                tips = np.array([screws.places(q)[1] for q in way])
                np.testing.assert_allclose(tips[-1], state.tool.tip.position, atol=1e-9)
                room = min(float(judge(tips).min()) for judge in judged)
                assert room >= 0.0
                poses, least, pressed = poses + len(tips), min(least, room), pressed + (room < 0.02)
                if state.last is not None:
                    held |= {b.words for b in state.last.report.active_constraints() if b.kind in ("tube", "envelope")}
    assert poses == 2 * len(HOSTILE) * STEPS * (FINE - 1)
    assert pressed > 20
    assert least < 0.0135
    assert f"the tube of {RADIUS:g} mm about the path" in held
    assert any("envelope" in words for words in held)
