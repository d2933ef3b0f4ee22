"""Strict JSON from untrusted files: every accepted value can be written, compared, reported and computed with."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from typing import Any, NoReturn

MAX_DEPTH = 64  # of nested lists and objects
MAX_DIGITS = 300  # of an integer: a float has 308
_TOO_DEEP = f"it is nested more than {MAX_DEPTH} deep"


def parse_json(text: str | bytes) -> Any:
    """Parse a JSON value without NaN and infinity from text, or from bytes in UTF-8, 16 or 32.

    Rejects objects with duplicate keys, which readers resolve differently, numbers too large for a float, and unpaired
    surrogates, which cannot be encoded again. The depth is limited explicitly, since the interpreter's limit depends on
    the caller's stack.

    Raises:
        ValueError: the text is not such a value; the message gives the reason, without a full stop.
    """
    if isinstance(text, bytes):
        text = text.decode(json.detect_encoding(text))
    try:
        data = json.loads(
            text, parse_constant=_no_constant, parse_float=_float, parse_int=_int, object_pairs_hook=_object
        )
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    level = [data]
    for _ in range(MAX_DEPTH):
        level = [inner for item in level for inner in _inside(item)]
        if not level:
            _check_texts(text, data)
            return data
    raise ValueError(_TOO_DEEP)


def _inside(item: Any) -> Iterable[Any]:
    if isinstance(item, dict):
        return item.values()
    return item if isinstance(item, list) else ()


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        seen = set[str]()
        for key, _ in pairs:
            if key in seen:
                raise ValueError(f"the key {key!a:.60} stands twice in one object")
            seen.add(key)
    return found


def _check_texts(text: str, data: Any) -> None:
    if "\\u" in text:  # only an escape can be an unpaired surrogate
        try:
            json.dumps(data, ensure_ascii=False).encode()
        except UnicodeEncodeError:
            raise ValueError("a text of it is not sound Unicode") from None


def _float(word: str) -> float:
    found = float(word)
    if math.isinf(found):
        raise ValueError("a number of it is too large")
    return found


def _int(word: str) -> int:
    if len(word) > MAX_DIGITS:
        raise ValueError("a number of it is too large")
    return int(word)


def _no_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number of JSON")
