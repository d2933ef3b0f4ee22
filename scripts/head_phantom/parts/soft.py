"""Soft tissue: skin, eyes, the airway behind the nose, the mouth."""

from __future__ import annotations

from head_phantom.shapes import Ellipsoid, Halfspaces, Part, Shared, Tube

HEAD_OUTLINE = (
    Part("scalp", Ellipsoid((0, 111, 61), (78, 94, 67))),
    Part("occiput", Ellipsoid((0, 134, 22), (62, 58, 47)), 16),
    Part("forehead and temples", Ellipsoid((0, 62, 18), (64, 57, 62)), 16),
    Part("face", Ellipsoid((0, 38, -25), (50, 48, 50)), 14),
    Part("chin", Ellipsoid((0, 12, -57), (19, 16, 15)), 10),
    Part("neck", Tube([(0, 96, -10), (0, 96, -50), (0, 97, -130)], [54, 53, 56], (1.05, 0.98, 1)), 18),
    Part("masseter", Ellipsoid((50, 46, -20), (14, 26, 30)), 16, paired=True),
    Part("cheek", Ellipsoid((29, 14, 0), (19, 13, 19)), 14, paired=True),
    Part("buccal fat", Ellipsoid((31, 21, -22), (14, 16, 15)), 12, paired=True),
    Part("lips", Ellipsoid((0, -2, -19), (25, 11, 14)), 10),
    Part("upper lip", Tube([(0, -9.5, -18), (9, -8.5, -18), (21, 0, -22)], [4.4, 4.2, 2]), 5, paired=True),
    Part("lower lip", Tube([(0, -9, -28), (9, -7.5, -28), (20, 0, -24)], [4.8, 4.4, 2]), 5, paired=True),
    Part(
        "line of the mouth",
        Tube([(0, -16, -23.2), (12, -13, -23.4), (22, -5, -24)], [1, 1, 0.7]),
        2,
        True,
        taken=True,
    ),
    Part("philtrum", Tube([(0, -16, -8), (0, -15.5, -14)], [2, 2]), 3, taken=True),
    Part(
        "helix",
        Tube(
            [(73, 96, 2), (78, 101, -6), (81, 113, 6), (83, 117, 22), (82, 108, 33), (77, 97, 27), (75, 97, 16)],
            [3, 3.4, 2.6, 2.4, 2.4, 2.4, 2],
        ),
        3,
        paired=True,
    ),
    Part("auricle", Ellipsoid((77, 105, 13), (3, 11, 20)), 5, paired=True),
    Part("concha", Ellipsoid((81, 101, 9), (5, 5.5, 8)), 3, paired=True, taken=True),
)
EXTERNAL_NOSE = (
    Part("dorsum", Tube([(0, 12, 47), (0, -6, 33), (0, -18, 17)], [6, 7.4, 8]), 9),
    Part("tip", Ellipsoid((0, -18, 11), (8.5, 7.5, 7.5)), 5),
    Part("ala", Ellipsoid((10.5, -8, 5), (6.6, 10, 9)), 6, paired=True),
    Part("rim of the nostril", Ellipsoid((7.5, -12, 1.5), (8, 8.5, 6)), 4, paired=True),
    Part("columella", Tube([(0, -19, 7), (0, -9, 0)], [3.6, 4]), 4),
)
EYELIDS = (
    Part("lids", Ellipsoid((33, 20.5, 37), (16, 11.5, 13)), 8, paired=True),
    Part(
        "lid slit",
        Tube([(19, 13, 35), (27, 7.8, 36), (34, 7.4, 36.2), (44, 13, 37.5)], [0.7, 0.9, 0.9, 0.7]),
        1.5,
        paired=True,
        taken=True,
    ),
)
EYE = (
    Part("globe", Ellipsoid((33, 22, 37), (12, 12, 12)), paired=True),
    Part("optic nerve", Tube([(31, 32, 37), (24, 44, 34.5), (16, 56, 33)], [2.2, 2.1, 2.0]), 1, paired=True),
)
EYE_MUSCLES = (
    Part(
        "medial rectus", Tube([(21.5, 21, 37), (18.5, 36, 36), (16, 53, 33)], [1.2, 2.0, 1.0], (1, 1, 2)), paired=True
    ),
    Part("lateral rectus", Tube([(44.5, 23, 37), (37, 40, 35), (19, 54, 33)], [1.2, 2.0, 1.0], (1, 1, 2)), paired=True),
    Part(
        "superior rectus",
        Tube([(33, 21, 48.5), (27, 38, 44.5), (17, 54, 36)], [1.0, 1.6, 1.0], (2.2, 1, 1)),
        paired=True,
    ),
    Part(
        "inferior rectus", Tube([(33, 21, 25.5), (27, 38, 26), (17, 54, 30)], [1.0, 1.7, 1.0], (2.2, 1, 1)), paired=True
    ),
)
CHEWING_MUSCLES = (
    Part("temporalis", Ellipsoid((58, 66, 32), (8, 30, 40)), 4, paired=True),
    Part("masseter", Ellipsoid((55, 58, -16), (7.5, 15, 27)), 4, paired=True),
    Part("pterygoids", Ellipsoid((33, 66, -10), (9, 11, 22)), 4, paired=True),
    Part("sternocleidomastoid", Tube([(55, 112, -10), (46, 92, -50), (40, 80, -95)], [9, 10, 10]), 4, paired=True),
    Part("muscles of the neck", Ellipsoid((0, 128, -60), (40, 26, 60)), 4),
    Part("tongue", Ellipsoid((0, 36, -31), (21, 34, 16)), 4),
    Part("floor of the mouth", Ellipsoid((0, 32, -48), (18, 26, 10)), 5),
)
PHARYNX = (
    Part(
        "pharynx",
        Tube(
            [(0, 50, -1), (0, 60, -1.2), (0, 67, -6), (0, 70.5, -18), (0, 71, -40), (0, 64, -75), (0, 64, -110)],
            [6, 7.3, 7.3, 6.2, 5.2, 6.4, 7],
            (1.7, 1, 1),
        ),
    ),
)
CHOANAE = (Part("choanae", Tube([(0, 57, 1), (0, 66, -2), (0, 72, -16)], [8, 9, 10], (1.4, 1, 1)), 3, taken=True),)
MOUTH = (
    Part(
        "mouth",
        Shared(
            [Ellipsoid((0, 28, -13), (17, 24, 4)), Halfspaces([((0, 0, -1), 15)], ((-20, 0, -15), (20, 60, -4)), 0)], 1
        ),
    ),
)
