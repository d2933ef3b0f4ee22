"""HAZ-22: code in arrays of the store or in a worker's answer never runs."""

from __future__ import annotations

import json
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from app.cases.files import STORED, CaseFiles
from app.store import FileStore
from app.store.files import StorageError
from vfix_engine.files.sandbox.crossing import load


class Canary:
    """Makes a file when it is unpickled."""

    def __init__(self, file: Path):
        self.file = file

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return (os.mkdir, (str(self.file),))


@pytest.mark.parametrize("member", ["vertices", "faces"])
def test_code_in_a_stored_archive_never_runs(tmp_path: Path, member: str) -> None:
    """HAZ-22: an archive of the store with a pickled member."""
    sung = tmp_path / "sung"
    arrays: dict[str, object] = {"vertices": np.eye(3), "faces": np.array([[0, 1, 2]])}
    arrays[member] = np.array([Canary(sung)], dtype=object)
    files = FileStore(tmp_path / "files")
    key = files.put_with(lambda file: np.savez(file, allow_pickle=True, **arrays))
    with pytest.raises(StorageError, match="damaged"):
        CaseFiles(files).surface(STORED + key)
    assert not sung.exists()
    with np.load(files.path(key), allow_pickle=True) as archive:
        assert archive[member] is not None
    assert sung.exists(), "the canary sings where pickle is allowed"


def test_code_in_an_answer_of_a_worker_never_runs(tmp_path: Path) -> None:
    """HAZ-22: a worker that was taken over answers with a pickle in an array's place."""
    sung = tmp_path / "sung"
    (tmp_path / "answer.json").write_text(json.dumps({"kind": "array", "value": 0}), encoding="utf-8")
    np.save(tmp_path / "answer-0.npy", np.array([Canary(sung)], dtype=object), allow_pickle=True)
    for answer in ((tmp_path / "answer-0.npy").read_bytes(), pickle.dumps(Canary(sung))):
        (tmp_path / "answer-0.npy").write_bytes(answer)
        with pytest.raises(ValueError, match=r"allow_pickle|magic string"):
            load(tmp_path, "answer", 1 << 20)
        assert not sung.exists()
