"""The query on a GPU, if available, including transfers, launches and checks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import report
from benchmarks.lumen_peers import literal_query
from benchmarks.lumen_scene import JUDGED, Scene
from vfix_engine.arrays import Array
from vfix_engine.pathway.query import gpu
from vfix_engine.robots.snake_surface import LinkVertices

COUNTS = (500, 1000, 2000, 5000, JUDGED, 50_000, 1_000_000)
NAMED = (500, JUDGED, 1_000_000)
POSES = 15  # of one timing, in sequence


def need_gpu() -> None:
    """Raise BenchmarkRefused if no GPU can be used."""
    if not gpu.available():
        raise report.BenchmarkRefused("no GPU can be used here: it takes a driver and pip install 'vfix[gpu]'")


def measure(scene: Scene, shift_mm: float, rounds: int) -> dict[str, Any] | None:
    """Return times in µs and rates in kHz by number of vertices, and the largest error; None without a GPU."""
    if not gpu.available():
        return None
    rows = [sweep_row(scene, count, shift_mm, rounds) for count in COUNTS]
    asked = {row["vertices"]: row["us"] for row in rows}
    return {
        "name": gpu.name(),
        "us": {str(count): asked[count] for count in NAMED},
        "khz": {str(count): 1e3 / asked[count] for count in NAMED},
        "max_abs_diff": max(row["max_abs_diff"] for row in rows),
        "vertices_sweep": rows,
    }


def sweep_row(scene: Scene, count: int, shift_mm: float, rounds: int) -> dict[str, Any]:
    """Return µs of a query with vertices on the GPU, and of one that sends them as in the paper, checked by loops."""
    vertices, poses = scene.vertices(count), scene.poses(shift_mm, POSES)
    query, packed, window = gpu.GpuQuery(vertices), scene.packed, scene.window
    placed = [_placed(vertices, pose) for pose in poses]
    asks: dict[str, Callable[[], object]] = {
        "us": lambda: [query.deviations(packed, pose, window) for pose in poses],
        "vertices_sent_us": lambda: [query.deviations_of(each, packed, window) for each in placed],
    }
    seconds = report.interleaved(asks, rounds)
    apart = 0.0
    for pose, each in zip(poses, placed, strict=True):
        wanted = _by_loops(scene, vertices, pose)
        for found in (query.deviations(packed, pose, window), query.deviations_of(each, packed, window)):
            apart = max(apart, float(np.abs(found.depth - wanted).max()))
    times = {name: 1e6 * float(np.median(each)) / POSES for name, each in seconds.items()}
    return {"vertices": count} | times | {"max_abs_diff": apart}


def _placed(vertices: LinkVertices, frames: Array) -> Array:
    """Return the vertices (V, 3) in the patient frame."""
    link = np.repeat(np.arange(len(frames)), np.diff(vertices.start))
    placed: Array = np.einsum("vij,vj->vi", frames[link, :, :3], vertices.points) + frames[link, :, 3]
    return placed


def _by_loops(scene: Scene, vertices: LinkVertices, pose: Array) -> Array:
    rows, radius = scene.packed.rows, np.ascontiguousarray(scene.packed.polar[:, 0])
    gap = np.empty(len(vertices.points))
    return literal_query(vertices.points, vertices.start, pose, rows, radius, *scene.window, gap)
