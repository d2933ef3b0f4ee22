"""Colours of protected structures are told from all else that the slices draw, by every common kind of eye."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.cases.segments import OUTLINE_COLOUR
from app.plans.zones import COLOURS
from app.scene import palette
from app.tabs.plan.regions import REMOVED_COLOUR
from vfix_engine.arrays import Array

PANE = Path(__file__).parents[3] / "app/web/js/slices/pane.js"
TOOL, MARGIN, GHOST, _ = re.findall(r"(?:tool|ring): \"(#[0-9a-f]{6})\"", PANE.read_text())
OTHERS = {
    "bone": OUTLINE_COLOUR,
    "path": palette.hex_colour(palette.ACCENT),
    "line of the path": "#ffffff",
    "target": palette.hex_colour(palette.TARGET),
    "tool": TOOL,
    "tool of another run": GHOST,
    "margin": MARGIN,
    "removed bone": REMOVED_COLOUR,
}
# Machado, Oliveira and Fernandes (2009), severity 1, of linear RGB.
EYES = {
    "normal": np.eye(3),
    "protan": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deutan": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]]
    ),
    "tritan": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]]
    ),
}
LEAST = 20.0  # CIE76 difference; that of the amber that structures had to the bone's outline is 5


def seen(code: str, eye: Array) -> Array:
    """CIELAB of a colour as an eye sees it."""
    rgb = np.array([int(code[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    linear = np.clip(eye @ np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4), 0.0, 1.0)
    shown = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    lab: Array = cv2.cvtColor(shown.astype(np.float32).reshape(1, 1, 3), cv2.COLOR_RGB2LAB)[0, 0].astype(np.float64)
    return lab


@pytest.mark.parametrize("eye", EYES)
def test_structures_have_colours_of_their_own(eye: str) -> None:
    for colour in COLOURS:
        for name, other in OTHERS.items():
            away = float(np.linalg.norm(seen(colour, EYES[eye]) - seen(other, EYES[eye])))
            assert away > LEAST, f"{colour} is near the colour of {name} to {eye} eyes: {away:.0f}"
