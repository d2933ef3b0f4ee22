"""A run on disk, as a drive leaves it."""

import json
from pathlib import Path


def write_run(folder: Path, ticks: int = 100, whole: bool = True) -> Path:
    """Write a small run into a folder that is not there yet."""
    folder.mkdir()
    manifest = {"schema": "vfix-run/1", "world": "rigid", "seed": 7, "columns": [["t", "s"]]}
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    (folder / "spec.npz").write_bytes(b"the spec, the same for every drive of a plan")
    (folder / "ticks.f64").write_bytes(bytes(8) * ticks)
    (folder / "events.jsonl").write_text('{"at": 3, "kind": "note", "content": "x"}\n', encoding="utf-8")
    (folder / "sideways.f64").write_bytes(b"a reading")
    if whole:
        (folder / "end.json").write_text(json.dumps({"ticks": ticks, "sha256": "ab", "lost": 2}), encoding="utf-8")
    return folder
