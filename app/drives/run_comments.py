"""Comments on stored runs, as an instructor writes, changes and deletes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.clock import utc_now
from app.drives.live_comments import RunComment, check_room, checked_comment, clock_of
from app.drives.runs import RunService, row_of
from app.drives.stored_run import COMMENTS, comments_in
from app.kit.errors import NotFound
from app.kit.values import new_id, number
from app.store import Store
from vfix_engine.errors import InputError
from vfix_engine.runtime.run import Run


class RunComments:
    """Comments on stored runs. Thread-safe; every change is one transaction."""

    def __init__(self, store: Store, runs: RunService) -> None:
        self._store, self._runs = store, runs

    def add(self, run_id: str, at_s: float, text: object) -> RunComment:
        """A comment at a driven time since the last return to the start.

        Raises NotFound, InputError for such a text or time, and TooMany.
        """
        said, step, t_s = checked_comment(text), *self._place(run_id, at_s)
        new = RunComment(new_id("c"), t_s, step, said, utc_now())
        with self._store.writing() as session:
            there = _stored(session, run_id)
            check_room(there)
            _store(session, run_id, (*there, new))
        return new

    def edit(self, run_id: str, comment_id: str, text: object = None, at_s: float | None = None) -> RunComment:
        """Another text, another time, or both. Raises as `add`."""
        changes: dict[str, Any] = {} if text is None else {"text": checked_comment(text)}
        if at_s is not None:
            changes["step"], changes["t_s"] = self._place(run_id, at_s)
        with self._store.writing() as session:
            there = _stored(session, run_id)
            new = replace(_one(there, comment_id), **changes)
            _store(session, run_id, [new if one.id == comment_id else one for one in there])
        return new

    def delete(self, run_id: str, comment_id: str) -> None:
        """Raises NotFound."""
        with self._store.writing() as session:
            there = _stored(session, run_id)
            gone = _one(there, comment_id)
            _store(session, run_id, [one for one in there if one is not gone])

    def _place(self, run_id: str, at_s: float) -> tuple[int, float]:
        """Number of steps before a time of a run, and that time in s. Raises InputError for one outside of it."""
        at_s = number(at_s, "the time of a comment")
        with self._runs.laid_out(run_id) as folder:
            first, t = clock_of(Run.read(folder))
        if not len(t) or not 0.0 <= at_s <= t[-1] + 0.05:  # as the page rounds its end
            end = t[-1] if len(t) else 0.0
            raise InputError(f"this run lasts from 0 to {end:.1f} s; {at_s:g} s is outside of it.")
        return first + int(np.searchsorted(t, at_s, side="right")), round(min(at_s, float(t[-1])), 4)


def _one(there: Sequence[RunComment], comment_id: str) -> RunComment:
    for one in there:
        if one.id == comment_id:
            return one
    raise NotFound(f"this run has no comment {comment_id!r:.80}.")


def _stored(session: Session, run_id: str) -> tuple[RunComment, ...]:
    return comments_in(row_of(session, run_id).manifest)


def _store(session: Session, run_id: str, comments: Sequence[RunComment]) -> None:
    """A run without comments has no word of them."""
    row = row_of(session, run_id)
    rest = {name: value for name, value in row.manifest.items() if name != COMMENTS}
    row.manifest = {**rest, COMMENTS: [vars(one) for one in comments]} if comments else rest
