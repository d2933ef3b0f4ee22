"""Where the left half of a head ends and the right one begins, as far as its case tells."""

from __future__ import annotations

import numpy as np

from app.cases.model import Case, to_triple
from app.imaging.openings import OpeningsOfHead
from app.plans.paths import Midplane


def midplane_of(case: Case, openings: OpeningsOfHead | None) -> Midplane:
    """The plane halfway between both nostrils; where they are not known, through the middle of the bone across x.

    A head may lie aside in its scan, so x = 0 is not its middle.
    """
    by_side = {one.side: np.array(one.position) for one in openings.items} if openings is not None else {}
    if "left" in by_side and "right" in by_side:
        across = by_side["left"] - by_side["right"]
        middle = 0.5 * (by_side["left"] + by_side["right"])
        return Midplane(to_triple(middle), to_triple(across / np.linalg.norm(across)), "halfway between the nostrils")
    bounds = next(surface.bounds_lps_mm for surface in case.surfaces if surface.name == case.anatomy.surface)
    middle = np.mean(bounds, axis=0)
    return Midplane(to_triple(middle), (1.0, 0.0, 0.0), "the middle of the bone, which the scan may show in part")
