"""Hostile archives: each is refused with a plain message, or its content can be listed, shown and written again."""

import hashlib
import io
import json
import os
import struct
import zipfile
from collections.abc import Callable, Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from session_doubles import other_case

from app.api.case_models import CasePublic
from app.cases.model import CaseFrame
from app.cases.structures import BONE
from app.cli import main
from app.commands.case import summary, surface_lines
from app.exchange.archive.checking import CheckedArchive, is_archive
from app.kit import array_files, zip_directory
from app.kit.errors import TooLarge
from app.planning.protected_structures import with_surface_errors
from app.plans.model import PlanContent, PlanPoint
from app.plans.paths import PlanPath
from app.plans.public import PlanPublic
from app.plans.zones import PlanZone
from app.registration.public import RegistrationPublic
from app.services import Services, build_services
from app.settings import Settings
from app.store.models import CaseRow
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import InputError, PlanError
from vfix_engine.files.volume import Volume

Entries = dict[str, bytes]
MUTANTS = 200
EVIL: tuple[Any, ...] = (
    1e308, -5.0, 10**299, 10**25, "x" * 100_000, "<b>\u202e\x00", None, True, {}, [], [1], {"a": 1}, "", "NaN",
    "../../etc/passwd", -1, 0.5,
)  # fmt: skip


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Services]:
    made = build_services(Settings(home=tmp_path_factory.mktemp("hostile"), port=0))
    yield made
    made.close()


@pytest.fixture(scope="module")
def whole(services: Services) -> Entries:
    """The entries of an archive of a case with a surface, two volumes, a structure, a plan and a registration."""
    bare = other_case(services)
    mesh = services.cases.case_surface(bare.id)
    services.purge.run(bare.id)
    hu = np.arange(60, dtype=np.int16).reshape(3, 4, 5)
    volume = Volume(hu, np.zeros(3), np.ones(3), np.eye(3), 1.5, (2000.0, 400.0))
    case = services.cases.create("Other", frame=CaseFrame("LPS", False), surfaces={"bone": mesh}, volume=volume)
    spare = services.cases.files.put_surface("optic", mesh)

    def change(content: Any, _: Any) -> Any:
        (bone,) = content.structures
        optic = type(bone)(
            "optic", "Optic nerve", "spare", "optic", spare.source, bone.provenance, 0.5, True, colour="#ffaa00"
        )
        return type(content)(
            content.frame, (*content.surfaces, spare), content.volumes, (), ("a note",), "head", (bone, optic)
        )

    services.cases.change_content(case.id, change)
    plan = services.plans.create(
        case.id, "Way", PlanContent(paths=(PlanPath(points=(PlanPoint("a", "", (0.0, 0.0, 0.0)),)),))
    )
    services.registrations.create(case.id, "R")
    services.versions.save(plan.id, "First")
    target = io.BytesIO()
    services.archive_writer.write(case.id, target)
    services.purge.run(case.id)
    with zipfile.ZipFile(target) as packed:
        return {name: packed.read(name) for name in packed.namelist()}


def packed(entries: Entries, path: Path) -> Path:
    """The entries as an archive with sound checksums."""
    found = {name: data for name, data in entries.items() if name != "SHA256SUMS"}
    sums = "".join(f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in found.items())
    with zipfile.ZipFile(path, "w") as target:
        for name, data in {**found, "SHA256SUMS": sums.encode()}.items():
            target.writestr(name, data)
    return path


def left_of(services: Services) -> tuple[Any, ...]:
    """Every case, and every file and folder of the store."""
    home = services.settings.home
    return [case.id for case in services.cases.list(include_deleted=True)], sorted(map(str, home.glob("files/**/*")))


def is_refused(services: Services, path: Path, words: str, kind: type[InputError] = InputError) -> None:
    before = left_of(services)
    with pytest.raises(kind, match=words):
        services.archive_reader.read(path)
    assert left_of(services) == before


def use(services: Services, case_id: str) -> None:
    """What lists, shows and writes a case."""
    for case in services.cases.list():
        assert not case.unreadable
        CasePublic.of(case).model_dump_json()
        json.dumps(summary(case), allow_nan=False).encode()
        "\n".join(surface_lines(case)).encode()
    services.archive_writer.write(case_id, io.BytesIO())
    for plan in services.plans.list(case_id):
        msgspec.json.encode(PlanPublic.of(plan))
        services.registering.registration_of(plan)
    for registration in services.registrations.list(case_id):
        msgspec.json.encode(RegistrationPublic.of(registration))


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The path of every value within a JSON value, itself included."""
    yield path
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inner:
        yield from leaves(one, (*path, key))


def put(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    """The value with another one at a path; where `new` is the path itself, without that."""
    if not path:
        return new
    copied = deepcopy(value)
    holder = copied
    for key in path[:-1]:
        holder = holder[key]
    if new is path:
        del holder[path[-1]]
    else:
        holder[path[-1]] = new
    return copied


def test_a_mutant_of_the_json_is_refused_or_harmless(services: Services, whole: Entries, tmp_path: Path) -> None:
    random, before = np.random.default_rng(20), left_of(services)
    names = [name for name in whole if name == "case.json" or name.startswith("documents/")]
    sources = {name: json.loads(whole[name]) for name in names}
    refused = 0
    for _ in range(MUTANTS):
        name = "case.json" if random.random() < 0.7 else names[random.integers(len(names))]
        paths = list(leaves(sources[name]))
        path = paths[random.integers(len(paths))]
        evil = (*EVIL, path)[random.integers(len(EVIL) + 1)]
        mutant = put(sources[name], path, evil)
        archive = packed({**whole, name: json.dumps(mutant).encode()}, tmp_path / "mutant.zip")
        try:
            made = services.archive_reader.read(archive)
        except InputError:
            refused += 1
        else:
            use(services, made.id)
            services.purge.run(made.id)
        assert left_of(services) == before, (name, path, evil)
    assert MUTANTS * 0.75 < refused < MUTANTS


def replaced(name: str, old: str, new: str) -> Callable[[Entries], None]:
    def change(entries: Entries) -> None:
        found = next(one for one in entries if one.startswith(name))
        assert old.encode() in entries[found], old
        entries[found] = entries[found].replace(old.encode(), new.encode(), 1)

    return change


def within(*path: Any, value: Any) -> Callable[[Entries], None]:
    """Another value in case.json."""

    def change(entries: Entries) -> None:
        entries["case.json"] = json.dumps(put(json.loads(entries["case.json"]), path, value)).encode()

    return change


CASES: dict[str, tuple[Callable[[Entries], None], str]] = {
    "infinite": (replaced("case.json", "10.0", "1e999"), "too large"),
    "400 digits": (replaced("documents/plan/", '"revision": 1', f'"revision": {"9" * 400}'), "too large"),
    "a huge revision": (replaced("documents/plan/", '"revision": 1', f'"revision": {10**20}'), "revision"),
    "no revision": (replaced("documents/plan/", '"revision": 1', '"revision": true'), "does not hold"),
    "surrogate": (within("created", value="\ud800"), "Unicode"),
    "time": (within("created", value="yesterday"), "a time"),
    "case hash": (replaced("documents/plan/", '"case_hash": "', '"case_hash": "x'), "hash of its case"),
    "source": (within("content", "surfaces", 0, "source", value=5), "source of a surface"),
    "asset": (within("content", "surfaces", 0, "source", value="asset:../../x.ply"), "source of a surface"),
    "surface name": (within("content", "surfaces", 0, "name", value=["bone"]), "must be text"),
    "blank name": (within("content", "structures", 1, "name", value=" "), "empty or invisible"),
    "assumed": (within("content", "frame", "assumed", value={}), "true or false"),
    "frame": (within("content", "frame", "name", value="MNI"), "LPS, RAS"),
    "frame of a structure": (within("content", "structures", 1, "frame", value="RAS"), "frame of a structure"),
    "deviation": (within("content", "structures", 1, "deviation_mm", value=-5.0), "deviation of a structure"),
    "certified": (within("content", "surfaces", 0, "report", value={
        "mean_deviation_mm": 0, "max_deviation_mm": 0, "dropped": {}, "certified_mm": -1.0}), "certified"),
    "colour": (within("content", "structures", 1, "colour", value="NaN"), "colour"),
    "geometry": (within("content", "structures", 1, "geometry", value="sha256:" + "0" * 64), "another geometry"),
    "triangles": (within("content", "surfaces", 0, "triangles", value=-1), "whole number"),
    "other triangles": (within("content", "surfaces", 0, "triangles", value=5), "another size"),
    "other bounds": (within("content", "surfaces", 0, "bounds_lps_mm", 0, 0, value=-40.0), "another size or place"),
    "other spacing": (within("content", "volumes", 0, "spacing_mm", 0, value=1.25), "another size or place"),
    "two of one name": (within("content", "surfaces", 1, "name", value="bone"), "called the same"),
    "no anatomy": (within("content", "structures", 0, "role", value="spare"), "driven in"),
    "other surface": (within("content", "structures", 1, "surface", value="else"), "names a surface"),
    "dots": (lambda entries: entries.update({"plans/..json": b"{}"}), "no part of a case"),
    "more dots": (lambda entries: entries.update({"plans/...json": b"{}"}), "no part of a case"),
}  # fmt: skip


@pytest.mark.parametrize("name", list(CASES))
def test_hostile_json_is_refused_in_words(services: Services, whole: Entries, tmp_path: Path, name: str) -> None:
    change, words = CASES[name]
    entries = dict(whole)
    change(entries)
    is_refused(services, packed(entries, tmp_path / "a.zip"), words)


# -- stored files


def npy(header: str, data: bytes = b"") -> bytes:
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\0" + struct.pack("<H", len(text)) + text + data


def array(values: Any) -> bytes:
    target = io.BytesIO()
    np.save(target, values, allow_pickle=True)
    return target.getvalue()


def npz(method: int = zipfile.ZIP_STORED, **arrays: bytes) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", method) as made:
        for name, data in arrays.items():
            made.writestr(f"{name}.npy", data)
    return target.getvalue()


def header(shape: str, kind: str = "'<f8'") -> bytes:
    return npy(f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}}}")


FACES = array(np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32))
CORNERS = array(np.zeros((4, 3)))


def with_byte(data: bytes, mark: bytes, offset: int, value: int) -> bytes:
    at = data.index(mark) + offset
    return data[:at] + bytes([value]) + data[at + 1 :]


def many_entries(count: int) -> bytes:
    """A list of entries without entries."""
    one = struct.pack("<4s4B4HL2L5H2L", b"PK\1\2", 20, 3, 20, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0) + b"a"
    return one * count + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, count & 65535, count & 65535, len(one) * count, 0, 0)


FILES: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "no NumPy archive"),
    "text": (b"hello", "no NumPy archive"),
    "a bare array": (array(np.zeros((4, 3))), "no NumPy archive"),
    "10^10": (npz(vertices=header("(10000000000, 3)"), faces=FACES), "shape of an array"),
    "10^30": (npz(vertices=header(f"({10**30}, 3)"), faces=FACES), "shape of an array"),
    "negative": (npz(vertices=header("(-1, 3)"), faces=FACES), "something else than numbers"),
    "damaged header": (npz(vertices=npy("{'descr':'<f8',[[[["), faces=FACES), "header of an array"),
    "deep header": (npz(vertices=npy("(" * 3000), faces=FACES), "header of an array"),
    "structured": (npz(vertices=array(np.zeros(4, [("a", "f8")])), faces=FACES), "something else than numbers"),
    "objects": (npz(vertices=array(np.array([{}], object)), faces=FACES), "something else than numbers"),
    "complex": (npz(vertices=array(np.zeros((4, 3), complex)), faces=FACES), "something else than numbers"),
    "no faces": (npz(vertices=CORNERS), "does not hold what it should"),
    "one more": (npz(vertices=CORNERS, faces=FACES, extra=FACES), "does not hold what it should"),
    "no array": (npz(vertices=b"abc", faces=FACES), "header of an array"),
    "lzma": (npz(zipfile.ZIP_LZMA, vertices=CORNERS, faces=FACES), "packed in an unknown way"),
    "encrypted": (with_byte(npz(vertices=CORNERS, faces=FACES), b"PK\1\2", 8, 1), "encrypted"),
    "compression 99": (with_byte(npz(vertices=CORNERS, faces=FACES), b"PK\1\2", 10, 99), "packed in an unknown way"),
    "said to be larger": (with_byte(npz(vertices=CORNERS, faces=FACES), b"PK\1\2", 27, 1), "larger than it can be"),
    "many entries": (many_entries(5000), "32 entries are allowed"),
}  # fmt: skip


@pytest.mark.parametrize("name", list(FILES))
def test_a_hostile_stored_file_is_refused_and_leaves_nothing(
    services: Services, whole: Entries, tmp_path: Path, name: str
) -> None:
    data, words = FILES[name]
    old = json.loads(whole["case.json"])["content"]["surfaces"][0]["source"].removeprefix("sha256:")
    new = hashlib.sha256(data).hexdigest()
    entries = {key: value.replace(old.encode(), new.encode()) for key, value in whole.items() if old not in key}
    entries[f"files/{new[:2]}/{new}"] = data
    is_refused(services, packed(entries, tmp_path / "a.zip"), words)


def test_a_damaged_array_is_told_by_its_checksum(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, bits=np.arange(999))
    assert np.array_equal(array_files.read_arrays(path)["bits"], np.arange(999))
    data = path.read_bytes()
    path.write_bytes(with_byte(data, b"bits.npy", 300, data[data.index(b"bits.npy") + 300] ^ 1))
    with pytest.raises(array_files.ArraysUnusable, match="damaged"):
        array_files.read_arrays(path)


def test_columns_first_come_back_as_they_were(tmp_path: Path) -> None:
    values = np.asfortranarray(np.arange(24, dtype=np.int16).reshape(2, 3, 4))
    np.savez(tmp_path / "a.npz", hu=values)
    assert np.array_equal(array_files.read_arrays(tmp_path / "a.npz")["hu"], values)


# -- the end of the zip

LARGE, LOCATOR = struct.Struct("<4sQ2H2L4Q"), struct.Struct("<4sLQL")


def end(here: int, size: int, offset: int, comment: bytes = b"") -> bytes:
    return struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, here, here, size, offset, len(comment)) + comment


def large(count: int, size: int) -> bytes:
    record = LARGE.pack(b"PK\6\6", 44, 45, 45, 0, 0, count, count, size, 0)
    return record + LOCATOR.pack(b"PK\6\7", 0, size, 1)


BOMB = struct.pack("<4s4B4HL2L5H2L", b"PK\1\2", 20, 3, 20, 0, 0, 0, 0, 0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0)
BOMB = (BOMB + b"plans/a.json") * 200_000
HUGE = (0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF)
ENDS: dict[str, tuple[bytes, type[InputError]]] = {
    "said": (end(1, len(BOMB), 0), TooLarge),
    "ZIP64": (large(200_000, len(BOMB)) + end(*HUGE), TooLarge),
    "ZIP64 beside a small one": (large(200_000, len(BOMB)) + end(1, 10, 0), InputError),
    "a mark in the offset": (end(1, len(BOMB), int.from_bytes(b"PK\5\6", "little")), TooLarge),
    "a mark in the comment": (large(1, len(BOMB)) + end(*HUGE, b"PK\6\6" + bytes(60)), InputError),
    "an end in the comment": (end(1, len(BOMB), 0, end(0, 0, 0)), InputError),
    "small, and not at its place": (end(1, 10, 0), InputError),
}


@pytest.mark.parametrize("name", list(ENDS))
def test_a_long_list_of_entries_is_never_read(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tail, kind = ENDS[name]
    path = tmp_path / "bomb.zip"
    path.write_bytes(BOMB + tail)
    monkeypatch.setattr(zipfile, "ZipFile", lambda *_: pytest.fail("the list of entries was read"))
    with pytest.raises(kind, match=r"list of entries|no zip"):
        CheckedArchive(path)
    assert not is_archive(path)


def test_a_zip_that_needs_zip64_is_read(tmp_path: Path) -> None:
    """As zipfile writes the end of more entries than the small record can count."""
    path = tmp_path / "many.zip"
    with zipfile.ZipFile(path, "w") as made:
        for number in range(0x10000):
            made.writestr(f"{number}", b"")
    assert b"PK\6\6" in path.read_bytes()[-98:]
    zip_directory.check_directory(path, 0x10000)
    with pytest.raises(TooLarge):
        zip_directory.check_directory(path, 100)


# -- what is no regular file, what is stored already, and what shrinks a margin


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_what_is_no_regular_file_is_neither_read_nor_replaced(
    services: Services, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(services.settings.home))
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for words in (["export", "head-phantom", str(pipe)], ["import-archive", str(pipe)], ["import-archive", "/"]):
        assert main(["case", *words]) == 2
        assert "is not a regular file" in capsys.readouterr().err
    assert pipe.is_fifo()


def test_a_case_that_cannot_be_read_is_listed_and_can_be_removed(services: Services) -> None:
    case = other_case(services)
    with services.store.writing() as session:
        row = session.get_one(CaseRow, case.id)
        row.document = {**row.document, "frame": {"name": "LPS", "assumed": {}}}
    (listed,) = [one for one in services.cases.list() if one.id == case.id]
    assert "true or false" in listed.unreadable
    assert CasePublic.of(listed).unreadable == listed.unreadable
    assert summary(listed)["unreadable"]
    assert surface_lines(listed) == []
    assert services.cases.rename(case.id, "Renamed").name == "Renamed"
    assert services.cases.delete(case.id).deleted_at
    services.purge.run(case.id)
    assert case.id not in [one.id for one in services.cases.list(include_deleted=True)]


@pytest.mark.parametrize("error", [-5.0, float("nan"), float("inf")])
def test_no_error_of_a_surface_makes_a_margin_smaller(error: float) -> None:
    zone = PlanZone("z", "Optic", {"kind": "structure", "structure": "optic"}, margin_mm=2.0)
    (grown,) = with_surface_errors([zone], {"optic": 0.5, BONE: error})
    assert grown.margin_mm == 2.5
    with pytest.raises(PlanError, match="Optic"):
        with_surface_errors([zone], {"optic": error})
    with pytest.raises(InputError, match="cannot be off"):
        SurfaceUncertainty(error, 0.0)
