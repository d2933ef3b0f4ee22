"""Presets of a snake's drive: the printed parameters of Kwok 2013, and a list of what is not printed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ...robots.snake import SnakeModel
from .settings import DriveSettings

OURS = (
    "the certificate of each whole motion in the arm 'certified', with backtracking; the paper prints none",
    "the centreline and the contours, which are fitted to the surface and not placed by hand",
    "how joints keep their limits where the centreline bends more sharply than they can",
    "the search for control bends by rays from rest, instead of a concave minimisation",
    "the bound of a link by place, at most half the lumen's radius there",
    "the control 'view', which is not the paper's",
)


@dataclass(frozen=True)
class SnakePreset:
    """A paper's robot and drive.

    links, snake: the robot. drive: values of ``DriveSettings`` by name. printed: what the paper prints, by its symbol;
    assumed: what it does not, and what is taken instead.
    """

    name: str
    paper: str
    links: int
    snake: SnakeModel
    drive: Mapping[str, float | int | str | bool]
    printed: Mapping[str, float]
    assumed: Mapping[str, str]

    def robot(self) -> SnakeModel:
        """The whole robot."""
        return replace(self.snake, links=self.links)

    def settings(self, **changed: object) -> DriveSettings:
        """The drive's settings, some of them changed.

        Raises:
            InputError: a value out of its range.
        """
        values: dict[str, object] = {**self.drive, **changed}
        return DriveSettings(**values)  # type: ignore[arg-type]  # checked by the class

    def report(self) -> dict[str, object]:
        """What is printed, what is assumed, and what stays the package's own."""
        return {
            "preset": self.name,
            "paper": self.paper,
            "printed": dict(self.printed),
            "assumed": dict(self.assumed),
            "ours": list(OURS),
        }


PRESETS = {
    one.name: one
    for one in (
        SnakePreset(
            "kwok2013",
            "Kwok, Tsoi, Vitiello, Clark, Chow, Luk & Yang 2013",
            30,
            SnakeModel(1, length_mm=28.0, q_max=math.radians(45.0)),
            {
                "control": "parameterised", "bends": 4, "manipulated": 5, "r_max": 1.4, "reoptimise_below": 0.15,
                "lock_bend": True, "contours": 50, "interpolated": 197, "angles": 1, "vertices_per_link": 100,
                "speed_max": math.radians(36.0),
            },
            {
                "L": 30, "L'": 5, "link in mm": 28.0, "q_max in °": 45.0, "q̇_max in °/s": 36.0, "τ_max in mN·m": 75.6,
                "f_b,max in N": 0.88, "f_I,max in N": 3.30, "c_b": 1e-3, "c_I": 3e-3, "k of a link in N/mm": 0.07,
                "k of the last link in N/mm": 0.45, "a_i in mm": 0.0, "r_max": 1.4,
                "r below which bends are found": 0.15, "control bends": 4,
                "contours placed": 50, "contours interpolated": 197, "vertices": 500, "field of view in °": 70.0,
            },
            {
                "b_i of (17)": "smaller for the last link, without a number: 8 mm, and 4 mm for the last, or half the "
                "lumen's radius",
                "radius of a link": "not printed: 6 mm",
                "mass of a link": "not printed: 15 g, of which the motors can hold six links",
                "camera ahead of the last frame": "not printed: 6 mm",
                "f_h,max": "not printed: 3.3 N, the peak of the device that the paper used",
                "units of c_b and c_I": "not printed: N·rad/s and N·N·m",
                "admittance of a hand without a device": "the paper has a device: 10 mm/s per N",
                "radius of a contour": "placed by hand in the paper: the 0.3 quantile of the rays to the wall",
                "scale of a manual hand": "not printed, nor which motion turns which angle: the camera of a "
                "straight robot moves like the hand",
                "speeds of the hand": "not printed: insertion at 20 mm/s",
            },
        ),
    )
}  # fmt: skip
