"""Images with header and voxels in two files, or in a zip: joined into one file for the readers.

NRRD (`.nhdr`), MetaImage (`.mhd`) and NIfTI pairs (`.hdr`, `.img`). The header is not validated here: the joined file
is read like any other.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path

from vfix_engine.errors import ImageError, SegmentationFound
from vfix_engine.files.dicom_files import contents, names
from vfix_engine.files.nrrd import INTO_A_CASE

HEADER_SUFFIXES = (".nhdr", ".mhd", ".hdr")
_WHOLE_SUFFIXES = (".nrrd", ".nii", ".nii.gz", ".mha")
_MAX_HEADER = 1 << 16  # [byte]
_NIFTI_HEADER = 348


def is_header(path: Path) -> bool:
    """Whether the file name is that of a header whose voxels are in another file."""
    return path.name.lower().endswith(HEADER_SUFFIXES)


def files_of(header: Path) -> tuple[Path, ...]:
    """Return the header, and the files beside it whose names begin with its name, which may contain its voxels."""
    stem = header.name.rpartition(".")[0]
    beside = (file for file in sorted(header.parent.glob(f"{_literal(stem)}.*")) if file.is_file())
    return (header, *(file for file in beside if file != header))


def joined(path: Path, files: tuple[Path, ...], into: Path) -> Path | None:
    """Create one image file in `into` from a folder, a zip or the given files; None if there is no image.

    files: a header and the files beside it; empty for a folder or zip. Raises ImageError.
    """
    known = [file.name for file in files] if files else names(path)
    images = [name for name in known if name.lower().endswith(_WHOLE_SUFFIXES)]
    headers = [name for name in known if name.lower().endswith(HEADER_SUFFIXES)]
    if not headers and len(images) > 1 and all(name.lower().endswith((".nii", ".nii.gz")) for name in known):
        raise SegmentationFound(
            f"there are {len(images)} images in it, masks of a segmentation perhaps. {INTO_A_CASE} Of CTs choose one."
        )
    if len(headers) + (len(images) if not headers else 0) > 1:
        raise ImageError(f"there are {len(headers) or len(images)} images in it; choose one of them, with its voxels.")
    if headers:
        held = {name: data for name, data in _held(path, files) if name in known}
        return _join(headers[0], held, into)
    if images:
        data = next(data for name, data in _held(path, files) if name == images[0])
        whole = into / f"image{next(s for s in reversed(_WHOLE_SUFFIXES) if images[0].lower().endswith(s))}"
        whole.write_bytes(data)
        return whole
    return None


def _held(path: Path, files: tuple[Path, ...]) -> Iterator[tuple[str, bytes]]:
    if files:
        yield from ((file.name, file.read_bytes()) for file in files)
    else:
        yield from ((place.name, data) for place, data in contents(path))


def _join(name: str, held: dict[str, bytes], into: Path) -> Path:
    header, others = held[name], {other: data for other, data in held.items() if other != name}
    suffix = name.lower().rpartition(".")[2]
    if suffix == "hdr":
        return _joined_nifti(header, name, others, into / "image.nii")
    if suffix == "mhd":
        return _joined_text(header, others, into / "image.mha", b"ElementDataFile", b"=")
    return _joined_text(header, others, into / "image.nrrd", b"data file", b":")


def _joined_text(header: bytes, others: dict[str, bytes], whole: Path, field: bytes, sign: bytes) -> Path:
    """Join the header lines, without the field that names the voxels' file, with those voxels."""
    lines = header[:_MAX_HEADER].splitlines(keepends=True)
    kept, voxels = [], None
    for line in lines:
        key, found, value = line.partition(sign)
        if found and key.strip().lower().replace(b"datafile", b"data file") == field.lower().replace(
            b"datafile", b"data file"
        ):
            voxels = _named(value.strip().decode("utf-8", "replace"), others)
            continue
        if key.strip() == b"HeaderSize" and value.strip() != b"0":
            raise ImageError("the MetaImage header skips a part of its voxels' file (HeaderSize), which is not read.")
        if line.strip():
            kept.append(line.rstrip(b"\r\n") + b"\n")
    if voxels is None:
        raise ImageError("the header does not name the file of its voxels; it is cut off, or not a header alone.")
    end = b"ElementDataFile = LOCAL\n" if sign == b"=" else b"\n"
    with whole.open("wb") as file:
        file.write(b"".join(kept) + end)
        file.write(voxels)
    return whole


def _joined_nifti(header: bytes, name: str, others: dict[str, bytes], whole: Path) -> Path:
    """Join a NIfTI-1 pair; a plain Analyze header does not distinguish left and right, and is refused."""
    if len(header) < _NIFTI_HEADER or header[344:348] != b"ni1\0":
        raise ImageError(
            "the header (.hdr) is not one of a NIfTI pair. Analyze files do not say which side is left; save the "
            "volume as NIfTI, NRRD or MetaImage."
        )
    order = "<" if struct.unpack_from("<i", header)[0] == _NIFTI_HEADER else ">"
    voxels = _named(name[: -len("hdr")] + "img", others)
    (offset,) = struct.unpack_from(order + "f", header, 108)
    if not 0 <= offset <= len(voxels):
        raise ImageError("the NIfTI header does not say rightly where its voxels begin.")
    one = bytearray(header[:_NIFTI_HEADER])
    one[344:348] = b"n+1\0"
    struct.pack_into(order + "f", one, 108, 352.0)
    with whole.open("wb") as file:
        file.write(bytes(one) + bytes(4))
        file.write(memoryview(voxels)[int(offset) :])
    return whole


def _named(wanted: str, others: dict[str, bytes]) -> bytes:
    """Return the file of that name; an upload may have changed characters in it."""
    plain = _plain(wanted)
    for name, data in others.items():
        if _plain(name) == plain:
            return data
    raise ImageError("the voxels lie in a second file, which the header names; choose both files together, or a zip.")


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9.]+", "_", name.replace("\\", "/").rpartition("/")[2].lower()).lstrip("_.")


def _literal(text: str) -> str:
    """Convert a file name to a pattern that matches only it."""
    return re.sub(r"([*?\[])", r"[\1]", text)
