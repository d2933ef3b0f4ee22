"""The kinds of documents that an archive carries."""

from __future__ import annotations

from typing import Any

from app.services.documents import DocumentKind
from app.services.label_kind import LABEL
from app.services.plan_kind import PLAN
from app.services.plan_versions import VERSION
from app.services.registration.document import RegistrationContent
from app.services.registration.fit_report import inconsistency
from app.services.registration.kind import REGISTRATION

KINDS: dict[str, DocumentKind[Any]] = {kind.name: kind for kind in (PLAN, VERSION, REGISTRATION, LABEL)}

NUMBERED = (PLAN.name, REGISTRATION.name)
"""Those that are called by their names: two of the same come in with a number."""


def contradiction(content: Any) -> str:
    """What a document's content contradicts itself in, though each of its values can be; '' for nothing."""
    return inconsistency(content) if isinstance(content, RegistrationContent) else ""
