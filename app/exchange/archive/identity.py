"""The content hash of an archive's case, computed again: it ties plans and registrations to an anatomy."""

from __future__ import annotations

from app.cases.files import CaseFiles
from app.cases.model import CaseContent
from app.cases.service import hash_of
from app.plans.shipped_head import is_shipped_head, shipped_hash
from vfix_engine.errors import InputError


def checked_hash(stated: str, content: CaseContent, files: CaseFiles) -> str:
    """Return the hash of a case whose files are already stored.

    The head shipped with vfix has the hash of its assets, and the copies in the archive are compared with them. The
    assets of the head of another version are not available, so that it gets the hash of its files instead.
    Raises InputError if the archive states another hash.
    """
    own = hash_of(content)
    if stated == own:
        return own
    if all(one.provenance.origin != "shipped" for one in content.structures):
        raise _other()
    if stated != shipped_hash():
        return own
    if not is_shipped_head(content, files):
        raise _other()
    return stated


def _other() -> InputError:
    return InputError("the archive was changed; its surfaces and volumes are not those that its content_hash names.")
