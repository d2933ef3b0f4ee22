"""The kinds of documents that an archive carries."""

from __future__ import annotations

from typing import Any

from app.documents import DocumentKind
from app.imaging.label_document import LABEL
from app.lumen.document import ROUTE
from app.plans.document import PLAN
from app.plans.versions import VERSION
from app.registration.document import RegistrationContent
from app.registration.fit_report import inconsistency
from app.registration.kind import REGISTRATION

KINDS: dict[str, DocumentKind[Any]] = {kind.name: kind for kind in (PLAN, VERSION, REGISTRATION, LABEL, ROUTE)}

NUMBERED = (PLAN.name, REGISTRATION.name, ROUTE.name)
"""Kinds with unique names: on import a second document of the same name gets a number."""


def contradiction(content: Any) -> str:
    """Return how the values of a document's content contradict each other, though each is valid; '' if they do not."""
    return inconsistency(content) if isinstance(content, RegistrationContent) else ""
