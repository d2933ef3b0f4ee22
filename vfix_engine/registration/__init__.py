"""Registration of an image to a patient by points, with the expected errors. LPS, mm.

``transform`` of a result maps the moving frame to the fixed frame. To register an image to a patient, the fixed points
are those measured on the patient and the moving points those of the image: the transform is then
``transform_image_to_patient`` of ``vfix_engine.frames.ImageRegistration``.
"""

from .beads import BeadSearch, DetectedBead, NoBead, find_beads, smallest_bead_mm
from .chained_error import target_errors_mm
from .correspondence import Candidate, Match, match_points
from .expected_error import estimated_factor, expected_fre_mm, fle_from_fre_mm
from .hand_eye import HandEye, register_robot_to_tracker
from .outlier import Outlier, find_outlier
from .pointer import PivotCalibration, TracedPath, calibrate_pivot, traced_path
from .points import Registration, register_points
from .surface import SurfaceRefinement, refine_on_surface
from .tracker import SimulatedTracker
from .transform_files import read_transform, write_transform

__all__ = [
    "BeadSearch",
    "Candidate",
    "DetectedBead",
    "HandEye",
    "Match",
    "NoBead",
    "Outlier",
    "PivotCalibration",
    "Registration",
    "SimulatedTracker",
    "SurfaceRefinement",
    "TracedPath",
    "calibrate_pivot",
    "estimated_factor",
    "expected_fre_mm",
    "find_beads",
    "find_outlier",
    "fle_from_fre_mm",
    "match_points",
    "read_transform",
    "refine_on_surface",
    "register_points",
    "register_robot_to_tracker",
    "smallest_bead_mm",
    "target_errors_mm",
    "traced_path",
    "write_transform",
]
