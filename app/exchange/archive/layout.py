"""What an archive looks like, and how large it may be.

    manifest.json               schema, notice, versions of the programs, what is in the archive and what was left out
    case.json                   the case: id, name, time, hash, and its content as the store has it
    documents/KIND/ID.json      each plan, version of a plan, registration and label, as the store has it now
    plans/ID.json               each plan once more in the plan format of vfix, for other programs; not read back
    runs/ID.json                manifests of recorded drives, where they were asked for; not read back
    files/XX/SHA256             surfaces, volumes, masks and URDFs under the SHA-256 of their content
    SHA256SUMS                  checksums of all of them, as `sha256sum -c` reads them

Surfaces and volumes are NumPy archives (.npz) without pickle: `vertices` (V, 3) and `faces` (F, 3), or `hu` (K, J, I)
with `origin`, `spacing` and `direction`; LPS mm.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

SCHEMA = "vfix-archive/1"
MANIFEST, CASE, SUMS = "manifest.json", "case.json", "SHA256SUMS"

MAX_ENTRIES = 20_000
MAX_TOTAL_BYTES = 16 << 30  # of all entries, unpacked
MAX_JSON_BYTES = 64 << 20  # of one JSON entry
MAX_RATIO = 200  # unpacked to packed, of an archive of more than FREE_BYTES; a CT packs 2 to 20 times
FREE_BYTES = 64 << 20

_ID = r"(?!\.+(?:/|json))[A-Za-z0-9_.\-]{1,64}"  # and not of dots alone
ENTRY = re.compile(
    rf"manifest\.json|case\.json|SHA256SUMS|documents/{_ID}/{_ID}\.json|plans/{_ID}\.json|runs/{_ID}\.json"
    r"|files/([0-9a-f]{2})/(?=\1)[0-9a-f]{64}"
)
FILE = re.compile(r"[0-9a-f]{64}")  # a stored file, wherever in a JSON its hash stands


def file_entry(key: str) -> str:
    """The entry of a stored file."""
    return f"files/{key[:2]}/{key}"


def renamed(value: Any, names: Mapping[str, str]) -> Any:
    """A JSON value in which each text that is one of the names is replaced."""
    if isinstance(value, str):
        return names.get(value, value)
    if isinstance(value, dict):
        return {key: renamed(inner, names) for key, inner in value.items()}
    return [renamed(inner, names) for inner in value] if isinstance(value, list) else value
