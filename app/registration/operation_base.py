"""What operations on registrations share: an edit that fits anew, and types of fields."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from app.operations.fields import REFUSED
from app.operations.operation import Context, Edit
from app.registration.document import RegistrationContent
from app.registration.fit_report import refitted
from app.registration.service import Registering
from app.registration.simulated_touch import MAX_NOISE_MM, NOISE_REFUSED

Registrations = Context[RegistrationContent, Registering]
Noise = Annotated[float, Meta(ge=0.0, le=MAX_NOISE_MM, extra={REFUSED: NOISE_REFUSED})]  # [mm]
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]


class RegistrationEdit(Edit, frozen=True):
    """An edit, after which the pairs are fitted anew."""

    of_open = True

    def apply(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return refitted(self.changed(content, context))

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        """The content before that. Raises VfixError where it cannot be."""
        raise NotImplementedError
