"""Snapshot of a driven snake after a step, at display rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...runtime.snapshot import Snapshot


class AtHand(NamedTuple):
    """What the operator of a driven snake has before his eyes and in his hand after a step, and how far it is inserted.

    camera: (4, 4) transform_camera_to_patient. forces: (2,) in N, x to the right and y down in the picture.
    progress_mm: arc length of the tip. All are as in ``SnakeSnapshot``, which takes ten times as long.
    """

    t: float
    camera: Array
    forces: Array
    progress_mm: float


@dataclass(frozen=True, kw_only=True)
class SnakeSnapshot(Snapshot):
    """The snake's own part; ``forces`` are (x, y, 0) in the axes of the camera's picture, x to the right, y down.

    arm: 'manual', 'guided' or 'certified', as in ``DriveSettings``; ``certified`` in the last only. hand_joint: that a
    manual hand turns, 1: the last.
    mode: 'inserting' or 'looking', by the last command. doing: 'straighten', 'bend', 'look' or '', as requested.
    bend: r of the distal links, about 1 where they can bend no further; straight: they have the conforming shape.
    can_look: all manipulated links are inside, so the camera can be steered.
    deviations, bounds: (L,) in mm, of each link; 0 and infinity for links that are still outside.
    resistance, guidance: (2,) in N, the two parts of the force on the hand (Kwok 2013, eq. 31-35).
    tissue_age_s: age of the pathway in use; 0 where nothing moves. following: the shape follows the tissue.
    control_bends: (4 or 8, L' + 1, 3) mm, the joints and the tip of the distal links in each control bend (10)-(20) of
    the robot's present place; (0, L' + 1, 3) where there is none, as under another control.
    looked_deg: (8,) angle of the view in each direction in the last or present look-round, clockwise from the
    right of the straight view's picture.
    """

    arm: str
    hand_joint: int
    mode: str
    doing: str
    bend: float
    straight: bool
    can_look: bool
    links_inside: int
    deviations: Array
    bounds: Array
    resistance: Array
    guidance: Array
    tissue_age_s: float
    following: bool
    looked_deg: Array
    control_bends: Array

    @property
    def eye(self) -> Array:
        """(3,) mm, of the camera."""
        place: Array = self.camera[:3, 3]
        return place

    @property
    def shaft(self) -> Array:
        """(3,) unit vector, the way that the camera looks."""
        ahead: Array = self.camera[:3, 2]
        return ahead

    @property
    def side(self) -> Array:
        """(3,) unit vector, up in the camera's picture."""
        up: Array = -self.camera[:3, 1]
        return up

    @property
    def guidance_force(self) -> Array:
        """(3,) N, ``guidance`` as ``forces`` are told."""
        return np.append(self.guidance, 0.0)
