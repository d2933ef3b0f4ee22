"""Versions on which the last bits of a run depend."""

from __future__ import annotations

import ctypes
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from .. import __version__

PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "pin")


@cache
def versions() -> dict[str, str]:
    """Versions of vfix, Python and packages, processor, and kernels selected by NumPy's BLAS; '' where unknown."""
    found = {"vfix": __version__, "python": platform.python_version(), "machine": platform.machine()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = ""
    return found | {"blas_core": blas_core()}


@cache
def blas_core() -> str:
    """Name of the OpenBLAS kernels, such as 'SkylakeX': the last bit of a result depends on them."""
    for library in sorted((Path(np.__file__).parent.parent / "numpy.libs").glob("libscipy_openblas*")):
        try:
            core = ctypes.CDLL(str(library)).scipy_openblas_get_corename64_
        except (OSError, AttributeError):
            continue
        core.restype = ctypes.c_char_p
        return str(core().decode())
    return ""
