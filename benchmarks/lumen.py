"""The proximity query of Kwok 2013, eq. 1-9: the engine's against the printed algorithm, compiled and in numpy.

Successive poses differ by a fraction of a degree in every joint, and are the same for all candidates. Each candidate
is called five times in a row, as a control loop asks about nearly the same pose repeatedly; slow candidates are called
once. The time is that of the engine's Python function with all its checks.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import lumen_controls, lumen_gpu, report
from benchmarks.attack.snake import command as lumen_attack
from benchmarks.lumen_peers import NumpyQuery, literal_query
from benchmarks.lumen_scene import JUDGED, LINKS, SEGMENTS, Scene
from benchmarks.lumen_threads import ThreadedQuery
from vfix_engine.arrays import Array
from vfix_engine.pathway.query.query import Query
from vfix_engine.robots.snake_surface import LinkVertices

Ask = Callable[[Array], object]

SUMMARY = "the query of a snake in its lumen against the paper's, compiled as printed and in numpy"
MIXED = 0.2  # fraction of the vertices outside
NARROW_MM = 3.0  # radius of a lumen half as wide as the snake: all vertices deviate by nearly the same amount
SMALL = 500  # vertices of the batch query
BATCH, BATCH_STIR = 200, np.radians(3.0)  # poses of one call, which differ as those of an optimiser
BURST = 5
POSES = 15  # for each fraction of vertices outside
AGREE_MM = 1e-9
MOST_US, MOST_SMALL_US = 1000.0, 30.0  # of a query: of 14,800 vertices, inside and mixed; of 500 in a batch
LEAST_RATIOS = {"vs_literal": 9.0, "vs_numpy": 150.0}  # of 14,800 vertices, in every scene
COUNTS = (500, 1000, 2000, 5000, JUDGED, 50_000)  # vertices of fig. 7a
ATTACK_STEPS = 2000  # of the adversary that both controls are tested with
SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # fractions of the vertices inside, fig. 7b


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: numbers of vertices and rounds, sweeps, folder of the plots."""
    parser.add_argument("--vertices", type=int, default=JUDGED, help=f"vertices of the snake (default {JUDGED:,})")
    parser.add_argument("--rounds", type=int, default=15, help="timings of each candidate (default 15, at least 3)")
    parser.add_argument("--threads", type=int, default=None, help="threads of the sweeps at most (default: all cores)")
    parser.add_argument("--no-sweeps", action="store_true", help="leave out the sweeps of fig. 7a and 7b")
    parser.add_argument("--plots", type=Path, metavar="FOLDER", help="draw the sweeps and bends as SVG files there")
    parser.add_argument("--controls", action="store_true", help="also bends and both controls: a minute more")
    parser.add_argument("--gpu", action="store_true", help="refuse to run where no GPU is found")
    lumen_attack.add_arguments(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return times, ratios, sweeps, and whether all candidates agree; or the findings of an attack.

    Raises:
        BenchmarkRefused: an option makes no sense, or matplotlib (for plots) or a GPU is missing.
    """
    if args.attack is not None:
        return lumen_attack.attack(args)
    threads = _thread_counts(args)
    if not LINKS <= args.vertices <= 1_000_000 or args.rounds < 3:
        raise report.BenchmarkRefused(f"{LINKS} to 1,000,000 vertices, and at least 3 rounds")
    if args.plots is not None and args.no_sweeps:
        raise report.BenchmarkRefused("--plots draws the sweeps, which --no-sweeps leaves out")
    if args.plots is not None:
        report.need("matplotlib", "--plots draws with")
    if args.gpu:
        lumen_gpu.need_gpu()
    machine = report.machine().to_dict()
    scene, count = Scene.made(), args.vertices
    shifts = {share: scene.shift_for(1.0 - share) for share in {1.0, 1.0 - MIXED, *(() if args.no_sweeps else SHARES)}}
    mixed = shifts[1.0 - MIXED]
    cases = {
        name: _Case(scene, count, shift, args.rounds) for name, shift in (("inside", shifts[1.0]), ("mixed", mixed))
    }
    cases["narrow"] = _Case(Scene.made(NARROW_MM), count, 0.0, args.rounds)
    times = {name: case.times() for name, case in cases.items()}
    batch = _Batch(scene, mixed, args.rounds)
    gpu = lumen_gpu.measure(scene, mixed, args.rounds)
    built: dict[str, Any] = {"bends": None, "controls": None}
    if args.controls:
        built = lumen_controls.measure(scene, args.rounds, ATTACK_STEPS)
    sweeps = _sweeps(args, scene, shifts, threads)
    swept = [row["max_abs_diff"] for sweep in sweeps.values() for row in sweep or []]
    apart = max([batch.apart, *(case.apart() for case in cases.values()), *swept])
    ratios = {name: _ratios(each) for name, each in times.items()}
    least = {name: min(each[name] for each in ratios.values()) for name in ratios["mixed"]}
    correct = apart <= AGREE_MM and (gpu is None or gpu["max_abs_diff"] <= AGREE_MM)
    ours = {name: each["ours"] for name, each in times.items()}
    return {
        "machine": machine,
        "vertices": count,
        "segments": SEGMENTS,
        "links": LINKS,
        "rounds": args.rounds,
        "us": {f"{count}_inside": ours["inside"], f"{count}_mixed": ours["mixed"], "500": batch.us},
        "narrow_us": ours["narrow"],
        "outside_percent": {name: case.outside_percent() for name, case in cases.items()} | {"500": batch.outside},
        "every_vertex_us": {name: each["every_vertex"] for name, each in times.items()},
        "literal_us": {name: each["literal"] for name, each in times.items()},
        "numpy_us": {name: each["numpy"] for name, each in times.items()},
        "ratios": least,
        "ratios_by_scene": ratios,
        "max_abs_diff": apart,
        "correct": correct,
        "meets": meets(ours, batch.us, least, count, correct),
        "gpu": gpu,
        **built,
        **sweeps,
        "plots": None if args.plots is None else _draw(args.plots, sweeps, count, gpu),
    }


def _sweeps(args: argparse.Namespace, scene: Scene, shifts: dict[float, float], threads: list[int]) -> dict[str, Any]:
    """Return fig. 7a, by the number of vertices, and fig. 7b, by the fraction of them inside; None if left out.

    shifts: shift of the snake in mm by that fraction.
    """
    if args.no_sweeps:
        return {"vertices_sweep": None, "inside_sweep": None}
    few, mixed = max(3, args.rounds // 3), shifts[1.0 - MIXED]
    by_count = [{"vertices": count} | _Case(scene, count, mixed, few).row(threads) for count in COUNTS]
    by_share = [
        {"inside_percent": 100.0 * share} | _Case(scene, args.vertices, shifts[share], few).row(threads)
        for share in SHARES
    ]
    return {"vertices_sweep": by_count, "inside_sweep": by_share}


def meets(ours: dict[str, float], small: float, least: dict[str, float], count: int, correct: bool) -> dict[str, Any]:
    """Return which targets are met. Most are for 14,800 vertices, and None for another number.

    Args:
        ours: µs by scene. small: µs of one pose of the batch. least: least ratio over all scenes by peer.
    """
    judged: dict[str, bool] = {f"{scene}_within_1_ms": ours[scene] <= MOST_US for scene in ("inside", "mixed")}
    judged |= {f"{at_least:g}_times_{name}": least[name] >= at_least for name, at_least in LEAST_RATIOS.items()}
    told = {name: met if count == JUDGED else None for name, met in judged.items()}
    return told | {"500_within_30_us": small <= MOST_SMALL_US, "agreement_within_1e-9_mm": correct}


def _draw(folder: Path, sweeps: dict[str, Any], count: int, gpu: dict[str, Any] | None) -> list[str]:
    """Draw Kwok 2013, fig. 7a to 7c and 8, and return the paths of the files."""
    from benchmarks import lumen_bends, lumen_plots, plots

    return plots.save(lumen_plots.sweeps_drawn(sweeps, count, gpu) | lumen_bends.bends_drawn(), folder)


def _ratios(times: dict[str, float]) -> dict[str, float]:
    """Return the peers' times over the engine's: for d_l of every link, and for δ_i of every vertex."""
    asked = {f"vs_{peer}": times[peer] / times["ours"] for peer in ("literal", "numpy")}
    return asked | {f"every_vertex_vs_{peer}": times[peer] / times["every_vertex"] for peer in ("literal", "numpy")}


def _thread_counts(args: argparse.Namespace) -> list[int]:
    """Return 2, 4, 8, … up to the number of cores or of requested threads, and that number itself."""
    cores = int(report.machine().cores)
    most = cores if args.threads is None else args.threads
    if not 1 <= most <= (os.cpu_count() or 1):
        raise report.BenchmarkRefused(f"--threads {most} is not between 1 and the {os.cpu_count()} of this machine")
    return [] if most == 1 else sorted({most, *(2**k for k in range(1, most.bit_length()) if 2**k <= most)})


class _Case:
    """The snake with a number of vertices at one place, and all candidates that answer the query."""

    def __init__(self, scene: Scene, count: int, shift_mm: float, rounds: int):
        self._scene, self._rounds = scene, rounds
        self._vertices: LinkVertices = scene.vertices(count)
        self._poses = scene.poses(shift_mm, POSES)
        self._query = Query(self._vertices)
        rows, self._radius = scene.packed.rows, np.ascontiguousarray(scene.packed.polar[:, 0])
        self._numpy = NumpyQuery(self._vertices.points, self._vertices.start, rows, self._radius)
        self._gap = np.empty(count)

    def times(self, threaded: dict[str, ThreadedQuery] | None = None) -> dict[str, float]:
        """Return the median µs of each candidate."""
        query, packed, window = self._query, self._scene.packed, self._scene.window
        candidates: dict[str, Ask] = {
            "ours": lambda pose: query.deviations(packed, pose, window),
            "every_vertex": lambda pose: query.every_vertex(packed, pose, window),
            **{name: each.deviations for name, each in (threaded or {}).items()},
            "literal": self._literal,
            "numpy": self._numpy.deviations,
        }
        bursts = {name: 1 if name in ("literal", "numpy") else BURST for name in candidates}
        seconds = in_turn(candidates, self._poses, self._rounds, bursts)
        return {name: 1e6 * float(np.median(each)) for name, each in seconds.items()}

    def row(self, thread_counts: list[int]) -> dict[str, float]:
        """Return one row of a sweep."""
        asked = {
            f"{n}_threads": ThreadedQuery(self._vertices, self._scene.packed, self._scene.window, n)
            for n in thread_counts
        }
        try:
            times = self.times(asked)
            apart = max([self.apart(), *(self._apart_of(each.deviations) for each in asked.values())])
        finally:
            for each in asked.values():
                each.close()
        row = {"outside_percent": self.outside_percent(), "ours_us": times.pop("ours")}
        return row | {f"{name}_us": value for name, value in times.items()} | {"max_abs_diff": apart}

    def apart(self) -> float:
        """Return the largest difference in mm between any two answers, of links and of vertices."""
        query, packed, window = self._query, self._scene.packed, self._scene.window
        apart = 0.0
        for pose in self._poses:
            depth, gap = query.deviations(packed, pose, window).depth, query.every_vertex(packed, pose, window)[0]
            literal = self._literal(pose)
            numpy_depth, numpy_gap = self._numpy.deviations(pose)
            for one, two in ((depth, literal), (depth, numpy_depth), (gap, self._gap), (gap, numpy_gap)):
                apart = max(apart, float(np.abs(one - two).max()))
        return apart

    def outside_percent(self) -> float:
        """Return the percentage of the vertices that deviate."""
        return 100.0 * self._scene.share_outside(self._query, self._poses)

    def _literal(self, pose: Array) -> Array:
        first, last = self._scene.window
        rows, vertices = self._scene.packed.rows, self._vertices
        return literal_query(vertices.points, vertices.start, pose, rows, self._radius, first, last, self._gap)

    def _apart_of(self, ask: Callable[[Array], Array]) -> float:
        return max(float(np.abs(ask(pose) - self._literal(pose)).max()) for pose in self._poses)


class _Batch:
    """A query of 500 vertices in 200 poses with one call, as by an optimiser. Times are µs per pose."""

    def __init__(self, scene: Scene, shift_mm: float, rounds: int):
        vertices, packed = scene.vertices(SMALL), scene.packed
        poses = scene.poses(shift_mm, BATCH, BATCH_STIR)
        query, gap, radius = Query(vertices), np.empty(SMALL), np.ascontiguousarray(packed.polar[:, 0])
        seconds = in_turn({"ours": lambda _: query.deviations(packed, poses, scene.window)}, poses, rounds, {"ours": 1})
        self.us = 1e6 * float(np.median(seconds["ours"])) / BATCH
        self.outside = 100.0 * scene.share_outside(query, poses)
        found = query.deviations(packed, poses, scene.window).depth
        wanted = [
            literal_query(vertices.points, vertices.start, pose, packed.rows, radius, *scene.window, gap)
            for pose in poses
        ]
        self.apart = float(np.abs(found - np.array(wanted)).max())


def in_turn(candidates: dict[str, Ask], poses: Array, rounds: int, bursts: dict[str, int]) -> dict[str, list[float]]:
    """Return the seconds of every call of candidates called in turn, each with own poses, without the first calls."""
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for ask in candidates.values():
        ask(poses[0])
    for k in range(rounds):
        for name, ask in candidates.items():
            for burst in range(bursts[name]):
                pose = poses[(k + burst) % len(poses)]
                begin = time.perf_counter()
                ask(pose)
                seconds[name].append(time.perf_counter() - begin)
    return seconds
