"""Pictures of the page as files: few colours, so that the docs stay small."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

MOST_BYTES = 250_000
COLOURED = 60  # of 255, between the strongest and the weakest part of a colour
COLOURS = (256, 160, 96, 64, 32)


class Album:
    """The folder that the pictures go to, and the names of those that were taken."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.taken: list[str] = []

    def add(self, name: str, png: bytes) -> None:
        """Keep a screenshot under a name. Raises ValueError where it stays too large."""
        (self.folder / f"{name}.png").write_bytes(small_png(png))
        self.taken.append(name)


def small_png(png: bytes) -> bytes:
    """The same picture with as many colours as fit into `MOST_BYTES`. Raises ValueError where none do."""
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
    """Pixels to choose the colours from, a fifth of them no greys: a legend would keep none of its own else."""
    pixels = np.asarray(picture).reshape(-1, 3)
    spread = pixels.max(axis=1).astype(int) - pixels.min(axis=1)
    coloured = pixels[spread > COLOURED]
    if len(coloured):
        pixels = np.concatenate([pixels, np.resize(coloured, (len(pixels) // 4, 3))])
    return Image.fromarray(pixels[None])
