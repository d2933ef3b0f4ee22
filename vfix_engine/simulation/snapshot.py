"""The frozen picture of a rehearsal after a step: what the page draws and the recorder keeps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..runtime.snapshot import Timing

__all__ = ["Snapshot", "Timing"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Snapshot:
    """Positions (3,) and segments (S, 3) in LPS mm, force in N, torque in N·mm, q in mm and rad.

    phase: 'approach', 'follow', 'done', 'inspect_approach', 'inspect_hold' or 'free'.
    held: the hand pushes and the tool does not move; slowed: it moves less than wanted; reason says why, in words.
    active: in words, every constraint that acts on the step, strongest first, also where it costs no motion.
    clearance_mm: of the whole tool, told up to threshold_mm.
    target_error_mm: |P_v − P_t|, NaN outside inspection.
    emergencies: steps so far that had to exceed a joint's acceleration limit.
    teleoperated: a master drives; reflection: force (3,) in N that it is to feel, no more than the force cap.
    """

    t: float
    q: Array
    segments_start: Array
    segments_end: Array
    radius: Array
    tip: Array
    grip: Array
    virtual_point: Array
    force: Array
    torque: Array
    mode: str
    phase: str
    held: bool
    slowed: bool
    reason: str
    active: tuple[str, ...]
    blocking_point: Array | None
    tip_error_mm: float
    clearance_mm: float
    margin_mm: float
    threshold_mm: float
    progress_mm: float
    length_mm: float
    target_error_mm: float
    rows: int
    steps: int
    running: bool = False
    timing: Timing = field(default_factory=Timing)
    emergencies: int = 0
    teleoperated: bool = False
    reflection: Array = field(default_factory=lambda: np.zeros(3))
