"""Immutable view of a system after a step, for display at display rate."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array


@dataclass(frozen=True)
class Timing:
    """Timing of the real-time loop: rate in Hz, step times and latency in µs, number of late ticks.

    real_time: the loop has a real-time priority; without_why: reason why not, '' if it has one or is at rest.
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
    """One reason why the system moves less than the command asks; a value, which the display puts into words.

    kind: of the constraint, such as 'bone', 'zone', 'joint', 'speed', 'bound', 'end'.
    structure: id of the structure or zone, or name of the joint; '' if there is none.
    part: of the tool or robot, such as 'shaft' or 'link 12'; distance_mm: NaN if there is none.
    point: (3,) in LPS mm on the structure, None if there is none.
    words: a sentence provided by the world, if any.
    """

    kind: str
    structure: str = ""
    part: str = ""
    distance_mm: float = float("nan")
    point: Array | None = None
    words: str = ""


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """Fields common to all worlds; a world adds its own in a subclass.

    t: simulated time in s; q: joints (n,) in mm and rad; steps: control periods since the start.
    capsules: (S, 7) axis start (3), end (3) and radius of every part of the robot or tool, LPS mm.
    tip: (3,) in LPS mm; camera: (4, 4) transform_camera_to_patient, z along the optical axis, x to the right.
    outcome: of the last step: 'idle', 'moved', 'shrunk' (a fraction of the request) or 'held'.
    blockers: constraints that reduced or held it, strongest first.
    forces: (3,) in N on the operator's hand.
    progress_mm, length_mm: arc length along the path or lumen, and its total; 0 if there is none.
    certified: every motion of this world is certified before it is made; False unless its system says so.
    running, timing: filled in by the loop.

    No field has a default in the class, so that a subclass can compute all of them on demand.
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
    certified: bool = field(default_factory=bool)
    running: bool = field(default_factory=bool)
    timing: Timing = field(default_factory=Timing)
