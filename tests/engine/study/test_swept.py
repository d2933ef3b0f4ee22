"""Swept volumes and near passes against shapes whose distance is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.engine.study.test_series import ASIDE, CALM, recorded, scene
from vfix_engine.errors import InputError
from vfix_engine.study.series import series_of
from vfix_engine.study.swept import SweptPoses, kept_poses, near_passes, swept_volume
from vfix_engine.worlds.freehand.spec import FreehandSpec


class Stopped(Exception):
    pass


def ball_along_x(radius: float = 2.0, far: float = 12.0, step: float = 0.2) -> SweptPoses:
    """A ball, which is a capsule without length, moved along the x axis from 0 on."""
    places = np.zeros((round(far / step) + 1, 1, 3))
    places[:, 0, 0] = np.linspace(0.0, far, len(places))
    return SweptPoses(places, places.copy(), np.array([radius]))


def from_axis(places: np.ndarray, far: float = 12.0) -> np.ndarray:
    """Distance of places (n, 3) to the x axis from 0 to `far`."""
    nearest = np.zeros_like(places)
    nearest[:, 0] = np.clip(places[:, 0], 0.0, far)
    return np.asarray(np.linalg.norm(places - nearest, axis=1))


def test_a_ball_that_is_moved_sweeps_a_capsule() -> None:
    found = swept_volume(ball_along_x())
    assert np.abs(from_axis(found.vertices) - 2.0).max() < 0.06
    expected = np.pi * 4.0 * 12.0 + 4.0 / 3.0 * np.pi * 8.0
    assert found.volume_mm3 == pytest.approx(expected, rel=0.02), "positive, so its faces look outwards"
    edges = np.sort(np.concatenate([found.faces[:, [0, 1]], found.faces[:, [1, 2]], found.faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all(), "it is closed"


def test_a_long_tool_is_swept_whole() -> None:
    """A shaft of 120 mm that stands, and one that turns: the volume between two directions is a sector's."""
    tip = np.zeros((1, 1, 3))
    standing = SweptPoses(tip, tip + np.array([0.0, 0.0, 120.0]), np.array([1.5]))
    found = swept_volume(standing)
    assert found.volume_mm3 == pytest.approx(np.pi * 2.25 * 120.0 + 4.0 / 3.0 * np.pi * 1.5**3, rel=0.03)
    coarse = swept_volume(standing, voxel_mm=1.0)
    assert len(coarse.faces) < len(found.faces) / 3
    turn = np.linspace(0.0, 0.5, 400)
    ends = 60.0 * np.stack([np.sin(turn), np.zeros(400), np.cos(turn)], axis=1)[:, None]
    fan = swept_volume(SweptPoses(np.zeros((400, 1, 3)), ends, np.array([1.5])))
    # Steiner's formula of the flat sector: area times thickness, half a cylinder along its rim, a ball at its corners
    area, rim = 0.5 * 60.0**2 * 0.5, 60.0 * 0.5 + 2.0 * 60.0
    assert fan.volume_mm3 == pytest.approx(3.0 * area + np.pi * 2.25 / 2.0 * rim + 4.0 / 3.0 * np.pi * 1.5**3, rel=0.03)


def test_near_passes_are_the_distances_of_vertices() -> None:
    x, y = np.meshgrid(np.arange(-10.0, 25.0), np.arange(-12.0, 13.0), indexing="ij")
    plane = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, -5.0)])
    number = np.arange(x.size).reshape(x.shape)
    corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    a, b, c, d = (one.ravel() for one in corners)
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    found = near_passes(plane, faces, ball_along_x(step=0.05), reach_mm=4.0)
    expected = np.minimum(from_axis(found.vertices) - 2.0, 4.0)
    np.testing.assert_allclose(found.least_mm, expected, atol=1e-3)
    assert found.least_mm.min() == pytest.approx(3.0)
    assert (found.least_mm[found.faces] < 4.0).any(axis=1).all()
    shown = (from_axis(plane) - 2.0 < 4.0 - 1e-3)[faces].any(axis=1)
    assert len(found.faces) == pytest.approx(shown.sum(), abs=4)
    deep = near_passes(plane + np.array([0.0, 0.0, 4.0]), faces, ball_along_x(step=0.05))
    assert deep.least_mm.min() == pytest.approx(-1.0), "within the tool"
    far = near_passes(plane - np.array([0.0, 0.0, 50.0]), faces, ball_along_x())
    assert (len(far.vertices), len(far.faces)) == (0, 0)


def test_poses_are_thinned_no_further_than_a_step() -> None:
    random = np.random.default_rng(5)
    ends = np.cumsum(random.normal(size=(600, 4, 3)) * 0.03, axis=0)
    ends[300:] += [3.0, 0.0, 0.0]  # one step of the drive that is longer
    kept = kept_poses(ends, 0.25)
    assert (kept[0], kept[-1]) == (0, 599)
    apart = np.abs(np.diff(ends[kept], axis=0)).max(axis=(1, 2))
    assert (apart > 0.25).sum() == 1
    assert 20 < len(kept) < 400
    assert kept_poses(ends[:1], 0.25).tolist() == [0]


def test_the_tool_of_a_run_is_swept(tmp_path: Path) -> None:
    def act(driver: object, step: object) -> None:
        step(ASIDE, count=60)  # type: ignore[operator]

    run, _ = recorded(tmp_path, FreehandSpec(scene(), CALM), act)
    series = series_of(run)
    poses = SweptPoses.of(series)
    assert 2 <= len(poses.start) < len(series.t)
    told: list[float] = []
    volume = swept_volume(poses, 1.0, lambda stage, share: told.append(share))
    assert told == sorted(told)
    assert told[0] == 0.0
    one = swept_volume(SweptPoses(series.start[:1], series.end[:1], series.radius), 1.0)
    assert volume.volume_mm3 > one.volume_mm3 > 0.0
    spec = scene()
    passes = near_passes(np.asarray(spec.vertices), np.asarray(spec.faces), poses)
    assert passes.least_mm.min() < 0.5, "the wall was touched"

    def stop(stage: str, share: float) -> None:
        raise Stopped

    with pytest.raises(Stopped):
        swept_volume(poses, progress=stop)
    with pytest.raises(Stopped):
        near_passes(spec.vertices, spec.faces, poses, progress=stop)
    for wrong in (lambda: SweptPoses.of(series, 0.0), lambda: swept_volume(poses, -1.0)):
        with pytest.raises(InputError, match="positive"):
            wrong()
    with pytest.raises(InputError, match="positive"):
        near_passes(spec.vertices, spec.faces, poses, float("nan"))
