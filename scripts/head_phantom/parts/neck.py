"""Cervical vertebrae."""

from __future__ import annotations

from head_phantom.shapes import Ellipsoid, Halfspaces, Part, Shared, Tube

ATLAS_AND_DENS = (
    Part(
        "ring of the atlas",
        Tube([(0, 86, -29), (14, 90, -29), (22, 100, -29), (18, 112, -29), (0, 122, -30)], [3, 4, 6, 4, 3]),
        paired=True,
    ),
    Part("transverse process of the atlas", Tube([(22, 100, -29), (38, 103, -31)], [4, 2.6]), 3, paired=True),
    Part("dens", Tube([(0, 92, -46), (0, 92, -27)], [4.6, 3.2]), 1),
)


def _vertebra(number: int) -> tuple[Part, ...]:
    y, z = 94.0 + 1.5 * number, -48.0 - 16.5 * number
    waist = Tube([(0, y, z - 12), (0, y, z + 12)], [8.4, 8.4], (1.25, 1, 1))
    ends = Halfspaces([((0, 0, 1), z + 6.2), ((0, 0, -1), 6.2 - z)], ((-12, y - 10, z - 7), (12, y + 10, z + 7)), 0)
    arch = Tube(
        [(8, y + 3, z + 1), (20, y + 6, z), (18, y + 14, z - 1), (7, y + 23, z - 3), (0, y + 27, z - 5)],
        [3, 4.2, 4.5, 2.6, 2.8],
        (1, 1, 1.25),
    )
    return (
        Part("body", Shared([waist, ends], 2.5)),
        Part("arch", arch, 2, paired=True),
        Part("transverse process", Tube([(14, y + 4, z), (26, y + 2, z - 3)], [3.2, 2.4]), 3, paired=True),
        Part("spinous process", Tube([(0, y + 26, z - 5), (0, y + 38, z - 11)], [2.8, 2.2]), 2),
        Part("foramen", Ellipsoid((0, y + 14, z), (9, 7, 20)), 1, taken=True),
    )


def vertebrae() -> tuple[Part, ...]:
    """Atlas, axis and the next three."""
    return (*ATLAS_AND_DENS, *(part for number in range(3) for part in _vertebra(number)))
