"""Which of the project's functions a piece of work passes, in the order of their first calls."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = tuple(str(ROOT / name) + "/" for name in ("app", "vfix_engine"))

Function = tuple[str, str]  # file below the checkout, qualified name


def functions_passed(work: Callable[[], Any]) -> list[Function]:
    """Python functions of ours that ``work`` enters on this thread, kernels that Python calls included."""
    found: dict[CodeType, None] = {}

    def note(frame: FrameType, event: str, argument: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(PACKAGES):
            found[frame.f_code] = None

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(before)
    names = ((str(Path(code.co_filename).relative_to(ROOT)), code.co_qualname) for code in found)
    return list(dict.fromkeys((file, name) for file, name in names if "<" not in name.rpartition(".")[2]))
