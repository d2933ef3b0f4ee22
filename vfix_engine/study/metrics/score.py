"""The score of one run: error, time, smoothness, contacts, clearance, holds, and inspection of targets."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Array, BoolArray
from ...errors import InputError
from ...runtime.command import COMMAND_COLUMNS, POSITION, RATE
from ...runtime.requests import SetTask
from ...runtime.run import Run
from ...runtime.system import SystemSpec
from ...validate import rigid_transform
from ...worlds.registry import is_certified, spec_of
from ...worlds.rigid.requests import ApproachPoint
from ...worlds.rigid.row import PHASES
from ..error_chain import ErrorChain
from .held import HELD, held_by
from .samples import Samples, samples_of
from .smoothness import filter_words, log_dimensionless_jerk, spectral_arc_length
from .true_frame import true_frame

PATH_WINDOW_MM = 5.0  # the nearest point of the path is searched this far from the recorded one, on the same branch
_COMMAND_NAMES = [name for name, _ in COMMAND_COLUMNS]
_LED = {"hand": 0.0, "position": POSITION, "rate": RATE}
_ON_PATH = [PHASES.index(name) for name in ("follow", "done")]
_APPROACH = PHASES.index("approach")
_PATH = [_APPROACH, *_ON_PATH]
_ON_TARGET = PHASES.index("inspect_hold")


@dataclass(frozen=True)
class MeanMax:
    """Mean and maximum over the samples."""

    mean: float
    max: float


@dataclass(frozen=True)
class Errors:
    """An error in mm: where the run has the tool (``robot_frame``), and where the tool truly was (``true_frame``)."""

    robot_frame: MeanMax
    true_frame: MeanMax


@dataclass(frozen=True)
class Approach:
    """The samples before the tip followed the path: their duration, and the tip's way in them."""

    time_s: float
    path_length_mm: float


@dataclass(frozen=True)
class PartContacts:
    """Contacts of one part of the tool with one structure: how many, the deepest, and their duration together."""

    structure: str
    part: str
    count: int
    max_depth_mm: float
    time_s: float


@dataclass(frozen=True)
class HeldTime:
    """Duration for which a constraint held the tool; ``kind``, ``structure`` and ``part`` as in ``Blocker``."""

    kind: str
    structure: str
    part: str
    time_s: float


@dataclass(frozen=True)
class RunScore:
    """The metrics of a run; docs/metrics.md defines each. Lengths in mm, angles in degrees, times in s.

    mode: 'freehand', 'hands-on' or 'teleoperated', 'mixed' where it was changed on the way, as in the manifest; None in
        a world that has none. certified: no motion was made without the certificate, False where the world is not
        known. whole: the run was recorded to its end; lost: steps that it lacks, which no figure counts.
    led_by: shares of the samples by what led the tool: 'hand', 'position' of a master, 'rate' of a device.
    path_error_mm: None where no sample follows a path; target_error_mm and angle_deg: None without inspection.
    path_length_mm, spectral_arc_length, log_dimensionless_jerk: of the tip after the approach; the last two None where
        they are not defined.
    least_clearance_mm: by structure, negative where it was entered; cut at the boundary threshold.
    held_by: None where a held step, made anew, ends at another pose, as with another version of the control.
    truth: figures of ``TrueFrame.report``, None without an error chain.
    """

    world: str
    mode: str | None
    certified: bool
    whole: bool
    lost: int
    led_by: dict[str, float]
    samples: int
    time_s: float
    approach: Approach
    path_error_mm: Errors | None
    path_length_mm: float
    spectral_arc_length: float | None
    log_dimensionless_jerk: float | None
    jerk_filter: str
    contacts: int
    max_depth_mm: float
    contacts_by: tuple[PartContacts, ...]
    least_clearance_mm: dict[str, float]
    held_s: float
    held_by: tuple[HeldTime, ...] | None
    target_error_mm: Errors | None
    angle_deg: float | None
    truth: dict[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


class _Tool(NamedTuple):
    """The tool in one frame: tips (n, 3), and rotations (n, 3, 3) there."""

    tip: Array
    rotation: Array


def score_run(
    run: Run,
    spec: SystemSpec | None = None,
    transform_believed_to_true: Array | None = None,
    errors: ErrorChain | None = None,
) -> RunScore:
    """Score a run of a rigid tool, from its last return to the start on.

    Args:
        spec: that the run was driven with; None: made of its manifest.
        transform_believed_to_true: (4, 4) rigid, from where the run has the tool to where it truly was, such as the
            error of a registration; None: both are the same.
        errors: the chain from one to the other, instead of a transform.

    Raises:
        InputError: the run cannot be read as ``samples_of`` says, its spec is not in the manifest, the transform is
            not rigid, or both a transform and errors are given.
    """
    spec = spec_of(run) if spec is None else spec
    samples = samples_of(run, spec)
    believed = true = _Tool(samples.believed, samples.rotation)
    truth = None
    if errors is not None:
        if transform_believed_to_true is not None:
            raise InputError("a score has errors or a transform, not both")
        frame = true_frame(run, spec, samples, errors)
        true, truth = _Tool(frame.tip, frame.rotation), frame.report()
    elif transform_believed_to_true is not None:
        moved = rigid_transform(transform_believed_to_true, "the transform")
        true = _Tool(believed.tip @ moved[:3, :3].T + moved[:3, 3], moved[:3, :3] @ believed.rotation)
    world = str(run.manifest["world"])
    task = _task(samples)
    rate = 1.0 / float(np.median(samples.period_s[task]))
    speed = _steps(samples.tip[task]) * rate
    contacts = contacts_of(samples)
    held = samples.outcome == HELD
    return RunScore(
        world=world,
        mode=run.mode,
        certified=is_certified(run.manifest),
        whole=run.whole,
        lost=run.lost,
        led_by=_led_by(run, samples),
        samples=len(samples.tip),
        time_s=float(samples.period_s.sum()),
        approach=Approach(
            float(samples.period_s[: task.start].sum()), float(_steps(samples.tip[: task.start + 1]).sum())
        ),
        path_error_mm=_path_error(run, samples, believed, true),
        path_length_mm=float(_steps(samples.tip[task]).sum()),
        spectral_arc_length=_number(spectral_arc_length(speed, rate)),
        log_dimensionless_jerk=_number(log_dimensionless_jerk(speed, rate)),
        jerk_filter=filter_words(rate),
        contacts=sum(one.count for one in contacts),
        max_depth_mm=max((one.max_depth_mm for one in contacts), default=0.0),
        contacts_by=contacts,
        least_clearance_mm={
            name: float(samples.distance[:, body].min()) for body, name in enumerate(samples.structures)
        },
        held_s=float(samples.period_s[held].sum()),
        held_by=_held_by(run, spec, samples),
        target_error_mm=_target_error(samples, believed, true),
        angle_deg=_angle(samples),
        truth=truth,
    )


def contacts_of(samples: Samples) -> tuple[PartContacts, ...]:
    """Contacts by structure and part of the tool: uninterrupted sequences of samples in which they overlap."""
    found = []
    for body, structure in enumerate(samples.structures):
        for part, name in enumerate(samples.tool.segment_names):
            distance = samples.distance[:, body, part]
            inside = distance < 0.0
            if inside.any():
                count = int(inside[0]) + int((inside[1:] & ~inside[:-1]).sum())
                time = float(samples.period_s[inside].sum())
                found.append(PartContacts(structure, name, count, -float(distance.min()), time))
    return tuple(found)


def _task(samples: Samples) -> slice:
    """The samples without the approach: from the first that follows the path on, all where the run follows none."""
    following = np.flatnonzero(np.isin(samples.phase, _ON_PATH))
    first = int(following[0]) if len(following) and np.isin(samples.phase[: following[0]], _PATH).all() else 0
    return slice(first, len(samples.tip))


def _follows(run: Run, samples: Samples) -> BoolArray:
    """(n,) whether a sample follows the path, or is brought back to it where the tip was pushed off.

    An approach with which the task begins, or to a chosen place of the path, does not follow it.
    """
    asked = {event.at - samples.first for event in run.events if isinstance(event.content, (ApproachPoint, SetTask))}
    follows = np.isin(samples.phase, _ON_PATH)
    for row in np.flatnonzero(samples.phase == _APPROACH).tolist():
        follows[row] = row > 0 and follows[row - 1] and row not in asked
    return follows


def _path_error(run: Run, samples: Samples, believed: _Tool, true: _Tool) -> Errors | None:
    """Distance of the tip to the path over the samples that follow it."""
    path = samples.path
    rows = np.flatnonzero(_follows(run, samples))
    if path is None or not len(rows):
        return None

    def errors(places: Array) -> MeanMax:
        away = []
        for place, tip, s in zip(places, believed.tip[rows], samples.path_s[rows], strict=True):
            window = PATH_WINDOW_MM + float(np.linalg.norm(place - tip))
            away.append(float(np.linalg.norm(path.closest(place, float(s), window)[1] - place)))
        return _mean_max(np.array(away))

    return Errors(*_both(errors, believed.tip[rows], true.tip[rows]))


def _target_error(samples: Samples, believed: _Tool, true: _Tool) -> Errors | None:
    """Distance of the inspected target to the point that the tool holds on it."""
    rows = samples.phase == _ON_TARGET
    if not rows.any():
        return None
    goals = samples.targets[samples.target[rows]]
    points = [samples.view_point_of(*one)[rows] for one in (believed, true)]
    return Errors(*_both(lambda places: _mean_max(np.linalg.norm(places - goals, axis=1)), *points))


def _both(errors: Callable[[Array], MeanMax], believed: Array, true: Array) -> tuple[MeanMax, MeanMax]:
    """Errors of the places (n, 3) in both frames."""
    first = errors(believed)
    return first, first if np.array_equal(believed, true) else errors(true)


def _angle(samples: Samples) -> float | None:
    """Largest rotation of the tool on a target from its pose when the target was reached, in degrees."""
    turned = []
    for target in np.unique(samples.target[samples.phase == _ON_TARGET]):
        rotation = samples.rotation[(samples.phase == _ON_TARGET) & (samples.target == target)]
        cosine = (np.einsum("ij,nij->n", rotation[0], rotation) - 1.0) / 2.0
        turned.append(float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)).max())))
    return max(turned, default=None)


def _held_by(run: Run, spec: SystemSpec, samples: Samples) -> tuple[HeldTime, ...] | None:
    """Time by constraint, the strongest of each held step."""
    time: dict[tuple[str, str, str], float] = defaultdict(float)
    places = np.flatnonzero(samples.outcome == HELD)
    for place, one in zip(places, held_by(run, spec, samples, places), strict=True):
        if one is None:
            return None
        time[one.kind, one.structure, one.part] += float(samples.period_s[place])
    return tuple(HeldTime(*key, seconds) for key, seconds in sorted(time.items(), key=lambda item: -item[1]))


def _led_by(run: Run, samples: Samples) -> dict[str, float]:
    """Shares of the samples that a hand, a master's position or a rate device led."""
    device = run.ticks[samples.first :, _COMMAND_NAMES.index("master")]
    return {name: float((device == value).mean()) for name, value in _LED.items()}


def _steps(tip: Array) -> Array:
    """(n − 1,) distances between neighbouring samples."""
    return np.asarray(np.linalg.norm(np.diff(tip, axis=0), axis=1))


def _mean_max(values: Array) -> MeanMax:
    return MeanMax(float(values.mean()), float(values.max()))


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value
