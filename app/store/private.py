"""Folders and files that only their owner may access, since they contain patient data.

On Windows nothing is done: the user's data folder is private by default.
"""

import contextlib
import logging
import os
from pathlib import Path

from vfix_engine.error_places import error_kind

_FOLDER, _FILE = 0o700, 0o600
_LOG = logging.getLogger(__name__)


def private_folder(path: Path) -> None:
    """Create the folder if it is missing, and restrict it to its owner."""
    path.mkdir(parents=True, exist_ok=True, mode=_FOLDER)
    _keep_from_others(path, _FOLDER)


def private_file(path: Path) -> None:
    """Create the file, empty, if it is missing, and restrict it to its owner."""
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, _FILE))
    _keep_from_others(path, _FILE)


def private_if_there(path: Path) -> None:
    """Restrict a file to its owner; another process may remove it meanwhile."""
    with contextlib.suppress(FileNotFoundError):
        _keep_from_others(path, _FILE)


def _keep_from_others(path: Path, mode: int) -> None:
    if os.name == "nt" or not path.stat().st_mode & 0o077:
        return
    try:
        path.chmod(mode)
    except FileNotFoundError:
        raise
    except OSError as error:  # another user's folder, or a file system without permissions
        _LOG.warning("other users of this machine may read %s: %s", path, error_kind(error))
