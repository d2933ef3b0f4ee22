"""JSON of anybody's making: refused in words wherever Python itself would stumble later, or not at all."""

import math

import pytest

from vfix_engine.json_text import MAX_DEPTH, MAX_DIGITS, parse_json


def test_values_are_read_as_they_are() -> None:
    text = '{"a": [1, -2.5e3, true, null, "ö"], "b": {"c": 12345678901234567890}}'
    assert parse_json(text) == {"a": [1, -2500.0, True, None, "ö"], "b": {"c": 12345678901234567890}}
    assert parse_json(text.encode()) == parse_json(text.encode("utf-16")) == parse_json(text)
    assert math.isfinite(float(parse_json("9" * MAX_DIGITS)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("9" * (MAX_DIGITS + 1), "too large"),
        ("-" + "9" * 100_000, "too large"),
        ("[-1e999]", "too large"),
        ('["\\ud800"]', "not sound Unicode"),
        ("[" * 100_000, "nested more than"),
        ("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), "nested more than 64 deep"),
        ("[NaN]", "NaN is no number"),
        ("[-Infinity]", "no number"),
        ("{", "line 1"),
        (b"\xff", "utf-8"),
        ('{"unit": "m", "unit": "mm"}', "the key 'unit' stands twice"),
        ("{" + ",".join(f'"k{n}":1' for n in range(100_000)) + ',"k99999":1}', "the key 'k99999' stands twice"),
        ('[{"a": {"b": 1, "c": 2, "b": 1}}]', "the key 'b' stands twice"),
    ],
)
def test_what_cannot_be_computed_with_is_refused(text: str | bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        parse_json(text)
