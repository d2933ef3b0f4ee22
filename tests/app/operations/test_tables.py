"""The tables of operations in the documentation are those of the declarations."""

import sys
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"


def test_the_tables_on_disk_are_those_of_the_declarations() -> None:
    sys.path.insert(0, str(SCRIPTS))
    import operation_tables

    from app.operations import specs

    text = operation_tables.TARGET.read_text(encoding="utf-8")
    assert text == operation_tables.with_tables(text), "run scripts/operation_tables.py"
    for spec in specs():
        assert f"<!-- operations of {spec.kind.name} -->" in text
