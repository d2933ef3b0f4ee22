"""The phantom's CT volumes as they are shipped: values rounded, compressed NRRD."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from vfix_engine.files.volume import Volume

HU_STEP = 4  # values are rounded to this, far below the noise, so that the files compress better


def packed(ct: Volume) -> Volume:
    """Return the volume as it is shipped, with its values rounded to multiples of `HU_STEP`."""
    return Volume((np.rint(ct.hu / HU_STEP) * HU_STEP).astype(np.int16), ct.origin, ct.spacing, ct.direction)


def write_nrrd(path: Path, ct: Volume) -> None:
    """Write an axis-aligned volume as compressed NRRD in LPS mm; equal volumes give equal files."""
    sizes = " ".join(str(n) for n in ct.hu.shape[::-1])
    directions = " ".join(f"({a:.17g},{b:.17g},{c:.17g})" for a, b, c in (ct.direction * ct.spacing).T)
    head = (
        "NRRD0004\n# Synthetic head. Not for clinical use.\ntype: short\ndimension: 3\n"
        f"space: left-posterior-superior\nsizes: {sizes}\nspace directions: {directions}\n"
        'kinds: domain domain domain\nendian: little\nencoding: gzip\nspace units: "mm" "mm" "mm"\n'
        f"space origin: ({','.join(f'{value:.17g}' for value in ct.origin)})\n\n"
    )
    path.write_bytes(head.encode("ascii") + gzip.compress(ct.hu.astype("<i2").tobytes(), 9, mtime=0))
