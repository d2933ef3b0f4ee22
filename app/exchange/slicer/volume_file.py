"""A CT volume as a compressed NRRD file in LPS mm. Format: https://teem.sourceforge.net/nrrd/format.html"""

from __future__ import annotations

import zlib
from pathlib import Path

from app.plans.model import NOTICE
from vfix_engine.files.volume import Volume

_LEVEL = 3  # of zlib: a third of the size, in a fraction of the time of the highest level
_GZIP = 31  # window bits of zlib for a gzip header without a time, so that equal volumes give equal files


def write_nrrd(path: Path, volume: Volume) -> None:
    """Write a volume slice by slice, without a copy of the whole. Raises OSError."""
    sizes = " ".join(str(n) for n in volume.hu.shape[::-1])
    directions = " ".join(_vector(column) for column in (volume.direction * volume.spacing).T.tolist())
    head = (
        f"NRRD0005\n# {NOTICE}\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: {sizes}\n"
        f"space directions: {directions}\nkinds: domain domain domain\nendian: little\nencoding: gzip\n"
        f'space units: "mm" "mm" "mm"\nspace origin: {_vector(volume.origin.tolist())}\n\n'
    )
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, _GZIP)
    with path.open("wb") as file:
        file.write(head.encode("ascii"))
        for layer in volume.hu:
            file.write(packer.compress(layer.astype("<i2", copy=False).tobytes()))
        file.write(packer.flush())


def _vector(values: list[float]) -> str:
    return "(" + ",".join(repr(float(value)) for value in values) + ")"
