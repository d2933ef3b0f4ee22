"""`vfix serve`: start the planner and open its page."""

import argparse
import contextlib
import dataclasses
import gc
import os
import socket
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator
from typing import TYPE_CHECKING

from app.browsers import PAGE_STAYS_S, private_page, remove_old_pages
from app.gateway.addresses import allowed_hosts, login_url
from app.settings import Settings, link_address, tracker_address
from vfix_engine.errors import InputError

if TYPE_CHECKING:
    import uvicorn

    from app.gateway.server import PlannerServer


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> argparse.ArgumentParser:
    """Declare the options of `vfix serve`."""
    parser = subparsers.add_parser("serve", help="start the planner and open its page", description=__doc__)
    parser.add_argument("--port", type=int, help="port to listen on (default 8765, or a free one if that is taken)")
    parser.add_argument("--host", help="address to listen on (default 127.0.0.1)")
    parser.add_argument(
        "--allow-remote",
        action="store_true",
        help="let other machines reach the planner; needs a token of your own in VFIX_TOKEN",
    )
    parser.add_argument(
        "--igtl",
        metavar="[HOST:]PORT",
        help="tell 3D Slicer and others of the open plan by OpenIGTLink on this port (18944 is usual); off without it",
    )
    parser.add_argument(
        "--tracker",
        metavar="HOST:PORT/NAME",
        help="a tracking server that speaks OpenIGTLink, such as PLUS, and the transform of its pointer",
    )
    parser.add_argument("--no-browser", action="store_true", help="print the address only")
    return parser


def run(args: argparse.Namespace) -> int:
    """Serve until interrupted, then end the process."""
    if args.allow_remote and not os.environ.get("VFIX_TOKEN"):
        raise InputError("--allow-remote needs a token of your own: set VFIX_TOKEN first.")
    settings = Settings.from_environment(
        host=args.host,
        port=args.port,
        allow_remote=args.allow_remote,
        igtl=None if args.igtl is None else link_address(args.igtl),
        tracker=None if args.tracker is None else tracker_address(args.tracker),
    )
    if settings.igtl is not None:
        bind(dataclasses.replace(settings, host=settings.igtl.host, port=settings.igtl.port), may_move=False).close()
    may_move = args.port is None and "VFIX_PORT" not in os.environ
    allowed_hosts(settings)  # refuses what cannot be guarded before anything is opened
    with bind(settings, may_move=may_move) as listener:
        settings = dataclasses.replace(settings, port=listener.getsockname()[1])
        check_ports(settings)
        server = _built(settings)
        listener.listen(128)  # whoever opens the address at once waits a moment and is not turned away
        print(f"vfix is at {login_url(settings)}", flush=True)
        if settings.igtl is not None:
            print(f"OpenIGTLink on {settings.igtl.host}, port {settings.igtl.port}", flush=True)
        remove_old_pages()
        opener = threading.Thread(target=_open_browser, args=(server, login_url(settings)), daemon=True)
        if not args.no_browser and _has_screen():
            opener.start()
        with contextlib.suppress(KeyboardInterrupt):  # uvicorn raises it again once everything is closed
            server.run(sockets=[listener])
        if opener.is_alive():
            opener.join(1.0)
    # All is stored and closed. A thread may still compute, which Python would wait for, and taking everything apart
    # takes seconds on a busy machine.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0 if server.started else 1)


def _built(settings: Settings) -> "PlannerServer":
    """The server of the planner, with garbage collection off: what is imported stays, and was looked at repeatedly."""
    with _uncollected():
        from app.gateway.connections import raise_descriptor_limit
        from app.gateway.server import PlannerServer
        from app.main import build  # takes seconds: a refusal need not wait for it

        raise_descriptor_limit()
        return PlannerServer(build(settings))


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def check_ports(settings: Settings) -> None:
    """Raise InputError where the page and OpenIGTLink are to have the same port."""
    if settings.igtl is not None and settings.igtl.port == settings.port:
        raise InputError(f"the page has port {settings.port} already; name another one for --igtl, such as 18944.")


def bind(settings: Settings, *, may_move: bool) -> socket.socket:
    """Bind the port before anything is started; with `may_move` a free one if it is taken.

    Raises InputError when the address is not available.
    """
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    if sys.platform == "win32":
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
    else:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((settings.host, settings.port))
        return listener
    except OSError as error:
        listener.close()
        if may_move:
            return bind(dataclasses.replace(settings, port=0), may_move=False)
        raise InputError(
            f"cannot listen on {settings.host}, port {settings.port}: {error.strerror}. "
            "Another planner may be running; `--port 0` takes any free port."
        ) from None


def _has_screen() -> bool:
    """Whether there is a screen; without one Python would open a text browser in the terminal."""
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _open_browser(server: "uvicorn.Server", url: str) -> None:
    """Open the page once it answers; the redirecting file stays long enough for a slow browser."""
    while not server.started:
        if server.should_exit:
            return
        time.sleep(0.05)
    try:
        with private_page(url) as page:
            webbrowser.open(page.as_uri())
            end = time.monotonic() + PAGE_STAYS_S
            while not server.should_exit and time.monotonic() < end:
                time.sleep(0.05)
    except OSError as error:
        print(f"no browser can be opened ({error}); open the address above yourself.", file=sys.stderr)
