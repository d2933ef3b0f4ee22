"""The binary channel ``/api/steps/rehearse/poses?plan=…``: one row of float64 for each snapshot, the newest wins.

The first message is text: ``{"type": "poses", "version", "fields"}``. Each that follows is binary, 8 bytes for each
field, little-endian. A reader that is slow misses rows and gets no old ones; nothing waits for it.
With ``&rate=control`` a message is all rows since the last one, a row for each control step. A reader that falls
behind by seconds is told how many it has missed: ``{"type": "missed", "rows"}``.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.messages.version import VERSION
from app.tabs.rehearse.poses import MAX_READERS, fields, row

if TYPE_CHECKING:
    from app.tabs.rehearse.shared_drive import SharedDrive
    from app.tabs.rehearse.shared_drives import SharedDrives
    from vfix_engine.runtime.ring import RowReader

POLL_S = 0.002  # between looks at the mailbox: a quarter of the time between two snapshots
BATCH_S = 0.01  # between two batches at control rate
NO_DRIVE, OTHER_ROBOT, TOO_MANY, NOTHING_TO_SAY = 4404, 4409, 4503, 1003
_PLAN = re.compile(r"[A-Za-z0-9_.\-]{1,64}")
_GONE = "nobody rehearses that plan; open it in a window first"

End = tuple[int, str]  # code and words with which a connection ends

router = APIRouter()


@router.websocket("/api/steps/rehearse/poses")
async def poses(websocket: WebSocket) -> None:
    """Rows of the drive of a plan, from its start to its end."""
    await websocket.accept()
    drives: SharedDrives = await asyncio.to_thread(websocket.app.state.sessions.shared, "rehearse")
    plan_id = websocket.query_params.get("plan", "")
    drive = drives.find(plan_id) if _PLAN.fullmatch(plan_id) else None
    if drive is None:
        await websocket.close(NO_DRIVE, _GONE)
        return
    if not drives.readers.acquire(blocking=False):
        await websocket.close(TOO_MANY, f"{MAX_READERS} programs read poses already; try again in 15 s")
        return
    try:
        send = _send_all if websocket.query_params.get("rate") == "control" else _send
        code, reason = await _until_either_ends(websocket, send(websocket, drives, plan_id, drive))
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # the reader was first
            await websocket.close(code, reason)
    finally:
        drives.readers.release()


async def _until_either_ends(websocket: WebSocket, sending: Coroutine[Any, Any, End]) -> End:
    """Send rows until the drive or the reader has gone; returns why the connection ends."""
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


async def _send_all(websocket: WebSocket, drives: SharedDrives, plan_id: str, drive: SharedDrive) -> End:
    """Batches of every step's row."""
    rows: RowReader | None = None
    missed = 0
    while drives.find(plan_id) is drive:
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


async def _told_columns(websocket: WebSocket, drive: SharedDrive) -> RowReader | None:
    """The rows of a drive that has begun, after the message that says what they are."""
    rows = drive.rows()
    if rows is not None:
        names = [column.name for column in rows.columns]
        await websocket.send_text(json.dumps({"type": "poses", "version": VERSION, "fields": names}))
    return rows


async def _send(websocket: WebSocket, drives: SharedDrives, plan_id: str, drive: SharedDrive) -> End:
    columns: list[str] = []
    before = None
    while drives.find(plan_id) is drive:
        snapshot = drive.snapshot()
        if snapshot is not None and snapshot is not before:
            before = snapshot
            if not columns:
                columns = fields(snapshot)
                await websocket.send_text(json.dumps({"type": "poses", "version": VERSION, "fields": columns}))
            values = row(snapshot)
            if len(values) != len(columns):
                return OTHER_ROBOT, "another robot stands here now; connect again"
            await websocket.send_bytes(values.tobytes())
        await asyncio.sleep(POLL_S)
    return NO_DRIVE, _GONE


async def _listen(websocket: WebSocket) -> End:
    """Nothing is taken from a reader; what it sends ends the connection."""
    message = await websocket.receive()
    return (1001, "") if message["type"] == "websocket.disconnect" else (NOTHING_TO_SAY, "this channel only sends")
