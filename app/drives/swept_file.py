"""The file of what a run's tool has swept and how near it has passed to bone, as the page takes it, little-endian.

The header has 36 bytes: `VFXW`; as uint32 the version, and the numbers of vertices V and triangles F of the swept
volume, and v and f of the bone within reach; as float32 the reach (mm), the least distance of those vertices (mm,
negative within the tool; the reach without any) and the swept volume (mm³). Then, without gaps: V × 3 float32 (LPS mm),
F × 3 uint32, v × 3 float32 (LPS mm), f × 3 uint32, and v float32 (mm), the least distance of each to the tool.
"""

from __future__ import annotations

import numpy as np

from vfix_engine.errors import InputError
from vfix_engine.study.swept import NearPasses, SweptVolume

MAGIC, VERSION = b"VFXW", 1
HEADER = np.dtype([("magic", "S4"), ("counts", "<u4", 5), ("figures", "<f4", 3)])


def packed(swept: SweptVolume, passes: NearPasses) -> bytes:
    """The bytes of the file."""
    header = np.zeros(1, HEADER)
    header["magic"] = MAGIC
    header["counts"] = (
        VERSION, len(swept.vertices), len(swept.faces), len(passes.vertices), len(passes.faces),
    )  # fmt: skip
    header["figures"] = (passes.reach_mm, passes.least_mm.min(initial=passes.reach_mm), swept.volume_mm3)
    parts = (
        header,
        swept.vertices.astype("<f4"),
        swept.faces.astype("<u4"),
        passes.vertices.astype("<f4"),
        passes.faces.astype("<u4"),
        passes.least_mm.astype("<f4"),
    )
    return b"".join(part.tobytes() for part in parts)


def check(data: bytes) -> bytes:
    """The same bytes. Raises InputError where their number is not what their header says."""
    header = np.frombuffer(data[: HEADER.itemsize].ljust(HEADER.itemsize), HEADER, 1)[0]
    version, *counts = (int(count) for count in header["counts"])
    size = HEADER.itemsize + 12 * sum(counts) + 4 * counts[2]
    if (header["magic"], version, len(data)) != (MAGIC, VERSION, size):
        raise InputError("the file of a swept volume is damaged.")
    return data
