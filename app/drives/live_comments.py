"""Comments at a time of a run, beside its recording and never in it: what they are, and those of a drive."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from app.clock import utc_now
from app.kit.errors import TooMany
from app.kit.names import check_line
from app.kit.values import new_id
from app.store.errors import StorageError
from vfix_engine.arrays import Array
from vfix_engine.errors import ControlError, InputError
from vfix_engine.runtime.requests import Reset
from vfix_engine.runtime.run import PART, Run

MAX_CHARACTERS = 300
MOST = 200  # of one run


def beside(folder: Path, kind: str) -> Path:
    """A file beside a drive's folder, complete or not: 'json' identifies what was driven, 'comments' has those."""
    return folder.with_name(f"{folder.name.removesuffix(PART)}.{kind}")


@dataclass(frozen=True)
class RunComment:
    """A comment. step: number of recorded steps before it. written: an ISO time.

    t_s: driven time since the last return to the start, as a score and a replay count it; None where the tool was
    returned to the start after it, or where the run does not say.
    """

    id: str
    t_s: float | None
    step: int
    text: str
    written: str


def checked_comment(text: object) -> str:
    """The text of a comment without blanks around it: one line. Raises InputError."""
    return check_line(text.strip() if isinstance(text, str) else text, "comment", MAX_CHARACTERS)


class LiveComments:
    """Comments on a drive that is being recorded; each is in a file beside the recording before it is shown.

    Thread-safe. folder: of the recording.
    """

    def __init__(self, folder: Path) -> None:
        self._file, self._lock, self._open = beside(folder, "comments"), threading.Lock(), True
        self._all: tuple[RunComment, ...] = ()

    @property
    def all(self) -> tuple[RunComment, ...]:
        """In the order in which they were written."""
        return self._all

    def add(self, text: object, t_s: float, step: int) -> RunComment:
        """Raises InputError for such a text, ControlError after the end of the drive, TooMany, and StorageError."""
        said = checked_comment(text)
        with self._lock:
            if not self._open:
                raise ControlError("the drive has ended; comment on its run in Review.")
            check_room(self._all)
            new = RunComment(new_id("c"), t_s, step, said, utc_now())
            _write(self._file, (*self._all, new))
            self._all = (*self._all, new)
            return new

    def close(self) -> None:
        """The run is stored from now on with the comments that there are."""
        with self._lock:
            self._open = False


def comments_beside(folder: Path) -> list[RunComment]:
    """The comments on a recording, at the times that it has them; [] without any, or where they are damaged."""
    try:
        found = [RunComment(**one) for one in json.loads(beside(folder, "comments").read_text(encoding="utf-8"))]
    except (OSError, ValueError, TypeError):
        return []
    if not found:
        return []
    try:
        first, t = clock_of(Run.read(folder))
    except InputError:  # kept with the run all the same
        return [replace(one, t_s=None) for one in found]
    return [replace(one, t_s=_time(one.step - first, t)) for one in found]


def _time(index: int, t: Array) -> float | None:
    """Driven time in s after a number of steps since the last return to the start; None before that."""
    if index < 0:
        return None
    return 0.0 if index == 0 else round(float(t[min(index, len(t)) - 1]), 4)


def clock_of(run: Run) -> tuple[int, Array]:
    """Number of the first step since the last return to the start, and the driven time (n,) in s from there on."""
    starts = [event.at for event in run.events if isinstance(event.content, Reset) and event.at < len(run.ticks)]
    first = max(starts, default=0)
    return first, np.maximum.accumulate(run.column("t")[first:])  # runs of before turn it back with another period


def check_room(there: Sequence[RunComment]) -> None:
    """Raise TooMany where a run takes no further comment."""
    if len(there) >= MOST:
        raise TooMany(f"a run has {MOST} comments at most; delete one first.")


def _write(file: Path, comments: Sequence[RunComment]) -> None:
    """Whole at any time, and durable: a planner that is killed loses none. Raises StorageError."""
    new = file.with_name(f"{file.name}.new")
    try:
        with new.open("w", encoding="utf-8") as target:
            json.dump([vars(one) for one in comments], target)
            target.flush()
            os.fsync(target.fileno())
        new.replace(file)
    except OSError as error:
        with suppress(OSError):
            new.unlink(missing_ok=True)
        raise StorageError(f"the comment could not be stored: {error.strerror or error}.") from error
