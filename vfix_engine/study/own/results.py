"""The results of a study: a folder with one file for each trial, each written at once or not at all."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

import msgspec

from ...errors import InputError
from .file import StudyCondition, StudyFile, TrialName, is_simulated
from .plugins import ScoredTrial

TRIALS = "trials"  # the folder of the trials' files


class TrialRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a trial came to.

    subject: code; trial: 1, 2, …; metrics: by name, None where the trial has none. completed: the path's end was
    reached. fingerprint: of the simulation that made it, '' of a real person. run: a real person's recorded run by
    its id, or a hash; '' of a simulated one.
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
        trial: ScoredTrial,
        metrics: dict[str, float | None],
        run: str = "",
    ) -> TrialRecord:
        """The record of a scored trial."""
        number = name.trial + 1
        return cls(
            "vfix-study-trial/1", name.subject, *name.condition, number, trial.completed, metrics, fingerprint, run
        )

    @property
    def name(self) -> TrialName:
        """Which trial it is."""
        condition = StudyCondition(self.case, self.plan, self.mode, self.arm, self.tool)  # type: ignore[arg-type]
        return TrialName(self.subject, condition, self.trial - 1)


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
        write_whole(self._file(record.name), msgspec.json.format(msgspec.json.encode(record), indent=1) + b"\n")

    def read(self, names: Iterable[TrialName]) -> dict[TrialName, TrialRecord]:
        """The records of those trials that are there.

        Raises:
            InputError: a file that is none of a trial.
        """
        found = {}
        for name in names:
            file = self._file(name)
            try:
                record = msgspec.json.decode(file.read_bytes(), type=TrialRecord)
            except FileNotFoundError:
                continue
            except (OSError, msgspec.MsgspecError) as error:
                raise InputError(
                    f"{file.name} of the results cannot be read; delete it to run the trial again: {error}"
                ) from None
            if record.name == name:
                found[name] = record
        return found

    def _file(self, name: TrialName) -> Path:
        told = hashlib.sha256("\0".join(name.condition).encode()).hexdigest()[:12]
        return self.folder / TRIALS / f"{name.subject}-{name.condition.mode}-{told}-{name.trial + 1:04d}.json"


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
