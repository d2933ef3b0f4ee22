"""The frozen picture of a system after a step: what is displayed, at display rate."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array


@dataclass(frozen=True)
class Timing:
    """How the real-time loop keeps its period: rate in Hz, step times and lateness in µs, late ticks counted.

    real_time: the loop has a real-time priority; without_why: why it drives without one, '' where it has one or rests.
    """

    loop_hz: float = 0.0
    step_us: float = 0.0
    step_us_p99: float = 0.0
    lateness_us_p50: float = 0.0
    lateness_us_p99: float = 0.0
    overruns: int = 0
    real_time: bool = False
    without_why: str = ""


@dataclass(frozen=True, eq=False)
class Blocker:
    """One reason why less is moved than the command asks for; a value, words are for whoever shows it.

    kind: what kind of constraint, such as 'bone', 'zone', 'joint', 'speed', 'bound', 'end'.
    structure: id of the structure or zone, or name of the joint; '' where there is none.
    part: of the tool or robot, such as 'shaft' or 'link 12'; distance_mm: NaN where there is none.
    point: (3,) in LPS mm on the structure, None where there is none.
    words: a sentence of the world itself, where it has one.
    """

    kind: str
    structure: str = ""
    part: str = ""
    distance_mm: float = float("nan")
    point: Array | None = None
    words: str = ""


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """What every world tells of its state; a world adds fields of its own in a subclass.

    t: simulated time in s; q: joints (n,) in mm and rad; steps: control periods since the start.
    capsules: (S, 7) axis start (3), end (3) and radius of every body part of the robot or tool, LPS mm.
    tip: (3,) in LPS mm; camera: (4, 4) transform_camera_to_patient, z along the optical axis, x to the right.
    outcome: of the last step: 'idle', 'moved', 'shrunk' (part of what was asked for) or 'held'.
    blockers: what shrank or held it, strongest first.
    forces: (3,) in N on the operator's hand.
    progress_mm, length_mm: arc length along the path or lumen, and the whole of it; 0 where there is none.
    running, timing: filled in by the loop.

    No field has a default in the class itself, so that a subclass can make all of them when they are asked for.
    """

    t: float
    q: Array
    capsules: Array
    tip: Array
    camera: Array
    outcome: str
    progress_mm: float
    length_mm: float
    steps: int
    blockers: tuple[Blocker, ...] = field(default_factory=tuple)
    forces: Array = field(default_factory=lambda: np.zeros(3))
    running: bool = field(default_factory=bool)
    timing: Timing = field(default_factory=Timing)
