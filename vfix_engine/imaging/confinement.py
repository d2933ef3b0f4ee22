"""What the kernel keeps a worker from, asked for by the worker itself before it imports or reads anything.

Linux offers two ways that need no rights of an administrator. Landlock leaves a process the files it is given, and a
seccomp filter refuses it connections, other programs and children of its own. Either holds for the rest of the process
and cannot be taken back. Where the kernel lacks one of them, and on other systems, the worker runs without it:
`probe` tells what holds, by trying.
"""

from __future__ import annotations

import ctypes
import os
import platform
import signal
import struct
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

_NO_NEW_PRIVILEGES, _SECCOMP, _DEATH_SIGNAL, _FILTER_MODE = 38, 22, 1, 2  # of prctl

# Landlock (landlock.h): its system calls have the same numbers on every processor.
_CREATE, _ADD, _RESTRICT = 444, 445, 446
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE, _IOCTL = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 14, 1 << 15
_OF_A_FILE = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL
_READ = _READ_FILE | _READ_DIR
_RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15}  # how many rights a version knows; 16 from version 5 on
_TCP, _SIGNALS_AND_SOCKETS = 0b11, 0b11

# Parts of the system that libraries read: shared libraries and their list, time zone, processor, memory, noise.
_SYSTEM = (
    "/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib", "/usr/share", "/etc/ld.so.cache", "/etc/localtime",
    "/proc/self", "/proc/cpuinfo", "/proc/meminfo", "/proc/stat", "/sys/devices/system", "/sys/fs/cgroup", "/dev/null",
    "/dev/zero", "/dev/urandom",
)  # fmt: skip

_ERRNO, _ALLOW, _EACCES, _ENOSYS = 0x00050000, 0x7FFF0000, 13, 38  # answers of a filter
_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06  # its instructions
_X32, _THREAD = 0x40000000, 0x00010000
# By machine: how the filter knows it, clone, and what is refused: connections, other programs, children, leaving the
# group, reaching into other processes, and io_uring, which does all of that without being asked.
_REFUSED = {
    "x86_64": (0xC000003E, 56, (41, 53, 57, 58, 59, 322, 109, 112, 101, 310, 311, 438, 425)),
    "aarch64": (0xC00000B7, 220, (198, 199, 221, 281, 154, 157, 117, 270, 271, 438, 425)),
}
_CLONE3 = 435  # hides its flags from a filter: the C library takes clone where it is missing


def die_with_parent(parent: int) -> None:
    """Have the kernel end this process when the one that started it ends, on Linux.

    parent: its process id; when it has ended already, so does this one.
    """
    if sys.platform == "linux":
        _prctl(_DEATH_SIGNAL, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def confine(readable: Sequence[Path], writable: Sequence[Path], listable: Sequence[Path]) -> None:
    """Leave this process what lies beneath these folders and files, Python and the system's libraries.

    Of the network and of other processes it is left nothing. Called while there is one thread only.
    """
    if sys.platform != "linux" or not _prctl(_NO_NEW_PRIVILEGES, 1):
        return
    _keep_to_files([*map(Path, _SYSTEM), *_python(), *readable], writable, listable)
    _refuse_calls()


def probe(file: str) -> dict[str, bool]:
    """What this process is kept from, by trying. file: one that it was not given, where the caller could write."""
    return {
        "network": _refused(_connect),
        "other_files": _refused(Path(file).read_bytes),
        "writing_elsewhere": _refused(lambda: _write_beside(Path(file))),
        "other_processes": _refused(_start_another),
        "large_files": _large_files_refused(),
    }


def _python() -> list[Path]:
    """Interpreter, standard library and installed packages."""
    packages = [Path(entry) for entry in sys.path if Path(entry).name in ("site-packages", "dist-packages")]
    return [Path(sys.base_prefix), Path(sys.base_exec_prefix), Path(sys.prefix), Path(os.__file__).parent, *packages]


def _keep_to_files(readable: Sequence[Path], writable: Sequence[Path], listable: Sequence[Path]) -> bool:
    libc = ctypes.CDLL(None, use_errno=True)
    version = libc.syscall(_CREATE, None, 0, 1)
    if version < 1:
        return False
    handled = (1 << _RIGHTS.get(version, 16)) - 1
    words = [handled, *([_TCP] if version >= 4 else []), *([_SIGNALS_AND_SOCKETS] if version >= 6 else [])]
    attributes = struct.pack(f"={len(words)}Q", *words)
    rules = libc.syscall(_CREATE, attributes, len(attributes), 0)
    if rules < 0:
        return False
    try:
        kinds = ((readable, _READ | _EXECUTE), (writable, handled & ~_EXECUTE), (listable, _READ_DIR))
        for paths, rights in kinds:
            for path in paths:
                _allow(libc, rules, path, rights)
        return bool(libc.syscall(_RESTRICT, rules, 0) == 0)
    finally:
        os.close(rules)


def _allow(libc: ctypes.CDLL, rules: int, path: Path, rights: int) -> None:
    """Add what lies beneath a path; a path that is not there needs no right."""
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        allowed = rights if path.is_dir() else rights & _OF_A_FILE
        if allowed:
            libc.syscall(_ADD, rules, 1, struct.pack("=Qi", allowed, place), 0)
    finally:
        os.close(place)


def _refuse_calls() -> bool:
    """The filter of system calls, for the processors whose numbers are known."""
    known = _REFUSED.get(platform.machine())
    if known is None or sys.maxsize < 1 << 32:
        return False
    architecture, clone, refused = known
    no, yes = (_RETURN, 0, 0, _ERRNO | _EACCES), (_RETURN, 0, 0, _ALLOW)
    program = [(_LOAD, 0, 0, 4), (_EQUAL, 1, 0, architecture), no, (_LOAD, 0, 0, 0), (_AT_LEAST, 0, 1, _X32), no]
    for number in refused:
        program += [(_EQUAL, 0, 1, number), no]
    program += [(_EQUAL, 0, 1, _CLONE3), (_RETURN, 0, 0, _ERRNO | _ENOSYS)]
    # A thread is no child: clone is refused without that flag, the lower half of its first argument.
    program += [(_EQUAL, 0, 4, clone), (_LOAD, 0, 0, 16), (_ANY_BIT, 0, 1, _THREAD), yes, no, yes]
    code = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *line) for line in program))
    whole = ctypes.create_string_buffer(struct.pack("@HP", len(program), ctypes.addressof(code)))
    return _prctl(_SECCOMP, _FILTER_MODE, ctypes.addressof(whole))


def _prctl(option: int, first: int, second: int = 0) -> bool:
    libc = ctypes.CDLL(None, use_errno=True)
    words = [ctypes.c_ulong(value) for value in (first, second, 0, 0)]
    return bool(libc.prctl(ctypes.c_int(option), *words) == 0)


def _refused(attempt: Callable[[], object]) -> bool:
    try:
        attempt()
    except OSError:
        return True
    return False


def _connect() -> None:
    import socket

    socket.socket(socket.AF_INET, socket.SOCK_STREAM).close()


def _write_beside(file: Path) -> None:
    with tempfile.TemporaryFile(dir=file.parent):
        pass


def _start_another() -> None:
    if not hasattr(os, "fork"):
        return
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)


def _large_files_refused() -> bool:
    with suppress(ImportError):
        import resource

        return resource.getrlimit(resource.RLIMIT_FSIZE)[0] != resource.RLIM_INFINITY
    return False
