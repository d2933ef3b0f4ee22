"""Import of a large CT: time and memory until its bone is visible and can be clicked."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from app.extras import has_app, need_app
from benchmarks import report
from vfix_engine.anatomy.phantom import load_head_ct
from vfix_engine.errors import InputError
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume

SUMMARY = "the import of a large CT, until bone can be seen and clicked"
SHAPE = (400, 512, 512)  # voxels along k, j, i
NOISE_HU = 20.0
SECONDS, MIB = 30.0, 3072.0  # targets on two cores
_ROOT = Path(__file__).resolve().parents[1]
_INSIDE = "--inside"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: what is imported."""
    parser.add_argument("--ct", type=Path, help="CT that is resampled to 512 x 512 x 400 (else the head phantom)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return seconds and MiB of an import by the planner, in a separate process and data folder.

    `seconds` is the time from the file to the displayed surface and the tree used for clicks. `peak_mib` is the sum of
    the peak resident memory of the planner's process and of its largest worker, which need not occur at the same time.

    Raises:
        BenchmarkRefused: the CT cannot be read, or the import fails.
        AppMissing: the planner is not installed.
    """
    if not has_app():
        raise need_app("vfix bench import")
    try:
        source = load_head_ct() if args.ct is None else read_volume(args.ct, "LPS", "mm")[0]
    except InputError as error:
        raise report.BenchmarkRefused(f"--ct cannot be used: {error}") from error
    with tempfile.TemporaryDirectory(prefix="vfix-import-") as folder:
        file = Path(folder) / "large.mha"
        _write(file, _resampled(source))
        told = _measured(file, Path(folder) / "home")
    peak = told["planner_mib"] + told["worker_mib"]
    return {
        "machine": report.machine().to_dict(),
        "voxels": list(SHAPE[::-1]),
        "noise_hu": NOISE_HU,
        **told,
        "peak_mib": peak,
        "correct": told["deviation_mm"] == 0.0 or told["certified_mm"] is not None,
        "meets": {"within_30_s": told["seconds"] <= SECONDS, "within_3_gib": peak <= MIB},
    }


def _resampled(source: Volume) -> Volume:
    """Return the CT linearly interpolated to a grid of `SHAPE` over the same box, with seeded noise."""
    from scipy import ndimage  # imported here: slow to load

    random = np.random.default_rng(1)
    steps = [np.linspace(0.0, count - 1.0, wanted) for count, wanted in zip(source.hu.shape, SHAPE, strict=True)]
    plane = np.stack(np.meshgrid(steps[1], steps[2], indexing="ij"))
    hu = np.empty(SHAPE, dtype=np.int16)
    for number, at in enumerate(steps[0]):
        below = min(int(at), source.hu.shape[0] - 2)
        mixed = source.hu[below] * (1.0 - (at - below)) + source.hu[below + 1] * (at - below)
        values = ndimage.map_coordinates(mixed, plane, order=1) + NOISE_HU * random.standard_normal(SHAPE[1:])
        hu[number] = np.clip(np.rint(values), -1024, 3071)
    counts = np.array(source.hu.shape[::-1]) - 1.0
    return Volume(hu, source.origin, source.spacing * counts / (np.array(SHAPE[::-1]) - 1.0), source.direction)


def _write(file: Path, volume: Volume) -> None:
    """Write the volume as uncompressed MetaImage."""
    words: dict[str, npt.NDArray[Any]] = {
        "Offset": volume.origin, "TransformMatrix": volume.direction.T.ravel(), "ElementSpacing": volume.spacing,
        "DimSize": np.array(SHAPE[::-1]),
    }  # fmt: skip
    lines = ["ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False"]
    lines += [f"{name} = {' '.join(f'{value:.17g}' for value in values)}" for name, values in words.items()]
    lines += ["ElementType = MET_SHORT", "ElementDataFile = LOCAL", ""]
    with file.open("wb") as out:
        out.write("\n".join(lines).encode())
        out.write(volume.hu.astype("<i2").tobytes())


def _measured(file: Path, home: Path) -> dict[str, Any]:
    environment = {**os.environ, "VFIX_HOME": str(home)}
    environment["PYTHONPATH"] = os.pathsep.join([str(_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "benchmarks.import_head", _INSIDE, str(file)]
    done = subprocess.run(command, env=environment, cwd=home.parent, capture_output=True, text=True)
    if done.returncode:
        raise report.BenchmarkRefused(f"the import failed: {done.stderr.strip().splitlines()[-1:] or 'no answer'}")
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return told


def _inside(file: Path) -> dict[str, Any]:
    """Run the import in the measured process."""
    from app.imaging.importing import ImportRequest
    from app.services import build_services
    from app.settings import Settings

    services = build_services(Settings.from_environment())
    began = time.perf_counter()
    case = services.importing.run(ImportRequest(file, frame="LPS", unit="mm"))
    imported = time.perf_counter() - began
    services.cases.display_meshes(case.id)
    seen = time.perf_counter() - began
    services.cases.tree(case)
    clicked = time.perf_counter() - began
    anatomy = case.surfaces[0].report
    assert anatomy is not None
    return {
        "seconds": clicked,
        "cpu_s": sum(os.times()[:4]),
        "import_s": imported,
        "picture_s": seen - imported,
        "tree_s": clicked - seen,
        "triangles": case.surfaces[0].triangles,
        "deviation_mm": anatomy.max_deviation_mm,
        "certified_mm": anatomy.certified_mm,
        "planner_mib": _peak_mib(of_children=False),
        "worker_mib": _peak_mib(of_children=True),
    }


def _peak_mib(*, of_children: bool) -> float:
    try:
        import resource
    except ImportError as error:
        raise report.BenchmarkRefused("the memory of a process is not told on this system") from error
    who = resource.RUSAGE_CHILDREN if of_children else resource.RUSAGE_SELF
    of_a_mib = 1 << 20 if sys.platform == "darwin" else 1 << 10  # reported in bytes there, in KiB elsewhere
    return resource.getrusage(who).ru_maxrss / of_a_mib


if __name__ == "__main__" and sys.argv[1:2] == [_INSIDE]:
    print(json.dumps(_inside(Path(sys.argv[2]))))
