"""The registration that a plan is driven through: where the robot stands in the image, what places may be off by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from app.services.registration_fit import fitted, report_of
from vfix_engine.errors import PlanError
from vfix_engine.frames import ImageRegistration

if TYPE_CHECKING:
    from app.services.plan_model import Plan
    from app.services.registering import PlanRegistration
    from vfix_engine.registration import Registration

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DrivenRegistration:
    """A registration as a drive, a verdict and a plot use it.

    image: from the image to what the robot stands in. fit: to the fiducials that are in use; None for a transform that
    came from elsewhere. fle_mm: rms length of the localisation error of one fiducial; None where it is not known.
    """

    id: str
    name: str
    image: ImageRegistration
    fit: Registration | None = None
    fle_mm: float | None = None

    @property
    def key(self) -> list[object]:
        """JSON values, equal for registrations by which a plan is driven and judged alike."""
        points = [] if self.fit is None else self.fit.moving.tolist() + self.fit.weights.tolist()
        return [self.image.to, self.image.transform.ravel().tolist(), points, self.fle_mm]

    def off_mm(self, places: npt.ArrayLike) -> Floats | None:
        """What each of these places (n, 3) of the image may be off by (n,), 95 of 100 times at most; LPS mm.

        None where no fiducials say so.
        """
        if self.fit is None or self.fle_mm is None:
            return None
        return self.fit.tre_95_mm(places, self.fle_mm)


def driven_registration(used: PlanRegistration) -> DrivenRegistration | None:
    """The registration that a plan uses, None where it uses none.

    Raises PlanError where the plan refers to one that cannot be used: it is not driven as if there were none.
    """
    if used.state == "none":
        return None
    if used.state != "ready" or used.document is None:
        raise PlanError(used.words)
    content = used.document.content
    fit = fitted(content.used_pairs) if content.made_from == "pairs" else None
    fle_mm = report_of(content).fle_mm
    return DrivenRegistration(used.document.id, used.document.name, content.registration, fit, fle_mm)


def no_registration(plan: Plan) -> DrivenRegistration | None:
    """Image and patient are one frame, as in a simulation."""
    return None
