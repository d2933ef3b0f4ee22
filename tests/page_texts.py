"""Every text of the planner that may reach the page: `python tests/page_texts.py` lists them.

A string of a module is a text unless its place says that it is none, so that none is missed silently.
"""

from __future__ import annotations

import ast
import itertools
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HOLE = "□"  # a value that only the running planner knows: one word
SHOWN_WORDS = 12  # the page shows so much of a text, and the rest behind '?'
VERDICT_WORDS = 8
# what prints or draws for itself, and what is nothing but names of tables and settings
ELSEWHERE = (
    "app/commands/",
    "app/cli.py",
    "app/store/migrations/",
    "app/exchange/report/",
    "app/exchange/study_report.py",
)
ELSEWHERE += (
    "app/exchange/study_report.py",
    "app/settings.py",
    "app/store/schema.py",
    "app/api/error_statuses.py",
    "app/gateway/scene_page.py",
)  # said before there is a page, in the docs, or no text but a script
HELP = ("app/planning/verdict_words.py",)  # the sentences of the verdict, behind '?'
VERDICTS = ("app/planning/verdict.py",)
# what never shows its arguments
SILENT_CALLS = {
    "debug",
    "info",
    "warning",
    "error",
    "exception",
    "text",
    "compile",
    "getLogger",
    "NewType",
    "TypeVar",
    "Field",
    "Query",
    "Path",
}
SILENT_CALLS |= {
    "File",
    "Form",
    "Header",
    "match",
    "search",
    "fullmatch",
    "sub",
    "execute",
    "CheckConstraint",
    "Index",
    "literal_column",
    "add_argument",
    "Verb",
}
SILENT_NAMES = {"description", "summary", "openapi_tags", "responses", "pattern", "responds", "help"}
MOST_ALTERNATIVES = 200


@dataclass(frozen=True)
class Text:
    """One text as it stands in a module; words: of what the page shows of it."""

    file: str
    line: int
    kind: str
    text: str

    @property
    def words(self) -> int:
        if self.kind == "verdict":  # some begin behind the word of their level
            return count_words(self.text if self.text[0].isalnum() else HOLE + self.text)
        return count_words(brief(self.text) if self.kind == "said" else self.text)

    @property
    def is_long(self) -> bool:
        """Whether it is past the limit of its kind; help has none."""
        return self.kind != "help" and self.words > (VERDICT_WORDS if self.kind == "verdict" else SHOWN_WORDS)


def count_words(text: str) -> int:
    """How many words a text has: what has neither letter nor digit, such as '·', is none."""
    return sum(any(letter.isalnum() or letter == HOLE for letter in word) for word in text.split())


def brief(text: str) -> str:
    """What the page shows of a text (app/web/js/brief.js): a dozen words, up to the end of a sentence or clause."""
    for end in (r"[.!?…][’)]?(?= )|$", r"[;:](?= )|(?= \()"):
        parts = [text[: match.end()] for match in re.finditer(end, text)]
        whole = [part for part in parts if count_words(part) <= SHOWN_WORDS and part.count("(") == part.count(")")]
        if whole:
            return whole[-1]
    return re.split(r"(?<=[.!?]) ", text)[0]


def server_texts() -> list[Text]:
    """The texts of all modules of the application."""
    files = sorted((ROOT / "app").rglob("*.py"))
    named = [(path, path.relative_to(ROOT).as_posix()) for path in files]
    return [
        text
        for path, name in named
        if not name.startswith(ELSEWHERE)
        for text in texts_of(path.read_text("utf-8"), name)
    ]


def texts_of(source: str, file: str) -> list[Text]:
    """The texts of one module."""
    tree = ast.parse(source)
    constants = {
        target.id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name)
    }
    kind = "verdict" if file in VERDICTS else "help" if file in HELP else "said"
    found = [
        Text(file, node.lineno, kind, " ".join(text.split()))
        for node in _strings(tree)
        for text in dict.fromkeys(_alternatives(node, constants))
        if " " in text.strip() and any(letter.isalpha() for letter in text.replace(HOLE, ""))
    ]
    return list(dict.fromkeys(found))


def _strings(node: ast.AST) -> Iterator[ast.expr]:
    """The outermost expressions below a node that are made of strings."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
            continue  # a docstring
        if isinstance(child, ast.Call) and _name(child.func) in SILENT_CALLS:
            continue
        if isinstance(child, ast.keyword) and child.arg in SILENT_NAMES:
            continue
        if isinstance(child, ast.AnnAssign) and _name(child.target) in SILENT_NAMES:
            continue
        if isinstance(child, ast.expr) and _is_textual(child):
            yield child
            yield from _within(child)
        else:
            yield from _strings(child)


def _within(node: ast.expr) -> Iterator[ast.expr]:
    """What is called or chosen within a text has texts of its own."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr) and _is_textual(child):
            yield from _within(child)
        elif not isinstance(child, ast.Constant):
            yield from ([child] if isinstance(child, ast.expr) and _is_textual(child) else _strings_or_self(child))


def _strings_or_self(node: ast.AST) -> Iterator[ast.expr]:
    if isinstance(node, ast.FormattedValue):
        if _is_textual(node.value):
            yield from _within(node.value)
            return
        node = node.value
    yield from _strings(node)


def _is_textual(node: ast.expr) -> bool:
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str)
    if isinstance(node, ast.JoinedStr):
        return True
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.Add | ast.Mod) and (_is_textual(node.left) or _is_textual(node.right))
    if isinstance(node, ast.IfExp):
        return _is_textual(node.body) or _is_textual(node.orelse)
    return isinstance(node, ast.BoolOp) and any(_is_textual(value) for value in node.values)


def _alternatives(node: ast.expr, constants: dict[str, ast.expr]) -> list[str]:
    """The strings that an expression may be; a part that is not known is one word."""
    if isinstance(node, ast.Constant):
        return [str(node.value)]
    if isinstance(node, ast.JoinedStr):
        return _product([_alternatives(value, constants) for value in node.values])
    if isinstance(node, ast.FormattedValue):
        return _alternatives(node.value, constants) if node.format_spec is None else [HOLE]
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _product([_alternatives(node.left, constants), _alternatives(node.right, constants)])
    if isinstance(node, ast.IfExp):
        return _alternatives(node.body, constants) + _alternatives(node.orelse, constants)
    if isinstance(node, ast.BoolOp):
        return [text for value in node.values for text in _alternatives(value, constants)]
    known = constants.get(node.id) if isinstance(node, ast.Name) else None
    return _alternatives(known, constants) if known is not None and _is_textual(known) else [HOLE]


def _product(parts: list[list[str]]) -> list[str]:
    made = [""]
    for part in parts:
        options = [max(part, key=count_words)] if len(made) * len(part) > MOST_ALTERNATIVES else part
        made = ["".join(pair) for pair in itertools.product(made, options)]
    return made


def _name(node: ast.expr) -> str:
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


if __name__ == "__main__":
    texts = server_texts()
    for text in texts:
        if "--long" not in sys.argv or text.is_long:
            print(f"{text.file}:{text.line} {text.kind} {text.words} {text.text}")
    words = sum(count_words(text.text) for text in texts)
    seen = sum(text.words for text in texts if text.kind != "help")
    long = sum(text.is_long for text in texts)
    print(f"{len(texts)} texts of {words} words, {seen} of them in sight, {long} past their limit")
