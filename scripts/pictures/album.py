"""Pictures of the page as files with few colours, so that the docs stay small."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

MOST_BYTES = 250_000
COLOURED = 60  # of 255: least difference between the channels of a pixel that counts as coloured
COLOURS = (256, 160, 96, 64, 32)


class Album:
    """The folder of the pictures, and the names of those taken so far."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.taken: list[str] = []

    def add(self, name: str, png: bytes) -> None:
        """Store a screenshot under a name. Raises ValueError if it stays too large."""
        (self.folder / f"{name}.png").write_bytes(small_png(png))
        self.taken.append(name)


def small_png(png: bytes) -> bytes:
    """Return the picture with as many colours as fit into `MOST_BYTES`. Raises ValueError if none fit."""
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    sample = _sample(picture)
    for count in COLOURS:
        made = io.BytesIO()
        palette = sample.quantize(count, method=Image.Quantize.MEDIANCUT)
        reduced = picture.quantize(palette=palette, dither=Image.Dither.NONE)
        reduced.save(made, "PNG", optimize=True)
        if made.tell() <= MOST_BYTES:
            return made.getvalue()
    raise ValueError(f"a picture takes {made.tell():,} bytes with {COLOURS[-1]} colours; {MOST_BYTES:,} are allowed.")


def _sample(picture: Image.Image) -> Image.Image:
    """Return pixels to choose the colours from, a fifth of them coloured, so that colours of a legend are kept."""
    pixels = np.asarray(picture).reshape(-1, 3)
    spread = pixels.max(axis=1).astype(int) - pixels.min(axis=1)
    coloured = pixels[spread > COLOURED]
    if len(coloured):
        pixels = np.concatenate([pixels, np.resize(coloured, (len(pixels) // 4, 3))])
    return Image.fromarray(pixels[None])
