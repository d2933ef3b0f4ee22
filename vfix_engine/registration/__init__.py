"""Registration: how an image lies on a patient, found by points, with the errors to expect. LPS, mm.

``transform`` of a result takes the moving frame to the fixed frame. To place an image on a patient the fixed points are
those measured at the patient and the moving points those of the image: the transform is then
``transform_image_to_patient`` of ``vfix_engine.frames.ImageRegistration``.
"""

from .beads import Bead, BeadSearch, NoBead, find_beads, smallest_bead_mm
from .correspondence import Candidate, Match, match_points
from .expected_error import expected_fre_mm, fle_from_fre_mm
from .outlier import Outlier, find_outlier
from .points import Registration, register_points
from .surface import SurfaceRefinement, refine_on_surface

__all__ = [
    "Bead",
    "BeadSearch",
    "Candidate",
    "Match",
    "NoBead",
    "Outlier",
    "Registration",
    "SurfaceRefinement",
    "expected_fre_mm",
    "find_beads",
    "find_outlier",
    "fle_from_fre_mm",
    "match_points",
    "refine_on_surface",
    "register_points",
    "smallest_bead_mm",
]
