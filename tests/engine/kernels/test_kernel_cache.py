"""Compiled kernels are kept per content of their sources, for their owner alone, and can always be done without."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from vfix_engine.kernels import kernel_cache
from vfix_engine.kernels.compiled import compiled

PACKAGE = Path(kernel_cache.__file__).parents[1]
SAMPLE = """
from vfix_engine.kernels.compiled import compiled
@compiled
def double(x):
    return 2.0 * x
assert double(4.0) == 8.0
print(sum(double.stats.cache_hits.values()), sum(double.stats.cache_misses.values()))
"""


def start(folder: Path, cache: Path) -> tuple[int, int]:
    """Hits and misses of a kernel in a fresh process that keeps its kernels under ``cache``."""
    (folder / "sample_kernel.py").write_text(SAMPLE, encoding="utf-8")
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"VFIX_CACHE": str(cache), "PYTHONPATH": str(PACKAGE.parent)}
    command = [sys.executable, "-P", str(folder / "sample_kernel.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=120)
    hits, misses = done.stdout.split()
    return int(hits), int(misses)


def test_a_second_start_finds_what_the_first_has_compiled(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    assert start(tmp_path, cache) == (0, 1)
    assert start(tmp_path, cache) == (1, 0)
    (folder,) = (cache / "kernels").iterdir()
    assert folder.name == kernel_cache.fingerprint()
    if os.name == "posix":
        assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.skipif(os.name != "posix", reason="rights are told otherwise there")
def test_a_folder_that_others_may_write_is_not_trusted(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    start(tmp_path, cache)
    (folder,) = (cache / "kernels").iterdir()
    folder.chmod(0o777)
    assert start(tmp_path, cache) == (0, 1)  # what lies there is not read


def test_where_nothing_can_be_kept_it_still_computes(tmp_path: Path) -> None:
    blocked = tmp_path / "a file"
    blocked.write_text("no folder", encoding="utf-8")
    assert start(tmp_path, blocked) == (0, 1)
    assert blocked.is_file()


def test_a_full_disk_costs_only_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    monkeypatch.setenv("VFIX_CACHE", str(tmp_path))
    monkeypatch.setattr(kernel_cache, "cache_folder", lambda: tmp_path)

    def full(*args: object) -> None:
        raise OSError(28, "No space left on device")

    def triple(x: float) -> float:
        return 3.0 * x

    kernel = numba.njit(triple)
    kernel._cache = kernel_cache.KernelCache(triple)
    monkeypatch.setattr(kernel._cache._cache_file, "save", full)
    monkeypatch.setattr(kernel_cache.KernelCache, "all_saved", True)
    assert kernel(2.0) == 6.0
    assert not kernel_cache.KernelCache.all_saved


def test_two_processes_may_compile_a_kernel_for_different_types_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither reads and changes what the other writes: there is a file for each types, and nothing besides."""
    import numba

    monkeypatch.setattr(kernel_cache, "cache_folder", lambda: tmp_path)

    def half(x: float) -> float:
        return x / 2

    def another_process() -> Any:
        kernel = numba.njit(half)
        kernel._cache = kernel_cache.KernelCache(half)
        return kernel

    assert another_process()(3.0) == 1.5
    (first,) = tmp_path.iterdir()
    kept = first.read_bytes()
    first.unlink()  # the other one has not seen it
    assert another_process()(3) == 1.5
    first.write_bytes(kept)
    later = another_process()
    assert (later(3.0), later(3)) == (1.5, 1.5)
    assert sum(later.stats.cache_hits.values()) == 2
    assert len(list(tmp_path.iterdir())) == 2
    later._cache.flush()
    assert not list(tmp_path.iterdir())


def test_any_change_of_a_source_makes_a_new_folder(tmp_path: Path) -> None:
    """Content, name, and a module more or less: a kernel that calls a changed one is compiled anew."""
    (tmp_path / "rooms").mkdir()
    kernel = tmp_path / "rooms" / "kernel.py"
    kernel.write_text("HALF = 0.5\n", encoding="utf-8")
    (tmp_path / "notes.txt").write_text("no source", encoding="utf-8")
    seen = [kernel_cache.hash_of_sources(tmp_path)]
    assert kernel_cache.hash_of_sources(tmp_path) == seen[0]
    kernel.write_text("HALF = 0.25\n", encoding="utf-8")
    seen.append(kernel_cache.hash_of_sources(tmp_path))
    kernel.rename(tmp_path / "rooms" / "other.py")
    seen.append(kernel_cache.hash_of_sources(tmp_path))
    (tmp_path / "more.py").touch()
    seen.append(kernel_cache.hash_of_sources(tmp_path))
    assert len(set(seen)) == 4
    (tmp_path / "notes.txt").write_text("changed", encoding="utf-8")
    assert kernel_cache.hash_of_sources(tmp_path) == seen[3]


def test_every_kernel_is_compiled_the_one_way() -> None:
    """Nothing is kept anywhere else."""
    for file in PACKAGE.rglob("*.py"):
        if file.name not in ("compiled.py", "kernel_cache.py"):
            assert "numba" not in imported_names(file), file.name


def imported_names(file: Path) -> set[str]:
    tree = ast.walk(ast.parse(file.read_text(encoding="utf-8")))
    return {alias.name for node in tree if isinstance(node, ast.Import) for alias in node.names}


def test_what_was_not_used_for_long_is_removed(tmp_path: Path) -> None:
    for name, age in {"old": 15, "young": 13, "now": 0}.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "kernel.nbc").write_bytes(b"x")
        seen = time.time() - age * 86_400
        os.utime(tmp_path / name, (seen, seen))
    kernel_cache.remove_unused(tmp_path)
    assert {folder.name for folder in tmp_path.iterdir()} == {"young", "now"}


def test_its_place_can_be_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VFIX_CACHE", str(tmp_path))
    assert kernel_cache.cache_root() == tmp_path
    monkeypatch.delenv("VFIX_CACHE")
    assert kernel_cache.cache_root().name in ("vfix", "Cache")


def test_a_plain_number_is_no_type_of_its_own() -> None:
    """Else whatever is handed a 0 and then a counter is compiled twice, with all below it."""

    @compiled
    def callee(count: int) -> int:
        return count + 1

    @compiled
    def caller(turns: int) -> int:
        count = callee(0)
        for _ in range(turns):
            count = callee(count)
        return count

    assert caller(4) == 5
    assert len(callee.signatures) == 1  # type: ignore[attr-defined]
