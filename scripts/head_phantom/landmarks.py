"""Known landmarks of the phantom: beads, a checked path through the nose, targets [mm, LPS]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from head_phantom.shapes import Vector


@dataclass(frozen=True)
class Bead:
    """A radio-opaque ball on the skin."""

    name: str
    centre: Vector
    radius: float = 2.0


@dataclass(frozen=True)
class Place:
    """A named point."""

    label: str
    position: Vector


BEADS = (
    Bead("forehead", (8.2, 4.9, 71.8)),
    Bead("left cheek", (51.5, 13.7, 20.6)),
    Bead("before the left ear", (72.7, 77.1, 20.4)),
    Bead("before the right ear", (-73.5, 73.3, 10.4)),
    Bead("chin", (-9.9, -7.6, -63.2)),
)

CORRIDOR = (
    Place("before the nostril", (7.5, -14.0, -6.0)),
    Place("nostril", (6.0, -11.0, 3.5)),
    Place("vestibule", (4.5, -1.5, 8.0)),
    Place("piriform aperture", (5.0, 8.0, 7.0)),
    Place("head of the inferior turbinate", (4.5, 17.5, 3.5)),
    Place("floor of the nose", (4.5, 36.5, 0.5)),
    Place("end of the inferior turbinate", (5.0, 46.0, -1.0)),
    Place("nasopharynx", (3.0, 65.0, -3.5)),
)

# Direction of the shaft of a tool with a bend of 30° at each place of the path, from the tip to the hand, and its roll
# in degrees: from `vfix plan suggest` along this path. With them the shaft passes through the nostril; without them the
# dry run takes it through the tip of the nose.
CORRIDOR_SHAFT = (
    ((-0.2, -0.876, -0.439), 56.0),
    ((-0.2, -0.876, -0.439), 56.0),
    ((-0.2, -0.876, -0.439), 83.0),
    ((-0.253, -0.895, -0.366), 109.0),
    ((-0.14, -0.95, -0.278), 139.0),
    ((0.032, -0.996, -0.082), 193.0),
    ((0.085, -0.996, -0.042), 195.0),
    ((0.045, -0.999, 0.008), 180.0),
)

TARGETS = (
    Place("maxillary ostium left", (9.2, 32.4, 19.4)),
    Place("sphenoid ostium left", (4.2, 52.0, 27.4)),
    Place("opening of the auditory tube left", (10.6, 66.5, -0.1)),
    Place("pharyngeal wall", (2.0, 74.7, -4.7)),
)

LANDMARKS = (
    Place("nasion", (0.0, 13.5, 47.5)),
    Place("rhinion", (0.0, 0.0, 31.0)),
    Place("anterior nasal spine", (0.0, -5.5, 1.0)),
    Place("posterior nasal spine", (0.0, 56.0, -9.0)),
)

# Places at which sizes are measured, on the left side.
IN_ANTRUM = np.array([25.0, 32.0, 8.0])
IN_NOSE = np.array([4.5, 36.5, 0.5])
OSTIUM_IN_ANTRUM, OSTIUM_IN_NOSE = np.array([20.5, 31.1, 18.4]), np.array([8.2, 30.5, 19.5])
OSTIUM_PLUG = np.array([12.5, 30.8, 19.1])
OSTIUM_PLUG_RADIUS = 3.0
CANINE_FOSSA_RAYS = np.array([[x, -8.0, z] for z in (5.0, 8.0, 11.0) for x in (27.0, 29.0, 31.0)])
CANINE_FOSSA_DIRECTION = np.array([-0.25, 1.0, 0.0])
