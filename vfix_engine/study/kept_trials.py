"""Results of trials kept in a folder while a study runs, so that one that was interrupted goes on where it was.

A result is a pickle: read a folder of your own alone.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import pickle
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..kernels.kernel_cache import hash_of_sources
from ..resources import assets_dir

_PACKAGE = Path(__file__).resolve().parents[1]
_STUDY = "study.json"
# What a pickle that was cut or changed raises.
_UNREADABLE = (
    OSError, EOFError, pickle.UnpicklingError, ValueError, TypeError, LookupError, AttributeError, ImportError,
    MemoryError,
)  # fmt: skip


class KeptTrials:
    """A folder of one study's results, made where it is missing.

    Args:
        study: all that its results depend on beside the engine's sources and the assets, as JSON has it.

    Raises:
        InputError: a folder of another study, of another version of engine or assets, or of something else.
        OSError: a folder that cannot be written.
    """

    def __init__(self, folder: Path, study: Mapping[str, Any]) -> None:
        self._folder = folder
        engine = hash_of_sources(_PACKAGE).hex()
        assets = assets_dir()
        files = sorted(file for file in assets.rglob("*") if file.is_file())
        data = {file.relative_to(assets).as_posix(): _hash(file) for file in files}
        head = json.dumps({**study, "engine": engine, "data": data}, sort_keys=True)
        folder.mkdir(parents=True, exist_ok=True)
        mark = folder / _STUDY
        if not mark.exists() and not any(folder.iterdir()):
            mark.write_text(head)
        if not mark.is_file() or mark.read_text() != head:
            raise InputError(
                f"{folder} holds something else than results of this study with this version of the engine; "
                "name another folder, or delete it"
            )

    def get(self, function: Callable[[Any], Any], key: Any) -> Any:
        """The kept result of ``function(key)``; None where there is none, or none that can be read."""
        try:
            return pickle.loads(self._file(function, key).read_bytes())
        except _UNREADABLE:
            return None

    def add(self, function: Callable[[Any], Any], key: Any, value: Any) -> None:
        """Keep a result. Raises OSError."""
        file = self._file(function, key)
        part = file.with_suffix(f".{os.getpid()}.part")
        part.write_bytes(pickle.dumps(value))
        part.replace(file)

    def _file(self, function: Callable[[Any], Any], key: Any) -> Path:
        while isinstance(function, functools.partial):  # its arguments follow from the study
            function = function.func
        name = f"{function.__module__}.{function.__qualname__} {key!r}"
        return self._folder / f"{hashlib.sha256(name.encode()).hexdigest()[:32]}.trial"


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16]
