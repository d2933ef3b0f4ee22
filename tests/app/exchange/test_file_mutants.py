"""Mutated files of every format, read in the worker: each is read or refused with a message (HAZ-16)."""

from __future__ import annotations

import gzip
import io
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk  # noqa: N813
import trimesh
from file_mutants import mutant, read_mutants

from app.exchange.markups import to_markups
from app.exchange.plan_files import to_csv, to_native_json
from app.plans.document import PLAN as PLANS
from app.plans.model import PlanContent, PlanPath, PlanPoint
from tests.engine.imaging_phantoms import asymmetric_volume, dicom_slices
from vfix_engine.files.sandbox.isolated import run_isolated

MUTANTS = 1000
Spoil = Callable[[np.random.Generator | None], bytes]  # the sound file where nothing random is given

POINTS = tuple(PlanPoint(str(n), f"point {n}, left", (6.0 + n, -11.25 * n, 3.5)) for n in range(6))
PLAN = replace(
    PLANS.draft(
        "case-1",
        "ab" * 32,
        "Left nose",
        PlanContent(
            targets=(PlanPoint("t", "ostium", (1.0, 2.0, 3.0)),),
            robot={"name": "steady_hand", "base": None, "q_start": None},
            settings={"margin_mm": 0.4},
            paths=(PlanPath(points=POINTS),),
        ),
        "plan-1",
    ),
    created="2026-01-01T00:00:00.000+00:00",
    modified="2026-01-01T00:00:00.000+00:00",
)


def image(name: str, folder: Path) -> bytes:
    sitk.WriteImage(sitk.GetImageFromArray(asymmetric_volume().hu), str(folder / name))
    return (folder / name).read_bytes()


def ball(kind: str, **options: str) -> bytes:
    data = trimesh.creation.icosphere(subdivisions=1, radius=50.0).export(file_type=kind, **options)
    return data if isinstance(data, bytes) else data.encode()


def plain(original: bytes) -> Spoil:
    return lambda random: original if random is None else mutant(original, random)


def packed_nifti(original: bytes) -> Spoil:
    """The pack itself spoiled, or what is in it."""

    def spoil(random: np.random.Generator | None) -> bytes:
        packed = gzip.compress(original, 1)
        if random is None:
            return packed
        return mutant(packed, random) if random.random() < 0.3 else gzip.compress(mutant(original, random), 1)

    return spoil


def series() -> Spoil:
    """One slice of a series in a zip, or the zip."""
    slices = []
    for one in dicom_slices(asymmetric_volume())[:3]:
        stream = io.BytesIO()
        pydicom.dcmwrite(stream, one, enforce_file_format=True)
        slices.append(stream.getvalue())

    def zipped(entries: list[bytes]) -> bytes:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            for number, data in enumerate(entries):
                archive.writestr(f"{number}", data)
        return stream.getvalue()

    def spoil(random: np.random.Generator | None) -> bytes:
        if random is None or random.random() < 0.2:
            return zipped(slices) if random is None else mutant(zipped(slices), random)
        which = int(random.integers(0, len(slices)))
        return zipped([mutant(data, random) if n == which else data for n, data in enumerate(slices)])

    return spoil


def spoiler(name: str, folder: Path) -> Spoil:
    if name == "ct.zip":
        return series()
    if name == "ct.nii.gz":
        return packed_nifti(image("ct.nii", folder))
    if name.endswith((".nrrd", ".nii", ".mha")):
        return plain(image(name, folder))
    texts = {"plan.json": to_native_json, "plan.mrk.json": to_markups, "plan.csv": to_csv}
    if name in texts:
        return plain(texts[name](PLAN).encode())
    if name == "plan.fcsv":
        rows = "".join(f"{n},{n},2.5,3,0,0,0,1,1,1,0,F-{n},,\n" for n in range(6))
        head = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
        return plain(
            (head + "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n" + rows).encode()
        )
    return plain(ball("ply", encoding="ascii") if name == "text.ply" else ball(name.rpartition(".")[2]))


@pytest.mark.parametrize(
    "name",
    [
        *("ct.nrrd", "ct.nii", "ct.nii.gz", "ct.mha", "ct.zip"),
        *("ball.ply", "text.ply", "ball.stl", "ball.obj"),
        *("plan.json", "plan.mrk.json", "plan.csv", "plan.fcsv"),
    ],
)
def test_mutants_are_read_or_refused(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """HAZ-16: 1,000 of each, none of them a traceback, late, or the end of the worker."""
    spoil, random = spoiler(name, tmp_path), np.random.default_rng(16)
    folder = tmp_path / "mutants"
    folder.mkdir()
    for number in range(MUTANTS + 1):
        (folder / f"{number:04d}-{name}").write_bytes(spoil(random if number else None))
    code = Path(__file__).resolve().parents[3] / "app"
    read, refused, slowest, strays = run_isolated(read_mutants, folder, code, seconds=300.0)
    assert strays == []
    assert read + refused == MUTANTS
    assert min(read, refused) > MUTANTS // 50  # otherwise they prove nothing
    assert slowest < 30.0
    with capsys.disabled():
        print(
            f"\n{MUTANTS:,} mutants of {name}: {read} read, {refused} refused, {1e3 * slowest:.0f} ms at most", end=""
        )
