"""Surfaces as other programs write them: read alike, or refused with what is really wrong."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vfix_engine.errors import FrameError, MeshError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.geometry.mesh import TriangleMesh

BOM = b"\xef\xbb\xbf"
CORNERS = np.array([[0, 0, 0], [80, 0, 0], [80, 60, 0], [0, 60, 0], [40, 30, 70.5]])
POLYGONS = [[3, 2, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
FACES = [[3, 2, 1], [3, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]


def read(tmp_path: Path, name: str, data: bytes) -> TriangleMesh:
    (tmp_path / name).write_bytes(data)
    return read_mesh(tmp_path / name, "LPS", "mm")[0]


def check(mesh: TriangleMesh) -> None:
    assert np.abs(mesh.triangles - CORNERS[FACES]).max() < 1e-4


# -- PLY


Item = Callable[[list[int]], tuple[str, list[Any]]]


def whole(polygon: list[int]) -> tuple[str, list[Any]]:
    return f"B{len(polygon)}i", [len(polygon), *polygon]


def ply(order: str, faces: str = "list uchar int vertex_indices", face: Item = whole) -> bytes:
    """order: of the bytes, '' for text. The faces are preceded by an element that nobody needs."""
    name = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = (
        f"ply\nformat {name} 1.0\ncomment a\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
        f"property uchar red\nelement edge 2\nproperty list uchar short ends\nelement face 5\n"
        + "".join(f"property {one}\n" for one in faces.split(";"))
        + "end_header\n"
    )
    rows = [("3fB", [*corner, 7]) for corner in CORNERS.tolist()] + [("Bh", [1, 9]), ("B2h", [2, 8, 8])]
    rows += [face(one) for one in POLYGONS]
    if order == "":
        return head.encode() + b"".join(b" ".join(f"{x:g}".encode() for x in row) + b"\n" for _, row in rows)
    return head.encode() + b"".join(struct.pack(order + form, *row) for form, row in rows)


@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize(
    ("faces", "face"),
    [
        ("list uchar int vertex_indices", whole),
        ("list int ushort vertex_index", lambda one: (f"i{len(one)}H", [len(one), *one])),
        ("uchar flag;list uchar uint vertex_indices", lambda one: (f"BB{len(one)}I", [1, len(one), *one])),
        (
            "list uchar int vertex_indices;list uchar float texcoord",
            lambda one: (f"B{len(one)}iB{2 * len(one)}f", [len(one), *one, 2 * len(one), *[0.5] * (2 * len(one))]),
        ),
        ("list char char vertex_indices;double area", lambda one: (f"b{len(one)}bd", [len(one), *one, 0.25])),
    ],
)
def test_mixed_polygons_of_a_ply(tmp_path: Path, order: str, faces: str, face: Item) -> None:
    """Text and binary, in either order of bytes, whatever else the faces have: one list of polygons."""
    check(read(tmp_path, "a.ply", ply(order, faces, face)))


def test_a_ply_with_marks_and_other_ends_of_lines(tmp_path: Path) -> None:
    check(read(tmp_path, "a.ply", BOM + ply("")))
    check(read(tmp_path, "a.ply", ply("").replace(b"\n", b"\r\n")))
    check(read(tmp_path, "a.ply", ply("").replace(b"\n", b"\r")))
    head, end, body = ply("<").partition(b"end_header\n")
    check(read(tmp_path, "a.ply", (head + end).replace(b"\n", b"\r\n") + body))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (ply("<") + b"\0" * 3, "holds 3 bytes more than its header claims"),
        (ply("<")[:-3], "cut off"),
        (ply("") + b"3 0 1 2\n", "claims 12 rows of values, but 13 are there; 1 are too many"),
        (ply("").replace(b"3 0 1 4", b"2 0 1", 1), "fewer than three corners"),
        (ply("").replace(b"70.5", b"70,5"), "decimal commas"),
        (ply("").replace(b"element face", b"element tristrips"), "strips, which are not read"),
        (ply("<", "list uchar float vertex_indices"), "whole numbers"),
        (ply("<").replace(b"binary_little_endian", b"binary_middle_endian"), "no format that is read"),
        ("ply\n".encode("utf-16"), "UTF-16"),
    ],
)
def test_a_ply_that_is_not_read_says_why(tmp_path: Path, data: bytes, words: str) -> None:
    with pytest.raises(MeshError, match=words) as refused:
        read(tmp_path, "a.ply", data)
    assert ("cut off" in str(refused.value)) == (words == "cut off")


# -- STL


def stl(name: str = "head", end: str = "head", change: Callable[[str], str] = str) -> bytes:
    facets = "".join(
        "facet normal 0 0 1\n outer loop\n"
        + "".join(f"  vertex {x:g} {y:g} {z:g}\n" for x, y, z in CORNERS[face])
        + " endloop\nendfacet\n"
        for face in FACES
    )
    return (change("solid") + f" {name}\n" + change(facets) + change("endsolid") + f" {end}\n").encode()


def binary_stl(header: bytes = b"") -> bytes:
    records = b"".join(struct.pack("<12fH", 0, 0, 1, *CORNERS[face].ravel(), 0) for face in FACES)
    return header.ljust(80, b"\0") + struct.pack("<I", len(FACES)) + records


@pytest.mark.parametrize(
    "data",
    [
        stl(change=str.upper),
        stl(change=str.title),
        BOM + stl(),
        BOM + stl(change=str.upper).replace(b"\n", b"\r\n"),
        stl().replace(b"\n", b"\r"),
        stl("vertex 1 2 3 facet endsolid", "endfacet vertex solid"),
        stl("facet normal 0 0 1 outer", "facet"),
        stl("", ""),
        stl().replace(b"\n", b" "),
        stl()[:-1],
        binary_stl(b"solid facet normal"),
        binary_stl(BOM),
    ],
)
def test_an_stl_of_another_program(tmp_path: Path, data: bytes) -> None:
    check(read(tmp_path, "a.stl", data))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (binary_stl() + b"\0\0", "holds 2 bytes too many after the 6 triangles"),
        (binary_stl() + b"\n", "holds 1 byte too many"),
        (binary_stl(b"solid facet") + b"\0" * 50, "holds 50 bytes too many"),
        (binary_stl()[:-2], "claims 6 triangles and holds 5; it is cut off"),
        (stl() + stl(), "several solids"),
        (b"; of a scanner\n" + stl(), "does not begin with 'solid'"),
        (stl() + b"3 0 1 2\n", "goes on after its end"),
        (stl()[: len(stl()) // 2], "cut off"),
        (stl().partition(b"endsolid")[0], "cut off"),
        (stl().replace(b"70.5", b"70,5"), "decimal commas"),
        (stl().replace(b"endloop", b"vertex 1 1 1 endloop", 1), "facet 1 of .* is not a normal and three corners"),
        (stl().decode().encode("utf-16"), "UTF-16"),
    ],
)
def test_an_stl_that_is_not_read_says_why(tmp_path: Path, data: bytes, words: str) -> None:
    with pytest.raises(MeshError, match=words) as refused:
        read(tmp_path, "a.stl", data)
    assert ("cut off" in str(refused.value)) == ("cut off" in words)


# -- OBJ

OBJ = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in CORNERS) + "".join(
    f"f {' '.join(str(n + 1) for n in one)}\n" for one in POLYGONS
)


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + OBJ,
        OBJ.replace("f 4 3 2 1\n", "f 4 3 \\\n2 1\n"),
        OBJ.replace("f 4 3 2 1\n", "f \\\n  4 3 \\\n  2 \\\n  1\n"),
        OBJ.replace("f 4 3 2 1\n", "f 4 3 2 \\  \r\n1\n"),
        OBJ.replace("v 80 60 0\n", "v 80 \\\n60 \\\n0\n"),
        "mtllib C:\\heads\\\n" + OBJ,
        "# C:\\heads\\\n" + OBJ,
        "g left \\\nright\ns off\n" + OBJ,
        OBJ.replace("v 80 60 0\n", "v 80 60 0 1.0 0.5 0.5 0.5\n"),
        OBJ.replace("\n", "\r"),
    ],
)
def test_an_obj_of_another_program(tmp_path: Path, text: str) -> None:
    check(read(tmp_path, "a.obj", text.encode()))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("V 1 2 3\n" + OBJ, "line 1 of the OBJ file begins with 'V'"),
        ("\u200bv 1 2 3\n" + OBJ, "line 1 of the OBJ file begins with"),
        (OBJ.replace("f 1 2 5", "face 1 2 5"), "line 7 of the OBJ file begins with 'face'"),
        ("o head\n\ufeff" + OBJ, "line 2 of the OBJ file begins with"),
        (OBJ + "surf 0 1 0 1 1 2 3\n", "free-form .*'surf'"),
        (OBJ + "call other.obj\n", "calls another file"),
        (OBJ.replace("v 80 60 0", "v 80,5 60 0"), "not a corner: its numbers have decimal commas"),
        (OBJ.replace("v 80 60 0", "v 80 5 60 0 0"), "line 3 of the OBJ file is not a corner"),
        (OBJ.replace("f 1 2 5", "f 1_0 2 5"), "line 7 of the OBJ file is not a triangle"),
        (OBJ.replace("f 4 3 2 1", "f 4 3\\\n2 1"), "put a blank before the backslash"),
        (OBJ + "f 1 2 \\\n", "cut off"),
        (OBJ[:-1], "does not end in a line break"),
    ],
)
def test_an_obj_that_is_not_read_says_why(tmp_path: Path, text: str, words: str) -> None:
    """HAZ-14: a first word that is not known may be a corner: passed over, all polygons would name others."""
    with pytest.raises(MeshError, match=words) as refused:
        read(tmp_path, "a.obj", text.encode())
    assert ("cut off" in str(refused.value)) == (words == "cut off")


# -- VTK


def vtk(binary: bool, before: bytes = b"", between: bytes = b"", version: str = "3.0") -> bytes:
    """before: sections above the points. between: sections above the polygons."""

    def values(numbers: list[float], kind: str) -> bytes:
        if binary:
            return np.array(numbers).astype(kind).tobytes() + b"\n"
        return " ".join(f"{x:g}" for x in numbers).encode() + b"\n"

    head = f"# vtk DataFile Version {version}\na\n{'BINARY' if binary else 'ASCII'}\nDATASET POLYDATA\n".encode()
    points = b"POINTS 5 float\n" + values(CORNERS.ravel().tolist(), ">f4")
    flat = [n for one in POLYGONS for n in (len(one), *one)]
    return head + before + points + between + f"POLYGONS 5 {len(flat)}\n".encode() + values(flat, ">i4")  # type: ignore[arg-type]


METADATA = b"METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1.5\n\n"
FIELDS = {
    "unsigned_char": (b"7 8 9", b"\x07\x08\x09"),
    "char": (b"-1 2 3", b"\xff\x02\x03"),
    "short": (b"1 2 3", b"\0\1\0\2\0\3"),
    "unsigned_long": (b"1 2 3", struct.pack(">3Q", 1, 2, 3)),
    "vtktypeint64": (b"1 2 3", struct.pack(">3q", 1, 2, 3)),
    "bit": (b"1 0 1", b"\xa0"),
    "string": (b"a b\n\nc", b"\xc3a b\xc0\xc1c"),
}


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("kind", FIELDS)
def test_foreign_arrays_of_a_vtk_are_passed_over(tmp_path: Path, kind: str, binary: bool) -> None:
    field = f"FIELD FieldData 2\nFlag 1 3 {kind}\n".encode() + FIELDS[kind][binary] + b"\n"
    field += METADATA + b"n 1 1 int\n" + (b"\0\0\0\1" if binary else b"1") + b"\n"
    check(read(tmp_path, "a.vtk", vtk(binary, field)))
    check(read(tmp_path, "a.vtk", vtk(binary, between=METADATA + field)))


@pytest.mark.parametrize("binary", [False, True])
def test_vertices_and_lines_of_a_vtk_are_passed_over(tmp_path: Path, binary: bool) -> None:
    cells = (
        b"VERTICES 2 5\n" + (struct.pack(">5i", 1, 0, 2, 1, 2) if binary else b"1 0\n2 1 2") + b"\n"
        b"LINES 1 3\n" + (struct.pack(">3i", 2, 0, 1) if binary else b"2 0 1") + b"\n"
    )
    check(read(tmp_path, "a.vtk", vtk(binary, between=cells)))
    offsets = (struct.pack(">2q", 0, 1), struct.pack(">q", 3)) if binary else (b"0 1", b"3")
    newer = b"VERTICES 2 1\nOFFSETS vtktypeint64\n%s\nMETADATA\na\n\nCONNECTIVITY vtktypeint64\n%s\n" % offsets
    check(read(tmp_path, "a.vtk", vtk(binary, between=newer, version="5.1")))


def test_keywords_of_a_vtk_in_small_letters(tmp_path: Path) -> None:
    text = vtk(False, between=METADATA + b"LINES 1 3\n2 0 1\n")
    head, line, rest = text.partition(b"\na\n")
    check(read(tmp_path, "a.vtk", head + line + rest.lower()))
    check(read(tmp_path, "a.vtk", BOM + head + line + rest.title().replace(b"\n", b"\r\n")))
    check(read(tmp_path, "a.vtk", text.replace(b"DATASET POLYDATA", b"DATASET  polydata")))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (vtk(False).replace(b"POLYGONS", b"TRIANGLE_STRIPS"), "strips, which are not read"),
        (vtk(False, b"NORMALS n float\n"), "a section 'normals', which is not known"),
        (vtk(False, b"FIELD f 1\na 1 1 variant\n0\n"), "type that is not read, 'variant'"),
        (vtk(False).replace(b"70.5", b"70,5"), "decimal commas"),
        (vtk(False)[:-1], "does not end in a line break"),
        (vtk(True)[:-9], "cut off"),
    ],
)
def test_a_vtk_that_is_not_read_says_why(tmp_path: Path, data: bytes, words: str) -> None:
    with pytest.raises(MeshError, match=words) as refused:
        read(tmp_path, "a.vtk", data)
    assert ("cut off" in str(refused.value)) == (words == "cut off")


def test_information_in_an_array_of_a_vtp_is_passed_over(tmp_path: Path) -> None:
    key = '<InformationKey name="L2_NORM_RANGE">\n<Value index="0">0</Value></InformationKey>'

    def array(name: str, kind: str, values: list[float]) -> str:
        body = " ".join(f"{x:g}" for x in values)
        return (
            f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="3" format="ascii">{{}}{body}{{}}</DataArray>'
        )

    parts = (
        array("Points", "Float32", CORNERS.ravel().tolist()),
        array("connectivity", "Int64", [n for one in POLYGONS for n in one]),
        array("offsets", "Int64", np.cumsum([len(one) for one in POLYGONS]).tolist()),
    )
    text = (
        '<VTKFile type="PolyData" version="1.0"><PolyData><Piece NumberOfPoints="5" NumberOfPolys="5"><Verts>'
        "</Verts><Points>{}</Points><Polys>{}{}</Polys></Piece></PolyData></VTKFile>"
    ).format(*parts)
    check(read(tmp_path, "a.vtp", text.format(*[key, ""] * 3).encode()))
    check(read(tmp_path, "a.vtp", text.format(*["", key] * 3).encode()))


# -- units


@pytest.mark.parametrize(("unit", "per_mm"), [("um", 1e3), ("µm", 1e3), ("μm", 1e3), ("m", 1e-3), ("mm", 1.0)])
def test_the_unit_comes_before_the_range(tmp_path: Path, unit: str, per_mm: float) -> None:
    """HAZ-14: a head of 80 mm is 80,000 µm, and farther than any head if that was read as mm."""
    corners = "".join("v " + " ".join(f"{x * per_mm * 10:.9g}" for x in row) + "\n" for row in CORNERS)
    file = tmp_path / "a.obj"
    file.write_text(f"# SPACE=LPS UNIT={unit}\n{corners}f 1 2 5\n", encoding="utf-8")
    mesh, report = read_mesh(file)
    assert np.abs(mesh.vertices - 10 * CORNERS).max() < 1e-3
    assert (report.unit, report.unit_named) == (unit[0].translate({0xB5: "u", 0x3BC: "u"}) + unit[1:], True)


def test_a_unit_that_is_not_known_is_not_taken_for_mm(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("# UNIT=inch\n" + OBJ)
    with pytest.raises(FrameError, match="unit 'inch' is not known"):
        read_mesh(tmp_path / "a.obj", assume=True)


# -- files of public reports


def test_files_of_reports_are_read_alike(trial_data: Path) -> None:
    folder = trial_data / "reports"
    read_ = {name: read_mesh(folder / name, assume=True)[0] for name in ("09_mixed_text.ply", "09_mixed_binary.ply")}
    assert np.array_equal(*(mesh.triangles for mesh in read_.values()))
    assert len(read_["09_mixed_text.ply"].faces) == 12
    for name in (
        "10_field_uchar.vtk",
        "10_vertices.vtk",
        "11_bom.stl",
        "11_upper.stl",
        "13_bom.obj",
        "13_continued.obj",
    ):
        mesh = read_mesh(folder / name, assume=True)[0]
        a, b, c = np.moveaxis(mesh.triangles, 1, 0)
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(874_000, rel=0.01), name
    with pytest.raises(MeshError, match="2 bytes too many"):
        read_mesh(folder / "12_two_bytes_more.stl", assume=True)
