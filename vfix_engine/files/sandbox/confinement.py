"""Sandbox of a worker process, set up by the worker itself before it imports or reads anything.

Linux has two mechanisms that need no administrator. Landlock restricts the process to given files. A seccomp filter
refuses connections, other programs, child processes, and what Landlock does not cover: changes of permissions, owners,
times and attributes of files, and signals and limits to other processes. Both last as long as the process.
If the kernel lacks one of them, and on other systems, the worker runs without it; `probe` tests what is in force.
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
from dataclasses import dataclass
from pathlib import Path

_NO_NEW_PRIVILEGES, _SECCOMP, _DEATH_SIGNAL, _FILTER_MODE = 38, 22, 1, 2  # of prctl

# Landlock (landlock.h): its system call numbers are the same on every processor.
_CREATE, _ADD, _RESTRICT = 444, 445, 446
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE, _IOCTL = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 14, 1 << 15
_OF_A_FILE = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL
_READ = _READ_FILE | _READ_DIR
_RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15}  # number of access rights by ABI version; 16 from version 5 on
_TCP, _SIGNALS_AND_SOCKETS = 0b11, 0b11

# Parts of the system that libraries read: shared libraries and their list, time zone, processor, memory, randomness.
_SYSTEM = (
    "/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib", "/usr/share", "/etc/ld.so.cache", "/etc/localtime",
    "/proc/self", "/proc/cpuinfo", "/proc/meminfo", "/proc/stat", "/sys/devices/system", "/sys/fs/cgroup", "/dev/null",
    "/dev/zero", "/dev/urandom",
)  # fmt: skip

_ERRNO, _ALLOW, _EPERM, _ENOSYS = 0x00050000, 0x7FFF0000, 1, 38  # return values of a filter
_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06  # BPF instructions
_X32, _THREAD = 0x40000000, 0x00010000


@dataclass(frozen=True)
class _Calls:
    """System call numbers on one processor architecture.

    architecture: its identifier in the filter. refused: with any arguments. own: their first argument is a process id,
    which must be 0, the caller itself. tgkill: its first argument must be the caller, since abort() signals itself so.
    """

    architecture: int
    clone: int
    tgkill: int
    own: tuple[int, ...]
    refused: tuple[int, ...]


# With the same number everywhere: io_uring, which bypasses the filter; pidfd_open, pidfd_getfd and pidfd_send_signal;
# process_madvise and process_mrelease; fchmodat2, setxattrat, removexattrat and file_setattr.
_REFUSED_EVERYWHERE = (425, 434, 438, 424, 440, 448, 452, 463, 466, 469)
# `own` in order: kill, prlimit64, sched_setparam, sched_setscheduler, sched_setaffinity, sched_setattr, migrate_pages,
# move_pages.
_CALLS = {
    "x86_64": _Calls(
        0xC000003E, 56, 234, (62, 302, 142, 144, 203, 314, 256, 279),
        (
            41, 53, 57, 58, 59, 322, 109, 112,  # socket, socketpair, fork, vfork, execve, execveat, setpgid, setsid
            101, 310, 311, 298,  # ptrace, process_vm_readv, process_vm_writev, perf_event_open
            200, 129, 297, 141, 251,  # tkill, rt_sigqueueinfo, rt_tgsigqueueinfo, setpriority, ioprio_set
            90, 91, 268, 92, 93, 94, 260,  # chmod, fchmod, fchmodat, chown, fchown, lchown, fchownat
            132, 235, 261, 280,  # utime, utimes, futimesat, utimensat
            188, 189, 190, 197, 198, 199,  # setxattr, lsetxattr, fsetxattr, removexattr, lremovexattr, fremovexattr
        ),
    ),
    "aarch64": _Calls(
        0xC00000B7, 220, 131, (129, 261, 118, 119, 122, 274, 238, 239),
        (
            198, 199, 221, 281, 154, 157,  # socket, socketpair, execve, execveat, setpgid, setsid
            117, 270, 271, 241,  # ptrace, process_vm_readv, process_vm_writev, perf_event_open
            130, 138, 240, 140, 30,  # tkill, rt_sigqueueinfo, rt_tgsigqueueinfo, setpriority, ioprio_set
            52, 53, 55, 54,  # fchmod, fchmodat, fchown, fchownat
            88,  # utimensat
            5, 6, 7, 14, 15, 16,  # setxattr, lsetxattr, fsetxattr, removexattr, lremovexattr, fremovexattr
        ),
    ),
}  # fmt: skip
_CLONE3 = 435  # hides its flags from a filter: the C library falls back to clone if it is missing


def die_with_parent(parent: int) -> None:
    """End this process when its parent ends, on Linux.

    parent: process id of the parent; if it has already ended, this process exits.
    """
    if sys.platform == "linux":
        _prctl(_DEATH_SIGNAL, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def confine(readable: Sequence[Path], writable: Sequence[Path], listable: Sequence[Path]) -> None:
    """Restrict this process to the given folders and files, Python and the system's libraries.

    Network and other processes become inaccessible. Call it while the process has one thread.

    Args:
        readable, writable: folders and files with everything below them.
        listable: folders whose entries may be listed only.
    """
    if sys.platform != "linux" or not _prctl(_NO_NEW_PRIVILEGES, 1):
        return
    _keep_to_files([*map(Path, _SYSTEM), *_python(), *readable], writable, listable)
    _refuse_calls()


def probe(file: str) -> dict[str, bool]:
    """Test which operations are refused. file: one outside the given paths that the user could write."""
    return {
        "network": _refused(_connect),
        "other_files": _refused(Path(file).read_bytes),
        "writing_elsewhere": all(
            _refused(attempt, Path(file)) for attempt in (_write_beside, _give_rights, _set_times)
        ),
        "other_processes": all(
            _refused(attempt) for attempt in (_start_another, _signal, _limit, _set_priority, _set_cores)
        ),
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
    """Allow access below a path; a missing path needs no rule."""
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
    """Install the system call filter, on processors with known call numbers."""
    known = _CALLS.get(platform.machine())
    if known is None or sys.maxsize < 1 << 32:
        return False
    no, yes = (_RETURN, 0, 0, _ERRNO | _EPERM), (_RETURN, 0, 0, _ALLOW)
    program = [(_LOAD, 0, 0, 4), (_EQUAL, 1, 0, known.architecture), no, (_LOAD, 0, 0, 0), (_AT_LEAST, 0, 1, _X32), no]
    for number in (*known.refused, *_REFUSED_EVERYWHERE):
        program += [(_EQUAL, 0, 1, number), no]
    program += [(_EQUAL, 0, 1, _CLONE3), (_RETURN, 0, 0, _ERRNO | _ENOSYS)]
    # These depend on the lower half of their first argument. Threads are allowed: clone is refused without that flag.
    itself = [(known.tgkill, os.getpid()), *((number, 0) for number in known.own)]
    for number, test in [*((n, (_EQUAL, 0, 1, who)) for n, who in itself), (known.clone, (_ANY_BIT, 0, 1, _THREAD))]:
        program += [(_EQUAL, 0, 4, number), (_LOAD, 0, 0, 16), test, yes, no]
    program += [yes]
    code = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *line) for line in program))
    whole = ctypes.create_string_buffer(struct.pack("@HP", len(program), ctypes.addressof(code)))
    return _prctl(_SECCOMP, _FILTER_MODE, ctypes.addressof(whole))


def _prctl(option: int, first: int, second: int = 0) -> bool:
    libc = ctypes.CDLL(None, use_errno=True)
    words = [ctypes.c_ulong(value) for value in (first, second, 0, 0)]
    return bool(libc.prctl(ctypes.c_int(option), *words) == 0)


def _refused(attempt: Callable[..., object], *args: object) -> bool:
    try:
        attempt(*args)
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


# The probes below change nothing if they are allowed; they are refused only on Linux.
def _give_rights(file: Path) -> None:
    file.chmod(file.stat().st_mode & 0o777)


def _set_times(file: Path) -> None:
    state = file.stat()
    os.utime(file, ns=(state.st_atime_ns, state.st_mtime_ns))


def _signal() -> None:
    if sys.platform == "linux":
        os.kill(os.getppid(), 0)


def _limit() -> None:
    if sys.platform == "linux":
        import resource

        resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE)


def _set_priority() -> None:
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, os.getppid(), os.getpriority(os.PRIO_PROCESS, os.getppid()))


def _set_cores() -> None:
    if sys.platform == "linux":
        os.sched_setaffinity(os.getppid(), os.sched_getaffinity(os.getppid()))


def _large_files_refused() -> bool:
    with suppress(ImportError):
        import resource

        return resource.getrlimit(resource.RLIMIT_FSIZE)[0] != resource.RLIM_INFINITY
    return False
