"""What a tracker measures of recorded trials: the error chain of an experiment, and how it is drawn.

    x_true = T_session (play(q) + C (f + weight))      the tip where it is, in the tracker's frame
    seen   = x_true + tracker                          per sample

The reference curve of both papers is the trace of a tracker's pointer, so errors of tracing are in no mode, and the
registration of the skull carries trace and robot alike. What is left of it is T_session, the error of the robot in the
tracker's frame, by its calibration and registration ("the two main sources of tip motion error", Li 2004, V): a shift
at the target, and a turn about it. A free hand has no robot, and only the tracker.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array
from ..error_chain import ErrorChain
from ..error_chain.stages import EncoderError, RegistrationError
from ..error_chain.true_tool import Sample, TrueTool
from .apparatus import PAPERS, StudyCase, apparatus
from .trials import MODES, Trial, seeds

STATION_MM = 0.02  # of the polyline that stands for the path when distances are measured
_SESSION, _TRACKER, _SERVO = 1, 2, 3  # in the names of seeds, behind a subject's number


@dataclass(frozen=True)
class ErrorSizes:
    """Sizes of an experiment's errors.

    shift_mm, turn_rad: standard deviations per axis of T_session at the target.
    compliance_mm_per_n: C; weight_n: of the hand that rests on the handle.
    backlash_mm, backlash_rad: full width, of prismatic and revolute joints.
    tracker_mm: standard deviation per axis and sample. servo_mm: rms in 3-D, every 5 mm of travel and straight in
    between, of what a position servo leaves, seen by the encoders. by_subject: T_session is drawn anew for each
    subject, else once.
    """

    shift_mm: float
    turn_rad: float
    compliance_mm_per_n: float = 0.1
    weight_n: float = 1.5
    backlash_mm: float = 0.2
    backlash_rad: float = 1e-3
    tracker_mm: float = 0.1
    servo_mm: float = 0.0
    by_subject: bool = True

    def by_encoders(self) -> ErrorSizes:
        """What shows in the encoders, mapped to the CT: the registration alone, as in Li 2004."""
        return replace(self, compliance_mm_per_n=0.0, backlash_mm=0.0, backlash_rad=0.0, tracker_mm=0.0)


SERVO_TRAVEL_MM = 5.0  # assumed: of stick and slip


@functools.cache
def _stations(case: StudyCase) -> tuple[cKDTree, Array]:
    path = apparatus(*case).path
    places = path.position(np.linspace(0.0, path.length, round(path.length / STATION_MM)))
    return cKDTree(places), places


def off_path(points: Array, case: StudyCase = PAPERS) -> Array:
    """Distances (n,) of points (n, 3) to the reference curve of a case."""
    tree, places = _stations(case)
    nearest = tree.query(points)[1]
    found = np.full(len(points), np.inf)
    for first in (nearest - 1, nearest):  # the two parts of the polyline that meet there
        start, end = places[np.clip(first, 0, len(places) - 2)], places[np.clip(first, 0, len(places) - 2) + 1]
        way = end - start
        share = np.clip(np.einsum("ij,ij->i", points - start, way) / np.einsum("ij,ij->i", way, way), 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(points - start - share[:, None] * way, axis=1))
    return found


def session(sizes: ErrorSizes, study: int, subject: int, case: StudyCase = PAPERS) -> RegistrationError:
    """T_session of a subject's session in the laboratory of a study, with a case."""
    number = subject if sizes.by_subject else 0
    random = np.random.default_rng(seeds(study, number, 0, _SESSION))
    shift, turn = random.standard_normal((2, 3))
    target = apparatus(*case).scene.targets[0]
    return RegistrationError(_triple(sizes.shift_mm * shift), _triple(sizes.turn_rad * turn), _triple(target))


def played(trial: Trial, sizes: ErrorSizes) -> Array:
    """The tip (n, 3) behind the play of the joints; of a free hand the tip itself."""
    if not trial.q.shape[1] or not (sizes.backlash_mm or sizes.backlash_rad):
        return trial.tip
    around = apparatus(*trial.case)
    chain = ErrorChain(encoders=EncoderError(backlash_mm=sizes.backlash_mm, backlash_rad=sizes.backlash_rad))
    tool, none = TrueTool(chain, around.scene.tool, around.scene.placed_robot()), np.zeros(3)
    turned = np.eye(3)
    samples = (
        Sample(i * trial.dt_s, i, q, tip, turned, None, none)
        for i, (q, tip) in enumerate(zip(trial.q, trial.tip, strict=True))
    )
    return np.array([tool.at(sample).true for sample in samples])


def robot_frame_error(trial: Trial, sizes: ErrorSizes, study: int) -> Array:
    """Errors (n,) by the encoders: what control leaves, and with ``servo_mm`` what the servo leaves."""
    if not sizes.servo_mm:
        return trial.error_mm
    random = np.random.default_rng(
        seeds(study, trial.key.subject, trial.key.trial + 1, _SERVO, MODES.index(trial.key.mode))
    )
    travel = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(trial.tip, axis=0), axis=1))])
    knots = np.arange(0.0, travel[-1] + 2 * SERVO_TRAVEL_MM, SERVO_TRAVEL_MM)
    values = random.standard_normal((len(knots), 3)) / np.sqrt(3.0)
    off = np.column_stack([np.interp(travel, knots, values[:, axis]) for axis in range(3)])
    return off_path(trial.tip + sizes.servo_mm * off, trial.case)


def tracked(trial: Trial, sizes: ErrorSizes, study: int, behind_play: Array | None = None) -> Array:
    """Places (n, 3) of the tip by the tracker, of a trial in the laboratory of a study; LPS mm.

    behind_play: (n, 3) of ``played``, where it is known: it does not depend on the laboratory.
    """
    key = trial.key
    tip = played(trial, sizes) if behind_play is None else behind_play
    if trial.q.shape[1]:
        force = trial.force + np.array([0.0, sizes.weight_n, 0.0]) * trial.force.any(axis=1, keepdims=True)
        motion = session(sizes, study, key.subject, trial.case).transform
        tip = (tip + sizes.compliance_mm_per_n * force) @ motion[:3, :3].T + motion[:3, 3]
    random = np.random.default_rng(seeds(study, key.subject, key.trial + 1, _TRACKER, MODES.index(key.mode)))
    return np.asarray(tip + sizes.tracker_mm * random.standard_normal(tip.shape))


def true_frame_error(trial: Trial, sizes: ErrorSizes, study: int, behind_play: Array | None = None) -> Array:
    """Errors (n,) by the tracker, of a trial in the laboratory of a study; behind_play: as of ``tracked``."""
    seen = tracked(trial, sizes, study, behind_play)
    if trial.key.mode == "inspection":
        return np.asarray(np.linalg.norm(seen - apparatus(*trial.case).scene.targets[0], axis=1))
    return off_path(seen, trial.case)


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
