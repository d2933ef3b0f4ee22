"""Names: the number appended to a name that is taken."""

import pytest

from app.kit.names import MAX_NAME, printable, unused_name


@pytest.mark.parametrize(
    ("name", "taken", "given"),
    [
        ("A", [], "A"),
        ("A", ["B", "A 2"], "A"),
        ("A", ["A"], "A 2"),
        ("A", ["A", "A 2", "A 7", "A 0", "A x", "B 9"], "A 8"),
        ("A 2", ["A", "A 2"], "A 2 2"),
        ("a.c (x)", ["a.c (x)", "abc (x) 5"], "a.c (x) 2"),
        ("A", ["A", "A ٣", "A 99999999"], "A 2"),
        ("A", ["A", "A 999999", "A 1000000"], "A 1000001"),
    ],
)
def test_a_name_that_is_taken_gets_a_number(name: str, taken: list[str], given: str) -> None:
    assert unused_name(name, taken) == given


def test_what_came_last_has_the_largest_number() -> None:
    assert [unused_name("A", taken, last=True) for taken in ([], ["A"], ["A 4"], ["A", "A 4"])] == [
        "A", "A 2", "A 5", "A 5",
    ]  # fmt: skip


def test_a_long_name_keeps_room_for_its_number() -> None:
    name, taken = "n" * MAX_NAME, set[str]()
    for _ in range(3):
        taken.add(unused_name(name, taken))
    assert len(taken) == 3
    assert max(map(len, taken)) == MAX_NAME


def test_what_a_terminal_obeys_is_shown_as_an_escape() -> None:
    assert printable("Größe\x1b[31m\n\u202e") == r"Größe\x1b[31m\n\u202e"
