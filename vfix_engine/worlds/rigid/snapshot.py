"""Snapshot of a rigid tool after a step, for the page and the recorder."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...arrays import Array
from ...runtime import snapshot as of_any_world
from ...runtime.snapshot import Timing

__all__ = ["RigidSnapshot", "Timing"]


@dataclass(frozen=True, kw_only=True)
class RigidSnapshot(of_any_world.Snapshot):
    """The fields of every world, and those of the rigid tool: positions (3,) in LPS mm, force in N, torque in N·mm.

    phase: 'approach', 'follow', 'done', 'inspect_approach', 'inspect_hold' or 'free'.
    held: the hand pushes and the tool does not move; slowed: it moves less than commanded; reason says why, in words.
    active: in words, every constraint that acts on the step, strongest first, also where it costs no motion.
    clearance_mm: of the whole tool, exact up to threshold_mm.
    target_error_mm: |P_v − P_t|, NaN outside inspection.
    emergencies: steps so far that had to exceed a joint's acceleration limit.
    teleoperated: a master drives; ``reflection`` is the force on it then, no more than the force cap.
    """

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
    target_error_mm: float
    rows: int
    emergencies: int = field(default_factory=int)
    teleoperated: bool = field(default_factory=bool)

    @property
    def segments_start(self) -> Array:
        """(S, 3) starts of the tool's axis segments, from the tip on."""
        return self.capsules[:, :3]

    @property
    def segments_end(self) -> Array:
        """(S, 3) their ends."""
        return self.capsules[:, 3:6]

    @property
    def radius(self) -> Array:
        """(S,) radii of the segments."""
        return self.capsules[:, 6]

    @property
    def reflection(self) -> Array:
        """(3,) in N, force on a master; another name of ``forces``."""
        return self.forces
