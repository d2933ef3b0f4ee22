"""The worker's end of `isolated.run_isolated`: run as a script with the folder that contains its request."""

from __future__ import annotations

import errno
import importlib
import json
import logging
import os
import signal
import sys
import threading
import warnings
from pathlib import Path
from typing import Any


def main(folder: Path) -> None:
    """Execute the request in `folder`, and write a result or a failure there."""
    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    sys.path[:] = request["path"]
    from vfix_engine.files.sandbox import confinement

    confinement.die_with_parent(request["parent"])
    _limit(request["memory_bytes"], request["seconds"])
    confinement.confine(*([Path(path) for path in request[kind]] for kind in ("readable", "writable", "listable")))
    threading.Thread(target=_end_with_caller, daemon=True).start()
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")  # warnings quote the file

    from vfix_engine.errors import VfixError
    from vfix_engine.files.sandbox import crossing

    try:
        function = getattr(importlib.import_module(request["module"]), request["function"])
        options: dict[str, Any] = {"progress": _report_progress} if request["progress"] else {}
        arguments = crossing.load(folder, "arguments", request["memory_bytes"])
        crossing.save(function(*arguments, **options), folder, "result")
    except VfixError as error:
        series = getattr(error, "series", ())
        _write_failure(folder, type(error).__name__, str(error), getattr(error, "missing", ()), series)
    except MemoryError:
        _write_failure(folder, "InputError", "reading the file takes more memory than it may.", ())
    except RecursionError:
        _write_failure(folder, "InputError", "the file is nested too deeply.", ())
    except OSError as error:
        words = _DISK_ERRORS.get(error.errno or 0, f"the file could not be read ({type(error).__name__}).")
        _write_failure(folder, "InputError", words, ())
    # The trust boundary: any other error was caused by the file, and its message may quote it.
    except Exception as error:
        _write_failure(folder, "InputError", f"the file could not be read ({type(error).__name__}).", ())


_DISK_ERRORS = {
    errno.ENOSPC: "reading the file takes more disk than there is; make room and try again.",
    errno.EDQUOT: "reading the file takes more disk than you may use; make room and try again.",
    errno.EFBIG: "reading the file takes more disk than it may.",
}


def _end_with_caller() -> None:
    """End this process group when the caller, which holds the other end of stdin, ends."""
    while os.read(0, 1):
        pass
    if os.name == "posix":
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def _limit(memory_bytes: int, seconds: float) -> None:
    try:
        import resource
    except ImportError:  # Windows: the time limit of the caller remains
        return
    wanted = (
        (resource.RLIMIT_AS, memory_bytes),
        (resource.RLIMIT_CPU, 2 * int(seconds) + 1),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, memory_bytes),  # of each file; a result has been in memory before
    )
    for kind, value in wanted:
        hard = resource.getrlimit(kind)[1]
        value = value if hard == resource.RLIM_INFINITY else min(value, hard)
        try:
            resource.setrlimit(kind, (value, value))
        except (ValueError, OSError):  # macOS refuses some: the time limit of the caller remains
            continue


def _report_progress(stage: str, fraction: float) -> None:
    print(json.dumps([stage, fraction]), flush=True)


def _write_failure(
    folder: Path, kind: str, message: str, missing: tuple[str, ...], series: tuple[dict[str, Any], ...] = ()
) -> None:
    text = json.dumps({"kind": kind, "message": message, "missing": list(missing), "series": list(series)})
    (folder / "failure.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
