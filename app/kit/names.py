"""Checks of names typed by users: kept as typed, without control, invisible or reordering characters."""

import re
import unicodedata
from collections.abc import Collection

from vfix_engine.errors import InputError

MAX_NAME, MAX_TEXT = 120, 10_000  # [characters]
COLOUR = "#[0-9a-f]{6}"  # a pattern, of a whole text
# Controls, lone surrogates, line and paragraph separators.
_REFUSED_CATEGORIES = frozenset({"Cc", "Cs", "Zl", "Zp"})
# Characters that reorder the surrounding text, by which a name could look like another one.
_REORDERING = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


# Letters and a symbol that are blank, and therefore no name by themselves.
_BLANK = frozenset("\u115f\u1160\u3164\uffa0\u2800")
# Marks without a glyph: joiners, vowels that are not drawn, and variation selectors.
_SELECTORS = (
    ("\u034f", "\u034f"), ("\u17b4", "\u17b5"), ("\u180b", "\u180f"), ("\ufe00", "\ufe0f"),
    ("\U000e0100", "\U000e01ef"),
)  # fmt: skip


def check_name(text: object, what: str) -> str:
    """Check a name and return it unchanged.

    Raises InputError if it is invisible, too long or contains a refused character.
    """
    return _without_noncharacters(check_stored_name(text, what), what)


def check_label(text: object, what: str) -> str:
    """Check a label as `check_name`, but allow an empty one, since other programs write points without labels."""
    return _without_noncharacters(_seen_or_empty(check_stored_label(text, what), what), what)


def printable(text: str) -> str:
    """The text with what a terminal obeys or nobody sees as escapes, such as '\\x1b'."""
    return "".join(one if one.isprintable() else ascii(one)[1:-1] for one in text)


def check_stored_name(text: object, what: str) -> str:
    """Check a name as `check_name`, but allow Unicode noncharacters, so that stored items with them stay readable."""
    name = check_stored_label(text, what)
    if not _is_seen(name):
        raise InputError(f"the {what} is empty or invisible; give it a name of letters, digits or signs.")
    return name


def unused_name(name: str, taken: Collection[str], *, last: bool = False) -> str:
    """Return the name, with a number larger than all numbers already appended to it if it is taken.

    last: also append a number if only numbered names are taken, so that the newest item has the largest number.
    """
    short = name[: MAX_NAME - 8]
    found = [re.fullmatch(re.escape(short) + r" ([1-9]\d{0,5})", one, re.ASCII) for one in taken]
    numbers = [int(match[1]) for match in found if match]
    if name not in taken and not (last and numbers):
        return name
    number = max(numbers, default=1) + 1
    while (made := f"{short.rstrip()} {number}") in taken:
        number += 1
    return made


def _seen_or_empty(label: str, what: str) -> str:
    if label and not _is_seen(label):
        raise InputError(f"the {what} is invisible; use letters, digits or signs, or leave it empty.")
    return label


def _without_noncharacters(text: str, what: str) -> str:
    """Raise InputError for Unicode noncharacters such as U+FFFE, which are not allowed in XML and cannot be typed."""
    if any(0xFDD0 <= ord(c) <= 0xFDEF or ord(c) & 0xFFFE == 0xFFFE for c in text):
        raise InputError(f"the {what} holds a character that is none; use letters, digits and signs.")
    return text


def as_seen(text: str) -> str:
    """Return the visible form of a name: names with equal forms look the same, whatever characters they contain."""
    shown = unicodedata.normalize("NFC", "".join(c for c in text if not _is_hidden(c)))
    return " ".join(shown.split())


def _is_hidden(c: str) -> bool:
    """Return whether a character has no glyph: it joins, separates or modifies its neighbours, or is blank."""
    return unicodedata.category(c) == "Cf" or c in _BLANK or any(low <= c <= high for low, high in _SELECTORS)


def _is_seen(text: str) -> bool:
    return any(unicodedata.category(c)[0] in "LNPS" and c not in _BLANK for c in text)


def check_line(text: object, what: str, most: int) -> str:
    """Check a text of one line as `check_name`, with another allowed number of characters."""
    line = _without_noncharacters(_checked_line(text, what, most), what)
    if not _is_seen(line):
        raise InputError(f"the {what} is empty or invisible; write letters, digits or signs.")
    return line


def check_stored_label(text: object, what: str) -> str:
    """Check a label as `check_stored_name`, but allow empty and invisible ones, so that stored plans stay readable."""
    return _checked_line(text, what, MAX_NAME)


def _checked_line(text: object, what: str, most: int) -> str:
    if not isinstance(text, str):
        raise InputError(f"the {what} must be text.")
    if len(text) > most:
        raise InputError(f"the {what} has {len(text)} characters; {most} are allowed.")
    if any(unicodedata.category(c) in _REFUSED_CATEGORIES or c in _REORDERING for c in text):
        raise InputError(f"the {what} holds a control character; use letters, digits and signs.")
    return text


def check_text(text: object, what: str, most: int) -> str:
    """Check a text of several lines and return it unchanged.

    what: its name in plural, for messages. most: allowed number of characters.
    Raises InputError if it is too long or contains a refused character.
    """
    if not isinstance(text, str):
        raise InputError(f"the {what} must be text.")
    if len(text) > most:
        raise InputError(f"the {what} have {len(text):,} characters; {most:,} are allowed.")
    inner = text.replace("\n", "").replace("\t", "")
    if any(unicodedata.category(c) in _REFUSED_CATEGORIES or c in _REORDERING for c in inner):
        raise InputError(f"the {what} hold a control character; use letters, digits, signs and line breaks.")
    return text
