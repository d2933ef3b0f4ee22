"""Folders and files that only their owner may read: heads are patient data.

Windows keeps the user's data folder to the user by itself; there, nothing is done.
"""

import contextlib
import logging
import os
from pathlib import Path

_FOLDER, _FILE = 0o700, 0o600
_LOG = logging.getLogger(__name__)


def private_folder(path: Path) -> None:
    """Make the folder where it is missing, and keep it from everybody but its owner."""
    path.mkdir(parents=True, exist_ok=True, mode=_FOLDER)
    _keep_from_others(path, _FOLDER)


def private_file(path: Path) -> None:
    """Make the file, empty, where it is missing, and keep it from everybody but its owner."""
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, _FILE))
    _keep_from_others(path, _FILE)


def private_if_there(path: Path) -> None:
    """Keep a file that another process may be removing from everybody but its owner."""
    with contextlib.suppress(FileNotFoundError):
        _keep_from_others(path, _FILE)


def _keep_from_others(path: Path, mode: int) -> None:
    if os.name == "nt" or not path.stat().st_mode & 0o077:
        return
    try:
        path.chmod(mode)
    except FileNotFoundError:
        raise
    except OSError as error:  # another's folder, or a disk that knows no rights
        _LOG.warning("other users of this machine may read %s: %s", path, error.strerror)
