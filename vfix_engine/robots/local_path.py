"""File names in a description: only files inside its own folder are accepted (HAZ-19)."""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import RobotError

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_PACKAGE = "package://"
_MAX_LENGTH = 1024


def local_path(folder: Path, name: str) -> Path:
    """The resolved path of a file inside ``folder``; symbolic links are followed, nothing is opened.

    name: relative, with '/' as separator; a prefix 'package://' is removed and the package name is taken as a folder.

    Raises:
        RobotError: the name is absolute, has a scheme, '..', '%' or a backslash, or leads outside through a link.
    """
    rest = name.removeprefix(_PACKAGE)
    shown = ascii(name[:80])
    if not rest or len(rest) > _MAX_LENGTH or any(ord(letter) < 32 or letter in "\\%" for letter in rest):
        raise RobotError(f"the file name {shown} is empty, too long or has a letter that none here may have")
    if _SCHEME.match(rest):
        raise RobotError(f"the file name {shown} has a scheme; only files inside the robot's folder are read")
    # Windows ignores spaces around a part: '.. ' is '..' there.
    if rest[0] in "/~" or any(part == ".." or part != part.strip() for part in rest.split("/")):
        raise RobotError(f"the file name {shown} leads out of the robot's folder")
    try:
        root = folder.resolve()
        path = (root / rest).resolve()
    except (OSError, RuntimeError, ValueError):
        raise RobotError(f"the file name {shown} cannot be followed") from None
    if not path.is_relative_to(root) or path == root:
        raise RobotError(f"the file name {shown} leads out of the robot's folder")
    return path
