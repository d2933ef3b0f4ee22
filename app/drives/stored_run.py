"""A run as it is stored, and read from its row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from app.drives.live_comments import RunComment
from app.store.models import RunRow
from vfix_engine.errors import InputError
from vfix_engine.runtime.control_mode import run_mode
from vfix_engine.worlds.registry import arm_of, is_certified

RunOrigin = Literal["page", "command line", "replay", "study"]

COMMENTS = "comments"  # key of what is stored of a run


@dataclass(frozen=True)
class RunFile:
    """A file of a run."""

    sha256: str
    size_bytes: int


@dataclass(frozen=True)
class StoredRun:
    """A stored run.

    case_id, plan_id: what was driven, where that is stored. origin: page, command line, replay or study.
    manifest: as it was written; end: number of ticks, their digest and how many were lost, None for an interrupted
    run. files: by name. pierced: what the tool pierced, as in `PiercedReport`; None where that was not measured.
    plan_sha256: `driven_hash` of the plan that was driven, or the key of a route's way; None where that was not told.
    teacher: whether it is marked as the teacher's, of which a plan has one at most. comments: in the order of time.
    recorded: when it was stored; began: when its recording began, '' where that was not told.
    """

    id: str
    case_id: str | None
    plan_id: str | None
    origin: RunOrigin
    recorded: str
    size_bytes: int
    manifest: dict[str, Any]
    end: dict[str, Any] | None
    files: dict[str, RunFile]
    pierced: dict[str, Any] | None = None
    teacher: bool = False
    comments: tuple[RunComment, ...] = ()
    plan_sha256: str | None = None
    began: str = ""

    @property
    def world(self) -> str:
        """'rigid', 'freehand', 'snake' or 'snake drive'."""
        return str(self.manifest.get("world", ""))

    @property
    def mode(self) -> str | None:
        """'freehand', 'hands-on' or 'teleoperated', 'mixed' where it was changed on the way.

        None for a snake, and for a run whose word does not fit its world: no reader drives or scores it.
        """
        try:
            return run_mode(self.manifest)
        except InputError:
            return None

    @property
    def arm(self) -> str | None:
        """'manual', 'guided' or 'certified' of a snake; None of another world."""
        return arm_of(self.manifest)

    @property
    def links(self) -> int | None:
        """How many links a snake has; None of another world, and where the manifest does not hold it."""
        if self.arm is None:
            return None
        snake = self.manifest["spec"].get("snake")
        links = snake.get("links") if isinstance(snake, dict) else None
        return links if type(links) is int else None

    @property
    def certified(self) -> bool:
        """Whether every motion of it was certified: by its world, the columns of its rows, and a snake's arm."""
        return is_certified(self.manifest)

    @property
    def whole(self) -> bool:
        """Whether the drive was recorded to its end."""
        return self.end is not None


def stored_run(row: RunRow) -> StoredRun:
    """The run of a row."""
    stored = row.manifest
    return StoredRun(
        id=row.id,
        case_id=row.case_id,
        plan_id=row.plan_id,
        origin=stored["origin"],
        recorded=row.recorded,
        size_bytes=row.size_bytes,
        manifest=stored["manifest"],
        end=stored["end"],
        files={name: RunFile(**file) for name, file in row.files.items()},
        pierced=stored.get("pierced"),
        teacher=stored.get("teacher", False),
        comments=comments_in(stored),
        plan_sha256=stored.get("plan_sha256"),
        began=stored.get("began", ""),
    )


def comments_in(stored: dict[str, Any]) -> tuple[RunComment, ...]:
    """The comments of what is stored of a run, in the order of time."""
    found = (RunComment(**one) for one in stored.get(COMMENTS, ()))
    return tuple(sorted(found, key=lambda one: (one.step, one.written)))
