"""Surfaces through every file format, and the files that must not be read."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from vfix_engine.errors import FrameError, MeshError
from vfix_engine.files.mesh_files import read_mesh, write_ply
from vfix_engine.geometry.mesh import TriangleMesh


@pytest.fixture
def wedge() -> TriangleMesh:
    """A tetrahedron of no symmetry, with coordinates that float32 keeps."""
    vertices = np.array([[0, 0, 0], [40, 0, 0], [0, 25, 0], [10, 5, 60]], dtype=float)
    return TriangleMesh(
        vertices + np.array([-12.5, 7.25, 100.0]),
        np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], dtype=np.int32),
    )


def save(mesh: TriangleMesh, file: Path, factor: float = 1.0, signs: tuple[int, int, int] = (1, 1, 1)) -> Path:
    trimesh.Trimesh(mesh.vertices * factor * signs, mesh.faces, process=False).export(file)
    return file


@pytest.mark.parametrize("kind", ["ply", "stl", "obj"])
@pytest.mark.parametrize(("unit", "factor"), [("mm", 1.0), ("m", 1e-3)])
@pytest.mark.parametrize(("frame", "signs"), [("LPS", (1, 1, 1)), ("RAS", (-1, -1, 1))])
def test_formats_bring_the_same_surface(
    tmp_path: Path, wedge: TriangleMesh, kind: str, unit: str, factor: float, frame: str, signs: tuple[int, int, int]
) -> None:
    """HAZ-14: within 1e-3 mm, triangle by triangle, and turned the same way."""
    mesh, report = read_mesh(save(wedge, tmp_path / f"bone.{kind}", factor, signs), frame, unit)
    assert (report.name, report.assumed) == (frame, False)
    assert np.abs(mesh.triangles - wedge.triangles).max() < 1e-3
    assert np.allclose(mesh.face_normals, wedge.face_normals, atol=1e-4)


def test_text_stl_is_read(tmp_path: Path, wedge: TriangleMesh) -> None:
    file = tmp_path / "bone.stl"
    trimesh.Trimesh(wedge.vertices, wedge.faces, process=False).export(file, file_type="stl_ascii")
    assert np.allclose(read_mesh(file, "LPS", "mm")[0].triangles, wedge.triangles, atol=1e-4)
    file.write_text(file.read_text()[:-60])
    with pytest.raises(MeshError, match="cut off"):
        read_mesh(file, "LPS", "mm")


def test_frame_and_unit_are_asked_for(tmp_path: Path, wedge: TriangleMesh) -> None:
    """HAZ-14: what is missing is named; assumed only when the caller says so, and then reported."""
    file = save(wedge, tmp_path / "bone.stl")
    for given, missing in [((None, None), ("frame", "unit")), (("RAS", None), ("unit",)), ((None, "m"), ("frame",))]:
        with pytest.raises(FrameError) as refused:
            read_mesh(file, *given)
        assert refused.value.missing == missing
    mesh, report = read_mesh(file, assume=True)
    assert (report.name, report.assumed) == ("LPS", True)
    assert np.allclose(mesh.triangles, wedge.triangles)
    assert read_mesh(file, "RAS", assume=True)[1].assumed  # the unit still is


def test_ply_of_ours_names_its_frame_and_loses_nothing(tmp_path: Path, wedge: TriangleMesh) -> None:
    odd = TriangleMesh(wedge.vertices / 3.0, wedge.faces)
    write_ply(tmp_path / "bone.ply", odd)
    mesh, report = read_mesh(tmp_path / "bone.ply")
    assert np.array_equal(mesh.vertices, odd.vertices)
    assert np.array_equal(mesh.faces, odd.faces)
    assert (report.name, report.assumed) == ("LPS", False)
    with pytest.raises(FrameError, match="names the frame LPS"):
        read_mesh(tmp_path / "bone.ply", "RAS")


def test_frame_in_a_slicer_comment_is_used(tmp_path: Path, wedge: TriangleMesh) -> None:
    file = save(wedge, tmp_path / "bone.obj", signs=(-1, -1, 1))
    file.write_text("# File created by 3D Slicer. SPACE=RAS\n" + file.read_text())
    mesh, report = read_mesh(file, unit="mm")
    assert (report.name, report.assumed) == ("RAS", False)
    assert np.allclose(mesh.triangles, wedge.triangles, atol=1e-4)


@pytest.mark.parametrize(("first", "second"), [("SPACE=LPS", "SPACE=RAS"), ("UNIT=m", "UNIT=mm")])
@pytest.mark.parametrize("kind", ["ply", "obj"])
def test_comments_that_contradict_each_other_are_refused(tmp_path: Path, kind: str, first: str, second: str) -> None:
    """HAZ-14: wherever they stand; the same words twice are none."""
    data, mark = exported(kind, "ascii" if kind == "ply" else None), {"ply": "comment", "obj": "#"}[kind]
    top, rest = (data.split(b"\n", 2)[:2], data.split(b"\n", 2)[2]) if kind == "ply" else ([], data)
    for words, told in [((first, second), True), ((first, first), False)]:
        lines = [f"{mark} {word}".encode() for word in words]
        near = b"\n".join([*top, *lines, rest])
        far = b"\n".join([*top, lines[0], rest]) + lines[1] + b"\n"
        for content in (near, far)[: 1 if kind == "ply" else 2]:
            (tmp_path / f"ball.{kind}").write_bytes(content)
            if told:
                named = f"{second} after {first}"
                with pytest.raises(FrameError, match=named):
                    read_mesh(tmp_path / f"ball.{kind}", assume=True)
            else:
                assert len(read_mesh(tmp_path / f"ball.{kind}", assume=True)[0].faces) == 1280


def test_real_surface_keeps_its_triangles(trial_data: Path) -> None:
    mesh, _ = read_mesh(trial_data / "head_ct" / "nose_sinus_bone_lps_mm.ply", assume=True)
    assert len(mesh.faces) == 182_000
    assert len(mesh.vertices) == 91_420


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("count_too_big.stl", "claims 4,294,967,295 triangles and holds 4"),
        ("truncated.stl", "cut off"),
        ("nan_vertex.stl", "not finite"),
        ("zero_triangles.stl", "no triangles"),
        ("index_out_of_range.ply", "corner 7"),
    ],
)
def test_malformed_surfaces_are_refused(trial_data: Path, name: str, words: str) -> None:
    """HAZ-16, HAZ-09: a reader of meshes alone takes several of these in silence."""
    with pytest.raises(MeshError, match=words):
        read_mesh(trial_data / "formats" / "malformed" / name, assume=True)


def test_odd_but_valid_surfaces_are_read(trial_data: Path) -> None:
    folder = trial_data / "formats" / "malformed"
    assert len(read_mesh(folder / "quad_face.ply", assume=True)[0].faces) == 2
    assert len(read_mesh(folder / "solid_header_but_binary.stl", assume=True)[0].faces) == 4


def test_false_claims_of_a_ply_are_refused(tmp_path: Path, wedge: TriangleMesh) -> None:
    """HAZ-17: nothing is allocated on a count that the file cannot hold."""
    data = save(wedge, tmp_path / "bone.ply").read_bytes()
    for old, new in [(b"vertex 4", b"vertex 99999999"), (b"face 4", b"face 4000000000"), (b"vertex 4", b"vertex -4")]:
        (tmp_path / "false.ply").write_bytes(data.replace(old, new, 1))
        with pytest.raises(MeshError):
            read_mesh(tmp_path / "false.ply", assume=True)


def exported(kind: str, encoding: str | None = None) -> bytes:
    """A ball of 1,280 triangles as a file."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=50.0)
    data = ball.export(file_type=kind, **({"encoding": encoding} if encoding else {}))
    return data if isinstance(data, bytes) else data.rstrip().encode() + b"\n"


@pytest.mark.parametrize(("kind", "encoding"), [("ply", "ascii"), ("ply", "binary"), ("obj", None), ("stl", None)])
def test_a_file_that_was_cut_off_loses_no_bone_in_silence(tmp_path: Path, kind: str, encoding: str | None) -> None:
    """HAZ-16: wherever it was cut, and where something was added. An OBJ that ends with a line has no count to miss."""
    data, file = exported(kind, encoding), tmp_path / f"ball.{kind}"
    file.write_bytes(data)
    assert len(read_mesh(file, "LPS", "mm")[0].faces) == 1280
    cuts = [int(len(data) * 0.85), *range(len(data) - 12, len(data))]
    for cut in (cut for cut in cuts if kind != "obj" or data[cut - 1 : cut] != b"\n"):
        file.write_bytes(data[:cut])
        with pytest.raises(MeshError):
            read_mesh(file, "LPS", "mm")
    more = {"obj": b"f 1 2\n"}.get(kind, b"3 0 1 2\n")
    file.write_bytes(data + more)
    with pytest.raises(MeshError):
        read_mesh(file, "LPS", "mm")


def test_a_refused_surface_says_what_is_wrong(tmp_path: Path) -> None:
    """The counts, the line, the corner that is really named, and what to do."""
    ply, obj = exported("ply", "ascii"), exported("obj")
    faults = [
        ("ball.ply", b"\n".join(ply.splitlines()[:1500]) + b"\n", r"claims 1,922 rows of values, but 1,490 are there"),
        (
            "ball.ply",
            ply.replace(b"\n3 0 ", b"\n3 -1 ", 1),
            r"names corner -1, counted from 0, of a surface with 642 corners",
        ),
        ("ball.ply", ply.replace(b"\n3 0 ", b"\n3 ", 1), r"row \d+ of the PLY file has 3 values, not 4"),
        ("ball.ply", ply[:-1], "add a line break"),
        ("ball.obj", obj[:-1], "add a line break"),
        ("ball.obj", obj + b"v 1 2\n", r"line \d+ of the OBJ file is not a corner"),
        ("ball.obj", obj.replace(b"v -26.28", b"v -5e31 ", 1), "mm from the origin"),
    ]
    for name, data, words in faults:
        (tmp_path / name).write_bytes(data)
        with pytest.raises(MeshError, match=words):
            read_mesh(str(tmp_path / name), "LPS", "mm")


CORNERS = "v 0 0 0\nv 80 0 0 1 0 0\nv 0 80 0\nv 0 0 80\nv 80 80 80\n"


@pytest.mark.parametrize(
    ("text", "faces"),
    [
        ("g a\nusemtl a\nf 1 3 2\ng b\nusemtl b\nf 1 2 4\n", [[0, 2, 1], [0, 1, 3]]),
        ("vn 0 0 1\nvn 0 1 0\nf 1//1 3//2 2//1\nf 1//2 2//1 4//2\n", [[0, 2, 1], [0, 1, 3]]),
        ("vt 0 0\nvt 0 1\nvn 0 0 1\nf 1/1 3/2 2/1\nf 1/2/1 2/1/1 4/2/1\n", [[0, 2, 1], [0, 1, 3]]),
        ("f 1 2 3 4 5\n", [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
        ("f -5 -4 -3 # from the end\nl 1 2\n\nf 1 2 5\n", [[0, 1, 2], [0, 1, 4]]),
        ("o a\r\nf 1 2 3\r\n", [[0, 1, 2]]),
    ],
)
def test_what_an_obj_may_hold_besides_changes_no_triangle(tmp_path: Path, text: str, faces: list[list[int]]) -> None:
    """Materials, groups, normals and textures neither double a corner nor drop one."""
    file = tmp_path / "head.obj"
    file.write_text(CORNERS + text, newline="")
    mesh = read_mesh(file, "LPS", "mm")[0]
    assert mesh.vertices.tolist() == [[0, 0, 0], [80, 0, 0], [0, 80, 0], [0, 0, 80], [80, 80, 80]]
    assert mesh.faces.tolist() == faces


@pytest.mark.parametrize("line", ["f 1 2", "f 1 2 0", "f 1 2 x", "f -9 1 2", "f 1 2 99999999999999999999", "v 1 2 y"])
def test_line_of_an_obj_that_makes_no_sense_is_named(tmp_path: Path, line: str) -> None:
    """HAZ-16."""
    (tmp_path / "head.obj").write_text(CORNERS + "f 1 2 3\n" + line + "\n")
    with pytest.raises(MeshError, match="line 7 of the OBJ file is not a"):
        read_mesh(tmp_path / "head.obj", "LPS", "mm")


def test_materials_named_by_an_obj_are_not_opened(tmp_path: Path, wedge: TriangleMesh) -> None:
    file = save(wedge, tmp_path / "bone.obj")
    file.write_text("mtllib ../../secret.mtl\nusemtl a\n" + file.read_text())
    assert len(read_mesh(file, assume=True)[0].faces) == 4
