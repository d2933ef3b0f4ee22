"""Lines and words on pictures of a lumen, through OpenCV; colours are red, green, blue in 0 … 255."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....arrays import Array
from ....pathway import packed as column
from ....pathway.packed import PackedPathway
from .camera_view import Picture, PinholeCamera

Colour = tuple[int, int, int]
PixelBox = tuple[int, int, int, int]  # left, top, right, foot [px]

INK: Colour = (40, 44, 52)
RIM: Colour = (0, 128, 140)
MARK: Colour = (176, 20, 110)
PAPER: Colour = (255, 255, 255)

_ROUND = 48  # corners of a drawn circle
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_FINE = 4  # OpenCV draws between pixels with this many binary places
_LINE = 15  # [px] height of a name
_DOT = (4, 9)  # [px] radius of a dot, and of the ring
_TRIES = 12  # steps of 6 px that a name moves up or down to be read
_FAR = 20_000  # [px] lines are clipped beyond this


def rims(packed: PackedPathway) -> tuple[Array, Array]:
    """Centres (C, 3) of a pathway's contours and their rims (C, n, 3), closed, in mm."""
    rows, polar = packed.rows, packed.polar
    parts = [
        (column.START, column.END),
        (column.START_FIRST, column.END_FIRST),
        (column.START_SECOND, column.END_SECOND),
    ]
    centre, first, second = (
        np.concatenate([rows[:, start : start + 3], rows[-1:, end : end + 3]]) for start, end in parts
    )
    angles = polar.shape[1] if polar.shape[1] > 1 else _ROUND
    turn = np.linspace(0.0, 2.0 * np.pi, angles + 1)
    radius = np.broadcast_to(polar, (len(polar), angles))[:, np.arange(angles + 1) % angles, None]
    around = np.cos(turn)[None, :, None] * first[:, None] + np.sin(turn)[None, :, None] * second[:, None]
    return centre, centre[:, None] + radius * around


def draw_line(
    picture: Picture,
    view: PinholeCamera,
    points: ArrayLike,
    colour: Colour,
    hidden_by: Array | None = None,
    width: int = 1,
) -> None:
    """A line through points (n, 3) mm; omitted where something nearer, ``hidden_by`` (H, W) mm, covers it."""
    pixels, distance = view.project(points)
    kept: NDArray[np.bool_] = np.asarray((np.abs(pixels) < _FAR).all(axis=1))  # not where it is NaN either
    if hidden_by is not None:
        size = np.array([view.width, view.height])
        x, y = np.clip(np.nan_to_num(pixels), 0, size - 1).astype(np.int64).T
        kept = kept & ~(hidden_by[y, x] < distance - 1.0)
    fixed = np.rint(np.nan_to_num(pixels, posinf=0.0, neginf=0.0).clip(-_FAR, _FAR) * 2**_FINE).astype(np.int32)
    for k in np.flatnonzero(kept[:-1] & kept[1:]):
        ends = [tuple(int(v) for v in fixed[i]) for i in (k, k + 1)]
        cv2.line(picture, ends[0], ends[1], colour, width, cv2.LINE_AA, _FINE)


def draw_marks(
    picture: Picture, view: PinholeCamera, places: Mapping[str, ArrayLike], names: Mapping[str, str], ringed: str
) -> None:
    """A dot at each position (3,) and its name beside it, clear of other dots and names; ``ringed`` is large, and named
    first.

    A name that is farther away is connected to its dot by a line.
    """
    spots: dict[str, tuple[int, int]] = {}
    for key in sorted(places, key=lambda one: one != ringed):
        pixels, _ = view.project(np.asarray(places[key], dtype=np.float64)[None])
        if np.isfinite(pixels).all() and (np.abs(pixels) < _FAR).all():
            spots[key] = round(float(pixels[0, 0])), round(float(pixels[0, 1]))
    dots: dict[str, PixelBox] = {}
    for key, (x, y) in spots.items():
        half = _DOT[key == ringed] + 2
        dots[key] = (x - half, y - half, x + half, y + half)
    taken: list[PixelBox] = []
    for key, (x, y) in spots.items():
        large = key == ringed
        radius, scale = _DOT[large], 0.6 if large else 0.45
        others = [*taken, *(box for other, box in dots.items() if other != key)]
        box = _free(view, (x, y), radius, text_width(names[key], scale, large), others)
        taken.append(box)
        if not y - _LINE < 0.5 * (box[1] + box[3]) < y + _LINE:
            end = (box[0] - 4 if box[0] > x else box[2] + 4, round(0.5 * (box[1] + box[3])))
            cv2.line(picture, (x, y), end, MARK, 1, cv2.LINE_AA)
        write(picture, names[key], (box[0], box[3]), scale, MARK, bold=large, halo=True)
    for key, (x, y) in spots.items():
        cv2.circle(picture, (x, y), _DOT[key == ringed], PAPER, 4, cv2.LINE_AA)
        cv2.circle(picture, (x, y), _DOT[key == ringed], MARK, 2 if key == ringed else -1, cv2.LINE_AA)


def _free(view: PinholeCamera, at: tuple[int, int], radius: int, wide: int, others: list[PixelBox]) -> PixelBox:
    """The box of a name that overlaps none of the others, as near to its dot as possible: right or left, then lower."""
    x, y = at
    boxes = []
    for drop in sorted(range(-6 * _TRIES, 6 * _TRIES + 1, 3), key=lambda one: (abs(one), -one)):
        aside = 6 + min(abs(drop) // 2, 14)
        for left in (x + radius + aside, x - radius - aside - wide):
            foot = min(max(y + 5 + drop, _LINE), view.height - 6)
            if left >= 4 and left + wide < view.width:
                boxes.append((left, foot - _LINE, left + wide, foot))
    free = [b for b in boxes if not any(_meet(b, other) for other in others)]
    return (free or boxes or [(4, y + 5 - _LINE, 4 + wide, y + 5)])[0]


def _meet(one: PixelBox, two: PixelBox) -> bool:
    return one[0] - 3 < two[2] and two[0] < one[2] + 3 and one[1] < two[3] + 3 and two[1] < one[3] + 3


def text_width(text: str, scale: float, bold: bool = False) -> int:
    """Width in pixels of a text."""
    return int(cv2.getTextSize(text, _FONT, scale, 2 if bold else 1)[0][0])


def write(
    picture: Picture,
    text: str,
    at: tuple[int, int],
    scale: float = 0.5,
    colour: Colour = INK,
    bold: bool = False,
    halo: bool = False,
) -> None:
    """A text with its lower left corner at (x, y); a halo makes it readable on any background."""
    weight = 2 if bold else 1
    if halo:
        lighten(picture, (at[0] - 3, at[1] - _LINE, at[0] + text_width(text, scale, bold) + 3, at[1] + 5))
    cv2.putText(picture, text, at, _FONT, scale, colour, weight, cv2.LINE_AA)


def lighten(picture: Picture, box: PixelBox) -> None:
    """Fade a part of a picture to nearly the colour of paper."""
    part = picture[max(box[1], 0) : max(box[3], 0), max(box[0], 0) : max(box[2], 0)]
    part[:] = np.rint(0.25 * part + 0.75 * np.array(PAPER)).astype(np.uint8)


def draw_compass(picture: Picture, view: PinholeCamera) -> None:
    """The patient's axes in the lower left corner, without those that point at the eye."""
    turned = view.transform_camera_to_patient[:3, :3]
    foot = np.array([74.0, view.height - 60.0])
    lighten(picture, (4, view.height - 122, 144, view.height - 4))
    # In LPS x runs to the left, y to the back and z to the head.
    drawn: list[Array] = []
    for name, row in sorted(
        (("head", 2), ("left", 0), ("back", 1)), key=lambda one: -np.linalg.norm(turned[one[1], :2])
    ):
        along = turned[row, :2]
        length = float(np.linalg.norm(along))
        if length < 0.3 or any(along @ other > 0.9 * length for other in drawn):
            continue
        drawn.append(along / length)
        tip = foot + 34.0 * along
        ends = [(round(float(p[0])), round(float(p[1]))) for p in (foot, tip)]
        cv2.arrowedLine(picture, ends[0], ends[1], INK, 1, cv2.LINE_AA, tipLength=0.25)
        beyond = tip + (16.0, 10.0) * drawn[-1]
        at = round(float(beyond[0])) - text_width(name, 0.4) // 2, round(float(beyond[1])) + 4
        write(picture, name, at, 0.4)


def draw_scale(picture: Picture, view: PinholeCamera, distance: float, length_mm: float) -> None:
    """A bar as long as ``length_mm`` at a distance from the eye, in the lower right corner."""
    pixels = round(view.focal * length_mm / distance)
    right, foot = view.width - 20, view.height - 20
    text = f"{length_mm:g} mm"
    lighten(picture, (right - pixels - 6, foot - 26, right + 6, foot + 8))
    cv2.line(picture, (right - pixels, foot), (right, foot), INK, 2, cv2.LINE_AA)
    write(picture, text, (right - (pixels + text_width(text, 0.45)) // 2, foot - 8), 0.45)
