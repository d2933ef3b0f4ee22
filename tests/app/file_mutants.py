"""Spoiled copies of a file, and the worker that reads many of them in one process."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from vfix_engine.errors import VfixError


def mutant(original: bytes, random: np.random.Generator) -> bytes:
    """A copy with a few bytes changed, often near the beginning; sometimes it is cut, or a block is gone or double.

    Half of the new bytes are taken from the file itself, so that what was text is often text again.
    """
    data = bytearray(original)
    reach = min(len(data), 400) if random.random() < 0.5 else len(data)
    for place in random.integers(0, reach, random.integers(1, 4)):
        data[place] = original[random.integers(0, len(original))] if random.random() < 0.5 else random.integers(0, 256)
    start, stop = np.sort(random.integers(0, len(data), 2))
    how = random.random()
    if how < 0.1:
        return bytes(data[:start])
    if how < 0.15:
        return bytes(data[:start] + data[stop:])
    if how < 0.2:
        return bytes(data[:stop] + data[start:])
    return bytes(data)


def read_mutants(folder: Path, code: Path) -> tuple[int, int, float, list[str]]:
    """Read each file of a folder as the planner would, after the first, which is sound.

    code: the folder of the program's own packages, which the worker is given with it.

    Returns how many were read, how many refused in words, the slowest one in s, and what else happened, which is
    nothing.
    """
    read = refused = 0
    slowest, strays = 0.0, []
    sound, *spoiled = sorted(folder.iterdir())
    _read(sound)  # and it loads what it needs, which is no mutant's time
    for file in spoiled:
        start = time.perf_counter()
        try:
            _read(file)
            read += 1
        except VfixError as error:
            refused += 1
            if len(str(error)) < 10 or "Canary" in str(error):
                strays.append(f"{file.name}: {error}")
        except Exception as error:  # whatever it is, it would have been a traceback
            strays.append(f"{file.name}: {type(error).__name__}: {error}")
        slowest = max(slowest, time.perf_counter() - start)
    return read, refused, slowest, strays


def _read(file: Path) -> None:
    from app.exchange.plan_files import read_plan
    from vfix_engine.files.mesh_files import is_mesh, read_mesh
    from vfix_engine.files.readers import is_volume, read_volume

    if is_mesh(file):
        bounds = read_mesh(file, assume=True)[0].bounds
    elif is_volume(file):
        bounds = read_volume(file, assume=True)[0].bounds
    else:
        points = read_plan(file.name, file.read_bytes(), points_as="path").content.points
        bounds = np.array([point.position for point in points])
    if not np.isfinite(bounds).all():
        raise ArithmeticError("a number that is not finite came in")
