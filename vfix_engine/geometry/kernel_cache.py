"""Where compiled kernels are kept between starts.

numba keeps them beside the code, which a system-wide installation cannot write, and looks only at the file that a
kernel stands in: a kernel that calls a changed one would go on with the old one inside. So they are kept in the
user's cache folder, in a folder named after the content of every source file of the engine. Any change makes a new
folder; folders that nobody has used for long are removed then. VFIX_CACHE names another place.
NUMBA_CACHE_DIR, where it is set, is left to numba and its rules.

What is kept is code, and whoever can write it can run it: the folder is for its owner alone.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numba
import platformdirs
from numba.core import caching
from numba.core.codegen import ll as llvm  # type: ignore[attr-defined]

KEPT_S = 14 * 86_400  # a folder of other kernels that was not used for so long is removed
_PACKAGE = Path(__file__).resolve().parents[1]


def cache_root() -> Path:
    """Folder of all compiled kernels of this user."""
    named = os.environ.get("VFIX_CACHE")
    return Path(named).expanduser() if named else Path(platformdirs.user_cache_dir("vfix", appauthor=False))


@cache
def cache_folder() -> Path | None:
    """The folder of the kernels as they are now, made where it is missing; None where none can be kept."""
    kernels = cache_root() / "kernels"
    folder = kernels / fingerprint()
    try:
        if not folder.is_dir():
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            remove_unused(kernels)
        with suppress(PermissionError):  # one that somebody else has filled may be read
            os.utime(folder)
        others_write = os.name == "posix" and folder.stat().st_mode & 0o022
        readable = os.access(folder, os.R_OK | os.X_OK)
    except OSError:
        return None
    return folder if readable and not others_write else None


@cache
def fingerprint() -> str:
    """Of all that a compiled kernel depends on: its sources, Python, numba, LLVM and the processor."""
    digest = hashlib.sha256()
    for part in (sys.implementation.cache_tag, numba.__version__, str(llvm.llvm_version_info)):
        digest.update(str(part).encode())
    digest.update(f"{llvm.get_host_cpu_name()} {os.environ.get('NUMBA_CPU_NAME', '')}".encode())
    digest.update(hash_of_sources(_PACKAGE))
    return digest.hexdigest()[:20]


def hash_of_sources(package: Path) -> bytes:
    """Hash of the names and contents of all modules of a package; constants of any of them can be part of a kernel."""
    digest = hashlib.sha256()
    for name, file in sorted((file.relative_to(package).as_posix(), file) for file in package.rglob("*.py")):
        digest.update(name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.digest()


def remove_unused(kernels: Path) -> None:
    """Remove folders of kernels that were not used for long."""
    with suppress(OSError):
        for folder in kernels.iterdir():
            if folder.is_dir() and time.time() - folder.stat().st_mtime > KEPT_S:
                shutil.rmtree(folder, ignore_errors=True)


class _Locator(caching._CacheLocator):
    """Where numba finds a compiled kernel; the folder's name stands for the sources."""

    def __init__(self, function: Any, file: str) -> None:
        self._py_file = file
        module = hashlib.sha256(function.__module__.encode()).hexdigest()[:8]
        self._disambiguator = f"{function.__code__.co_firstlineno}-{module}"

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        return fingerprint()

    def get_disambiguator(self) -> str:
        return self._disambiguator

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Locator:
        return cls(function, file)


class _Kept(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012  # as numba has it


class KernelCache(caching.FunctionCache):
    """numba's cache of one function, in our folder. A disk that is full or not writable costs time, not the kernel.

    all_kept: whether every kernel that this process has compiled could be written.
    """

    _impl_class = _Kept
    all_kept: ClassVar[bool] = True

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep what was compiled, where it can be kept."""
        try:
            super().save_overload(signature, data)  # type: ignore[no-untyped-call]
        except OSError:
            KernelCache.all_kept = False

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """What was kept; None where there is nothing or it cannot be read."""
        with suppress(OSError, EOFError):
            return super().load_overload(signature, target_context)  # type: ignore[no-untyped-call]
        return None
