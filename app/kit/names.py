"""Names that people give: kept as typed, never read as markup, free of characters that hide or break something."""

import re
import unicodedata
from collections.abc import Collection

from vfix_engine.errors import InputError

MAX_NAME = 120  # [characters]
# Controls, lone surrogates, line and paragraph separators.
_REFUSED_CATEGORIES = frozenset({"Cc", "Cs", "Zl", "Zp"})
# Characters that reorder the text around them: a name must not look like another one.
_REORDERING = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


# Letters and a sign that are blank, and therefore no name by themselves.
_BLANK = frozenset("\u115f\u1160\u3164\uffa0\u2800")
# Marks that have no shape of their own: joiners, vowels that are not drawn, and selectors of variants.
_SELECTORS = (
    ("\u034f", "\u034f"), ("\u17b4", "\u17b5"), ("\u180b", "\u180f"), ("\ufe00", "\ufe0f"),
    ("\U000e0100", "\U000e01ef"),
)  # fmt: skip


def check_name(text: object, what: str) -> str:
    """The name as it was given. Raises InputError when nobody sees it, it is too long or holds a refused character."""
    return _without_noncharacters(check_stored_name(text, what), what)


def check_label(text: object, what: str) -> str:
    """Like `check_name`, but it may be empty: other programs write points without a label."""
    return _without_noncharacters(_seen_or_empty(check_stored_label(text, what), what), what)


def check_stored_name(text: object, what: str) -> str:
    """Like `check_name`, with the non-characters of Unicode: what was stored with such a name stays readable."""
    name = check_stored_label(text, what)
    if not _is_seen(name):
        raise InputError(f"the {what} is empty or invisible; give it a name of letters, digits or signs.")
    return name


def unused_name(name: str, taken: Collection[str], *, last: bool = False) -> str:
    """The name of what comes in: where one of these has it, with a number that is larger than those behind it.

    last: also where only such numbers are left of it, so that what came last has the largest.
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
    """Refuse what Unicode keeps for programs, such as U+FFFE: XML cannot hold it, and nobody can type it."""
    if any(0xFDD0 <= ord(c) <= 0xFDEF or ord(c) & 0xFFFE == 0xFFFE for c in text):
        raise InputError(f"the {what} holds a character that is none; use letters, digits and signs.")
    return text


def as_seen(text: str) -> str:
    """What people see of a name: two that are equal so look the same, whatever characters hide in them."""
    shown = unicodedata.normalize("NFC", "".join(c for c in text if not _is_hidden(c)))
    return " ".join(shown.split())


def _is_hidden(c: str) -> bool:
    """Whether nothing is drawn of a character: it joins, parts or changes its neighbours, or is blank."""
    return unicodedata.category(c) == "Cf" or c in _BLANK or any(low <= c <= high for low, high in _SELECTORS)


def _is_seen(text: str) -> bool:
    return any(unicodedata.category(c)[0] in "LNPS" and c not in _BLANK for c in text)


def check_stored_label(text: object, what: str) -> str:
    """Like `check_stored_name`, but it may be empty or invisible: plans with such a label stay readable."""
    if not isinstance(text, str):
        raise InputError(f"the {what} must be text.")
    if len(text) > MAX_NAME:
        raise InputError(f"the {what} has {len(text)} characters; {MAX_NAME} are allowed.")
    if any(unicodedata.category(c) in _REFUSED_CATEGORIES or c in _REORDERING for c in text):
        raise InputError(f"the {what} holds a control character; use letters, digits and signs.")
    return text


def check_text(text: object, what: str, most: int) -> str:
    """Text of several lines, as it was given. Raises InputError where it is too long or holds a refused character."""
    if not isinstance(text, str):
        raise InputError(f"the {what} must be text.")
    if len(text) > most:
        raise InputError(f"the {what} have {len(text):,} characters; {most:,} are allowed.")
    inner = text.replace("\n", "").replace("\t", "")
    if any(unicodedata.category(c) in _REFUSED_CATEGORIES or c in _REORDERING for c in inner):
        raise InputError(f"the {what} hold a control character; use letters, digits, signs and line breaks.")
    return text
