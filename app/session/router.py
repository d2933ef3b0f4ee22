"""The WebSocket ``/session?tab=…``: a hello both ways, then sections of the view model out, validated commands in."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import math
import re
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping, MutableMapping
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, FastAPI
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.kit.prompt_threads import PROMPT_THREADS
from app.messages.hello import NotUnderstood, read_hello
from app.messages.sections import HelloMessage, NoteMessage, ReplyMessage, StateMessage
from app.messages.version import VERSION
from app.operations.messages import messages
from app.session.client_sessions import MAX_PAGES, ClientSessions, TabTaken, TooManyTabs
from app.session.commands import InvalidMessage, parse_command
from app.tabs.registry import specs

if TYPE_CHECKING:
    from app.session.client_session import ClientSession

Message = HelloMessage | StateMessage | ReplyMessage | NoteMessage
MAX_MESSAGE_CHARS = 64_000
MIN_INTERVAL_S = 0.015  # interval of states sent to a client; the sessions' clock limits it to 50 a second
MAX_NOTES = MAX_REPLIES = 64  # waiting for a client: further notes are dropped, and no command is read meanwhile
MAX_PER_SECOND = 400  # messages of one client; a hand, keys and a heartbeat stay below 100
HELLO_S = 10.0  # deadline of a client's hello, so that silent clients occupy no connection
INVALID, NOT_TEXT, SILENT, TAB_TAKEN, NOT_UNDERSTOOD, FLOOD, TOO_MANY = 1008, 1003, 4408, 4409, 4426, 4429, 4503
_LOG = logging.getLogger(__name__)
_TAB = re.compile(r"[A-Za-z0-9_-]{8,64}")
_WANTED = re.compile(r"[A-Za-z0-9_.\-]{1,64}")


@contextlib.asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    sessions = ClientSessions(app.state.services, app.state.scene_server, lambda: str(app.state.warmup.status.text))
    app.state.sessions = sessions
    PROMPT_THREADS.enrol()
    sessions.start()
    try:
        yield
    finally:
        await asyncio.to_thread(sessions.close)


router = APIRouter(lifespan=_lifespan)


@router.websocket("/session")
async def serve_client(websocket: WebSocket) -> None:
    """One client. The gateway's guard has already checked token, Host and Origin."""
    client = websocket.query_params.get("tab", "")
    await websocket.accept()  # also before a refusal: else a page does not get code and reason
    if not _TAB.fullmatch(client):
        await websocket.close(INVALID, "a tab is 8 to 64 letters, digits, '-' or '_'")
        return
    wanted = {
        name: value
        for name in ("case", "plan", "step")
        if _WANTED.fullmatch(value := websocket.query_params.get(name, ""))
    }
    sessions: ClientSessions = websocket.app.state.sessions
    try:
        session = await _connect(sessions, client, wanted)
    except TabTaken:
        await websocket.close(TAB_TAKEN, "another connection speaks for this tab; take another name for it")
        return
    except TooManyTabs:
        await websocket.close(TOO_MANY, f"{MAX_PAGES} pages of this planner are open; close one, or try again in 15 s")
        return
    try:
        await _serve(websocket, session)
    finally:
        sessions.disconnect(client)


async def _connect(sessions: ClientSessions, client: str, wanted: dict[str, str]) -> ClientSession:
    """A page that reloads may be faster than the end of its old connection: wait for that briefly."""
    for _ in range(20):
        try:
            return await _made(sessions, client, wanted)
        except TabTaken:
            await asyncio.sleep(0.1)
    return await _made(sessions, client, wanted)


async def _made(sessions: ClientSessions, client: str, wanted: dict[str, str]) -> ClientSession:
    """Not on the loop's thread, since a new session takes a while; it is left at once if its client is gone."""
    making = asyncio.ensure_future(asyncio.to_thread(sessions.connect, client, wanted))
    try:
        return await asyncio.shield(making)
    except asyncio.CancelledError:
        making.add_done_callback(lambda made: None if _failed(made) else sessions.disconnect(client))
        raise


def _failed(made: asyncio.Future[ClientSession]) -> bool:
    return made.cancelled() or made.exception() is not None


class ClientOutbox:
    """Replies and notes on their way to a client (HAZ-31). Owned by the event loop's thread.

    The number of waiting notes is limited. Replies are never dropped, since a client waits for each: while
    `MAX_REPLIES` wait, no further command is read, so that a client that does not read cannot request more. Its hand
    decays then.
    """

    def __init__(self) -> None:
        self._waiting: deque[Message] = deque()
        self._replies = 0
        self.changed = asyncio.Event()  # there is something to send
        self._room = asyncio.Event()
        self._room.set()

    def put(self, message: Message) -> None:
        """Queue a message."""
        reply = message["type"] == "reply"
        if not reply and len(self._waiting) - self._replies >= MAX_NOTES:
            return
        self._waiting.append(message)
        self._replies += reply
        if self._replies >= MAX_REPLIES:
            self._room.clear()
        self.changed.set()

    def waiting(self) -> list[Message]:
        """The waiting messages, in order; each stays until it is sent."""
        return list(self._waiting)

    def sent(self) -> None:
        """The first waiting message has been sent."""
        self._replies -= self._waiting.popleft()["type"] == "reply"
        if self._replies < MAX_REPLIES:
            self._room.set()

    async def room(self) -> None:
        """Wait until a further command may be read."""
        await self._room.wait()


def hello() -> HelloMessage:
    """The first message to a client: the version of the messages, the tabs with their panels, and the operations."""
    return {
        "type": "hello",
        "version": VERSION,
        "steps": [{"name": spec.name, "label": spec.label, "panel": f"/tabs/{spec.name}/panel.js"} for spec in specs()],
        "operations": [{"type": kind, "name": message.title} for kind, message in messages().items()],
    }


async def _serve(websocket: WebSocket, session: ClientSession) -> None:
    loop = asyncio.get_running_loop()
    outbox = ClientOutbox()

    def send_soon(message: Message) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(outbox.put, message)

    def changed_soon() -> None:
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(outbox.changed.set)

    session.note = lambda words, error: send_soon({"type": "note", "words": words, "error": error})
    unsubscribe = session.view_model.subscribe(changed_soon)
    outbox.changed.set()
    tasks = list[asyncio.Task[None]]()
    try:
        if not await _greeted(websocket, session):
            return
        tasks = [
            asyncio.create_task(_write(websocket, session, outbox)),
            asyncio.create_task(_read(websocket, session, outbox, send_soon)),
        ]
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            with contextlib.suppress(WebSocketDisconnect, RuntimeError):
                task.result()
    finally:
        unsubscribe()
        session.note = lambda words, error: None
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _greeted(websocket: WebSocket, session: ClientSession) -> bool:
    """Exchange hellos; nothing else is sent before. False without the client's: the connection ends."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # the client has gone
        await websocket.send_text(to_text(hello()))
        try:
            message = await asyncio.wait_for(websocket.receive(), HELLO_S)
            if message["type"] == "websocket.disconnect" or not await _may_be_read(websocket, message):
                return False
            session.greet(read_hello(message["text"]).role)
        except TimeoutError:
            await websocket.close(SILENT, f"no hello came within {HELLO_S:g} s; connect again")  # as from a busy page
        except NotUnderstood as error:
            await websocket.close(NOT_UNDERSTOOD, str(error))
        else:
            return True
    return False


async def _may_be_read(websocket: WebSocket, message: MutableMapping[str, Any], count: int = 1) -> bool:
    """Whether a message is text, short, and within the rate limit; if not, the connection ends."""
    text = message.get("text")
    if text is None:
        await websocket.close(NOT_TEXT, "commands are text, not bytes")
        return False
    if count > MAX_PER_SECOND or len(text) > MAX_MESSAGE_CHARS:
        bounds = f"{MAX_PER_SECOND} messages a second of {MAX_MESSAGE_CHARS} characters each"
        await websocket.close(FLOOD, f"more than {bounds} are not taken; try again in 10 s")
        return False
    return True


async def _write(websocket: WebSocket, session: ClientSession, outbox: ClientOutbox) -> None:
    """Latest state wins: what changed while the last message was on its way goes out as one message (HAZ-31).

    A reply is taken from the queue before the state is read, and sent after it: its receiver has seen the result of the
        command.
    """
    revision = 0
    while True:
        await outbox.changed.wait()
        outbox.changed.clear()
        messages = outbox.waiting()
        revision, sections = session.view_model.changed_since(revision)
        if sections:
            await websocket.send_text(to_text({"type": "state", "sections": sections}))
        for message in messages:
            await websocket.send_text(to_text(message))
            outbox.sent()
        await asyncio.sleep(MIN_INTERVAL_S)


def to_text(message: Mapping[str, object]) -> str:
    """JSON of a message. A non-finite number becomes null, is logged, and does not cost the page its connection."""
    try:
        return json.dumps(message, allow_nan=False)
    except ValueError:
        _LOG.error("a message to the page of the type %s has non-finite numbers", message.get("type"))
        return json.dumps(_finite(message), allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


async def _read(
    websocket: WebSocket, session: ClientSession, outbox: ClientOutbox, send_soon: Callable[[Message], None]
) -> None:
    loop = asyncio.get_running_loop()
    second, count = loop.time(), 0
    while True:
        await outbox.room()
        message = await websocket.receive()
        if message["type"] == "websocket.disconnect":
            return
        if loop.time() - second >= 1.0:
            second, count = loop.time(), 0
        count += 1
        if not await _may_be_read(websocket, message, count):
            return
        try:
            command = parse_command(message["text"])
        except InvalidMessage as error:
            send_soon(_refusal(_number(message["text"]), f"The page asked for something impossible: {error}"))
            continue
        reply = None
        if command.id is not None:
            number = command.id

            def reply(ok: bool, result: Any, number: int = number) -> None:
                done: ReplyMessage = {"type": "reply", "id": number, "ok": True, "result": result}
                send_soon(done if ok else _refusal(number, result))

        if not session.command(command, reply):
            send_soon(_refusal(command.id, "The planner is busy; that was not done."))


def _refusal(number: int | None, words: str) -> Message:
    """Report why a command was not executed: by its reply, where it waits for one, else by a note."""
    if number is None:
        return {"type": "note", "words": words, "error": True}
    return {"type": "reply", "id": number, "ok": False, "error": {"message": words}}


def _number(text: str) -> int | None:
    """The id of an invalid message, if a client can wait for a reply to it."""
    try:
        number = json.loads(text)["id"]  # leniently: also beside a NaN, for which the message is refused
    except (ValueError, LookupError, TypeError, RecursionError):
        return None
    return number if type(number) is int else None
