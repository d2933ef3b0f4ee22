"""The mailboxes: newest wins, nothing torn."""

import struct
import threading
import time
import zlib

import pytest

from vfix_engine.errors import ControlError
from vfix_engine.runtime.mailbox import Mailbox


def test_newest_wins_and_nothing_is_read_twice() -> None:
    box = Mailbox.create(100)
    reader = Mailbox.attach(box.name)
    try:
        assert reader.read() is None
        box.write(b"one")
        box.write(b"two")
        news = reader.read()
        assert news is not None
        assert news[1] == b"two"
        assert reader.read(news[0]) is None
        with pytest.raises(ControlError, match="does not fit"):
            box.write(bytes(101))
    finally:
        reader.close()
        box.close()


def test_a_header_that_is_only_half_written_is_no_empty_message() -> None:
    """Packing clears the whole header before it writes the sequence: for a moment length and checksum are 0."""
    box = Mailbox.create(100)
    reader = Mailbox.attach(box.name)
    try:
        box.write(b"one")
        struct.pack_into("<QQQ", box._memory.buf, 0, 4, 0, 0)
        assert reader.read() is None
        box.write(b"two")
        news = reader.read()
        assert news is not None
        assert news[1] == b"two"
        box.write(b"")
        news = reader.read()
        assert news is not None
        assert news[1] == b""
    finally:
        reader.close()
        box.close()


def test_no_torn_message_under_load() -> None:
    box = Mailbox.create(5000)
    reader = Mailbox.attach(box.name)
    stop = threading.Event()

    def write() -> None:
        i = 0
        while not stop.is_set():
            i += 1
            body = str(i).encode() * 200
            time.sleep(0)  # let the reader in
            box.write(zlib.crc32(body).to_bytes(4, "little") + body)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        seen = whole = 0
        while whole < 500:
            news = reader.read(seen)
            if news is None:
                continue
            seen, message = news
            assert zlib.crc32(message[4:]) == int.from_bytes(message[:4], "little")
            whole += 1
    finally:
        stop.set()
        writer.join()
        reader.close()
        box.close()
