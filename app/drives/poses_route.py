"""The binary channel ``/api/v1/steps/TAB/poses?plan=…``: one row of float64 for each snapshot, the newest wins.

``plan`` names the document that is driven; ``case`` a case that is driven without one.

The first message is text: ``{"type": "poses", "version", "fields"}``. Each following one is binary, 8 bytes for each
field, little-endian. A slow reader misses rows and gets no old ones; nothing waits for it.
With ``&rate=control`` a message has all rows since the last one, a row for each control step. A reader that falls
behind by seconds gets the number of missed rows: ``{"type": "missed", "rows"}``.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
from collections.abc import Coroutine, Mapping
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.drives.poses import ANY_WORLD, MAX_READERS, PoseColumns
from app.messages.version import VERSION

if TYPE_CHECKING:
    from app.drives.shared_drive import SharedDrive
    from app.drives.shared_drives import SharedDrives
    from vfix_engine.runtime.ring import RowReader

    Drive = SharedDrive[Any, Any]
    Drives = SharedDrives[Any, Any]

POLL_S = 0.002  # polling interval of the mailbox: a quarter of the time between two snapshots
BATCH_S = 0.01  # between two batches at control rate
NO_DRIVE, OTHER_ROBOT, TOO_MANY, NOTHING_TO_SAY = 4404, 4409, 4503, 1003
_ID = re.compile(r"[A-Za-z0-9_.\-]{1,64}")
_GONE = "nobody rehearses that plan; open it in a window first"

End = tuple[int, str]  # code and reason with which a connection ends


def poses_router(tab: str, columns: PoseColumns = ANY_WORLD) -> APIRouter:
    """The channel of a tab's drives. columns: of a row for each snapshot."""
    router = APIRouter()

    @router.websocket(f"/api/v1/steps/{tab}/poses")
    async def poses(websocket: WebSocket) -> None:
        """Rows of one drive, from its start to its end."""
        await _serve(websocket, tab, columns)

    return router


async def _serve(websocket: WebSocket, tab: str, columns: PoseColumns) -> None:
    await websocket.accept()
    drives: Drives = await asyncio.to_thread(websocket.app.state.sessions.shared, tab)
    drive = _asked_for(drives, websocket.query_params)
    if drive is None:
        with contextlib.suppress(WebSocketDisconnect):  # it may have left already
            await websocket.close(NO_DRIVE, _GONE)
        return
    if not drives.readers.acquire(blocking=False):
        await websocket.close(TOO_MANY, f"{MAX_READERS} programs read poses already; try again in 15 s")
        return
    try:
        at_control_rate = websocket.query_params.get("rate") == "control"
        send = _send_all(websocket, drives, drive) if at_control_rate else _send(websocket, drives, drive, columns)
        code, reason = await _until_either_ends(websocket, send)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # the reader was first
            await websocket.close(code, reason)
    finally:
        drives.readers.release()


def _asked_for(drives: Drives, query: Mapping[str, str]) -> Drive | None:
    case_id, document_id = query.get("case"), query.get("plan")
    asked = [one for one in (case_id, document_id) if one is not None]
    return drives.find(case_id, document_id) if asked and all(map(_ID.fullmatch, asked)) else None


async def _until_either_ends(websocket: WebSocket, sending: Coroutine[Any, Any, End]) -> End:
    """Send rows until the drive or the reader is gone; returns why the connection ends."""
    tasks = [asyncio.create_task(sending), asyncio.create_task(_listen(websocket))]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        return next(iter(done)).result()
    except (RuntimeError, WebSocketDisconnect):
        return 1001, ""
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _send_all(websocket: WebSocket, drives: Drives, drive: Drive) -> End:
    """Batches of every step's row."""
    rows: RowReader | None = None
    missed = 0
    while drives.has(drive):
        rows = rows or await _told_columns(websocket, drive)
        if rows is not None:
            if rows.ended:
                return OTHER_ROBOT, "another robot stands here now; connect again"
            batch = rows.read()
            if len(batch):
                await websocket.send_bytes(batch.tobytes())
            if rows.lost > missed:
                await websocket.send_text(json.dumps({"type": "missed", "rows": rows.lost - missed}))
                missed = rows.lost
        await asyncio.sleep(BATCH_S)
    return NO_DRIVE, _GONE


async def _told_columns(websocket: WebSocket, drive: Drive) -> RowReader | None:
    """The rows of a started drive, after the message that describes them."""
    rows = drive.rows()
    if rows is not None:
        names = [column.name for column in rows.columns]
        await websocket.send_text(json.dumps({"type": "poses", "version": VERSION, "fields": names}))
    return rows


async def _send(websocket: WebSocket, drives: Drives, drive: Drive, columns: PoseColumns) -> End:
    names: list[str] = []
    before = None
    while drives.has(drive):
        snapshot = drive.snapshot()
        if snapshot is not None and snapshot is not before:
            before = snapshot
            if not names:
                names = columns.names(snapshot)
                await websocket.send_text(json.dumps({"type": "poses", "version": VERSION, "fields": names}))
            values = columns.row(snapshot)
            if len(values) != len(names):
                return OTHER_ROBOT, "another robot stands here now; connect again"
            await websocket.send_bytes(values.tobytes())
        await asyncio.sleep(POLL_S)
    return NO_DRIVE, _GONE


async def _listen(websocket: WebSocket) -> End:
    """A reader must not send anything; a message from it ends the connection."""
    message = await websocket.receive()
    return (1001, "") if message["type"] == "websocket.disconnect" else (NOTHING_TO_SAY, "this channel only sends")
