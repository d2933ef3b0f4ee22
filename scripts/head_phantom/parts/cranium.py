"""Braincase and skull base."""

from __future__ import annotations

from dataclasses import dataclass

from head_phantom.shapes import Box, Ellipsoid, Pair, Part, Plate, Tube, Vector

VAULT = (
    Part("parietal vault", Ellipsoid((0, 103, 60), (70, 80, 60.5))),
    Part("occipital squama", Ellipsoid((0, 138, 37), (61, 57.5, 56)), 24),
    Part("posterior fossa", Ellipsoid((0, 132, 22), (56, 50, 41)), 14),
    Part("temporal squama", Ellipsoid((0, 106, 40), (68.5, 58, 42)), 14),
)
VAULT_THICKNESS = 6.4  # [mm]
VAULT_THICKNESS_SPREAD = 0.7  # [mm]
BASE_THICKNESS = 3.6  # [mm] floor of the braincase

FRONTAL_BONE = (
    Part("frontal bone", Ellipsoid((0, 62, 60), (47, 48.5, 34)), 12),
    Part("roof of the orbits", Ellipsoid((0, 50, 44), (49, 36, 19)), 10),
    Part("frontal squama", Ellipsoid((0, 65, 68), (49, 47, 40)), 22),
    Part("frontal eminence", Ellipsoid((24, 40, 81), (18, 16, 17)), 16, paired=True),
)

BRAIN = (
    Part("frontal lobes", Ellipsoid((0, 64, 61), (43.5, 38.5, 23)), 12),
    Part("frontal poles", Ellipsoid((0, 66, 72), (40, 43, 34)), 14),
    Part("temporal lobe", Ellipsoid((38, 80, 22), (21, 27, 20)), 8, paired=True),
)

# Hollows for muscles.
FOSSAE = (
    Part("temporal fossa", Ellipsoid((62, 54, 27), (14.5, 25, 33)), 10, paired=True, taken=True),
    Part("infratemporal fossa", Ellipsoid((49, 69, -8), (21, 22, 25)), 6, paired=True, taken=True),
)

TEMPORAL_BONE = (
    Part("mastoid process", Ellipsoid((54.5, 107, -6), (8, 12, 17)), 10, paired=True),
    Part("supramastoid crest", Tube([(66, 92, 14), (67, 106, 18), (65, 118, 24)], [2.5, 2.5, 1.5]), 6, paired=True),
    Part("articular eminence", Tube([(43, 73, 8.5), (53, 74, 7.5), (62, 76, 9)], [4, 4, 3.5]), 5, paired=True),
    Part("tympanic plate", Tube([(45, 92.5, 2), (60, 93.5, 0)], [2.6, 3.2], (1, 1, 1.8)), 4, paired=True),
    Part("styloid process", Tube([(43, 95, -4), (41.5, 92, -16), (39.5, 88, -30)], [2.6, 1.7, 0.9]), 3, paired=True),
    Part("digastric notch", Tube([(46, 101, -19), (46, 116, -14)], [2.6, 2.6]), 3, paired=True, taken=True),
)

OCCIPITAL_BONE = (
    Part("external occipital protuberance", Ellipsoid((0, 188.5, 22), (11, 5, 6)), 10),
    Part("nuchal line", Tube([(0, 189.5, 21), (26, 182, 17), (46, 160, 10)], [2.2, 2.4, 1.2]), 7, paired=True),
    Part("inferior nuchal line", Tube([(0, 166, -8), (22, 158, -8), (36, 142, -9)], [1.5, 1.7, 1.0]), 6, paired=True),
)

# Solid bone that the braincase must not thin.
BASE = (
    Part("clivus", Tube([(0, 80, 14), (0, 88, -6), (0, 95, -18)], [6, 5.5, 5], (1.7, 1, 1)), 4),
    Part("dorsum sellae", Tube([(0, 82, 22), (0, 82, 29)], [3.2, 2], (3, 1, 1)), 3),
    Part("floor of the sphenoid", Tube([(0, 64, 10.5), (0, 80, 8)], [2.2, 6], (2.4, 1, 1)), 4),
    Part("petrous ridge", Tube([(16, 84, 6), (36, 94, 7), (56, 104, 6)], [6, 8, 10]), 6, paired=True),
    Part("lesser wing", Tube([(14, 61, 34), (30, 55, 41)], [2.0, 1.4]), 4, paired=True),
    Part("occipital condyle", Tube([(13, 99, -21), (17.5, 112, -19)], [4.4, 4.2], (1, 1, 1.2)), 4, paired=True),
)

PTERYGOID = (
    Part("pterygoid process", Tube([(16.5, 58, 15), (16, 57.5, 2), (16, 56.5, -6)], [3.6, 3, 2.6]), 4, paired=True),
    Part(
        "medial pterygoid plate",
        Plate([(55, 12), (62, 11), (62, -2), (60, -13), (57, -14), (55, -6)], 13.2, 0.9, ((0.0, 58), (0.03, 0)), 0.8),
        2,
        paired=True,
    ),
    Part(
        "lateral pterygoid plate",
        Plate([(55, 12), (67, 10), (69, -2), (66, -11), (58, -9), (55, -4)], 17.5, 0.9, ((0.42, 56), (-0.05, 0)), 0.8),
        2.5,
        paired=True,
    ),
)

FORAMINA = (
    Part("foramen magnum", Tube([(0, 114, -44), (0, 114, -2)], [15, 15], (1, 1.15, 1)), 3, taken=True),
    Part("optic canal", Tube([(16, 52, 32), (9.5, 70, 33.5)], [2.3, 2.3]), 1.5, paired=True, taken=True),
    Part("external acoustic meatus", Tube([(78, 97, 1), (58, 99, 3)], [3.3, 3]), 1, paired=True, taken=True),
    Part("foramen ovale", Tube([(23, 77, -12), (24, 77, 16)], [2.4, 2.4], (1, 1.5, 1)), 1, paired=True, taken=True),
    Part("carotid canal", Tube([(28, 93, -14), (28, 92, 3)], [3.2, 3.0]), 1, paired=True, taken=True),
    Part(
        "jugular foramen", Tube([(28, 101, -16), (24, 104, 6)], [3.6, 3.0], (1.5, 1, 1)), 1.5, paired=True, taken=True
    ),
)

ORBITAL_FISSURES = (
    Part(
        "superior orbital fissure",
        Tube([(17, 55, 27), (21, 57, 33), (26, 60, 38)], [2.1, 1.8, 1.1]),
        1,
        paired=True,
        taken=True,
    ),
    Part(
        "inferior orbital fissure",
        Tube([(21, 55, 23), (30, 45, 20.5), (36, 37, 20)], [2.0, 1.9, 1.2]),
        1,
        paired=True,
        taken=True,
    ),
)


@dataclass(frozen=True)
class Line:
    """A line on the outer surface: where a plane (or a cylinder about the x axis) meets it inside a box.

    plane: (normal, offset), or arc: ((y, z) of the axis, radius). depth > 0 is a groove, < 0 a ridge. [mm]
    serration: how far the line wanders [mm].
    """

    name: str
    box: Box
    plane: tuple[Vector, float] | None = None
    arc: tuple[Pair, float] | None = None
    depth: float = 0.7
    width: float = 0.75
    serration: float = 1.3
    paired: bool = False


LINES = (
    Line("coronal suture", ((-84, 56, 40), (84, 134, 134)), plane=((0, 1, -0.28), 52.0)),
    Line("sagittal suture", ((-16, 86, 76), (16, 174, 134)), plane=((1, 0, 0), 0.0)),
    Line("lambdoid suture", ((-4, 118, 16), (80, 204, 114)), plane=((0.62, 1, 0.28), 197.0), paired=True),
    Line("squamous suture", ((50, 66, 28), (84, 128, 70)), arc=((97, 22), 31.0), serration=0.8, paired=True),
    Line("occipitomastoid suture", ((44, 112, -10), (84, 140, 22)), plane=((0, 1, 0.3), 124.0), paired=True),
    Line(
        "temporal line",
        ((38, 30, 50), (84, 150, 105)),
        arc=((92, 28), 62.0),
        depth=-0.45,
        width=2.2,
        serration=0.0,
        paired=True,
    ),
    Line(
        "zygomaticofrontal suture",
        ((38, 17, 34), (58, 42, 57)),
        plane=((0.15, 0.1, 1), 55.5),
        depth=0.5,
        serration=0.5,
        paired=True,
    ),
    Line(
        "zygomaticotemporal suture",
        ((52, 50, -4), (80, 80, 24)),
        plane=((0, 1, -0.8), 55.0),
        depth=0.45,
        serration=0.3,
        paired=True,
    ),
    Line(
        "zygomaticomaxillary suture",
        ((18, 0, -8), (48, 38, 26)),
        plane=((1, 0.2, 0.75), 43.5),
        depth=0.28,
        serration=0.6,
        paired=True,
    ),
    Line("nasofrontal suture", ((-12, -4, 42), (12, 26, 58)), plane=((0, -0.5, 1), 43.5), depth=0.3, serration=0.9),
    Line("internasal suture", ((-6, -16, 25), (6, 20, 50)), plane=((1, 0, 0), -0.5), depth=0.4, serration=0.2),
    Line(
        "nasomaxillary suture",
        ((0, -12, 24), (18, 22, 50)),
        plane=((1, -0.12, 0.06), 7.6),
        depth=0.22,
        serration=0.2,
        paired=True,
    ),
)
