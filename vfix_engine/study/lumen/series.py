"""The series of a run of a snake in a lumen: what is plotted over its time, and where the robot was, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, BoolArray, IndexArray
from ...errors import InputError
from ...robots.snake_kernel import snake_frames
from ...runtime.run import Run
from ...runtime.system import SystemSpec
from .samples import LumenSamples, last_of_intervals, lumen_samples_of


@dataclass(frozen=True, eq=False)
class LumenSeries:
    """A run from its last return to the start on, n samples; patient frame, LPS mm.

    t: (n,) s. depth: (n,) mm, of the tip along its way; speed: (n,) mm/s, of the insertion since the sample before.
    chain: (n, L + 1, 3) centres of the joints from the base on, last the tip; radius_mm: of a link.
    eye, shaft, side: (n, 3) of the camera: its place, the way it looks, and up in its picture.
    deviation, bound, link: (n,) of the link nearest to its bound; beyond: (n,) mm beyond it, negative within it.
        NaN, NaN, 0 and −∞ while no link is inside.
    distal: (n,) mm, the largest depth of the last links outside the pathway. bend: (n,) r.
    force, guidance: (n,) N, on the hand, and the part of it by (33)-(35). guidance_xy, resistance_xy: (n, 2) N, that
        part and the rest at t, to the right in the picture and down.
    held: (n,) whether a command was held; limit, limit_link: (n,) codes as in ``LumenSamples`` of its first step.
    """

    t: Array
    depth: Array
    speed: Array
    chain: Array
    eye: Array
    shaft: Array
    side: Array
    deviation: Array
    bound: Array
    link: IndexArray
    beyond: Array
    distal: Array
    bend: Array
    force: Array
    guidance: Array
    guidance_xy: Array
    resistance_xy: Array
    held: BoolArray
    limit: IndexArray
    limit_link: IndexArray
    radius_mm: float


def lumen_series_of(run: Run, rate_hz: float, spec: SystemSpec | None = None) -> LumenSeries:
    """The series of a run of a snake at no more than ``rate_hz``: the last sample of every interval of that time.

    Of each interval the sample whose link is nearest to its bound gives deviation, bound and link; distal, bend and
    forces are its largest, held whether any sample was. The run's last sample is always there.

    Raises:
        InputError: a rate that is not positive; as ``lumen_samples_of``.
    """
    if not rate_hz > 0.0:
        raise InputError(f"series are made at a positive rate in Hz, not at {rate_hz!r:.40}")
    samples = lumen_samples_of(run, spec)
    last = last_of_intervals(samples.t, rate_hz)
    first = np.append(0, last[:-1] + 1)
    interval = np.repeat(np.arange(len(last)), np.diff(last, prepend=-1))
    nearest = _of_largest(np.nan_to_num(samples.deviation / samples.bound, nan=-1.0), interval, last)
    held = np.logical_or.reduceat(samples.held, first)
    began = _of_largest(samples.held.astype(np.float64), interval, last, earliest=True)
    chain, eye, shaft, side = _poses(samples, last)
    depth, t = samples.depth[last], samples.t[last]
    return LumenSeries(
        t=t,
        depth=depth,
        speed=np.diff(depth, prepend=depth[:1]) / np.maximum(np.diff(t, prepend=0.0), 1e-9),
        chain=chain,
        eye=eye,
        shaft=shaft,
        side=side,
        deviation=samples.deviation[nearest],
        bound=samples.bound[nearest],
        link=samples.link[nearest],
        beyond=np.maximum.reduceat(samples.beyond, first),
        distal=np.maximum.reduceat(samples.distal, first),
        bend=np.maximum.reduceat(samples.bend, first),
        force=np.maximum.reduceat(np.linalg.norm(samples.force, axis=1), first),
        guidance=np.maximum.reduceat(np.linalg.norm(samples.guidance, axis=1), first),
        guidance_xy=samples.guidance[last],
        resistance_xy=samples.force[last] - samples.guidance[last],
        held=held,
        limit=np.where(held, samples.limit[began], 0),
        limit_link=np.where(held, samples.limit_link[began], 0),
        radius_mm=samples.snake.radius_mm,
    )


def _of_largest(values: Array, interval: IndexArray, last: IndexArray, earliest: bool = False) -> IndexArray:
    """Of each interval the sample with the largest of ``values`` (n,): the latest of several, or the earliest."""
    rank = np.arange(len(values)) * (-1 if earliest else 1)
    found: IndexArray = np.lexsort((rank, values, interval))[last]
    return found


def _poses(samples: LumenSamples, rows: IndexArray) -> tuple[Array, Array, Array, Array]:
    """Joints, and place, way and up of the camera, at some samples."""
    snake, frames = samples.snake, np.empty((samples.snake.links, 3, 4))
    chain, camera = np.empty((len(rows), snake.links + 1, 3)), np.empty((len(rows), 3, 4))
    for number, row in enumerate(rows.tolist()):
        snake_frames(samples.q[row], samples.base[row], snake.length_mm, frames)
        chain[number, 0], chain[number, 1:] = samples.base[row, :, 3], frames[:, :, 3]
        camera[number] = frames[-1]
    shaft, side = camera[:, :, 2], -camera[:, :, 1]
    return chain, camera[:, :, 3] + snake.camera_offset_mm * shaft, shaft, side
