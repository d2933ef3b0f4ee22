"""`vfix bench piercing`: suggested paths in a head, and whether one of them pierces tissue, checked by brute force.

From each entry to its targets, moved by up to 2 mm, paths are searched with each tool until the requested number is
found. Their poses, 8 mm apart, are checked in the voxels by independent code (`piercing_judge`). None may pierce.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks import report
from benchmarks.piercing_judge import pierced_runs
from vfix_engine.anatomy.phantom import load_head_ct, load_landmarks
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.anatomy.room_air import room_air
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.anatomy.solids import solid_of_volumes
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.arrays import Array
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.suggestion import Alternative, Room, SearchSpace, suggest_path

SUMMARY = "suggested ways in a head: none pierces skin or a wall, judged out of the voxels by another code"
TOOLS = ("straight_pointer", "bent_30", "endoscope_0")
SLACK_MM = 0.75  # both codes have grids of 0.5 mm
EVERY_MM = 8.0  # between the checked poses
_MOVED_MM, _AROUND_MM = 2.0, 30.0


class Head(NamedTuple):
    """A scan with entries (n, 3) and the targets of each (n, m, 3), in LPS mm."""

    volume: Volume
    entries: Array
    targets: Array


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: which head, and how many paths."""
    parser.add_argument("--ways", type=int, default=100, metavar="N", help="ways to look at (default 100)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the moved ends")
    parser.add_argument("--head", type=Path, metavar="FILE", help="a CT; by default the head phantom")
    for end in ("--entry", "--target"):
        words = "of that CT, LPS mm; may be repeated"
        parser.add_argument(end, type=_place, action="append", default=[], metavar="X,Y,Z", help=words)


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return the numbers of paths and of those that pierce.

    Raises:
        BenchmarkRefused: a number or an argument makes no sense.
    """
    if not 1 <= args.ways <= 100_000 or args.seed < 0:
        raise report.BenchmarkRefused("--ways is from 1 to 100,000, --seed 0 or more")
    if args.head is not None and not (args.entry and args.target):
        raise report.BenchmarkRefused("--head needs an --entry and a --target of it")
    machine, begin = report.machine().to_dict(), time.perf_counter()
    head = phantom() if args.head is None else _given(args)
    ways, pierce, asked = 0, 0, 0
    for found, entry in suggested(head, np.random.default_rng(args.seed)):
        asked += 1
        for one in found[: args.ways - ways]:
            ways += 1
            pierce += bool(pierced_by(head.volume, one, entry))
        if ways >= args.ways or asked >= 4 * args.ways:
            break
    return {
        "machine": machine,
        "ways": ways,
        "searches": asked,
        "pierce": pierce,
        "seconds": time.perf_counter() - begin,
        "correct": ways == args.ways and pierce == 0,
    }


def phantom() -> Head:
    """Return the head phantom with both nostrils as entries, and for each the targets that a rigid tool reaches."""
    known = load_landmarks()
    entry, targets = (np.array([point.position for point in part]) for part in (known.corridor[:1], known.corridor[4:]))
    mirrored = np.array([-1.0, 1.0, 1.0])
    return Head(load_head_ct(), np.concatenate([entry, entry * mirrored]), np.stack([targets, targets * mirrored]))


def _given(args: argparse.Namespace) -> Head:
    entries, targets = np.array(args.entry), np.array(args.target)
    return Head(read_volume(args.head)[0], entries, np.repeat(targets[None], len(entries), axis=0))


def suggested(
    head: Head, random: np.random.Generator, tools: Sequence[str] = TOOLS
) -> Iterator[tuple[tuple[Alternative, ...], Array]]:
    """Yield the alternatives and the entry of one search after another, endlessly."""
    ends = np.concatenate([head.entries, head.targets.reshape(-1, 3)])
    focus = np.stack([ends.min(axis=0) - _AROUND_MM, ends.max(axis=0) + _AROUND_MM])
    bone, tissue = (solid_of_volumes([head.volume], level, focus) for level in (BONE_HU, TISSUE_HU))
    tree, room, air = ProximityTree(extract_surface(head.volume)), Room(bone, tissue), room_air(tissue, [head.volume])
    robot, every, number = RobotModel.load("steady_hand"), [Tool.load(name) for name in tools], 0
    while True:
        side = random.integers(len(head.entries))
        entry = head.entries[side] + random.uniform(-_MOVED_MM, _MOVED_MM, 3)
        target = head.targets[side, random.integers(head.targets.shape[1])] + random.uniform(-_MOVED_MM, _MOVED_MM, 3)
        around = SearchSpace(tree, room, ways=Ways(tissue, air, entry))
        try:
            found = suggest_path(around, robot, every[number % len(every)], entry, target, ControlSettings())
            yield found.alternatives, entry
        except InputError:  # an end that was moved into tissue
            yield (), entry
        number += 1


def pierced_by(volume: Volume, one: Alternative, entry: Array, every_mm: float = EVERY_MM) -> list[Array]:
    """Return where the poses of an alternative pierce tissue, by brute force."""
    rows = np.unique(np.rint(one.run.s / every_mm), return_index=True)[1]
    found = list[Array]()
    for row in np.union1d(rows, [len(one.run.s) - 1]):
        found += pierced_runs(volume, one.run.segments_start[row], one.run.segments_end[row], entry, SLACK_MM)
    return found


def _place(text: str) -> tuple[float, float, float]:
    x, y, z = (float(part) for part in text.split(","))
    return x, y, z
