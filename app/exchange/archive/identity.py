"""What the case of an archive is, by its files: its content hash, which ties plans, routes and registrations to it."""

from __future__ import annotations

from dataclasses import replace

from app.cases.files import CaseFiles
from app.cases.model import CaseContent
from app.cases.service import hash_of
from app.lumen.shipped_lumens import is_shipped_hash, restored_lumen
from app.plans.shipped_head import is_shipped_head, shipped_hash
from vfix_engine.errors import InputError

OTHER_VERSION = "This lumen came along with another version of vfix; here it is a lumen as any other."


def checked_identity(stated: str, content: CaseContent, files: CaseFiles) -> tuple[CaseContent, str]:
    """Return the content and the hash of a case whose files are already stored.

    The head shipped with vfix has the hash of its assets, and the copies in the archive are compared with them; so are
    the shipped lumens, whose surface is that of vfix again, with what belongs to it, such as a base. The assets of
    another version are not available, so that such a case gets the hash of its files instead.
    Raises InputError if the archive states another hash.
    """
    own = hash_of(content)
    if content.kind == "lumen" and _shipped(content):
        return _lumen(stated, own, content, files)
    if stated == own:
        return content, own
    if not _shipped(content):
        raise _other()
    if stated != shipped_hash():
        return content, own
    if not is_shipped_head(content, files):
        raise _other()
    return content, stated


def _lumen(stated: str, own: str, content: CaseContent, files: CaseFiles) -> tuple[CaseContent, str]:
    restored = restored_lumen(content, files)
    if restored is not None:
        return restored
    if is_shipped_hash(stated):
        raise _other()
    notes = content.notes if OTHER_VERSION in content.notes else (*content.notes, OTHER_VERSION)
    return replace(content, notes=notes), own


def _shipped(content: CaseContent) -> bool:
    return any(one.provenance.origin == "shipped" for one in content.structures)


def _other() -> InputError:
    return InputError("the archive was changed; its surfaces and volumes are not those that its content_hash names.")
