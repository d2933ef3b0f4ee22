"""The registration that a plan is driven through: where the robot stands in the image, what places may be off by."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy.typing as npt

from app.registration.calibration import motion_covariance
from app.registration.document import RegistrationContent
from app.registration.fit_report import counted_fle, fitted, in_our_words
from vfix_engine.arrays import Array
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.frames import ImageRegistration
from vfix_engine.registration import target_errors_mm

if TYPE_CHECKING:
    from app.plans.model import Plan
    from app.registration.service import PlanRegistration
    from vfix_engine.registration import Registration


@dataclass(frozen=True, eq=False)
class DrivenRegistration:
    """A registration as a drive, a verdict and a plot use it.

    image: from the image to what the robot stands in. fit: to the fiducials that are in use; None for a transform that
    came from elsewhere or was refined on a surface, of which no error is known. fle_mm: rms length of the localisation
    error of one fiducial as stated; None where it is estimated from the fit, see `counted_fle`. between: covariance
    (6, 6) of what lies between the points and the frame, see `motion_covariance`; None for nothing. content: the
    document's, of the same reading.
    """

    id: str
    name: str
    image: ImageRegistration
    fit: Registration | None = None
    fle_mm: float | None = None
    between: Array | None = None
    content: RegistrationContent = field(default_factory=RegistrationContent)

    @property
    def key(self) -> list[object]:
        """JSON values, equal for registrations by which a plan is driven and judged alike."""
        fit = self.fit
        points = [] if fit is None else [fit.moving.tolist(), fit.fixed.tolist(), fit.weights.tolist()]
        between = [] if self.between is None else [self.between.ravel().tolist()]
        return [self.image.to, self.image.transform.ravel().tolist(), points, self.fle_mm, *between]

    def off_mm(self, places: npt.ArrayLike) -> Array | None:
        """What each of these places (n, 3) of the image may be off by (n,), 95 of 100 times at most; LPS mm.

        None where no fiducials say so.
        """
        if self.fit is None:
            return None
        return target_errors_mm(self.fit, places, self.fle_mm, motion_covariance=self.between)[1]


@dataclass(frozen=True)
class AsStored:
    """Says that the registration of the plan is to be read."""


AS_STORED = AsStored()
Through = DrivenRegistration | None | AsStored  # what was read already, None of a plan that uses none, or not yet


def driven_registration(used: PlanRegistration) -> DrivenRegistration | None:
    """The registration that a plan uses, None where it uses none.

    Raises PlanError where the plan refers to one that cannot be used: it is not driven as if there were none.
    """
    if used.state == "none":
        return None
    if used.state != "ready" or used.document is None:
        raise PlanError(used.words)
    content = used.document.content
    fit, image = None, content.registration
    if content.made_from == "pairs":
        try:
            fit = fitted(content.used_pairs)
        except VfixError as error:
            raise PlanError(in_our_words(error)) from None
    fle_mm = content.fle_mm if fit is None else counted_fle(content, fit)
    between = None if fit is None else motion_covariance(content)
    return DrivenRegistration(used.document.id, used.document.name, image, fit, fle_mm, between, content)


def no_registration(plan: Plan) -> DrivenRegistration | None:
    """Image and patient are one frame, as in a simulation."""
    return None
