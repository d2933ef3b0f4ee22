"""Generate the synthetic head shipped under assets/head_phantom: CT volumes, surfaces, landmarks.

    python scripts/make_head_phantom.py --out DIR

The same platform and the same locked packages give the same bytes. Takes a few minutes and about 1 GB of memory.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from head_phantom import files, landmarks, measure, surfaces
from head_phantom.generate import NOSE_BOX, generate
from vfix_engine.anatomy import phantom
from vfix_engine.files.mesh_files import write_ply
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

GENERATOR_VERSION = 1
HEAD_SPACING = 0.8  # [mm]
NOSE_SPACING = 0.5
DISPLAY_SPACING = 0.8
SKIN_SPACING = 1.2


def main() -> None:
    """Generate all files and print what was made."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)

    nose = _timed("CT of the nose", lambda: files.packed(generate(NOSE_SPACING, NOSE_BOX)))
    files.write_nrrd(out / phantom.NOSE_CT, nose)
    head = _timed("CT of the head", lambda: files.packed(generate(HEAD_SPACING)))
    files.write_nrrd(out / phantom.HEAD_CT, head)
    bone, report = _timed("bone around the nose", lambda: surfaces.bone_around_nose(nose))
    print(f"  {report}, to be kept as BONE_REPORT in vfix_engine/anatomy/phantom.py")
    write_ply(out / phantom.BONE, bone)
    for name, make in (
        ("skull", lambda: surfaces.skull(DISPLAY_SPACING)),
        ("skull_half", lambda: surfaces.half_skull(DISPLAY_SPACING)),
        ("skin", lambda: surfaces.skin(SKIN_SPACING)),
    ):
        mesh: TriangleMesh = _timed(f"{name} for display", make)
        print(f"  {len(mesh.faces):,} triangles")
        write_ply(out / phantom.DISPLAY[name], mesh)
    description = _description(nose, head)
    names = (phantom.HEAD_CT, phantom.NOSE_CT, phantom.BONE, *phantom.DISPLAY.values())
    description["files"] = {name: _file(out / name) for name in names}
    (out / phantom.DESCRIPTION).write_text(json.dumps(description, indent=2) + "\n", encoding="utf-8")
    for name, entry in description["files"].items():
        print(f"{name:24} {entry['bytes']:>12,} bytes  {entry['sha256']}")
    print(f"{'together':24} {sum(path.stat().st_size for path in out.iterdir()):>12,} bytes")
    print(json.dumps(description["sizes"], indent=2))


def _description(nose: Volume, head: Volume) -> dict[str, Any]:
    return {
        "schema": phantom.SCHEMA,
        "notice": "Synthetic head. Not for clinical use.",
        "frame": "LPS",
        "unit": "mm",
        "generator_version": GENERATOR_VERSION,
        "beads": [
            {"name": bead.name, "centroid": list(bead.centre), "radius_mm": bead.radius} for bead in landmarks.BEADS
        ],
        "landmarks": _places(landmarks.LANDMARKS),
        "corridor": {"name": "left nostril to nasopharynx", "points": _corridor()},
        "targets": _places(landmarks.TARGETS),
        "sizes": {name: round(value, 3) for name, value in _sizes(nose, head).items()},
    }


def _corridor() -> list[dict[str, Any]]:
    shafts = [{"direction": list(direction), "roll_deg": roll} for direction, roll in landmarks.CORRIDOR_SHAFT]
    return [place | shaft for place, shaft in zip(_places(landmarks.CORRIDOR), shafts, strict=True)]


def _places(places: tuple[landmarks.Place, ...]) -> list[dict[str, Any]]:
    return [{"label": place.label, "position": list(place.position)} for place in places]


def _sizes(nose: Volume, head: Volume) -> dict[str, float]:
    sizes = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        mirror = np.array([sign, 1.0, 1.0])
        seed = landmarks.IN_ANTRUM * mirror
        plug = measure.Plug(landmarks.OSTIUM_PLUG * mirror, landmarks.OSTIUM_PLUG_RADIUS)
        antrum = measure.air_region(nose, seed, plug)
        sizes[f"maxillary_sinus_{side}_cm3"] = measure.volume_cm3(nose, antrum)
        sizes[f"maxillary_ostium_{side}_mm"] = measure.bottleneck_mm(
            nose, landmarks.OSTIUM_IN_ANTRUM * mirror, landmarks.OSTIUM_IN_NOSE * mirror
        )
        walls = [
            measure.thickness_mm(nose, start * mirror, landmarks.CANINE_FOSSA_DIRECTION * mirror)
            for start in landmarks.CANINE_FOSSA_RAYS
        ]
        sizes[f"canine_fossa_bone_{side}_mm"] = float(np.mean(walls))
    errors = [
        np.linalg.norm(measure.bead_centroid(head, bead.centre) - np.array(bead.centre)) for bead in landmarks.BEADS
    ]
    sizes["bead_centroid_error_max_mm"] = float(max(errors))
    return sizes


def _file(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}


def _timed(what: str, make: Callable[[], Any]) -> Any:
    start = time.perf_counter()
    made = make()
    print(f"{what}: {time.perf_counter() - start:.1f} s", flush=True)
    return made


if __name__ == "__main__":
    main()
