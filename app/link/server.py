"""A server of OpenIGTLink on its own thread: messages are broadcast to all clients, and received by one listener.

All resources are bounded, since any user of this machine may connect: the number of clients, the size of a body before
it is read, the time that a message takes to arrive or to be sent. For a slow client only the newest message of each
name is queued.

A client may be silent for any time, as one that only listens is. To prevent clients from holding all places, a new
client replaces the one whose last complete message is oldest if all places are taken.
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
MAX_BODY_BYTES = 256 << 10  # a list has at most 300 points of 136 bytes
ARRIVAL_S = 5.0  # for a message to arrive, from the first byte of its header to the last of its body
SLOW_S = 2.0  # a client that receives nothing for this long is dropped
_QUEUE_BYTES = 64 << 10  # limit of the write buffer of one client
STATUS = "Status"  # name of the text that answers a message

Listener = Callable[[LinkMessage], str]


class LinkServer:
    """Sends messages to several clients and receives theirs. Thread-safe.

    on_message: called on another thread with each message of a client; the text that it returns, or the message of a
        VfixError that it raises, is sent back as the text 'Status'. greeting: returns the first messages for a new
        client.
    """

    def __init__(
        self, host: str, port: int, on_message: Listener, greeting: Callable[[], Iterable[LinkMessage]]
    ) -> None:
        self._host, self._port = host, port
        self._on_message, self._greeting = on_message, greeting
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="openigtlink", daemon=True)
        self._clients: dict[_Client, None] = {}  # ordered by their last message, the oldest first
        self._serving: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._server: asyncio.Server | None = None
        self._started = threading.Event()
        self._refusal: OSError | None = None

    def start(self) -> int:
        """Start to listen and return the port. Raises InputError if the address is not available."""
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
        """Number of connected clients."""
        return len(self._clients)

    def broadcast(self, messages: Iterable[LinkMessage]) -> None:
        """Send messages to every client, without waiting."""
        packed = [(type(message).__name__ + message.name, pack(message)) for message in messages]
        with contextlib.suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(self._enqueue, packed)

    def close(self) -> None:
        """Disconnect every client and close the port."""
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
        self._loop.run_until_complete(self._disconnect())
        self._loop.run_until_complete(self._loop.shutdown_default_executor())
        self._loop.close()

    async def _disconnect(self) -> None:
        """Close all connections, including those whose task has not begun yet."""
        assert self._server is not None
        self._server.close()
        await asyncio.sleep(0)  # lets accepted connections begin
        for writer in self._serving.values():
            writer.transport.abort()
        tasks = asyncio.all_tasks(self._loop) - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.sleep(0)  # lets aborted transports close their sockets

    def _enqueue(self, packed: Iterable[tuple[str, bytes]]) -> None:
        for client in self._clients:
            for key, data in packed:
                client.put(key, data)

    def _begin(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a client in an own task, so that its errors are logged."""
        task = self._loop.create_task(self._serve(reader, writer))
        self._serving[task] = writer  # the loop keeps only weak references to tasks
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
        receiving = self._loop.create_task(self._receive(reader, client))
        try:
            for message in await self._loop.run_in_executor(None, self._greeting_of, client):
                client.put(type(message).__name__ + message.name, pack(message))
            await asyncio.wait((sending, receiving), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._clients.pop(client, None)
            for task in (sending, receiving):
                task.cancel()
            for done in await asyncio.gather(sending, receiving, return_exceptions=True):
                if isinstance(done, LinkFault):
                    _LOG.warning("OpenIGTLink: a client was dropped: %s", done)  # it quotes nothing that was received
                elif isinstance(done, Exception):
                    _LOG.error("OpenIGTLink: a client was dropped: %s", error_places(done))
            await _closed(writer)

    def _make_room(self) -> None:
        silent = next(iter(self._clients))
        del self._clients[silent]
        silent.leave()
        _LOG.warning("OpenIGTLink: %d clients are connected; the one silent longest gave way to a new one", MAX_CLIENTS)

    def _greeting_of(self, client: _Client) -> list[LinkMessage]:
        """Return the first messages for a client, on a worker thread; none for one that was replaced meanwhile."""
        return list(self._greeting()) if client in self._clients else []

    async def _receive(self, reader: asyncio.StreamReader, client: _Client) -> None:
        """Read messages one after another, each after the previous one is handled. Raises LinkFault."""
        while True:
            try:
                first = await reader.readexactly(1)
                async with asyncio.timeout(ARRIVAL_S):
                    header, body = await _arrived(first, reader)
            except (asyncio.IncompleteReadError, ConnectionError):
                return
            except TimeoutError:
                raise LinkFault(f"a message did not arrive within {ARRIVAL_S:g} s.") from None
            if client in self._clients:  # move it to the end
                self._clients[client] = self._clients.pop(client)
            try:
                words = await self._loop.run_in_executor(None, self._handle, header, body)
            except VfixError as error:
                words = str(error)
            if words:
                client.put("Text" + STATUS, pack(Text(STATUS, words)))

    def _handle(self, header: Header, body: bytes) -> str:
        """Unpack and handle a message on a worker thread: the checksum of a large body takes tens of milliseconds."""
        message = unpack(header, body)
        return "" if message is None or isinstance(message, ToolPoses) else self._on_message(message)


class _Client:
    """The queue of one client: the newest message of each name."""

    def __init__(self, writer: asyncio.StreamWriter) -> None:
        self._writer = writer
        self._waiting: dict[str, bytes] = {}
        self._some = asyncio.Event()
        writer.transport.set_write_buffer_limits(high=_QUEUE_BYTES)

    def put(self, key: str, data: bytes) -> None:
        """Queue a message, replacing an older one of its name; on the loop's thread."""
        self._waiting.pop(key, None)  # moves it to the end
        self._waiting[key] = data
        self._some.set()

    async def send(self) -> None:
        """Send queued messages until the connection ends. Raises LinkFault if the client receives nothing."""
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
        """End the connection, which also ends its tasks."""
        self._writer.transport.abort()


async def _arrived(first: bytes, reader: asyncio.StreamReader) -> tuple[Header, bytes]:
    """Read the rest of a message after its first byte. Raises LinkFault if it is invalid or too large."""
    header = parse_header(first + await reader.readexactly(HEADER_BYTES - 1))
    if header.size > MAX_BODY_BYTES:
        raise LinkFault(f"a body of {header.size:,} bytes was announced; {MAX_BODY_BYTES:,} are taken.")
    return header, await reader.readexactly(header.size)


async def _closed(writer: asyncio.StreamWriter) -> None:
    writer.transport.abort()  # does not wait until the client has received everything
    with contextlib.suppress(OSError):
        await writer.wait_closed()
