"""GLB, VTK and VTP: the same surface as from PLY, whatever the way it is written; damaged files are refused."""

import base64
import contextlib
import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from vfix_engine.errors import FrameError, MeshError
from vfix_engine.files.mesh_files import READERS, is_mesh, mesh_suffixes, read_mesh
from vfix_engine.geometry.mesh import TriangleMesh

SPHERE = trimesh.creation.icosphere(subdivisions=2, radius=30.0)
VERTICES = np.asarray(SPHERE.vertices, dtype=np.float32) + np.float32([5, -20, 40])
FACES = np.asarray(SPHERE.faces, dtype=np.int64)
TITLE = "3D Slicer output. SPACE=RAS"


def legacy(binary: bool, version: str = "4.2", title: str = TITLE) -> bytes:
    count = len(FACES)
    head = f"# vtk DataFile Version {version}\n{title}\n{'BINARY' if binary else 'ASCII'}\nDATASET POLYDATA\n"
    points = f"POINTS {len(VERTICES)} float\n".encode() + numbers(VERTICES, ">f4", binary)
    if version >= "5":
        lists = [("OFFSETS", np.arange(count + 1) * 3), ("CONNECTIVITY", FACES)]
        cells = f"POLYGONS {count + 1} {3 * count}\n".encode() + b"".join(
            f"{name} vtktypeint64\n".encode() + numbers(values, ">i8", binary) for name, values in lists
        )
    else:
        counted = np.column_stack([np.full(count, 3), FACES])
        cells = f"POLYGONS {count} {4 * count}\n".encode() + numbers(counted, ">i4", binary)
    after = b"POINT_DATA 162\nNORMALS Normals float\n"
    return head.encode() + points + cells + after


def numbers(values: np.ndarray, kind: str, binary: bool) -> bytes:
    if binary:
        return values.astype(kind).tobytes() + b"\n"
    return "\n".join(" ".join(f"{value:.9g}" for value in row) for row in np.atleast_2d(values)).encode() + b"\n"


def vtp(form: str, packed: bool = False, space: str | None = "RAS") -> bytes:
    """form: ascii, binary, base64 or raw; the last two are appended."""
    appended = b""
    texts = []
    named = np.frombuffer((space or "").encode() + b"\0", np.uint8)
    arrays = [
        ("FieldData", "SPACE", "String", named),
        ("Points", "Points", "Float32", VERTICES),
        ("Polys", "connectivity", "Int64", FACES),
        ("Polys", "offsets", "Int64", np.arange(1, len(FACES) + 1) * 3),
    ]
    for _, name, kind, values in arrays:
        tag = "Array" if kind == "String" else "DataArray"
        facts = f'type="{kind}" Name="{name}" NumberOfComponents="{3 if name == "Points" else 1}"'
        data = values.astype({"Float32": "<f4", "Int64": "<i8"}.get(kind, "u1")).tobytes()
        if form == "ascii":
            body = " ".join(str(value) for value in values.ravel())
            texts.append(f'<{tag} {facts} format="ascii">{body}</{tag}>')
        elif form == "binary":
            texts.append(f'<{tag} {facts} format="binary">{encoded(data, packed)}</{tag}>')
        else:
            texts.append(f'<{tag} {facts} format="appended" offset="{len(appended)}"/>')
            appended += encoded(data, packed).encode() if form == "base64" else b"".join(blocks(data, packed))
    compressor = ' compressor="vtkZLibDataCompressor"' if packed else ""
    head = (
        f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" '
        f'header_type="UInt32"{compressor}>\n<PolyData>{"<FieldData>" + texts[0] + "</FieldData>" if space else ""}'
        f'<Piece NumberOfPoints="{len(VERTICES)}" NumberOfPolys="{len(FACES)}" NumberOfStrips="0">'
        f"<Points>{texts[1]}</Points><Polys>{texts[2]}{texts[3]}</Polys></Piece></PolyData>\n"
    )
    tail = b"" if form in ("ascii", "binary") else f'<AppendedData encoding="{form}">\n_'.encode()
    end = b"" if not tail else b"\n</AppendedData>"
    return head.encode() + tail + appended + end + b"</VTKFile>"


def blocks(data: bytes, packed: bool) -> list[bytes]:
    """Header and content, as the VTK file formats have them; packed in blocks of 1,000 bytes."""
    if not packed:
        return [struct.pack("<I", len(data)), data]
    parts = [data[at : at + 1000] for at in range(0, len(data), 1000)]
    deflated = [zlib.compress(part) for part in parts]
    last = len(parts[-1]) % 1000
    sizes = [len(one) for one in deflated]
    return [struct.pack(f"<{3 + len(parts)}I", len(parts), 1000, last, *sizes), b"".join(deflated)]


def encoded(data: bytes, packed: bool) -> str:
    head, body = blocks(data, packed)
    if packed:
        return (base64.b64encode(head) + base64.b64encode(body)).decode()
    return base64.b64encode(head + body).decode()


def read(tmp_path: Path, name: str, data: bytes, frame: str | None = None) -> TriangleMesh:
    file = tmp_path / name
    file.write_bytes(data)
    return read_mesh(file, frame, "mm")[0]


def check(mesh: TriangleMesh, mirrored: bool = True) -> None:
    wanted = VERTICES.astype(np.float64) * ([-1.0, -1.0, 1.0] if mirrored else [1.0, 1.0, 1.0])
    assert np.abs(mesh.triangles - wanted[FACES]).max() < 1e-4


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("version", ["3.0", "4.2", "5.1"])
def test_legacy_vtk(tmp_path: Path, binary: bool, version: str) -> None:
    check(read(tmp_path, "x.vtk", legacy(binary, version)))


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("form", ["ascii", "binary", "base64", "raw"])
def test_vtp(tmp_path: Path, form: str, packed: bool) -> None:
    check(read(tmp_path, "x.vtp", vtp(form, packed)))


@pytest.mark.parametrize("binary", [True, False])
def test_a_field_names_the_frame(tmp_path: Path, binary: bool) -> None:
    """As VTK's own writer has it: a text of fewer than 64 bytes after its length, or on a line."""
    field = b"FIELD FieldData 2\nn 1 1 int\n" + numbers(np.array([7]), ">i4", binary) + b"SPACE 1 1 string\n"
    text = b"\xc3RAS\n" if binary else b"RAS\n"
    data = legacy(binary, "5.1", "plain").replace(b"POINTS", field + text + b"\nPOINTS", 1)
    check(read(tmp_path, "x.vtk", data))


def test_polygons_are_split(tmp_path: Path) -> None:
    head = b"# vtk DataFile Version 3.0\nSPACE=LPS\nASCII\nDATASET POLYDATA\nPOINTS 5 double\n"
    points = b"0 0 0 10 0 0 10 10 0\n0 10 0 5 5 10\n"
    mesh = read(tmp_path, "x.vtk", head + points + b"POLYGONS 2 9\n4 0 1 2 3\n3 0 1 4\n")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 4]]


@pytest.mark.parametrize(("name", "data"), [("x.vtk", legacy(True, title="plain")), ("x.vtp", vtp("raw", space=None))])
def test_a_file_without_a_frame_is_asked_about(tmp_path: Path, name: str, data: bytes) -> None:
    with pytest.raises(FrameError) as asked:
        read(tmp_path, name, data)
    assert asked.value.missing == ("frame",)
    check(read(tmp_path, name, data, "LPS"), mirrored=False)


def glb(mesh: trimesh.Trimesh | None = None, turn: np.ndarray | None = None) -> bytes:
    scene = trimesh.Scene()
    made = mesh or trimesh.Trimesh(VERTICES, FACES, process=False)
    scene.add_geometry(made, transform=np.eye(4) if turn is None else turn)
    return scene.export(file_type="glb")  # type: ignore[no-any-return]


def test_glb(tmp_path: Path) -> None:
    check(read(tmp_path, "x.glb", glb(), "LPS"), mirrored=False)
    turn = trimesh.transformations.rotation_matrix(0.5, [1, 2, 3])
    turn[:3, 3] = [1.0, 2.0, 3.0]
    mesh = read(tmp_path, "x.glb", glb(turn=turn), "LPS")
    assert np.abs(mesh.triangles - trimesh.transform_points(VERTICES, turn)[FACES]).max() < 1e-3


def test_a_mirrored_node_keeps_its_triangles_turned_outwards(tmp_path: Path) -> None:
    mesh = read(tmp_path, "x.glb", glb(turn=np.diag([-1.0, 1.0, 1.0, 1.0])), "LPS")
    a, b, c = np.moveaxis(mesh.triangles - mesh.bounds.mean(axis=0), 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0


def changed_glb(change: Callable[[dict[str, object]], None]) -> bytes:
    data = glb()
    size = struct.unpack_from("<I", data, 12)[0]
    facts = json.loads(data[20 : 20 + size])
    change(facts)
    text = json.dumps(facts).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    return (
        struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + rest
    )


def many(facts: dict[str, object]) -> None:
    facts["accessors"][0]["count"] = 1 << 40  # type: ignore[index]


def circle(facts: dict[str, object]) -> None:
    facts["nodes"][0]["children"] = [0]  # type: ignore[index]


def strips(facts: dict[str, object]) -> None:
    facts["meshes"][0]["primitives"][0]["mode"] = 5  # type: ignore[index]


def lines(facts: dict[str, object]) -> None:
    points = {"attributes": {"POSITION": 0}, "mode": 1}
    facts["meshes"][0]["primitives"].append(points)  # type: ignore[index]


def test_lines_of_a_glb_are_passed_over(tmp_path: Path) -> None:
    check(read(tmp_path, "x.glb", changed_glb(lines), "LPS"), mirrored=False)
    with pytest.raises(MeshError, match="something was added"):
        read(tmp_path, "x.glb", glb() + b"\0\0", "LPS")


def elsewhere(facts: dict[str, object]) -> None:
    facts["buffers"][0]["uri"] = "/etc/passwd"  # type: ignore[index]


def draco(facts: dict[str, object]) -> None:
    facts["extensionsRequired"] = ["KHR_draco_mesh_compression"]


def backwards(facts: dict[str, object]) -> None:
    facts["bufferViews"][0]["byteOffset"] = -400  # type: ignore[index]


@pytest.mark.parametrize("change", [many, circle, strips, elsewhere, draco, backwards])
def test_glb_that_is_not_read(tmp_path: Path, change: Callable[[dict[str, object]], None]) -> None:
    with pytest.raises(MeshError, match="GLB"):
        read(tmp_path, "x.glb", changed_glb(change), "LPS")


WHOLE = {
    "b.vtk": legacy(True),
    "a.vtk": legacy(False),
    "n.vtk": legacy(True, "5.1"),
    "r.vtp": vtp("raw", True),
    "b.vtp": vtp("binary", True),
    "a.vtp": vtp("ascii"),
    "x.glb": glb(),
}


@pytest.mark.parametrize("name", WHOLE)
def test_a_file_that_was_cut_off_is_refused(tmp_path: Path, name: str) -> None:
    """Wherever it was cut within its corners and triangles."""
    data = WHOLE[name]
    for share in np.linspace(0.02, 0.9, 23):
        with pytest.raises(MeshError):
            read(tmp_path, name, data[: int(share * len(data))], "RAS" if name != "x.glb" else "LPS")


@pytest.mark.parametrize("name", WHOLE)
def test_damaged_bytes_are_refused_or_give_a_surface(tmp_path: Path, name: str) -> None:
    """HAZ-16: 100 files with wrong bytes: an error with words, or a finite surface; nothing else."""
    rng = np.random.default_rng(7)
    for _ in range(100):
        data = bytearray(WHOLE[name])
        for place in rng.integers(0, len(data), 8):
            data[place] = rng.integers(0, 256)
        with contextlib.suppress(MeshError, FrameError):
            assert np.isfinite(read(tmp_path, name, bytes(data)).vertices).all()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (legacy(False).replace(b"POLYDATA", b"STRUCTURED_GRID"), "not a surface"),
        (legacy(False).replace(b"POLYGONS", b"TRIANGLE_STRIPS"), "strips"),
        (legacy(False).replace(b"float", b"bit"), "type that is not read"),
        (vtp("ascii").replace(b"PolyData", b"ImageData"), "not a surface"),
        (vtp("raw", True).replace(b"vtkZLib", b"vtkLZMA"), "another method"),
        (vtp("raw").replace(b'NumberOfPoints="', b'NumberOfPoints="1'), "claims 1[0-9]+ points and holds"),
        (vtp("raw").replace(b'NumberOfPolys="', b'NumberOfPolys="9'), "claims 9[0-9]+ polygons and holds"),
        (vtp("ascii").replace(b"<PolyData>", b"<!DOCTYPE a []><PolyData>"), "entities"),
    ],
)
def test_what_is_not_read_says_why(tmp_path: Path, data: bytes, words: str) -> None:
    with pytest.raises(MeshError, match=words):
        read(tmp_path, "x.vtp" if b"VTKFile" in data else "x.vtk", data)


def read_off(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Reader of a format of one's own, Geomview's OFF, as docs/architecture.md adds one."""
    head, *lines = data.decode("ascii").split("\n")
    if head != "OFF":
        raise MeshError("the file does not begin with OFF. Export it again.")
    vertices, faces, _ = (int(word) for word in lines[0].split())
    rows = [line.split() for line in lines[1:] if line]
    if len(rows) != vertices + faces:
        raise MeshError(f"the file claims {vertices + faces} rows and holds {len(rows)}. Export it again.")
    return np.array(rows[:vertices], dtype=np.float64), np.array(rows[vertices:], dtype=np.int64)[:, 1:]


def test_a_format_of_ones_own_is_read_and_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(READERS, ".off", read_off)
    rows = [" ".join(map(str, row)) for row in VERTICES] + [" ".join(map(str, (3, *row))) for row in FACES]
    text = "\n".join(["OFF", f"{len(VERTICES)} {len(FACES)} 0", *rows])
    assert is_mesh(tmp_path / "head.off")
    (tmp_path / "head.off").write_text(text)
    with pytest.raises(FrameError):
        read_mesh(tmp_path / "head.off")
    mesh, _ = read_mesh(tmp_path / "head.off", "LPS", "mm")
    np.testing.assert_allclose(mesh.vertices, VERTICES, rtol=1e-6)
    np.testing.assert_array_equal(mesh.faces, FACES)
    (tmp_path / "head.off").write_text(text.rsplit("\n", 1)[0])
    with pytest.raises(MeshError, match="claims"):
        read_mesh(tmp_path / "head.off", "LPS", "mm")
    (tmp_path / "head.off").write_text(text.rsplit("\n", 1)[0] + f"\n3 0 1 {len(VERTICES)}")
    with pytest.raises(MeshError, match="corner"):
        read_mesh(tmp_path / "head.off", "LPS", "mm")


@pytest.mark.parametrize("file", ["app/tabs/patient/files-in.js", "app/commands/import_.py", "docs/cli.md"])
def test_every_place_that_lists_the_formats_lists_all(file: str) -> None:
    text = (Path(__file__).parents[3] / file).read_text(encoding="utf-8")
    for suffix in mesh_suffixes():
        lists = [suffix in text, f"{suffix[1:]}|" in text] if file.endswith(".js") else [suffix in text]
        assert all(lists), suffix
