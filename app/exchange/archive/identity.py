"""The hash of an archive's case, computed anew: by it plans and registrations belong to an anatomy."""

from __future__ import annotations

from app.cases.files import CaseFiles
from app.cases.model import CaseContent
from app.cases.service import hash_of
from app.plans.shipped_head import is_shipped_head, shipped_hash
from vfix_engine.errors import InputError


def checked_hash(said: str, content: CaseContent, files: CaseFiles) -> str:
    """The hash of a case whose files are stored already. Raises InputError where the archive says another one.

    The head that travels with vfix has the hash of its assets; the copies of the archive are compared with them. Of
    the head of another version the assets are not here, so that it gets the hash of its files instead.
    """
    own = hash_of(content)
    if said == own:
        return own
    if all(one.provenance.origin != "shipped" for one in content.structures):
        raise _other()
    if said != shipped_hash():
        return own
    if not is_shipped_head(content, files):
        raise _other()
    return said


def _other() -> InputError:
    return InputError(
        "the surfaces and volumes of the archive are not those that its content_hash names; the archive was changed."
    )
