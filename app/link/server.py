"""A server of OpenIGTLink on a thread of its own: what is told goes to every client, what they send to one listener.

Bounded everywhere, since any user of this machine may connect: clients, the size of a body before it is read, the time
that a message takes to arrive or to be taken. Of a name only the newest message waits for a client that is slow.

A client may be silent for as long as it wants, as one that only listens is. So nobody can hold every place: where all
are taken, the client whose last whole message is longest ago gives way to a new one.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
from collections.abc import Callable, Iterable

from app.link.messages import HEADER_BYTES, Header, LinkFault, LinkMessage, Text, ToolPoses, pack, parse_header, unpack
from vfix_engine.error_places import error_places
from vfix_engine.errors import InputError, VfixError

_LOG = logging.getLogger(__name__)

MAX_CLIENTS = 8
MAX_BODY_BYTES = 256 << 10  # of points there are 300 at most, 136 bytes each
ARRIVAL_S = 5.0  # for a message to arrive, from the first byte of its header to the last of its body
SLOW_S = 2.0  # a client that takes nothing for so long is dropped
_QUEUE_BYTES = 64 << 10  # that wait in the system for one client
STATUS = "Status"  # name of the text that answers a message

Listener = Callable[[LinkMessage], str]


class LinkServer:
    """Sends to and hears several clients; thread-safe.

    heard: called on a thread of its own with each message of a client; the words that it returns are sent back as the
        text 'Status'. Raises VfixError, whose words are sent back as well. greeting: what a new client is sent first.
    """

    def __init__(self, host: str, port: int, heard: Listener, greeting: Callable[[], Iterable[LinkMessage]]) -> None:
        self._host, self._port = host, port
        self._heard, self._greeting = heard, greeting
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="openigtlink", daemon=True)
        self._clients: dict[_Client, None] = {}  # the one that has been silent longest first
        self._serving: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._server: asyncio.Server | None = None
        self._started = threading.Event()
        self._refusal: OSError | None = None

    def start(self) -> int:
        """Listen; returns the port. Raises InputError where the address cannot be had."""
        self._thread.start()
        self._started.wait()
        if self._refusal is not None:
            self._thread.join()
            raise InputError(
                f"OpenIGTLink cannot listen on {self._host}, port {self._port}: {self._refusal.strerror}. "
                "Another program may have it; name another port."
            )
        assert self._server is not None
        return int(self._server.sockets[0].getsockname()[1])

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._clients)

    def tell(self, messages: Iterable[LinkMessage]) -> None:
        """Send to every client; never waits."""
        packed = [(type(message).__name__ + message.name, pack(message)) for message in messages]
        with contextlib.suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(self._tell, packed)

    def close(self) -> None:
        """Let go of every client and of the port."""
        if self._thread.is_alive():
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(5.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            opening = asyncio.start_server(self._begin, self._host, self._port, limit=_QUEUE_BYTES)
            self._server = self._loop.run_until_complete(opening)
        except OSError as error:
            self._refusal = error
            self._started.set()
            self._loop.close()
            return
        self._started.set()
        self._loop.run_forever()
        self._loop.run_until_complete(self._let_go())
        self._loop.run_until_complete(self._loop.shutdown_default_executor())
        self._loop.close()

    async def _let_go(self) -> None:
        """End everything: a client whose task has not begun yet has a socket as well."""
        assert self._server is not None
        self._server.close()
        await asyncio.sleep(0)  # connections that were accepted begin
        for writer in self._serving.values():
            writer.transport.abort()
        tasks = asyncio.all_tasks(self._loop) - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.sleep(0)  # transports that were aborted close their sockets

    def _tell(self, packed: Iterable[tuple[str, bytes]]) -> None:
        for client in self._clients:
            for key, data in packed:
                client.put(key, data)

    def _begin(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a client in a task of our own, whose end is looked at whatever it is."""
        task = self._loop.create_task(self._serve(reader, writer))
        self._serving[task] = writer  # the loop itself keeps weak references only
        task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._serving.pop(task, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            _LOG.error("OpenIGTLink: a client was dropped: %s", error_places(error))

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._clients) >= MAX_CLIENTS:
            self._make_room()
        client = _Client(writer)
        self._clients[client] = None
        sending = self._loop.create_task(client.send())
        hearing = self._loop.create_task(self._hear(reader, client))
        try:
            for message in await self._loop.run_in_executor(None, self._greeting_of, client):
                client.put(type(message).__name__ + message.name, pack(message))
            await asyncio.wait((sending, hearing), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._clients.pop(client, None)
            for task in (sending, hearing):
                task.cancel()
            for done in await asyncio.gather(sending, hearing, return_exceptions=True):
                if isinstance(done, LinkFault):
                    _LOG.warning("OpenIGTLink: a client was dropped: %s", done)  # which quotes nothing that came
                elif isinstance(done, Exception):
                    _LOG.error("OpenIGTLink: a client was dropped: %s", error_places(done))
            await _closed(writer)

    def _make_room(self) -> None:
        silent = next(iter(self._clients))
        del self._clients[silent]
        silent.leave()
        _LOG.warning("OpenIGTLink: %d clients are connected; the one silent longest gave way to a new one", MAX_CLIENTS)

    def _greeting_of(self, client: _Client) -> list[LinkMessage]:
        """Off the loop's thread; nothing for a client that has given way while others were greeted."""
        return list(self._greeting()) if client in self._clients else []

    async def _hear(self, reader: asyncio.StreamReader, client: _Client) -> None:
        """Read one message after the other; the next one is read once this one is dealt with. Raises LinkFault."""
        while True:
            try:
                first = await reader.readexactly(1)
                async with asyncio.timeout(ARRIVAL_S):
                    header, body = await _arrived(first, reader)
            except (asyncio.IncompleteReadError, ConnectionError):
                return
            except TimeoutError:
                raise LinkFault(f"a message did not arrive within {ARRIVAL_S:g} s.") from None
            if client in self._clients:  # it comes last now
                self._clients[client] = self._clients.pop(client)
            try:
                words = await self._loop.run_in_executor(None, self._dealt, header, body)
            except VfixError as error:
                words = str(error)
            if words:
                client.put("Text" + STATUS, pack(Text(STATUS, words)))

    def _dealt(self, header: Header, body: bytes) -> str:
        """Off the loop's thread: the checksum of a large body takes tens of milliseconds."""
        message = unpack(header, body)
        return "" if message is None or isinstance(message, ToolPoses) else self._heard(message)


class _Client:
    """What waits for one client: of each name the newest message."""

    def __init__(self, writer: asyncio.StreamWriter) -> None:
        self._writer = writer
        self._waiting: dict[str, bytes] = {}
        self._some = asyncio.Event()
        writer.transport.set_write_buffer_limits(high=_QUEUE_BYTES)

    def put(self, key: str, data: bytes) -> None:
        """Queue a message instead of an older one of its name; on the loop's thread."""
        self._waiting.pop(key, None)  # so that it comes last
        self._waiting[key] = data
        self._some.set()

    async def send(self) -> None:
        """Send what waits, for ever. Raises LinkFault where the client takes nothing."""
        with contextlib.suppress(ConnectionError):
            while True:
                await self._some.wait()
                while self._waiting:
                    self._writer.write(self._waiting.pop(next(iter(self._waiting))))
                    try:
                        await asyncio.wait_for(self._writer.drain(), SLOW_S)
                    except TimeoutError:
                        raise LinkFault(f"it took nothing for {SLOW_S:g} s.") from None
                self._some.clear()

    def leave(self) -> None:
        """End the connection, which ends whoever waits for it."""
        self._writer.transport.abort()


async def _arrived(first: bytes, reader: asyncio.StreamReader) -> tuple[Header, bytes]:
    """The message that begins with a byte, whole. Raises LinkFault for one that is none, or too large."""
    header = parse_header(first + await reader.readexactly(HEADER_BYTES - 1))
    if header.size > MAX_BODY_BYTES:
        raise LinkFault(f"a body of {header.size:,} bytes was announced; {MAX_BODY_BYTES:,} are taken.")
    return header, await reader.readexactly(header.size)


async def _closed(writer: asyncio.StreamWriter) -> None:
    writer.transport.abort()  # what a client does not take is not waited for
    with contextlib.suppress(OSError):
        await writer.wait_closed()
