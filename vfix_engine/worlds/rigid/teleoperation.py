"""Teleoperation: a master far from the tool, its motion instead of a force on the grip.

Li 2007, section V.F reads a device that cannot move (a SpaceBall, pushed against its own springs), and puts its three
translations τ in f's place in (10)-(11). A master that can move is coupled to the tool by a spring instead:

- its motion, scaled, leads a point ahead of the tool's own; the *lag* ℓ is what the tool has not followed yet;
- τ = stiffness · ℓ takes f's place in (10)-(11) and in the torque of (24);
- −τ is reflected to the master. The lag is cut where the spring reaches the force cap, so that the force is bounded
  and a master pushed into a virtual fixture winds nothing up;
- what the tool moves is taken off the lag, so that every motion ends where the master has stopped.

With an open clutch there is no spring: the master can be put elsewhere while the tool is at rest.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...control.admittance import saturate
from ...kernels.triples import triple
from ...runtime.command import Master

__all__ = ["Master", "advance_leader", "consume_motion", "spring"]


MAX_INCREMENT_MM = 50.0  # more than this within one period is an error of the sender, not a motion


def advance_leader(lag: Array, master: Master, settings: ControlSettings) -> Array:
    """The lag (3,) in mm after the master's motion, bounded by the force cap; nothing with an open clutch.

    An increment that is no number or too large counts as none (HAZ-05).
    """
    if not master.clutch:
        return np.zeros(3)
    increment = np.asarray(master.increment, dtype=float)
    if increment.shape != (3,) or not np.isfinite(increment).all() or np.abs(increment).max() > MAX_INCREMENT_MM:
        increment = np.zeros(3)
    most = settings.force_cap_n / settings.master_stiffness_n_per_mm
    return np.array(saturate(triple(lag + settings.master_scale * increment), most))


def spring(lag: Array, settings: ControlSettings) -> Array:
    """τ (3,) in N: what pulls the tool, and with the other sign the master."""
    return settings.master_stiffness_n_per_mm * lag


def consume_motion(lag: Array, moved: Array, guided: bool) -> Array:
    """The lag (3,) after the tool's point has ``moved`` (3,) in mm.

    guided: the fixture chose the direction (an approach): then the length of the displacement is what counts,
    or a master at rest would pull the tool for ever.
    """
    if not guided:
        return lag - moved
    length = float(np.linalg.norm(lag))
    return lag * max(0.0, 1.0 - float(np.linalg.norm(moved)) / length) if length > 0.0 else lag
