"""What the papers' figures show: one trial of each mode over time, thinned for a report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...arrays import Array
from ..path_plane import PathPlane
from .apparatus import apparatus
from .figures import Recorded
from .measured import ErrorSizes, robot_frame_error, tracked, true_frame_error
from .trials import TrialKey

SAMPLES = 150  # of a trial, at most
POSES = 24  # of the tool, for the volume that it swept


def traces(recorded: Mapping[TrialKey, Recorded], sizes: ErrorSizes, laboratory: int) -> dict[str, Any]:
    """The first trial of the first subject in each mode, and the path in the same plane.

    path: (m, 2) in mm, in the plane of the path as ``PathPlane.flat``; target: (2,) there. trials: by mode, with
    ``t_s`` and of n samples: ``progress_mm`` along the path, ``flat_mm`` (n, 2) of the tip by encoders, ``seen_mm``
    (n, 2) by the tracker, ``error_mm`` by encoders, ``seen_error_mm`` by the tracker, ``speed`` (7, n) of the joints in
    mm/s and rad/s, and of inspection ``off_mm`` and ``seen_off_mm`` (n, 3), from the target. tool: (p, k, 2) axis of
    the tool in p poses.
    """
    path, target = apparatus().path, apparatus().scene.targets[0]
    plane = PathPlane.of(path)
    every = np.linspace(0, len(plane.curve) - 1, min(SAMPLES, len(plane.curve))).astype(int)
    first = {key.mode: one for key, one in recorded.items() if key.subject == 0 and key.trial == 0}
    return {
        "path": _plain(plane.curve[every]),
        "target": _plain(plane.flat(target[None])[0]),
        "trials": {mode: _trace(one, plane, sizes, laboratory) for mode, one in sorted(first.items())},
    }


def _trace(recorded: Recorded, plane: PathPlane, sizes: ErrorSizes, laboratory: int) -> dict[str, Any]:
    trial, target = recorded.trial, apparatus().scene.targets[0]
    rows = np.linspace(0, len(trial.tip) - 1, min(SAMPLES, len(trial.tip))).astype(int)
    seen = tracked(trial, sizes, laboratory, recorded.behind_play)
    found: dict[str, Any] = {
        "t_s": _plain((rows + 1) * trial.dt_s),
        "progress_mm": _plain(trial.progress_mm[rows]),
        "flat_mm": _plain(plane.flat(trial.tip[rows])),
        "seen_mm": _plain(plane.flat(seen[rows])),
        "seen_error_mm": _plain(true_frame_error(trial, sizes, laboratory, recorded.behind_play)[rows]),
    }
    if trial.key.mode == "inspection":
        found |= {"off_mm": _plain(trial.tip[rows] - target), "seen_off_mm": _plain(seen[rows] - target)}
    if trial.q.shape[1]:
        speed = np.gradient(trial.q, trial.dt_s, axis=0)[rows]
        found |= {
            "error_mm": _plain(robot_frame_error(trial, sizes, laboratory)[rows]),
            "speed": _plain(speed.T),
            "tool": _plain(_tool(trial.q[np.linspace(0, len(trial.q) - 1, POSES).astype(int)], plane)),
        }
    return found


def _tool(joints: Array, plane: PathPlane) -> Array:
    """Axis (p, k, 2) of the tool in the plane, from the tip on, for joints (p, 7)."""
    scene = apparatus().scene
    robot = scene.placed_robot()
    found = []
    for q in joints:
        parts = scene.tool.segments(*robot.tip_pose(q))
        found.append(plane.flat(np.vstack([parts.end[:1], parts.start])))
    return np.array(found)


def _plain(values: Array) -> Any:
    return np.round(values, 4).tolist()
