"""The scene's inner server behind its lock, and the relay in front of it (HAZ-27, HAZ-28, HAZ-29, HAZ-31)."""

import contextlib
import dataclasses
import logging
import os
import queue
import secrets
import socket
import sys
import time
from pathlib import Path

import msgspec
import pytest
import viser
import viser._messages
import viser._viser
from knocking import Planner, eventually, knock, upgrade
from starlette.websockets import WebSocket
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from app.gateway import relay
from app.gateway.scene_messages import ALLOWED_MESSAGES, is_allowed
from app.gateway.scene_page import scene_page
from app.gateway.scene_server import MAX_TABS, SUBPROTOCOL, SceneServer

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 1.0),
    "fov": 1.0,
    "near": 0.1,
    "far": 1000.0,
    "image_height": 100,
    "image_width": 100,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 1.0, 0.0),
}


def scene(planner: Planner, tab: str, **options: object) -> ClientConnection:
    """A browser's connection to its scene."""
    return connect(
        f"ws://{planner.host}/scene/ws?tab={tab}",
        additional_headers=[planner.cookie],
        origin=planner.origin,
        subprotocols=[Subprotocol("viser-v1.1.1")],
        compression=None,
        max_size=None,
        proxy=None,
        **options,
    )


def say(connection: ClientConnection, **message: object) -> None:
    connection.send(msgspec.msgpack.encode(message))


def close_code(connection: ClientConnection) -> int | None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            connection.recv(timeout=60)
    return connection.close_code


def inner(planner: Planner, *headers: tuple[str, str], host: str | None = None, websocket: bool) -> int:
    port = planner.scene_server.port
    named = ("Host", f"127.0.0.1:{port}" if host is None else host)
    return knock(port, "GET", "/", [named, *(upgrade() if websocket else []), *headers]).status


@pytest.mark.parametrize("websocket", [False, True])
def test_the_inner_port_admits_the_relay_only(planner: Planner, websocket: bool) -> None:
    port, secret = planner.scene_server.port, planner.scene_server._secret
    key = ("X-Vfix-Relay", secret)
    assert inner(planner, key, websocket=websocket) == (101 if websocket else 200)
    assert inner(planner, websocket=websocket) == 401
    for wrong in ("", secret[:-1], secret + "x", planner.settings.token, "\xff"):
        assert inner(planner, ("X-Vfix-Relay", wrong), websocket=websocket) == 401
    assert inner(planner, key, key, websocket=websocket) == 401
    assert inner(planner, planner.bearer, planner.cookie, websocket=websocket) == 401
    for host in (f"localhost:{port}", "127.0.0.1", f"127.0.0.1:{planner.port}", f"evil.example:{port}"):
        assert inner(planner, key, host=host, websocket=websocket) == 403
    for origin in ("null", "http://evil.example", planner.origin, f"http://127.0.0.1:{port}"):
        assert inner(planner, key, ("Origin", origin), websocket=websocket) == 403


def test_the_inner_port_listens_on_loopback(planner: Planner) -> None:
    assert planner.scene_server.viser.get_host() == "127.0.0.1"
    with pytest.raises(OSError, match=r"."):
        socket.create_connection((_outer_address(), planner.scene_server.port), timeout=1).close()


def test_a_tab_is_paired_with_its_client_and_let_go(planner: Planner) -> None:
    connected: queue.Queue[tuple[str, viser.ClientHandle]] = queue.Queue()
    gone: queue.Queue[str] = queue.Queue()
    planner.scene_server.on_tab_connected(lambda tab, client: connected.put((tab, client)))
    planner.scene_server.on_tab_gone(gone.put)
    tabs = [f"paired-tab-{number}" for number in range(4)]
    with contextlib.ExitStack() as open_connections:
        connections = [open_connections.enter_context(scene(planner, tab)) for tab in tabs]
        for connection in reversed(connections):  # the order of arrival must not matter
            say(connection, **CAMERA)
        arrived = dict(connected.get(timeout=60) for _ in tabs)
        assert set(arrived) == set(tabs)
        for tab, connection in zip(tabs, connections, strict=True):
            assert planner.scene_server.client_for(tab) is arrived[tab]
            arrived[tab].gui.set_panel_label(f"for {tab}")
            assert any(f"for {tab}".encode() in _payload(connection.recv(timeout=60)) for _ in range(20))
    assert {gone.get(timeout=60) for _ in tabs} == set(tabs)
    assert all(planner.scene_server.client_for(tab) is None for tab in tabs)


def test_a_tab_has_one_holder(planner: Planner) -> None:
    with scene(planner, "one-holder"):
        with pytest.raises(InvalidStatus) as refused:
            scene(planner, "one-holder").close()
        assert refused.value.response.status_code == 409
    eventually(lambda: not planner.scene_server._held)
    scene(planner, "one-holder").close()
    eventually(lambda: not planner.scene_server._held)


@pytest.mark.parametrize("tab", ["", "short", "x" * 65, "has%20space", "a/b/c/d/e", "%22%3E%3Cscript%3E"])
def test_a_tab_is_a_plain_word(planner: Planner, tab: str) -> None:
    with pytest.raises(InvalidStatus) as refused:
        scene(planner, tab).close()
    assert refused.value.response.status_code == 400


def test_the_number_of_scenes_is_bounded(planner: Planner) -> None:
    with contextlib.ExitStack() as open_connections:
        for number in range(MAX_TABS):
            open_connections.enter_context(scene(planner, f"many-tabs-{number}"))
        with pytest.raises(InvalidStatus) as refused:
            scene(planner, "one-too-many").close()
        assert refused.value.response.status_code == 503
        assert refused.value.response.headers["Retry-After"] == "15"
    eventually(lambda: not planner.scene_server._held)


def test_a_client_of_another_version_is_told(planner: Planner) -> None:
    headers = [(name, value) for name, value in upgrade() if name != "Sec-WebSocket-Protocol"]
    credentials = [("Host", planner.host), planner.cookie, ("Origin", planner.origin)]
    answer = knock(planner.port, "GET", "/scene/ws?tab=other-version", [*credentials, *headers])
    assert answer.status == 400
    assert b"viser-v1.1.1" in answer.body


@pytest.fixture
def tunnels(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Every attempt to open viser's public tunnel."""
    opened: list[object] = []

    class Tunnel:
        def __init__(self, *arguments: object) -> None:
            opened.append(arguments)
            raise AssertionError("a tunnel was opened")

    monkeypatch.setattr(viser._viser, "ViserTunnel", Tunnel)
    return opened


def test_sharing_is_refused_to_code(planner: Planner, tunnels: list[object]) -> None:
    assert planner.scene_server.viser.request_share_url() is None
    planner.scene_server.viser.disconnect_share_url()
    assert not tunnels


def test_sharing_is_refused_to_a_raw_client_behind_the_lock(
    planner: Planner, tunnels: list[object], caplog: pytest.LogCaptureFixture
) -> None:
    headers = {"X-Vfix-Relay": planner.scene_server._secret, "X-Vfix-Tab": "raw-share-client"}
    url = f"ws://127.0.0.1:{planner.scene_server.port}/"
    with connect(url, additional_headers=headers, subprotocols=[SUBPROTOCOL], compression=None, proxy=None) as raw:
        say(raw, type="ShareUrlRequest")
        eventually(lambda: "share the scene publicly was refused" in caplog.text)
        say(raw, type="ShareUrlDisconnect")
    assert not tunnels


@pytest.mark.parametrize(
    "message",
    [
        {"type": "ShareUrlRequest"},
        {"type": "ShareUrlDisconnect"},
        {"type": "FileTransferStartUpload", "source_component_uuid": "x", "size_bytes": 10**12},
        {"type": "LocalStorageGetItemResponseMessage"},
        {"type": "SceneNodeClickMessage", "name": "/x"},
        {"type": "GuiUpdateMessage", "uuid": "no-such-element", "updates": {"value": 1e9}},
        {"type": "GuiButtonHoldMessage", "uuid": "x", "frequency": 1e9},
        {"type": "CommandTriggerMessage", "uuid": "x"},
        {"type": "TransformControlsUpdateMessage", "name": "/x", "wxyz": (1, 0, 0, 0), "position": (0, 0, 0)},
        {"type": "TransformControlsDragStartMessage", "name": "/x"},
        {"type": "TransformControlsDragEndMessage", "name": "/x"},
        {"type": "GetRenderResponseMessage", "payload": bytes(100_000)},
        {"type": "NoSuchMessage"},
        {"kind": "without a type"},
    ],
)
def test_the_relay_lets_through_what_a_picture_has_to_say(
    planner: Planner, tunnels: list[object], message: dict[str, object]
) -> None:
    with scene(planner, "talkative-tab") as connection:
        say(connection, **message)
        assert close_code(connection) == 1008
    assert not tunnels
    eventually(lambda: not planner.scene_server._held)


@pytest.mark.parametrize(
    "data",
    [
        b"", b"\xc1", b"\x81\xa4type", b"\x92\x01\x02", b"\x81\xa4type\xa1\xff", "text",
        b"\x82\xa1x" + b"\x91" * 5000 + b"\xc0\xa4type\xb3ViewerCameraMessage", b"\x91" * 100_000,
    ],
    ids=["nothing", "no code", "cut off", "a list", "no UTF-8", "text", "nested", "nested for ever"],
)  # fmt: skip
def test_the_relay_refuses_noise(planner: Planner, data: bytes | str, caplog: pytest.LogCaptureFixture) -> None:
    with scene(planner, "noisy-tab-1") as connection:
        connection.send(data)
        assert close_code(connection) == 1008
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
    eventually(lambda: not planner.scene_server._held)


def test_the_allowed_messages_are_those_of_the_pinned_viser() -> None:
    for message in ALLOWED_MESSAGES:
        theirs = [field.name for field in dataclasses.fields(getattr(viser._messages, message.__name__))]
        assert [field.name for field in msgspec.structs.fields(message)] == theirs


def test_what_a_browser_sends_is_allowed() -> None:
    """Numbers of JavaScript that are whole come as integers."""
    click = {"event_type": "click", "ray_origin": (0, 1.5, 2), "ray_direction": (0, 0, -1), "screen_pos": [(0.5, 1)]}
    drag = {
        "phase": "end", "name": "/hand/grip", "instance_index": None, "start_position": (0, 1, 2.5),
        "start_screen_pos": (0, 1), "end_position": (3, 4, 5), "end_screen_pos": (0.5, 0.5), "button": "left",
    }  # fmt: skip
    for message in (
        {**CAMERA, "wxyz": (1, 0, 0, 0), "fov": 1},
        {"type": "ScenePointerMessage", **click, "modifier": None},
        {"type": "ScenePointerMessage", **click, "modifier": "cmd/ctrl+shift"},
        {"type": "SceneNodeDragMessage", **drag, "modifier": "shift", "owner": "x"},
    ):
        assert is_allowed(msgspec.msgpack.encode(message)), message
    for wrong in ({**CAMERA, "wxyz": (1, 0)}, {**CAMERA, "more": 1}, {**CAMERA, "fov": "wide"}):
        assert not is_allowed(msgspec.msgpack.encode(wrong)), wrong


def test_a_flood_of_messages_is_read_at_the_relay_s_pace(planner: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    """A browser that sends far more than its share is read at the relay's pace, and ended when it goes on."""
    monkeypatch.setattr(relay, "FLOOD_S", 0.5)
    monkeypatch.setattr(relay, "MAX_PER_SECOND", 10)  # so little that a busy machine sends more, too
    monkeypatch.setattr(relay, "BURST", 10)
    arrived: list[float] = []
    codes: list[int] = []
    closes = WebSocket.close

    async def close(websocket: WebSocket, code: int = 1000, reason: str | None = None) -> None:
        codes.append(code)
        await closes(websocket, code, reason)

    monkeypatch.setattr(WebSocket, "close", close)
    with scene(planner, "flooding-tab", close_timeout=30, ping_interval=None) as connection:
        say(connection, **CAMERA)
        eventually(lambda: planner.scene_server.client_for("flooding-tab"))
        client = planner.scene_server.client_for("flooding-tab")
        assert client is not None
        client.camera.on_update(lambda camera: arrived.append(camera.fov))
        start = time.monotonic()
        with contextlib.suppress(ConnectionClosed):  # a busy machine may be slow to send: it goes on until it is ended
            for number in range(50_000):
                say(connection, **{**CAMERA, "fov": 0.5 + number / 1_000_000})
                time.sleep(0.0005)  # the planner runs in the same process and needs the interpreter, too
        told = close_code(connection)  # a client that is still sending may see the end of the line before the reason
        assert (codes, told in (4429, 1006)) == ([4429], True), f"{codes}, {told}"
        eventually(lambda: arrived)
        count, elapsed = len(arrived), time.monotonic() - start
    assert 0 < count <= relay.BURST + relay.MAX_PER_SECOND * elapsed + 2
    eventually(lambda: not planner.scene_server._held)


def test_a_pace_lets_a_burst_through_and_no_more_than_its_rate_afterwards() -> None:
    pace = relay.Pace(rate=100, burst=10)
    assert [pace.wait_s(50.0) for _ in range(10)] == [0.0] * 10
    now = 50.0
    for _ in range(200):
        now += pace.wait_s(now)
    assert now == pytest.approx(52.0)
    assert pace.wait_s(now + 1.0) == 0.0


def test_a_browser_that_vanishes_is_let_go(planner: Planner) -> None:
    connection = scene(planner, "vanishing-tab")
    say(connection, **CAMERA)
    eventually(lambda: planner.scene_server.client_for("vanishing-tab"))
    connection.socket.shutdown(socket.SHUT_RDWR)
    eventually(lambda: planner.scene_server.client_for("vanishing-tab") is None)
    eventually(lambda: not planner.scene_server._held)


def test_a_scene_that_ends_ends_the_browser_s_connection() -> None:
    scene_server = SceneServer()
    try:
        headers = {"X-Vfix-Relay": scene_server._secret, "X-Vfix-Tab": "ending-tab"}
        url = f"ws://127.0.0.1:{scene_server.port}/"
        raw = connect(url, additional_headers=headers, subprotocols=[SUBPROTOCOL], compression=None, proxy=None)
    finally:
        scene_server.stop()
    assert close_code(raw) in (1000, 1001, 1006)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", scene_server.port), timeout=2).close()


def test_slow_browsers_hold_back_their_own_picture_only(planner: Planner) -> None:
    """HAZ-31: of eight tabs three read nothing; the others get every frame, and nothing piles up for those three."""
    frames, size = 100, 300_000
    planner.scene_server.viser.scene.add_frame("/slow-test")
    with contextlib.ExitStack() as tabs:
        for number in range(3):
            say(tabs.enter_context(scene(planner, f"slow-tab-{number}", max_queue=1, close_timeout=0.5)), **CAMERA)
        quick = [tabs.enter_context(scene(planner, f"quick-tab-{number}")) for number in range(5)]
        for connection in quick:
            say(connection, **CAMERA)
        eventually(lambda: all(planner.scene_server.client_for(f"quick-tab-{number}") for number in range(5)))
        node = planner.scene_server.viser.scene.add_label("/slow-test/label", "")
        buffered = planner.scene_server.viser._websock_server._broadcast_buffer.message_from_id
        kept, memory = len(buffered), _resident_bytes()
        for number in range(frames):
            node.text = f"{number:03d} {secrets.token_hex(size // 2)}"
            planner.scene_server.viser.flush()
            for connection in quick:
                deadline = time.monotonic() + 60
                while f"{number:03d} ".encode() not in _payload(connection.recv(timeout=60)):
                    assert time.monotonic() < deadline
        assert len(buffered) <= kept + 1
        assert _resident_bytes() - memory < frames * size  # of the three together, which is a third of what they missed
    eventually(lambda: not planner.scene_server._held)


def _resident_bytes() -> int:
    """Memory of this process, in which planner and browsers are."""
    if sys.platform != "linux":
        return 0
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_the_scene_s_page_talks_to_the_relay(planner: Planner) -> None:
    page = planner.http("GET", "/scene/", planner.bearer).body.decode()
    assert page == scene_page()
    assert page.index("/scene/ws?tab=") < page.index("<script data-p")
    assert (
        "connect-src 'self' data: blob: ws://"
        in (planner.http("GET", "/scene/", planner.bearer).headers["Content-Security-Policy"])
    )


def _payload(frame: bytes | str) -> bytes:
    """The unpacked message part of one of viser's frames."""
    import zstandard

    assert isinstance(frame, bytes)
    size, packed = int.from_bytes(frame[:8], "little"), int.from_bytes(frame[8:16], "little")
    return zstandard.ZstdDecompressor().decompress(frame[16 : 16 + packed], max_output_size=size)


def _outer_address() -> str:
    """An address of this machine that is not loopback, as its name resolves or as it would send from."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # nothing is sent
        except OSError:
            return "127.0.0.2"
        return str(probe.getsockname()[0])


@pytest.mark.parametrize(
    "message",
    [
        {"type": "ViewerCameraMessage"},
        {**CAMERA, "position": "nowhere", "fov": "wide"},
        {"type": "ScenePointerMessage", "event_type": "click"},
        {"type": "SceneNodeDragMessage", "name": "/no/such/node"},
    ],
)
def test_a_malformed_message_harms_nobody_else(planner: Planner, message: dict[str, object]) -> None:
    with scene(planner, "healthy-tab") as healthy, scene(planner, "malformed-tab", close_timeout=1) as malformed:
        say(malformed, **message)
        assert close_code(malformed) == 1008
        say(healthy, **CAMERA)
        eventually(lambda: planner.scene_server.client_for("healthy-tab"))
    eventually(lambda: not planner.scene_server._held)
