"""The folder of temporary data: leftovers of ended planners are removed, files of running ones are not."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.store.errors import StorageError
from app.store.scratch import Scratch

ROOT = Path(__file__).resolve().parents[3]
KILLED = """
import os, sys
from pathlib import Path
from app.store.scratch import Scratch
scratch = Scratch(Path(sys.argv[1]))
(scratch.new_place() / "head.nrrd").write_bytes(b"x")
os.kill(os.getpid(), 9)
"""


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file() and not path.name.endswith(".lock"))


def test_what_a_killed_planner_left_is_removed_at_the_next_start(tmp_path: Path) -> None:
    """HAZ-30."""
    folder = tmp_path / "tmp"
    (folder / "0123456789abcdef").mkdir(parents=True)
    (folder / "0123456789abcdef" / "old.nrrd").write_bytes(b"x")
    (folder / "stray.zip").write_bytes(b"x")
    subprocess.run([sys.executable, "-c", KILLED, folder], cwd=ROOT, check=False)
    assert "head.nrrd" in files(folder)
    scratch = Scratch(folder)
    scratch.open()
    assert files(folder) == []
    scratch.close()
    assert [path.name for path in folder.iterdir()] == [".lock"]


def test_planners_of_one_home_leave_each_other_alone(tmp_path: Path) -> None:
    first, second = Scratch(tmp_path), Scratch(tmp_path)
    (first.new_place() / "first.nrrd").write_bytes(b"x")
    (second.new_place() / "second.nrrd").write_bytes(b"x")
    assert files(tmp_path) == ["first.nrrd", "second.nrrd"]
    second.close()
    assert files(tmp_path) == ["first.nrrd"]
    first.close()
    assert [path.name for path in tmp_path.iterdir()] == [".lock"]


def test_temporary_data_is_for_their_owner_alone(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path / "tmp")
    place = scratch.new_place()
    if os.name != "nt":
        assert [oct(path.stat().st_mode)[-3:] for path in (place, place.parent, place.parent.parent)] == ["700"] * 3
    scratch.close()
    scratch.close()


def test_a_disk_that_takes_no_folder_costs_no_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every refused upload tries again: what a try took is given back."""
    scratch = Scratch(tmp_path)
    real = Path.mkdir

    def full(place: Path, *args: int, **options: bool) -> None:
        if place.parent == tmp_path:
            raise OSError(28, "No space left on device")
        real(place, *args, **options)

    monkeypatch.setattr(Path, "mkdir", full)
    for _ in range(3):
        with pytest.raises(StorageError, match="No space left"):
            scratch.open()
        assert [path.name for path in tmp_path.iterdir()] == [".lock"]
    monkeypatch.undo()
    assert scratch.open().is_dir()
    scratch.close()
