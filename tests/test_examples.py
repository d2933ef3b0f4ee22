"""Every numbered example runs as it stands, says something, and is listed with its own first line."""

import ast
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))


def first_line(example: Path) -> str:
    docstring = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8")))
    assert docstring is not None
    return docstring.splitlines()[0]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_an_example_runs(example: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its own assertions hold; those of bone, HAZ-01, are among them."""
    runpy.run_path(str(example), run_name="__main__")
    assert capsys.readouterr().out.strip()


def test_the_examples_are_numbered_and_listed() -> None:
    assert [int(example.name[:2]) for example in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))
    page = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    for example in EXAMPLES:
        assert f"[{example.name}](examples/{example.name})" in page
        assert first_line(example) in page


def test_the_ten_lines_are_ten() -> None:
    """From the mesh to what holds the tool, in the second example."""
    tree = ast.parse(EXAMPLES[1].read_text(encoding="utf-8"))
    statements = [
        node for node in tree.body if not isinstance(node, (ast.Import, ast.ImportFrom, ast.Expr, ast.Assert))
    ]
    assert len(statements) <= 10
