"""Decoding of texts whose character set is declared wrongly or not at all, without dropping or replacing characters."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

_BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_WESTERN = ("cp1252", "latin-1")  # the superset of Windows has no character for five bytes
_ESCAPE = b"\x1b"  # of ISO 2022, whose 7-bit text is also valid UTF-8


def text_of_bytes(data: bytes, declared: Sequence[str] = ()) -> str:
    """Decode UTF-8, else a character set that the file declares (Python's name), else Latin-1."""
    marked = _BYTE_ORDER_MARKS.get(data[:2])
    for name in (*([marked] if marked else []), "utf-8-sig", *declared, *_WESTERN):
        try:
            return data.decode(name)
        except (UnicodeDecodeError, LookupError):
            continue
    raise AssertionError("Latin-1 has a character for every byte")


def text_of_element(dataset: Any, keyword: str) -> str:
    """Text of a DICOM element, '' if missing; its dataset declares the character set (PS3.3 C.12.1.1.2)."""
    from pydicom.charset import convert_encodings
    from pydicom.datadict import tag_for_keyword

    raw = dataset.get_item(tag_for_keyword(keyword)) if keyword in dataset else None
    data = getattr(raw, "value", None)
    if not isinstance(data, bytes) or _ESCAPE in data:
        return str(dataset.get(keyword) or "").strip()
    encodings = [str(one) for one in convert_encodings(dataset.original_character_set or "ISO_IR 6")]
    return text_of_bytes(data, encodings).strip(" \0")


def text_of_path(name: str) -> str:
    """A file name as it is displayed: bytes that are not UTF-8 are lone surrogates in Python's file names."""
    return text_of_bytes(os.fsencode(name)) if any("\udc80" <= c <= "\udcff" for c in name) else name


def text_of_member(name: str, flags: int, made_on: int) -> str:
    """Name of a zip member. flags, made_on: of its entry; without the UTF-8 flag zipfile decodes it as cp437.

    Programs of Unix and macOS (made_on 3 and 19) store names in the system's encoding, those of Windows in cp437.
    """
    if flags & 0x800:
        return name
    try:
        data = name.encode("cp437")
    except UnicodeEncodeError:
        return name
    return text_of_bytes(data, () if made_on in (3, 19) else ("cp437",))
