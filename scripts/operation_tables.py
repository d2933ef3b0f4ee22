"""Write the tables of operations in docs/api.md from their declarations.

    .venv/bin/python scripts/operation_tables.py

A table stands between `<!-- operations of KIND -->` and `<!-- end -->`; a test compares it with what this gives.
"""

import inspect
import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from app.operations import DocumentSpec, Operation, spec_named  # noqa: E402
from app.operations.bodies import fields_of  # noqa: E402
from app.operations.rest import addresses  # noqa: E402
from app.operations.schema import object_schema  # noqa: E402

TARGET = ROOT / "docs" / "api.md"
_TABLE = re.compile(r"(<!-- operations of (\S+) -->\n).*?(<!-- end -->\n)", re.DOTALL)


def table(spec: DocumentSpec) -> str:
    """The rows of a kind: what lists and shows it, and every address of its operations."""
    of_case, own = f"/cases/{{case_id}}/{spec.path}", f"/{spec.path}/{{{spec.id}}}"
    rows = [
        ("GET", of_case, f"the {spec.path} of a case, oldest first; `include_deleted` includes those to be restored"),
        ("GET", own, "one of them, deleted or not"),
    ]
    rows += [(method, path, _words(method, path, found)) for (method, path), found in addresses(spec).items()]
    lines = [f"| `{method} /api/v1{path}` | {words} |" for method, path, words in rows]
    return "\n".join(["| Route | What it does |", "| --- | --- |", *lines]) + "\n"


def with_tables(text: str) -> str:
    """The page with every table made anew."""
    return _TABLE.sub(lambda found: found[1] + table(spec_named(found[2])) + found[3], text)


def _words(method: str, path: str, operations: list[type[Operation]]) -> str:
    schema, _ = object_schema(fields_of(operations))
    fields = {name: kind for name, kind in schema.get("properties", {}).items() if f"{{{name}}}" not in path}
    if len(operations) > 1:
        return f"one per request: {', '.join(f'`{name}`' for name in fields)}"
    paragraphs = inspect.cleandoc(operations[0].__doc__ or "").split("\n\n")
    words = " ".join(" ".join(paragraph.split()) for paragraph in paragraphs).rstrip(".")
    words = words[:1].lower() + words[1:]
    needed = schema.get("required", [])
    if method == "DELETE":
        return f"{words}; `revision` as above"
    for title, names in (("Fields", needed), ("Optional", [name for name in fields if name not in needed])):
        told = ", ".join(f"`{name}`{_bounds(fields[name])}" for name in names if name in fields)
        words = f"{words}. {title}: {told}" if told else words
    return words


def _bounds(schema: dict[str, Any]) -> str:
    """What a field may be, in words, where its schema says so."""
    schema = next((one for one in schema.get("anyOf", []) if one.get("type") != "null"), schema)
    if "enum" in schema:
        return f" ({', '.join(f'`{word}`' for word in schema['enum'])})"
    if "minimum" in schema and "maximum" in schema:
        low, high = (f"{schema[end]:,.12g}" for end in ("minimum", "maximum"))
        return f" (at least {low})" if schema["maximum"] >= 2**53 else f" ({low} to {high})"
    if "maxItems" in schema and schema.get("items"):
        return f" (at most {schema['maxItems']:,})"
    return ""


def main() -> int:
    """Write the page."""
    TARGET.write_text(with_tables(TARGET.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
