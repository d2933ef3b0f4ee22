"""The server of OpenIGTLink: several clients, limits, and clients that misbehave."""

import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from app.link import server as module
from app.link.messages import HEADER_BYTES, Header, LinkMessage, ListPoint, PointList, Text, pack, parse_header, unpack
from app.link.server import LinkServer
from vfix_engine.errors import InputError, PlanError

GREETING = Text("Plan", "left nostril")


class Heard:
    """A listener that answers, or refuses what is called 'No'."""

    def __init__(self) -> None:
        self.messages: list[LinkMessage] = []

    def __call__(self, message: LinkMessage) -> str:
        self.messages.append(message)
        if message.name == "No":
            raise PlanError("the plan is locked.")
        return f"heard {message.name}"


@pytest.fixture(autouse=True)
def every_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests of the gateway in the same process hold the log to a few lines a minute."""
    monkeypatch.setattr(logging.getLogger(module.__name__), "filters", [])


@pytest.fixture
def heard() -> Heard:
    return Heard()


@pytest.fixture
def server(heard: Heard) -> Iterator[LinkServer]:
    made = LinkServer("127.0.0.1", 0, heard, lambda: [GREETING])
    made.port = made.start()  # type: ignore[attr-defined]
    yield made
    made.close()


def connect(server: LinkServer) -> socket.socket:
    opened = socket.create_connection(("127.0.0.1", server.port), timeout=5.0)  # type: ignore[attr-defined]
    assert receive(opened) == GREETING
    return opened


def exactly(opened: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count:
        piece = opened.recv(count - len(data))
        if not piece:
            raise EOFError
        data += piece
    return data


def receive(opened: socket.socket) -> LinkMessage | None:
    header = parse_header(exactly(opened, HEADER_BYTES))
    message = unpack(header, exactly(opened, header.size))
    return Text(message.name, message.text) if isinstance(message, Text) else message


def wait_for(condition: Callable[[], bool], seconds: float = 5.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.01)


def is_ended(opened: socket.socket) -> bool:
    try:
        return opened.recv(1) == b""
    except ConnectionError:
        return True


def test_every_client_is_told(server: LinkServer) -> None:
    with connect(server) as one, connect(server) as other:
        server.tell([Text("A", "1"), Text("B", "2")])
        assert [receive(one), receive(one)] == [Text("A", "1"), Text("B", "2")]
        assert [receive(other), receive(other)] == [Text("A", "1"), Text("B", "2")]
    wait_for(lambda: server.clients == 0)


def test_a_message_is_answered_and_a_refusal_told_in_words(server: LinkServer, heard: Heard) -> None:
    with connect(server) as opened:
        opened.sendall(pack(PointList("Targets", ())))
        assert receive(opened) == Text("Status", "heard Targets")
        opened.sendall(pack(PointList("No", ())))
        assert receive(opened) == Text("Status", "the plan is locked.")
    assert [message.name for message in heard.messages] == ["Targets", "No"]


def test_a_large_message_does_not_hold_up_the_other_clients(
    server: LinkServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its checksum is compared on another thread; meanwhile the others are served."""
    begun, go_on = threading.Event(), threading.Event()

    def slow(header: Header, body: bytes) -> LinkMessage | None:
        begun.set()
        assert go_on.wait(5.0)
        return unpack(header, body)

    monkeypatch.setattr(module, "unpack", slow)
    with connect(server) as large, connect(server) as other:
        large.sendall(pack(PointList("Path", (ListPoint("P", (0.0, 0.0, 0.0)),) * 1900)))
        assert begun.wait(5.0)
        server.tell([Text("A", "1")])
        assert receive(other) == Text("A", "1")
        go_on.set()
        assert [receive(large), receive(large)] == [Text("A", "1"), Text("Status", "heard Path")]


def test_a_message_in_pieces_is_put_together(server: LinkServer) -> None:
    data = pack(PointList("Path", ()))
    with connect(server) as opened:
        for byte in data[:20]:
            opened.sendall(bytes([byte]))
        opened.sendall(data[20:])
        assert receive(opened) == Text("Status", "heard Path")


def test_a_damaged_message_is_told_and_the_next_one_read(server: LinkServer, heard: Heard) -> None:
    good = pack(Text("Text", "hello"))
    with connect(server) as opened:
        opened.sendall(good[:-1] + b"X")
        answer = receive(opened)
        assert isinstance(answer, Text)
        assert "damaged" in answer.text
        assert not heard.messages
        opened.sendall(good)
        assert receive(opened) == Text("Status", "heard Text")


def test_a_body_that_is_too_large_is_not_read(server: LinkServer, heard: Heard) -> None:
    header = bytearray(pack(Text("T", "")))[:HEADER_BYTES]
    header[42:50] = (module.MAX_BODY_BYTES + 1).to_bytes(8, "big")
    with connect(server) as opened:
        opened.sendall(bytes(header))
        assert is_ended(opened)
    assert not heard.messages


def test_what_speaks_another_protocol_is_let_go(server: LinkServer, heard: Heard) -> None:
    with connect(server) as opened:
        opened.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUser-Agent: a browser that strays\r\n\r\n")
        assert is_ended(opened)
    assert not heard.messages


@pytest.mark.parametrize("cut", [1, HEADER_BYTES - 1, HEADER_BYTES, -1])
def test_a_message_that_does_not_arrive_is_not_waited_for(
    server: LinkServer, cut: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "ARRIVAL_S", 0.1)
    with connect(server) as opened:
        opened.sendall(pack(Text("T", "hello"))[:cut])
        assert is_ended(opened)
    wait_for(lambda: server.clients == 0)
    assert [record.getMessage() for record in caplog.records] == [
        "OpenIGTLink: a client was dropped: a message did not arrive within 0.1 s."
    ]


def test_one_that_only_listens_is_not_let_go(server: LinkServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """As 3D Slicer does; another one runs into the deadline beside it."""
    monkeypatch.setattr(module, "ARRIVAL_S", 0.1)
    with connect(server) as silent, connect(server) as half:
        half.sendall(b"\0")
        assert is_ended(half)
        server.tell([Text("A", "1")])
        assert receive(silent) == Text("A", "1")


def test_nobody_holds_every_place(server: LinkServer, caplog: pytest.LogCaptureFixture) -> None:
    """The one whose last message is longest ago gives way, whether or not others have sent anything."""
    first, *others = [connect(server) for _ in range(module.MAX_CLIENTS)]
    first.sendall(pack(Text("T", "")))
    assert receive(first) == Text("Status", "heard T")
    others[1].sendall(b"\0")  # a part of a message does not count
    one_more = connect(server)
    assert is_ended(others[0])
    still_more = connect(server)
    assert is_ended(others[1])
    wait_for(lambda: server.clients == module.MAX_CLIENTS)
    server.tell([Text("A", "1")])
    for opened in (first, *others[2:], one_more, still_more):
        assert receive(opened) == Text("A", "1")
    for opened in (first, *others, one_more, still_more):
        opened.close()
    assert "silent longest gave way" in caplog.text


def test_a_client_that_takes_nothing_is_dropped_and_the_others_go_on(
    server: LinkServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "SLOW_S", 0.2)
    slow = connect(server)
    with connect(server) as quick:
        for number in range(400):
            server.tell([Text("Large", f"{number} " + "x" * 60_000)])
            got = receive(quick)  # each of them, or a newer one
            assert isinstance(got, Text)
        wait_for(lambda: server.clients == 1)
    slow.close()
    wait_for(lambda: "a client was dropped: it took nothing for 0.2 s." in caplog.text)


def test_only_the_newest_of_a_name_waits(server: LinkServer) -> None:
    with connect(server) as opened:
        for number in range(5000):
            server.tell([Text("Tool", str(number))])
        seen = []
        while not seen or seen[-1] != 4999:
            message = receive(opened)
            assert isinstance(message, Text)
            seen.append(int(message.text))
        assert seen == sorted(seen)


def test_a_port_that_is_taken_is_told(server: LinkServer) -> None:
    second = LinkServer("127.0.0.1", server.port, lambda _: "", list)  # type: ignore[attr-defined]
    with pytest.raises(InputError, match="cannot listen"):
        second.start()


def test_the_end_lets_go_of_clients_and_of_the_port(heard: Heard) -> None:
    server = LinkServer("127.0.0.1", 0, heard, list)
    port = server.start()
    with socket.create_connection(("127.0.0.1", port), timeout=5.0) as opened:
        wait_for(lambda: server.clients == 1)
        server.close()
        assert is_ended(opened)
    server.tell([Text("T", "nobody")])
    assert "openigtlink" not in [thread.name for thread in threading.enumerate()]
    again = LinkServer("127.0.0.1", port, heard, list)
    assert again.start() == port
    again.close()
