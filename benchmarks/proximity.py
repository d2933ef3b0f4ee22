"""Proximity queries of the engine against coal's: interleaved, along the corridor, and each answer checked.

Poses are those of the robot driving the corridor in which bone is within the threshold: elsewhere the answer is empty.
Ratios are of medians over the poses, each pose's time being the median of its rounds.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import fast_simplification
import numpy as np

from benchmarks import cases, report
from benchmarks.brute_force import BruteForce
from benchmarks.coal_peer import CoalPeer, build
from vfix_engine.arrays import Array
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree

SUMMARY = "pairs and closest pair against coal's collide and distance"
COHERENT_MM = 0.75  # how far the tool may move while a candidate list holds
LEAST_POSES = 24
BURST = 5  # calls in a row: a query follows one of nearly the same pose, not one that has emptied the caches
AGREE_MM = 1e-6  # coal's tolerance
SMALL, MIDDLE = 10_000, 125_000  # triangles of the scaling table; the middle one is split into 4 and into 16


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which heads, how many poses and rounds, and how near counts."""
    cases.add_arguments(parser)
    parser.add_argument("--poses", type=int, default=32, help="poses along the corridor (default 32, at least 24)")
    parser.add_argument("--rounds", type=int, default=15, help="timings of each query and pose (default 15)")
    parser.add_argument("--threshold", type=float, default=3.0, help="how near a pair is, in mm (default 3)")
    parser.add_argument(
        "--no-scaling", action="store_true", help="leave out the table from 10,000 to 2,000,000 triangles"
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Times, ratios, memory and whether all was right.

    Raises:
        BenchmarkRefused: coal is not installed, an option makes no sense, or bone is never within the threshold.
    """
    if args.poses < LEAST_POSES or args.rounds < 3 or not 0.0 < args.threshold <= 20.0:
        raise report.BenchmarkRefused("at least 24 poses and 3 rounds, and a threshold above 0 and up to 20 mm")
    coal = report.need("coal")
    found = cases.find_cases(args)
    machine = report.machine().to_dict()
    poses = {case.name: _poses(case, args.poses, args.threshold) for case in found.found}
    measured = found.measure(lambda case: _measure(coal, case, poses[case.name], args.rounds, args.threshold))
    results = [each for each in measured["cases"].values() if each is not None]
    first = found.found[0]
    return {
        "machine": machine,
        "poses": args.poses,
        "rounds": args.rounds,
        "threshold_mm": args.threshold,
        "ratios": _worst([each["ratios"] for each in results]),
        "correct": all(each["correct"] for each in results),
        **measured,
        "scaling": None if args.no_scaling else _scaling(coal, first.mesh, poses[first.name], args),
    }


def _worst(ratios: list[dict[str, float]]) -> dict[str, float]:
    """Of each ratio the one that speaks least for the engine."""
    less_is_better = ("build_vs_coal", "memory_vs_coal")
    return {name: (max if name in less_is_better else min)(each[name] for each in ratios) for name in ratios[0]}


def _poses(case: cases.BenchCase, count: int, threshold: float) -> list[Segments]:
    """``count`` poses along the corridor in which bone is within the threshold."""
    tree = ProximityTree(case.mesh)
    near = [pose for pose in cases.drive(case).segments(10 * count) if tree.clearance(pose) <= threshold]
    if len(near) < count:
        raise report.BenchmarkRefused(f"bone is within {threshold:g} mm in {len(near)} poses only along {case.name}")
    return [near[i] for i in np.linspace(0, len(near) - 1, count).round().astype(int)]


def _measure(coal: Any, case: cases.BenchCase, poses: list[Segments], rounds: int, threshold: float) -> dict[str, Any]:
    mesh = case.mesh
    tree, peer = ProximityTree(mesh), CoalPeer(coal, mesh)
    times = _times(tree, peer, poses, rounds, threshold)
    builds = report.interleaved(
        {
            "ours": lambda: ProximityTree(mesh),
            "refit": lambda: tree.moved(mesh),
            "coal": lambda: build(coal, mesh),
        },
        5,
    )
    build_s = {name: float(np.median(seconds)) for name, seconds in builds.items()}
    found = [len(tree.pairs_within(pose, threshold)) for pose in poses]
    check = _Check(tree, peer, mesh.triangles, threshold)
    wrong = [fault for pose in poses for fault in check.faults(pose)]
    return {
        "triangles": len(mesh.faces),
        "pairs": {"median": float(np.median(found)), "most": max(found), "least": min(found)},
        "median_us": times,
        "ratios": {
            "all_pairs_vs_coal_collide": times["coal_collide"] / times["all_pairs"],
            "closest_vs_coal_distance": times["coal_distance"] / times["closest"],
            "coherent_vs_coal_collide": times["coal_collide"] / times["coherent"],
            "all_pairs_vs_coal_obb_collide": times["coal_collide_obb"] / times["all_pairs"],
            "coherent_vs_coal_obb_collide": times["coal_collide_obb"] / times["coherent"],
            "build_vs_coal": build_s["ours"] / build_s["coal"],
            "memory_vs_coal": tree.nbytes / peer.nbytes,
        },
        "build_s": build_s,
        "memory_mb": {"ours": tree.nbytes / 1e6, "coal": peer.nbytes / 1e6},
        "correct": not wrong,
        "wrong": wrong[:10],
    }


def _times(
    tree: ProximityTree, peer: CoalPeer, poses: list[Segments], rounds: int, threshold: float
) -> dict[str, float]:
    """Median over the poses of each query's median time in µs."""
    request = peer.margin_request(threshold)
    medians: dict[str, list[float]] = {}
    for pose in poses:
        tool, near = peer.tool(pose), tree.candidates(pose, threshold + COHERENT_MM)
        queries = _queries(tree, peer, pose, tool, near, request, threshold)
        for name, seconds in _in_turn(queries, rounds).items():
            medians.setdefault(name, []).append(1e6 * float(np.median(seconds)))
    return {name: float(np.median(each)) for name, each in medians.items()}


def _in_turn(queries: dict[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """Seconds of every call, the queries in turn, each ``BURST`` times in a row as a control loop asks them."""
    seconds: dict[str, list[float]] = {name: [] for name in queries}
    for call in queries.values():
        call()
    for _ in range(rounds):
        for name, call in queries.items():
            for _ in range(BURST):
                begin = time.perf_counter()
                call()
                seconds[name].append(time.perf_counter() - begin)
    return seconds


def _queries(
    tree: ProximityTree, peer: CoalPeer, pose: Segments, tool: Any, near: Any, request: Any, threshold: float
) -> dict[str, Callable[[], object]]:
    return {
        "all_pairs": lambda: tree.pairs_within(pose, threshold),
        "coherent": lambda: near.pairs_within(pose, threshold),
        "closest": lambda: tree.closest(pose),
        "clearance": lambda: tree.clearance(pose),
        "coherent_clearance": lambda: near.clearance(pose),
        "candidates": lambda: tree.candidates(pose, threshold + COHERENT_MM),
        "coal_collide": lambda: peer.collide(tool, request, peer.model),
        "coal_collide_obb": lambda: peer.collide(tool, request, peer.collide_model),
        "coal_distance": lambda: peer.distance(tool),
    }


class _Check:
    """Every answer of one pose against brute force and against coal."""

    def __init__(self, tree: ProximityTree, peer: CoalPeer, triangles: Array, threshold: float):
        self._tree, self._peer, self._brute, self._threshold = tree, peer, BruteForce(triangles), threshold
        self._scale = 1.0 + float(np.abs(triangles).max())

    def faults(self, pose: Segments) -> list[str]:
        """What is wrong in this pose, in words."""
        eps, threshold, tree = 1e-9 * self._scale, self._threshold, self._tree
        truth: dict[tuple[int, int], float] = {}
        least = np.inf
        for s in range(len(pose)):
            axis = (pose.start[s], pose.end[s])
            which, distance = self._brute.near(*axis, threshold + pose.radius[s] + eps)
            truth |= {(s, int(f)): float(d - pose.radius[s]) for f, d in zip(which, distance, strict=True)}
            least = min(least, self._brute.least(*axis) - float(pose.radius[s]))
        near = tree.candidates(pose, threshold + COHERENT_MM)
        faults = [
            *self._wrong_pairs("all pairs", tree.pairs_within(pose, threshold), truth, eps),
            *self._wrong_pairs("coherent pairs", near.pairs_within(pose, threshold), truth, eps),
        ]
        closest = tree.closest(pose).distance
        clearances = {"closest": closest, "clearance": tree.clearance(pose), "coherent clearance": near.clearance(pose)}
        faults += [f"{name} {value} is not {least}" for name, value in clearances.items() if abs(value - least) > eps]
        return faults + self._coal_disagrees(pose, truth, least)

    def _wrong_pairs(self, name: str, pairs: Any, truth: dict[tuple[int, int], float], eps: float) -> list[str]:
        told = {
            (int(s), int(f)): float(d)
            for s, f, d in zip(pairs.segment, pairs.triangle, pairs.distance, strict=True)
            if f >= 0
        }
        sure = {pair for pair, distance in truth.items() if distance <= self._threshold - eps}
        faults = [f"{name}: pair {pair} is missed" for pair in sure - told.keys()]
        faults += [f"{name}: pair {pair} is none" for pair in told.keys() - truth.keys()]
        off = {pair: told[pair] - truth[pair] for pair in told.keys() & truth.keys()}
        return faults + [f"{name}: {pair} is {error:g} off" for pair, error in off.items() if abs(error) > eps]

    def _coal_disagrees(self, pose: Segments, truth: dict[tuple[int, int], float], least: float) -> list[str]:
        tool = self._peer.tool(pose)
        pairs = self._peer.pairs(tool, self._peer.margin_request(self._threshold))
        sure = {pair for pair, distance in truth.items() if distance <= self._threshold - AGREE_MM}
        faults = [f"coal has no pair {pair}" for pair in sure - pairs.keys()]
        faults += [
            f"coal has the pair {pair}"
            for pair in pairs.keys() - truth.keys()
            if pairs[pair] <= self._threshold - AGREE_MM
        ]
        distance = self._peer.distance(tool)
        if least > AGREE_MM and abs(distance - least) > AGREE_MM:
            faults.append(f"coal's distance {distance} is not {least}")
        return faults


def _scaling(coal: Any, mesh: TriangleMesh, poses: list[Segments], args: argparse.Namespace) -> list[dict[str, Any]]:
    """The same poses in the same head at 10,000 to 2,000,000 triangles."""
    table = []
    for surface in _surfaces(mesh):
        begin = time.perf_counter()
        tree = ProximityTree(surface)
        build_s = time.perf_counter() - begin
        peer = CoalPeer(coal, surface)
        times = _times(tree, peer, poses[::2], max(3, args.rounds // 3), args.threshold)
        shown = ("all_pairs", "coherent", "closest", "coal_collide", "coal_distance")
        table.append(
            {
                "triangles": len(surface.faces),
                "pairs": float(np.median([len(tree.pairs_within(pose, args.threshold)) for pose in poses[::2]])),
                **{f"{name}_us": times[name] for name in shown},
                "build_s": build_s,
                "coal_build_s": peer.build_s,
            }
        )
    return table


def _surfaces(mesh: TriangleMesh) -> list[TriangleMesh]:
    """About 10,000, 40,000, 125,000, 500,000 and 2,000,000 triangles of the same surface."""
    small = [_thinned(mesh, count) for count in (SMALL, 4 * SMALL, MIDDLE)]
    finer = _split(small[-1])
    return [*small, finer, _split(finer)]


def _thinned(mesh: TriangleMesh, count: int) -> TriangleMesh:
    if count >= len(mesh.faces):
        return mesh
    vertices, faces = fast_simplification.simplify(
        mesh.vertices.copy(), mesh.faces.copy(), 1.0 - count / len(mesh.faces)
    )
    return TriangleMesh(vertices, faces)


def _split(mesh: TriangleMesh) -> TriangleMesh:
    """Each triangle into four at the middles of its edges."""
    a, b, c = mesh.triangles[:, 0], mesh.triangles[:, 1], mesh.triangles[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    corners = np.concatenate([np.stack(each, axis=1) for each in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
