"""Every text of the planner that may reach the page is within its limit; tests/web/page-words.test.js has the page's.

Counted is what the page shows: a dozen words of a text, up to the end of a sentence or clause; the rest is behind '?'.
A verdict has eight. Free are the sentences behind the verdict's '?', names that the user gave, and file contents.
"""

from __future__ import annotations

import re

import pytest
from page_texts import brief, count_words, server_texts, texts_of

UNKNOWN_WORDS = re.compile(r"\b(driven dry|not said|to spare|dry runs?)\b", re.IGNORECASE)


def test_no_text_is_past_its_limit() -> None:
    texts = server_texts()
    assert len(texts) > 1000, "the modules were read"
    long = [text for text in texts if text.is_long]
    assert [f"{one.file}:{one.line}: {one.words} words: {one.text}" for one in long] == []


def test_no_text_has_a_word_that_a_surgeon_does_not_know() -> None:
    assert [f"{one.file}:{one.line}: {one.text}" for one in server_texts() if UNKNOWN_WORDS.search(one.text)] == []


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (
            'def f():\n    """Not a text."""\n    return "One of two" if a else f"The {b} of two"',
            ["One of two", "The □ of two"],
        ),
        (
            'WORDS = "In sight"\n\n\ndef f():\n    raise E(f"{WORDS}, " + "and more")',
            ["In sight", "In sight, and more"],
        ),
        ("x = [f\"Outer {call('Inner words')} end\"]", ["Outer □ end", "Inner words"]),
        ('log.info("not for the page")', []),
    ],
)
def test_a_text_is_found_wherever_it_stands(source: str, expected: list[str]) -> None:
    assert [text.text for text in texts_of(source, "app/x.py")] == expected


def test_a_text_begins_with_a_dozen_words() -> None:
    assert count_words("3 mm · bone … 0.55") == 4
    assert brief("Locked. Unlock it first.") == "Locked. Unlock it first."
    long = "Images can identify the patient. An export that holds them asks first, each time."
    assert brief(long) == "Images can identify the patient."
    assert brief("the points lie in different frames; measure all of them again in one way, please.") == (
        "the points lie in different frames;"
    )
