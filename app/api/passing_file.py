"""A response out of a temporary file."""

import shutil
from collections.abc import Callable
from pathlib import Path

from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool
from starlette.types import Receive, Scope, Send


class PassingFile(FileResponse):
    """A file whose folder is deleted once it was sent, or the client is gone; `ended` is called then."""

    ended: Callable[[], object] = bool

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            try:
                await run_in_threadpool(shutil.rmtree, Path(self.path).parent, ignore_errors=True)
            finally:
                self.ended()
