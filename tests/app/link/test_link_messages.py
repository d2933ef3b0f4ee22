"""OpenIGTLink's messages: the bytes are those of another implementation, and what is damaged is refused."""

import struct

import numpy as np
import pytest
from fastcrc import crc64

from app.link.messages import (
    HEADER_BYTES,
    LinkFault,
    LinkMessage,
    ListPoint,
    PointList,
    Text,
    Transform,
    WrongChecksum,
    cut_name,
    pack,
    parse_header,
    unpack,
)

MATRIX = np.array([[0, -1, 0, 5.5], [0, 0, -1, -7.25], [1, 0, 0, 0.3125], [0, 0, 0, 1.0]])
# Packed by pyigtl 0.3.4 with the timestamp 1000.5 s.
TRANSFORM = bytes.fromhex(
    "00015452414e53464f524d000000526567697374726174696f6e0000000000000000000003e880000000000000000000003077f1373b0ee559b9"
    "00000000000000003f800000bf800000000000000000000000000000bf8000000000000040b00000c0e800003ea00000"
)
POINTS = bytes.fromhex(
    "0001504f494e54000000000000005061746800000000000000000000000000000000000003e8800000000000000000000110b76f9e636bf67198"
    + ("656e747279" + "00" * 59 + "00" * 32 + "ffff00ff" + "3fc00000c010000042f60000" + "00" * 24)
    + ("c39666666e756e67" + "00" * 56 + "00" * 32 + "ffff00ff" + "00000000000000003f000000" + "00" * 24)
)
STRING = bytes.fromhex(
    "0001535452494e470000000000005374617475730000000000000000000000000000000003e880000000000000000000000911bb731ffe031765"
    "0003000568656c6c6f"
)
# With the extended header of version 3, and two pairs of metadata.
EXTENDED = bytes.fromhex(
    "00025452414e53464f524d0000005374796c75730000000000000000000000000000000003e8800000000000000000000067b534febeaa4570d6"
    "000c001200000019000000000000000000000000"
    "3f800000bf800000000000000000000000000000bf8000000000000040b00000c0e800003ea00000"
    "000200150003000000020001000300000001"
    "5374796c75735472616e73666f726d5374617475734f4b6162"
)


def read(data: bytes) -> LinkMessage | None:
    return unpack(parse_header(data[:HEADER_BYTES]), data[HEADER_BYTES:])


def test_the_checksum_is_that_of_ecma_182() -> None:
    """By its published check value: the library's name of a polynomial is not enough to rely on."""
    header = struct.pack(">H12s20sQQQ", 1, b"STATUS", b"Tool", 0, 9, 0x6C40DF5F0B497347)
    assert unpack(parse_header(header), b"123456789") is None
    with pytest.raises(WrongChecksum):
        unpack(parse_header(header), b"123456788")


def test_a_transform_has_the_bytes_of_another_implementation() -> None:
    assert pack(Transform("Registration", MATRIX, 1000.5)) == TRANSFORM
    message = read(TRANSFORM)
    assert isinstance(message, Transform)
    assert (message.name, message.time_s) == ("Registration", 1000.5)
    np.testing.assert_array_equal(message.matrix, MATRIX)


def test_points_have_the_bytes_of_another_implementation() -> None:
    points = (ListPoint("entry", (1.5, -2.25, 123.0)), ListPoint("Öffnung", (0.0, 0.0, 0.5)))
    assert pack(PointList("Path", points, 1000.5)) == POINTS
    assert read(POINTS) == PointList("Path", points, 1000.5)


def test_a_text_is_read() -> None:
    assert read(STRING) == Text("Status", "hello", 1000.5)
    assert read(pack(Text("Status", "grün", 7.0))) == Text("Status", "grün", 7.0)


def test_the_extended_header_and_its_metadata_are_read() -> None:
    message = read(EXTENDED)
    assert isinstance(message, Transform)
    np.testing.assert_array_equal(message.matrix, MATRIX)
    assert message.metadata == {"StylusTransformStatus": "OK", "a": "b"}


def test_float32_is_all_that_is_lost() -> None:
    matrix = MATRIX.copy()
    matrix[:3, 3] = [123.456789012, -0.1, 999.999]
    message = read(pack(Transform("T", matrix)))
    assert isinstance(message, Transform)
    np.testing.assert_array_equal(message.matrix[:3], matrix[:3].astype(np.float32))


@pytest.mark.parametrize("at", [HEADER_BYTES, len(TRANSFORM) - 1, 57, 50])
def test_a_flipped_bit_is_noticed(at: int) -> None:
    damaged = bytearray(TRANSFORM)
    damaged[at] ^= 1
    with pytest.raises(LinkFault, match="damaged"):
        read(bytes(damaged))


def test_what_is_no_message_is_told() -> None:
    with pytest.raises(LinkFault, match="no OpenIGTLink"):
        parse_header(b"POST / HTTP/1.1".ljust(HEADER_BYTES))


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(number: float) -> None:
    with pytest.raises(LinkFault, match="finite"):
        read(pack(PointList("Path", (ListPoint("a", (0.0, number, 0.0)),))))
    matrix = MATRIX.copy()
    matrix[0, 3] = number
    with pytest.raises(LinkFault, match="finite"):
        read(pack(Transform("T", matrix)))


def with_body(data: bytes, body: bytes) -> bytes:
    return data[:42] + len(body).to_bytes(8, "big") + crc64.ecma_182(body).to_bytes(8, "big") + body


@pytest.mark.parametrize(
    ("data", "body"),
    [(TRANSFORM, b"\0" * 47), (POINTS, b"\0" * 137), (EXTENDED, b"\0" * 5), (EXTENDED, b"\xff" * 60)],
)
def test_bodies_of_wrong_lengths_are_refused(data: bytes, body: bytes) -> None:
    with pytest.raises(LinkFault):
        read(with_body(data, body))


def test_an_unknown_kind_is_passed_over() -> None:
    assert read(with_body(TRANSFORM.replace(b"TRANSFORM", b"SENSOR\0\0\0"), b"any")) is None


@pytest.mark.parametrize("name", ["", "a name of 21 letters.", "Öl"])
def test_a_name_that_does_not_fit_is_never_cut_in_silence(name: str) -> None:
    with pytest.raises(LinkFault, match="20 ASCII"):
        pack(Text(name, ""))


def test_labels_are_cut_between_characters() -> None:
    assert cut_name("ö" * 40) == "ö" * 31  # 63 bytes hold 31 of two
    assert cut_name("short") == "short"
