"""Cache of compiled kernels on disk.

numba's own cache lies beside the code, where a system-wide installation cannot write, and depends only on the file of a
kernel: a kernel that calls a changed one would not be recompiled. This cache lies in the user's cache folder, in a
folder named after a hash of all source files of the engine. A change creates a new folder, and folders unused for two
weeks are removed. VFIX_CACHE sets another location; NUMBA_CACHE_DIR selects numba's own cache.

The cache holds executable code: whoever can write to it can run code as the user. Only its owner has access.
"""

from __future__ import annotations

import glob
import hashlib
import os
import pickle
import secrets
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numba
import platformdirs
from numba.core import caching
from numba.core.codegen import ll as llvm  # type: ignore[attr-defined]
from numba.core.serialize import dumps

UNUSED_S = 14 * 86_400  # s without use after which a folder is removed
_PACKAGE = Path(__file__).resolve().parents[1]


def cache_root() -> Path:
    """Return the folder of all compiled kernels of this user."""
    named = os.environ.get("VFIX_CACHE")
    return Path(named).expanduser() if named else Path(platformdirs.user_cache_dir("vfix", appauthor=False))


@cache
def cache_folder() -> Path | None:
    """Return the folder for the present sources, created if missing; None if it cannot be used."""
    kernels = cache_root() / "kernels"
    folder = kernels / fingerprint()
    try:
        if not folder.is_dir():
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            remove_unused(kernels)
        with suppress(PermissionError):  # a readable folder of another user is acceptable
            os.utime(folder)
        others_write = os.name == "posix" and folder.stat().st_mode & 0o022
        readable = os.access(folder, os.R_OK | os.X_OK)
    except OSError:
        return None
    return folder if readable and not others_write else None


@cache
def fingerprint() -> str:
    """Hash everything that a compiled kernel depends on: sources, Python, numba, LLVM and the processor."""
    digest = hashlib.sha256()
    for part in (sys.implementation.cache_tag, numba.__version__, str(llvm.llvm_version_info)):
        digest.update(str(part).encode())
    digest.update(f"{llvm.get_host_cpu_name()} {os.environ.get('NUMBA_CPU_NAME', '')}".encode())
    digest.update(hash_of_sources(_PACKAGE))
    return digest.hexdigest()[:20]


def hash_of_sources(package: Path) -> bytes:
    """Hash names and contents of all modules of a package, since constants of any module can be part of a kernel."""
    digest = hashlib.sha256()
    for name, file in sorted((file.relative_to(package).as_posix(), file) for file in package.rglob("*.py")):
        digest.update(name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.digest()


def remove_unused(kernels: Path) -> None:
    """Remove folders of kernels unused for ``UNUSED_S``."""
    with suppress(OSError):
        for folder in kernels.iterdir():
            if folder.is_dir() and time.time() - folder.stat().st_mtime > UNUSED_S:
                shutil.rmtree(folder, ignore_errors=True)


class _Locator(caching._CacheLocator):
    """Location of a compiled kernel for numba; the folder's name is the fingerprint of the sources."""

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


class _CacheImpl(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012  # as numba has it


class KernelFiles:
    """Compiled versions of one kernel, each in a file named after its argument types.

    numba has one index per kernel, which it reads, changes and writes without a lock: if two processes compile the
    kernel for different types at the same time, one can get the machine code of the other.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self._folder, self._name = folder, name

    def load(self, key: Any) -> Any:
        """Return what was saved under the key, or None."""
        try:
            return pickle.loads(self._file(key).read_bytes())
        except FileNotFoundError:
            return None

    def save(self, key: Any, data: Any) -> None:
        """Write atomically. Raises OSError."""
        file = self._file(key)
        part = file.with_suffix(f".{secrets.token_hex(8)}.part")
        try:
            part.write_bytes(dumps(data))  # type: ignore[no-untyped-call]
            part.replace(file)
        except OSError:
            part.unlink(missing_ok=True)
            raise

    def flush(self) -> None:
        """Delete all versions of the kernel."""
        for file in self._folder.glob(f"{glob.escape(self._name)}.*.nbc"):
            file.unlink(missing_ok=True)

    def _file(self, key: Any) -> Path:
        return self._folder / f"{self._name}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"


class KernelCache(caching.FunctionCache):
    """numba's cache of one function in the folder above. If it is not writable, kernels are compiled in every process.

    all_saved: whether every kernel compiled by this process was written. told: called with the name of each kernel that
    is loaded or saved.
    """

    _impl_class = _CacheImpl
    all_saved: ClassVar[bool] = True
    told: ClassVar[Callable[[str], object]] = str

    def __init__(self, function: Any) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._cache_file = KernelFiles(Path(self._cache_path), self._impl.filename_base)  # type: ignore[assignment]

    def save_overload(self, signature: Any, data: Any) -> None:
        """Write a compiled kernel."""
        try:
            super().save_overload(signature, data)  # type: ignore[no-untyped-call]
        except OSError:
            KernelCache.all_saved = False
        KernelCache.told(self._impl.filename_base)

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Read a compiled kernel; None if it is missing or unreadable."""
        found: Any = None
        with suppress(OSError, EOFError):
            found = super().load_overload(signature, target_context)  # type: ignore[no-untyped-call]
        if found is not None:
            KernelCache.told(self._impl.filename_base)
        return found
