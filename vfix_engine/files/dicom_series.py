"""DICOM series of a folder or zip, for selection: collected while the files are read."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vfix_engine.errors import ImageError, SeriesUnclear
from vfix_engine.files.text_bytes import text_of_element

_MODALITY = re.compile(r"[A-Z]{2,16}")
_MAX_DESCRIPTION = 64  # [characters] by the standard


@dataclass
class Series:
    """Facts about a series; all but the description contain nothing a person wrote.

    pixels, pixel_mm: columns and rows, and the distances between them, of its slices, or of its localizers if it has no
        others; `scouts`: number of localizers. positions: of the slices along their normal, in mm.
    """

    modality: str
    description: str
    pixels: tuple[int, int]
    pixel_mm: tuple[float, float] | None
    files: int = 0
    scouts: int = 0
    slices: int = 0
    positions: list[float] = field(default_factory=list)
    wanted: tuple[str, ...] = ("CT",)

    def __str__(self) -> str:
        images = f"{self.files} image{'s' * (self.files > 1)} of {self.pixels[0]} x {self.pixels[1]}"
        return images if self.modality in self.wanted else f"{images}, not CT"

    def facts(self, number: int) -> dict[str, Any]:
        """Facts by which a user selects; spacing_mm: of columns, rows and slices, as far as the files state them."""
        gaps = np.diff(np.unique(np.round(self.positions, 3)))
        spacing = [*(self.pixel_mm or ()), *([float(np.median(gaps))] if len(gaps) else [])]
        return {
            "number": number,
            "modality": self.modality,
            "description": self.description,
            "slices": self.slices,
            "columns": self.pixels[0],
            "rows": self.pixels[1],
            "spacing_mm": [round(value, 3) for value in spacing],
        }


class SeriesList:
    """Series in the order of their first files. wanted: the accepted modalities."""

    def __init__(self, wanted: tuple[str, ...] = ("CT",)) -> None:
        self._wanted = wanted
        self._found: dict[str, Series] = {}

    def count(self, dataset: Any) -> int:
        """Add an image to its series; returns the number of the series, from 1."""
        identity = str(dataset.get("SeriesInstanceUID"))
        if identity not in self._found:
            self._found[identity] = _first_of(dataset, self._wanted)
        known = self._found[identity]
        if known.scouts == known.files and not is_localizer(dataset):  # a scout view can be larger than the slices
            known.pixels, known.pixel_mm = _pixels(dataset), _pixel_mm(dataset)
        known.scouts += is_localizer(dataset)
        known.files += 1
        known.slices += int(dataset.get("NumberOfFrames") or 1)
        position, axes = dataset.get("ImagePositionPatient"), dataset.get("ImageOrientationPatient")
        if position and axes and len(position) == 3 and len(axes) == 6:
            across = np.cross([float(v) for v in axes[:3]], [float(v) for v in axes[3:]])
            known.positions.append(float(across @ [float(value) for value in position]))
        return list(self._found).index(identity) + 1

    def chosen(self, series: int | None) -> Series:
        """Return the series of that number, or the only one. Raises ImageError if the choice is missing or wrong."""
        found = list(self._found.values())
        if not found:
            raise ImageError("there is no DICOM image in it.")
        listed = "; ".join(f"{number}: {one}" for number, one in enumerate(found[:20], start=1))
        if series is None and len(found) > 1:
            raise SeriesUnclear(
                f"there are {len(found)} series in it ({listed}). Say which one with --series on the command line, "
                "or name the folder or zip of one.",
                tuple(_facts(found)),
            )
        if series is not None and not 1 <= series <= len(found):
            raise ImageError(f"there is no series {series} in it; there are {len(found)} ({listed}).")
        return found[(series or 1) - 1]


def is_localizer(dataset: Any) -> bool:
    """Whether an image or a frame is marked as a scout view."""
    kinds = dataset.get("ImageType") or ()
    return "LOCALIZER" in ([kinds] if isinstance(kinds, str) else [str(kind).strip().upper() for kind in kinds])


def _facts(found: Iterable[Series]) -> list[dict[str, Any]]:
    return [one.facts(number) for number, one in enumerate(found, start=1)][:100]


def _first_of(dataset: Any, wanted: tuple[str, ...]) -> Series:
    modality = str(dataset.get("Modality") or "")
    words = "".join(c if c.isprintable() else " " for c in text_of_element(dataset, "SeriesDescription"))
    return Series(
        modality if _MODALITY.fullmatch(modality) else "?",
        " ".join(words.split())[:_MAX_DESCRIPTION],
        _pixels(dataset),
        _pixel_mm(dataset),
        wanted=wanted,
    )


def _pixels(dataset: Any) -> tuple[int, int]:
    """Columns and rows."""
    return int(dataset.get("Columns") or 0), int(dataset.get("Rows") or 0)


def _pixel_mm(dataset: Any) -> tuple[float, float] | None:
    """Distance between columns and between rows, if the file states it."""
    values = dataset.get("PixelSpacing")
    if values is None or len(values) != 2:
        return None
    between_rows, between_columns = (float(value) for value in values)
    return between_columns, between_rows
