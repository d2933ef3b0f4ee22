"""Layout and size limits of an archive.

    manifest.json       schema, notice, versions of the programs, what the archive contains and what was left out
    case.json           the case: id, name, time, hash, and its content as stored
    documents/KIND/ID.json
                        each plan, version of a plan, registration, label and route in its current state
    plans/ID.json       each plan also in the plan format of vfix, for other programs; not read back
    runs/ID.json        manifests of recorded drives, if requested, of one in a lumen with its arm and task; not read
                        back
    files/XX/SHA256     surfaces, volumes, masks and URDFs under the SHA-256 of their content
    SHA256SUMS          checksums of all of them, as `sha256sum -c` reads them

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
MAX_RATIO = 200  # unpacked to packed, for an archive of more than FREE_BYTES; a CT compresses by 2 to 20
FREE_BYTES = 64 << 20

_ID = r"(?!\.+(?:/|json))[A-Za-z0-9_.\-]{1,64}"  # but not dots alone
ENTRY = re.compile(
    rf"manifest\.json|case\.json|SHA256SUMS|documents/{_ID}/{_ID}\.json|plans/{_ID}\.json|runs/{_ID}\.json"
    r"|files/([0-9a-f]{2})/(?=\1)[0-9a-f]{64}"
)
FILE = re.compile(r"[0-9a-f]{64}")  # the hash of a stored file, anywhere in a JSON


def file_entry(key: str) -> str:
    """Return the name of the entry of a stored file."""
    return f"files/{key[:2]}/{key}"


def renamed(value: Any, names: Mapping[str, str]) -> Any:
    """Return a JSON value in which each string found in names is replaced by its new name."""
    if isinstance(value, str):
        return names.get(value, value)
    if isinstance(value, dict):
        return {key: renamed(inner, names) for key, inner in value.items()}
    return [renamed(inner, names) for inner in value] if isinstance(value, list) else value
