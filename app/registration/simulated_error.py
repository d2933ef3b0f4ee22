"""By how much a registration is off that was measured with the simulated pointer: there the truth is known."""

from __future__ import annotations

from app.registration.document import RegistrationContent
from app.registration.simulated_touch import check_simulated, simulated_pose
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.frames import inverse


def simulated_error(content: RegistrationContent, case_id: str) -> Array | None:
    """transform_believed_to_true (4, 4) in the image's frame, LPS mm; None where not all of it was simulated.

    A tip that the registration has at p of the image is at T_true⁻¹ T p of it.
    """
    if content.made_from == "none" or not content.used_pairs:
        return None
    try:
        check_simulated(content)
    except InputError:
        return None
    registered = content.registration
    off: Array = inverse(simulated_pose(case_id, registered.to)) @ registered.transform
    return off
