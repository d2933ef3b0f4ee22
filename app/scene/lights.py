"""Lights of the head: soft ambient light, and a key light from the upper left front that shows the relief of bone."""

from __future__ import annotations

import numpy as np
import viser

from app.scene import shapes
from vfix_engine.proximity.axes import rotation_z_to

# name, direction the light comes from (LPS), colour, intensity
_LIGHTS = (
    ("key", (0.35, -0.62, 0.85), (255, 246, 232), 2.7),
    ("fill", (-0.9, -0.6, 0.1), (208, 224, 255), 0.7),
    ("back", (0.1, 0.9, 0.35), (226, 234, 255), 0.9),
    ("below", (0.0, -0.3, -1.0), (235, 235, 245), 0.35),
)


def add_lights(scene: viser.SceneApi) -> None:
    """Replace the viewer's lights; without shadows, which reduce the frame rate and hide the nasal cavity."""
    scene.configure_default_lights(False, False)
    scene.configure_environment_map(None)  # the viewer's default environment lights everything evenly
    scene.add_light_ambient("/light/ambient", color=(255, 250, 244), intensity=0.42)
    for name, direction, colour, intensity in _LIGHTS:
        towards = np.array(direction)
        scene.add_light_directional(
            f"/light/{name}",
            color=colour,
            intensity=intensity,
            cast_shadow=False,
            wxyz=shapes.quaternion(rotation_z_to(towards)),
            position=tuple(1000.0 * towards / np.linalg.norm(towards)),
        )
