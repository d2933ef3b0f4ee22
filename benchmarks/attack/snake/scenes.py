"""The lumens of the attack: pathways by formula and, if its data are available, a real colon; at rest and moving."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

from benchmarks.attack.campaign import Random
from benchmarks.cases import DEFAULT_TRIAL_DATA
from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.arrays import Array
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.geometry.curve import Curve
from vfix_engine.pathway.cavity import body_cavity
from vfix_engine.pathway.pathway import Pathway, TissueMotion
from vfix_engine.pathway.tissue_motion import breathing, peristalsis, together
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.offline.drive_lumen import Lumen, lumen_between
from vfix_engine.worlds.snake.settings import DriveSettings

BODY = (0.0, 0.3, 1.0)  # direction in which the diaphragm pushes


@dataclass(frozen=True, eq=False)
class Arena:
    """One lumen with a snake.

    tips: mm, range of the tip at the start of an episode. bounds: mm, range of b_i. curve, slack: what the snake
    conforms to, if not the pathway's own.
    """

    links: int
    pathway: Pathway
    tips: tuple[float, float]
    bounds: tuple[float, ...] = (2.0, 5.0, 8.0)
    curve: Curve | None = None
    slack: Array | None = None


def _bend(
    radius: Array | float, bend: float = 90.0, turn: float = 2.4, rise: float = 0.0, contours: int = 25
) -> Pathway:
    """Return a bend over ``turn`` rad with every second contour interpolated.

    radius: of the lumen in mm. bend: radius of the bend in mm. rise: mm per rad.
    """
    angle = np.linspace(0.0, turn, contours)
    centre = np.column_stack([bend * (1.0 - np.cos(angle)), rise * angle, bend * np.sin(angle)])
    widths = np.asarray(radius, dtype=float)
    return Pathway(centre, np.full(contours, radius) if widths.ndim == 0 else widths, 2 * contours - 1)


def _lobed(contours: int = 25, angles: int = 28) -> Array:
    psi = 2.0 * np.pi * np.arange(angles) / angles
    return 13.0 * (1.0 + 0.2 * np.cos(3.0 * psi[None, :] + 0.1 * np.arange(contours)[:, None]))


def _waisted(contours: int = 25) -> Array:
    """Return radii that are wide, narrow, wide: 18 mm and 7 mm."""
    return 12.5 + 5.5 * np.cos(np.linspace(0.0, 6.0 * np.pi, contours))


def _hairpin() -> Pathway:
    """Return two parallel straight limbs with 6 mm between them."""
    angle = np.linspace(0.0, np.pi, 9)[1:-1]
    out, back = np.linspace(0.0, 120.0, 9), np.linspace(120.0, 0.0, 9)
    x = np.concatenate([np.zeros(9), 30.0 - 30.0 * np.cos(angle), np.full(9, 60.0)])
    z = np.concatenate([out, 120.0 + 30.0 * np.sin(angle), back])
    return Pathway(np.column_stack([x, np.zeros(len(x)), z]), np.full(len(x), 27.0), 2 * len(x) - 1)


def _made(links: int, pathway: Pathway, tissue: TissueMotion | None = None, **more: object) -> Arena:
    moved = pathway if tissue is None else pathway.moved(tissue)
    return Arena(links, moved, (0.75 * min(links, 5) * 28.0, pathway.length - 5.0), **more)  # type: ignore[arg-type]


@cache
def _colon_lumen() -> Lumen | str:
    """Return the prepared real colon, cached, or why it is missing. Its data are not part of vfix."""
    folder = _colon_folder()
    surface, info = folder / "colon_surface_lps_mm.stl", folder / "colon_info.json"
    if not (surface.is_file() and info.is_file()):
        return f"the real colon is not at {folder}; VFIX_TRIAL_DATA names the folder of its data"
    marks = json.loads(info.read_text(encoding="utf-8"))["landmarks"]
    mesh = read_mesh(surface, assume=True)[0]
    return lumen_between(mesh, marks["anus"]["lps"], marks["appendix_tip"]["lps"], SnakeModel(1), DriveSettings())


def _colon_folder() -> Path:
    return Path(os.environ.get("VFIX_TRIAL_DATA", DEFAULT_TRIAL_DATA)) / "colon"


@cache
def _embedded_lumen() -> Lumen:
    """Return the prepared synthetic colon that travels with vfix, cached."""
    case = colon_case()
    return lumen_between(case.mesh, case.start, case.end, SnakeModel(1), DriveSettings())


def _colon(links: int, tissue: TissueMotion | None = None) -> Arena | str:
    lumen = _colon_lumen()
    return lumen if isinstance(lumen, str) else _in_colon(lumen, links, tissue)


def _in_colon(lumen: Lumen, links: int, tissue: TissueMotion | None) -> Arena:
    tips = (
        0.75 * min(links, 5) * 28.0,
        min(links * 28.0, lumen.curve.length) if links > 5 else lumen.curve.length - 5.0,
    )
    if tissue is not None:
        return Arena(links, lumen.pathway.moved(tissue), tips, (5.0, 8.0))
    return Arena(links, lumen.pathway, tips, (5.0, 8.0), lumen.curve, lumen.slack)


_breath = partial(breathing, BODY, falloff_s=100.0)

BUILDERS: dict[str, Callable[[Random], Arena | str]] = {
    "tube": lambda _: _made(5, _bend(12.0, 1e4, 0.03)),
    "bend": lambda _: _made(5, _bend(13.0)),
    "helix": lambda _: _made(5, _bend(13.0, rise=35.0, turn=3.0)),
    "long helix": lambda _: _made(30, _bend(14.0, 110.0, 8.0, 45.0, 70)),
    "waists": lambda _: _made(5, _bend(_waisted(), 120.0)),
    "narrow": lambda _: _made(5, _bend(4.5, 150.0, 1.8)),  # inscribed radii of less than the bounds
    "lobes": lambda _: _made(5, _bend(_lobed())),
    "cavity": lambda _: _made(5, body_cavity()),
    "hairpin": lambda _: _made(5, _hairpin()),
    "breathing bend": lambda _: _made(5, _bend(13.0), _breath()),
    "breathing lobes": lambda _: _made(5, _bend(_lobed()), breathing(BODY, 8.0, 4.0)),
    "squeezing helix": lambda _: _made(5, _bend(13.0, rise=35.0, turn=3.0), peristalsis()),
    "squeezing long helix": lambda _: _made(30, _bend(14.0, 110.0, 8.0, 45.0, 70), together(_breath(), peristalsis())),
    "embedded colon, 30 links": lambda _: _in_colon(_embedded_lumen(), 30, None),
    "squeezing embedded colon, 30 links": lambda _: _in_colon(
        _embedded_lumen(), 30, together(_breath(), peristalsis())
    ),
    "colon, 5 links": lambda _: _colon(5),
    "colon, 30 links": lambda _: _colon(30),
    "breathing colon, 5 links": lambda _: _colon(5, _breath()),
    "breathing colon, 30 links": lambda _: _colon(30, _breath()),
    "squeezing colon, 30 links": lambda _: _colon(30, together(_breath(), peristalsis())),
}
