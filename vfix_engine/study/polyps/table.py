"""The twelve rows of Kwok 2013, Table III, from a run of study I, and figures of ours beside them.

What the paper prints of a row's definition is in section IV.C.1 a-c; what is taken where it says nothing is said here.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..lumen.deviation import deviation_of
from .series import PolypSeries
from .task import PolypTask


@dataclass(frozen=True)
class TableIII:
    """Table III of one run, in the paper's order.

    Task efficiency. completion_time_s: from the start until the robot reaches the end of the task, None where it did
    not. travelled_mm: way of the tip, for each polyp. polyps_missed: not cleared at the end.

    Targeting error. distance_error_mm, angle_error_deg: off 15 mm and 0°, the mean over the time in which a polyp was
    viewed, then over the polyps that were; None where none was. times_missed: how often the view of a polyp was lost
    before it was cleared, the mean over the polyps.

    Deviation of the distal links from the pathway as ``Deviation`` has it: deviations: episodes. deviation_max_mm,
    deviation_mean_mm: of the deepest link. deviation_time_mean_s, deviation_time_max_s: of an episode.
    deviation_length_mm: way of the tip while the last link is outside.
    """

    completion_time_s: float | None
    travelled_mm: float
    polyps_missed: int
    distance_error_mm: float | None
    angle_error_deg: float | None
    times_missed: float
    deviations: int
    deviation_max_mm: float
    deviation_mean_mm: float
    deviation_time_mean_s: float
    deviation_time_max_s: float
    deviation_length_mm: float

    def to_dict(self) -> dict[str, float | None]:
        """By name, JSON's types."""
        return asdict(self)


# Table III as printed: mean and standard deviation of 12 people without and with the paper's control.
PRINTED = {
    "completion_time_s": ((333.8, 94.78), (143.9, 11.15)),
    "travelled_mm": ((543.5, 191.0), (114.9, 22.60)),
    "polyps_missed": ((0.33, 0.65), (0.0, 0.0)),
    "distance_error_mm": ((2.63, 0.67), (1.68, 0.40)),
    "angle_error_deg": ((7.64, 1.76), (4.76, 0.81)),
    "times_missed": ((1.87, 0.90), (1.20, 0.50)),
    "deviations": ((63.08, 27.39), (34.00, 7.05)),
    "deviation_max_mm": ((33.66, 6.22), (10.72, 4.98)),
    "deviation_mean_mm": ((7.30, 2.30), (2.21, 0.81)),
    "deviation_time_mean_s": ((3.99, 2.46), (0.43, 0.12)),
    "deviation_time_max_s": ((54.08, 35.13), (3.07, 2.55)),
    "deviation_length_mm": ((4268.0, 1585.0), (372.9, 144.6)),
}


def table_iii(series: PolypSeries) -> TableIII:
    """The rows of a run."""
    task, progress = series.task, series.progress
    viewed = [viewing for viewing in progress.viewings if viewing.viewed_s > 0.0]
    distance = [viewing.distance_mm_s / viewing.viewed_s for viewing in viewed]
    angle = [viewing.angle_deg_s / viewing.viewed_s for viewing in viewed]
    off = deviation_of(series.deviation, series.dt, series.tip_step)
    return TableIII(
        completion_time_s=None if progress.reached_t is None else progress.reached_t - series.start_t,
        travelled_mm=float(series.tip_step.sum()) / len(task.polyps),
        polyps_missed=len(task.polyps) - progress.cleared,
        distance_error_mm=float(np.mean(distance)) if viewed else None,
        angle_error_deg=float(np.mean(angle)) if viewed else None,
        times_missed=float(np.mean([viewing.lost for viewing in progress.viewings])),
        deviations=off.episodes,
        deviation_max_mm=0.0 if off.depth_mm is None else off.depth_mm.max,
        deviation_mean_mm=0.0 if off.depth_mm is None else off.depth_mm.mean,
        deviation_time_mean_s=off.time_s / off.episodes if off.episodes else 0.0,
        deviation_time_max_s=off.longest_s,
        deviation_length_mm=off.length_mm,
    )


def beyond_bound_mm(series: PolypSeries) -> float:
    """The most that any link was beyond its bound; 0 where none was."""
    return float(max(series.beyond_bound.max(initial=-np.inf), 0.0))


def polyp_table(series: PolypSeries) -> list[dict[str, float | int | bool | None]]:
    """Of each polyp its place, whether it was cleared and when, and the means of Table III."""
    return [_polyp(series.task, index, series) for index in range(len(series.task.polyps))]


def _polyp(task: PolypTask, index: int, series: PolypSeries) -> dict[str, float | int | bool | None]:
    viewing = series.progress.viewings[index]
    seen = viewing.viewed_s > 0.0
    return {
        "s_mm": task.polyps[index].s_mm,
        "cleared": viewing.cleared_t is not None,
        "cleared_s": None if viewing.cleared_t is None else viewing.cleared_t - series.start_t,
        "viewed_s": viewing.viewed_s,
        "distance_error_mm": viewing.distance_mm_s / viewing.viewed_s if seen else None,
        "angle_error_deg": viewing.angle_deg_s / viewing.viewed_s if seen else None,
        "times_missed": viewing.lost,
    }
