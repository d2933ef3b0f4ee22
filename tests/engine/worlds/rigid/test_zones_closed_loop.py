"""No-fly zones in closed loop: pushed into from everywhere, the distance measured again by coal (HAZ-01, HAZ-02)."""

from __future__ import annotations

from dataclasses import replace

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.engine.scenes import CoalJudge, straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError, StartRefused
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.worlds.rigid.rehearsal import Command, Rehearsal, RehearsalState
from vfix_engine.worlds.rigid.scene import Scene

FAST = ControlSettings(dt_s=5e-3, k_tau=1.0)
KINDS = ("sphere", "capsule", "box", "half-space", "patch")
FAR = wall(300.0)
TO_ORIGIN = coal.Transform3s.Identity()


def a_solid(kind: str, near: np.ndarray, random: np.random.Generator) -> Shape | ProximityTree:
    """A shape or a small bent patch whose middle is at ``near``."""
    turn = Rotation.random(random_state=random).as_matrix()
    if kind == "sphere":
        return Sphere(near, random.uniform(1.0, 3.0))
    if kind == "capsule":
        return CapsuleShape(near - 4 * turn[0], near + 4 * turn[0], random.uniform(0.5, 2.0))
    if kind == "half-space":
        # Leaning so that the shaft, which goes far towards −y, stays on the free side.
        return HalfSpace(near, [-near[0], -random.uniform(0.0, 4.0), -near[2]])
    if kind == "box":
        placing = np.eye(4)
        placing[:3, :3], placing[:3, 3] = turn, near
        return Box(placing, random.uniform(0.5, 3.0, 3))
    x, y = np.meshgrid(np.linspace(-4, 4, 9), np.linspace(-4, 4, 9), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), 0.1 * (x.ravel() ** 2 - y.ravel() ** 2)]) @ turn.T + near
    a = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate([np.column_stack([a, a + 1, a + 9]), np.column_stack([a + 1, a + 10, a + 9])])
    return ProximityTree(TriangleMesh(points, faces))


class ZoneJudge:
    """Distance of a zone by coal, which shares no line with ours."""

    def __init__(self, solid: Shape | ProximityTree):
        if isinstance(solid, Sphere):
            self._body, self._place = coal.Sphere(solid.radius), coal.Transform3s(np.eye(3), solid.centre)
        elif isinstance(solid, CapsuleShape):
            self._body, self._place = _capsule(solid.start, solid.end, solid.radius)
        elif isinstance(solid, Box):
            transform = solid.transform_box_to_patient
            self._body = coal.Box(*(2 * solid.half_size))
            self._place = coal.Transform3s(transform[:3, :3], transform[:3, 3])
        elif isinstance(solid, HalfSpace):
            self._body, self._place = coal.Halfspace(solid.normal, float(solid.normal @ solid.point)), TO_ORIGIN
        else:
            self._mesh = CoalJudge(solid.mesh)

    def distance(self, segments: Segments) -> float:
        if hasattr(self, "_mesh"):
            return self._mesh.clearance(segments)
        least = np.inf
        for start, end, radius in zip(segments.start, segments.end, segments.radius, strict=True):
            body, place = _capsule(start, end, float(radius))
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            least = min(least, coal.distance(self._body, self._place, body, place, request, result))
        return float(least)


def _capsule(start: np.ndarray, end: np.ndarray, radius: float) -> tuple[coal.Capsule, coal.Transform3s]:
    along = end - start
    length = float(np.linalg.norm(along))
    turn = Rotation.align_vectors([along / length], [[0.0, 0, 1]])[0].as_matrix()
    return coal.Capsule(radius, length), coal.Transform3s(turn, (start + end) / 2)


def beside_the_tool(scene: Scene, random: np.random.Generator) -> np.ndarray:
    """A place some mm off a point of the tool, anywhere along its tip and the first part of its shaft."""
    segments = scene.tool.segments(np.eye(3), np.zeros(3))
    part = int(random.integers(2))
    share = random.uniform(0, 1) if part == 0 else random.uniform(0.7, 1)
    on_axis = segments.start[part] + share * (segments.end[part] - segments.start[part])
    away = random.normal(size=3)
    place: np.ndarray = on_axis + random.uniform(6.0, 8.0) * away / np.linalg.norm(away)
    return place


def towards(state: RehearsalState, place: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Full force that brings the nearest part of the tool to a place, with some disorder."""
    segments = state.tool.segments
    middle = segments.end[1]
    push = place - middle + random.normal(size=3) * 3.0
    return 5.0 * push / float(np.linalg.norm(push))


@pytest.mark.parametrize("kind", KINDS)
def test_no_push_from_anywhere_enters_a_zone(kind: str) -> None:
    """HAZ-01: adversarial pushes at zones around the whole tool: never nearer than the margin, by coal."""
    random = np.random.default_rng(KINDS.index(kind))
    base = straight_scene(FAR)
    touched = started = 0
    while started < 7:
        place, margin = beside_the_tool(base, random), float(random.uniform(0.0, 1.5))
        scene = replace(base, zones=(Zone("nerve", a_solid(kind, place, random), margin),))
        rehearsal, judge = Rehearsal(scene, FAST), ZoneJudge(scene.zones[0].solid)
        if rehearsal.controller.measure(scene.q_start).distance[1].min() < margin:
            with pytest.raises(StartRefused, match="protected structure 'nerve'"):
                rehearsal.start("free")
            continue
        state, started = rehearsal.start("free"), started + 1
        least = np.inf
        for i in range(120):
            force = towards(state, place, random) if i % 40 < 34 else 5.0 * _unit(random.normal(size=3))
            before = state
            state, snapshot = rehearsal.step(state, Command(force, twist=int(random.integers(-1, 2))))
            measured = judge.distance(state.tool.segments)
            assert measured >= margin - 1e-6
            assert min(measured, 3.0) == pytest.approx(min(float(state.tool.distance[1].min()), 3.0), abs=1e-5)
            if measured < margin + 0.05:
                _replay(scene, before, state, judge, margin)
                assert "protected structure 'nerve'" in " ".join(snapshot.active) or not snapshot.held
            least = min(least, measured)
        touched += least < margin + 0.05
    assert touched >= 4


def _replay(scene: Scene, before: RehearsalState, after: RehearsalState, judge: ZoneJudge, margin: float) -> None:
    """HAZ-02: between two poses as well."""
    robot = scene.placed_robot()
    for share in (0.25, 0.5, 0.75):
        pose = scene.tool.segments(*robot.tip_pose(before.tool.q + share * (after.tool.q - before.tool.q)))
        assert judge.distance(pose) >= margin - 2e-3


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / float(np.linalg.norm(vector))


def test_many_zones_and_bone_at_once() -> None:
    """Between two plates, a ball ahead and bone beside: every margin is kept at the same time, each its own."""
    zones = (
        Zone("left", HalfSpace([6, 0, 0], [-1, 0, 0]), 1.0),
        Zone("right", HalfSpace([-7, 0, 0], [1, 0, 0.2]), 0.4),
        Zone("ahead", Sphere([0, 14, 0], 5.0), 0.9),
        Zone("above", ProximityTree(_floor(9.0)), 0.6),
    )
    scene = replace(straight_scene(_floor(-10.0)), zones=zones)
    rehearsal, random = Rehearsal(scene, FAST), np.random.default_rng(3)
    judges = {zone.name: ZoneJudge(zone.solid) for zone in zones} | {"bone": CoalJudge(scene.tree.mesh)}
    margins = {zone.name: zone.margin_mm for zone in zones} | {"bone": FAST.margin_mm}
    state, least = rehearsal.start("free"), dict.fromkeys(margins, np.inf)
    push = np.zeros(3)
    for i in range(1300):
        if i % 130 == 0:
            push = 5.0 * _unit(random.normal(size=3))
        state, _ = rehearsal.step(state, Command(push, twist=int(random.integers(-1, 2))))
        for name, judge in judges.items():
            segments = state.tool.segments
            measured = judge.clearance(segments) if isinstance(judge, CoalJudge) else judge.distance(segments)
            assert measured >= margins[name] - 1e-6
            least[name] = min(least[name], measured)
    assert sum(least[name] < margins[name] + 0.05 for name in margins) >= 4


def _floor(z: float) -> TriangleMesh:
    plate = wall(0.0)
    return TriangleMesh(plate.vertices[:, [0, 2, 1]] + [0.0, 0.0, z], plate.faces)


def test_a_zone_across_the_path_holds_the_tool_and_is_named() -> None:
    path = np.array([[0.0, 0, 0], [0, 10, 0], [0, 30, 0]])
    scene = replace(
        straight_scene(FAR, path), zones=(Zone("optic nerve", CapsuleShape([-9, 12, 0], [9, 12, 0], 2.0), 0.8),)
    )
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.start()
    for _ in range(500):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
    assert snapshot.held
    assert snapshot.reason == "protected structure 'optic nerve' on the tip, 0.8 mm away"
    assert snapshot.blocking_point is not None
    assert snapshot.blocking_point == pytest.approx([0.0, 10.0, 0.0], abs=1e-3)


def test_a_start_in_a_zone_is_refused_by_its_name() -> None:
    """HAZ-04; and two zones of one name are refused, because no message could tell them apart."""
    ball = Sphere([0, 0, 0], 2.0)
    with pytest.raises(StartRefused, match=r"the tip would start inside protected structure 'eye', 3\.00 mm deep"):
        Rehearsal(replace(straight_scene(FAR), zones=(Zone("eye", ball, 1.0),)), FAST).start("free")
    with pytest.raises(InputError, match="two protected structures are called 'eye'"):
        Rehearsal(replace(straight_scene(FAR), zones=(Zone("eye", ball, 1.0), Zone("eye", ball, 0.5))), FAST)
