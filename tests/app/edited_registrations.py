"""A registration that a test edits, as a client does: by operations on its document."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from app.operations.operation import Change
from app.registration.document import RegistrationContent, StoredRegistration
from app.registration.edits import edit
from app.registration.operations import SPEC
from app.services import Services


class Edited:
    """The registration of an id."""

    def __init__(self, services: Services, registration_id: str) -> None:
        self._services, self.id = services, registration_id

    @property
    def document(self) -> StoredRegistration:
        return self._services.registrations.get(self.id)

    def do(self, operation: Change) -> StoredRegistration:
        return operation.run(SPEC.context(self._services), self.id)

    def change(self, change: Callable[[RegistrationContent], RegistrationContent]) -> StoredRegistration:
        return edit(self._services.registrations, self.id, change)

    def become(self, content: RegistrationContent) -> StoredRegistration:
        return self.change(lambda _: content)


def given(content: RegistrationContent, transform: np.ndarray) -> RegistrationContent:
    """The content with a transform from elsewhere."""
    return replace(content, transform=tuple(transform.ravel().tolist()), made_from="given")
