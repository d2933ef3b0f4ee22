"""Openings of the airway to the outside, through which a tool can enter: the nostrils in a head's widest CT."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np

from app.imaging.derived_of_ct import DerivedOfCt
from app.kit.array_files import read_arrays
from app.kit.values import Position
from vfix_engine.anatomy.nostrils import nostrils_of_volume
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.progress import ProgressCallback

OpeningSide = Literal["left", "right", ""]
NAMES: dict[OpeningSide, str] = {"left": "Left nostril", "right": "Right nostril", "": "Nostril"}
_SIDES: tuple[OpeningSide, ...] = ("", "left", "right")  # by their number in a file


@dataclass(frozen=True)
class Opening:
    """A nostril. side: of the patient, '' where it cannot be told; inward: unit vector; both in LPS, in mm."""

    id: str
    side: OpeningSide
    position: Position
    inward: Position
    radius_mm: float

    @property
    def name(self) -> str:
        return NAMES[self.side]


@dataclass(frozen=True)
class OpeningsOfHead:
    """All that the CT shows, the right one first; often none, such as where the scan ends above the nose."""

    items: tuple[Opening, ...]


class Openings(DerivedOfCt[OpeningsOfHead]):
    """Finds, stores and reads the openings of heads. Thread-safe."""

    job = "openings"
    file = "openings-1.npz"
    no_ct = "only the CT of a head shows nostrils."

    def find(self, volume: Volume, progress: ProgressCallback) -> OpeningsOfHead:
        return OpeningsOfHead(
            tuple(
                _opening(one.side, one.position, one.inward, one.radius_mm)
                for one in nostrils_of_volume(volume, progress=progress)
            )
        )

    def write(self, value: OpeningsOfHead, file: BinaryIO) -> None:
        np.savez(
            file,
            sides=np.array([_SIDES.index(one.side) for one in value.items], np.uint8),
            positions=np.array([one.position for one in value.items], np.float64).reshape(-1, 3),
            inward=np.array([one.inward for one in value.items], np.float64).reshape(-1, 3),
            radii=np.array([one.radius_mm for one in value.items], np.float64),
        )

    def read(self, path: Path) -> OpeningsOfHead:
        arrays = read_arrays(path)
        sides, positions, inward, radii = (arrays[name] for name in ("sides", "positions", "inward", "radii"))
        count = len(radii) if radii.ndim == 1 else -1
        if (sides.shape, positions.shape, inward.shape) != ((count,), (count, 3), (count, 3)):
            raise InputError("a file of openings is damaged.")
        if not all(np.isfinite(values).all() for values in (positions, inward, radii)) or (sides >= len(_SIDES)).any():
            raise InputError("a file of openings is damaged.")
        found = zip(sides.tolist(), positions, inward, radii, strict=True)
        return OpeningsOfHead(tuple(_opening(_SIDES[side], *rest) for side, *rest in found))


def _opening(side: OpeningSide, position: Any, inward: Any, radius_mm: Any) -> Opening:
    x, y, z = (float(value) for value in position)
    a, b, c = (float(value) for value in inward)
    return Opening(f"nostril-{side}" if side else "nostril", side, (x, y, z), (a, b, c), float(radius_mm))
