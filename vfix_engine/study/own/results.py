"""The results of a study: a folder with one file for each trial, each written at once or not at all.

So are the questionnaires that people have answered, and why trials of theirs are missing.
"""

from __future__ import annotations

import hashlib
import itertools
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Literal, TypeVar

import msgspec

from ...errors import InputError
from .file import StudyCondition, StudyFile, TrialName, is_simulated
from .questionnaire import AnsweredTlx

TRIALS, ANSWERS, SKIPS = "trials", "answers", "skips"  # the folders of the files

T = TypeVar("T")


class TrialRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a trial came to.

    subject: code; trial: 1, 2, …; metrics: by name, None where the trial has none. completed: the path's end was
    reached, or in a lumen the task done. fingerprint: of the simulation that made it, '' of a real person. run: a real
    person's recorded run by its id, or a hash; '' of a simulated one.
    """

    schema: Literal["vfix-study-trial/1"]
    subject: str
    case: str
    plan: str
    mode: str
    arm: str
    tool: str
    trial: int
    completed: bool
    metrics: dict[str, float | None]
    fingerprint: str = ""
    run: str = ""

    @classmethod
    def of(
        cls,
        name: TrialName,
        fingerprint: str,
        completed: bool,
        metrics: dict[str, float | None],
        run: str = "",
    ) -> TrialRecord:
        """The record of a scored trial."""
        number = name.trial + 1
        return cls("vfix-study-trial/1", name.subject, *name.condition, number, completed, metrics, fingerprint, run)

    @property
    def name(self) -> TrialName:
        """Which trial it is."""
        condition = StudyCondition(self.case, self.plan, self.mode, self.arm, self.tool)  # type: ignore[arg-type]
        return TrialName(self.subject, condition, self.trial - 1)


class SkippedTrial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A trial of a person that was left out. trial: 1, 2, …; reason: as whoever led the study put it."""

    schema: Literal["vfix-study-skip/1"]
    subject: str
    case: str
    plan: str
    mode: str
    arm: str
    tool: str
    trial: int
    reason: str

    @classmethod
    def of(cls, name: TrialName, reason: str) -> SkippedTrial:
        """A trial that was left out."""
        return cls("vfix-study-skip/1", name.subject, *name.condition, name.trial + 1, reason)


class StudyResults:
    """The results in a folder, which is made where it is missing.

    Raises:
        InputError: it cannot be made.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        try:
            (folder / TRIALS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"the folder of results cannot be made: {error.strerror}; choose another --results"
            ) from None

    def write(self, record: TrialRecord) -> None:
        """Write the file of a trial, and replace an older one. Raises InputError."""
        self._write(self._file(record.name), record)

    def write_answer(self, answer: AnsweredTlx) -> None:
        """Write the answers of a subject after a condition, and replace older ones. Raises InputError."""
        self._write(self._answer(answer.subject, answer.condition), answer)

    def write_skip(self, name: TrialName, reason: str) -> None:
        """Note why a trial is missing. Raises InputError."""
        self._write(self._file(name, SKIPS), SkippedTrial.of(name, reason))

    def forget(self, name: TrialName) -> None:
        """Remove the record of a trial, and why it is missing. Raises InputError."""
        for file in (self._file(name), self._file(name, SKIPS)):
            try:
                file.unlink(missing_ok=True)
            except OSError as error:
                raise InputError(f"{file.name} cannot be removed: {error.strerror}") from None

    def forget_answer(self, subject: str, condition: StudyCondition) -> None:
        """Remove the answers of a subject after a condition."""
        self._answer(subject, condition).unlink(missing_ok=True)

    def read(self, names: Iterable[TrialName]) -> dict[TrialName, TrialRecord]:
        """The records of those trials that are there.

        Raises:
            InputError: a file that is none of a trial.
        """
        records = ((name, _read(self._file(name), TrialRecord)) for name in names)
        return {name: record for name, record in records if record is not None and record.name == name}

    def read_answers(self, subjects: Iterable[str], wanted: Iterable[StudyCondition]) -> list[AnsweredTlx]:
        """The answers of subjects after conditions, those that are there. Raises InputError, as `read`."""
        places = itertools.product(subjects, tuple(wanted))
        found = (_read(self._answer(*place), AnsweredTlx) for place in places)
        return [one for one in found if one is not None]

    def read_reasons(self, names: Iterable[TrialName]) -> dict[TrialName, str]:
        """Why trials are missing, of those that were skipped. Raises InputError, as `read`."""
        skips = ((name, _read(self._file(name, SKIPS), SkippedTrial)) for name in names)
        return {name: skip.reason for name, skip in skips if skip is not None}

    def _file(self, name: TrialName, folder: str = TRIALS) -> Path:
        begin = f"{name.subject}-{name.condition.mode}-{_told(name.condition)}"
        return self.folder / folder / f"{begin}-{name.trial + 1:04d}.json"

    def _answer(self, subject: str, condition: StudyCondition) -> Path:
        return self.folder / ANSWERS / f"{subject}-{condition.mode}-{_told(condition)}.json"

    @staticmethod
    def _write(file: Path, content: msgspec.Struct) -> None:
        file.parent.mkdir(exist_ok=True)
        write_whole(file, msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n")


def _told(condition: StudyCondition) -> str:
    return hashlib.sha256("\0".join(condition).encode()).hexdigest()[:12]


def _read(file: Path, kind: type[T]) -> T | None:
    """What a file has, None where there is none. Raises InputError."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=kind)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.MsgspecError) as error:
        raise InputError(
            f"{file.name} of the results cannot be read; delete it to run the trial again: {error}"
        ) from None


def done_of(
    study: StudyFile, found: dict[TrialName, TrialRecord], fingerprints: dict[StudyCondition, str] | None = None
) -> dict[TrialName, TrialRecord]:
    """The records that are of this study: with its metrics and, of simulated people, of its scenes and people.

    fingerprints: of ``SimulatedTrials``; None: whatever they are.
    """
    return {
        name: record
        for name, record in found.items()
        if set(study.metrics) <= set(record.metrics)
        and (
            fingerprints is None or not is_simulated(name.subject) or record.fingerprint == fingerprints[name.condition]
        )
    }


def write_whole(file: Path, data: bytes) -> None:
    """Replace a file at once: whoever reads it sees the old or the new one. Raises InputError."""
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=".vfix-", dir=file.parent)
        try:
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(data)
            Path(temporary).replace(file)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(f"{file.name} cannot be written: {error.strerror}") from None
