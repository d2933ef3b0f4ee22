"""Names of what comes in: given, the file's own series description where the user agrees, else plain ones.

A plain name holds nothing of the file: people write the patient's name into file names and descriptions (HAZ-33).
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from app.clock import local_now
from app.kit.names import check_name, unused_name
from vfix_engine.errors import InputError

Sort = Literal["CT", "MR", "Surface", "Volume"]
_MODALITIES: tuple[Sort, ...] = ("CT", "MR")
NO_DESCRIPTION = "The file has no series description that can be a name; the usual name was given."
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")


@dataclass(frozen=True)
class WantedName:
    """What the user says of the name; what: it is a name of, in messages.

    given: None where the user gives none. described: whether the file's series description may become the name.
    """

    given: str | None
    described: bool
    what: str

    def check(self) -> None:
        """Raises InputError for a name that cannot be one, and for a name together with the wish for another."""
        if self.given is None:
            return
        check_name(self.given.strip(), f"{self.what}'s name")
        if self.described:
            raise InputError("give a name, or ask for the file's series description, not both.")

    def among(self, taken: Collection[str], sort: Sort, description: str) -> tuple[str, tuple[str, ...]]:
        """The name, where others are taken, and a note where it is not the one that was asked for.

        description: of the file's series, '' where it has none.
        """
        if self.given is not None:
            return check_name(self.given.strip(), f"{self.what}'s name"), ()
        if not self.described:
            return plain_name(sort, taken, local_now()), ()
        try:
            return unused_name(check_name(description, "series description"), taken), ()
        except InputError:
            return plain_name(sort, taken, local_now()), (NO_DESCRIPTION,)


def plain_name(sort: Sort, taken: Collection[str], now: datetime) -> str:
    """'CT 3, 25 Nov 19:40': sort of file, its number after the largest that is taken, and the time of import."""
    pattern = re.compile(rf"{sort} ([1-9]\d{{0,5}}), .*", re.ASCII)
    numbers = [int(match[1]) for name in taken if (match := pattern.fullmatch(name))]
    number, month = max(numbers, default=0) + 1, _MONTHS[now.month - 1]
    return f"{sort} {number}, {now.day} {month} {now:%H:%M}"


def sort_of_volume(modality: str) -> Sort:
    """Sort of a volume out of what its file says, which may be anything."""
    return next((known for known in _MODALITIES if known == modality), "Volume")
