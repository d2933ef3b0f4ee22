"""`vfix serve` as started by a user: one address with a token, loopback sockets, a clean shutdown (HAZ-29)."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from knocking import eventually, knock, upgrade

from app.commands import serve
from app.commands.serve import bind
from app.settings import Settings
from vfix_engine.errors import InputError

ROOT = Path(__file__).resolve().parents[3]


def environment(home: Path) -> dict[str, str]:
    """Nothing of our own settings but where the compiled kernels are."""
    kept = {name: value for name, value in os.environ.items() if name == "VFIX_CACHE" or not name.startswith("VFIX_")}
    return {**kept, "VFIX_HOME": str(home), "PYTHONUNBUFFERED": "1"}


@contextlib.contextmanager
def serving(home: Path, *arguments: str, **options: Any) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A planner in a process of its own, and the line that it prints."""
    command = [sys.executable, "-m", "app.cli", "serve", "--no-browser", *arguments]
    options = {"cwd": ROOT, "env": environment(home), "stdout": subprocess.PIPE, "text": True, **options}
    with subprocess.Popen(command, **options) as process:
        try:
            assert process.stdout is not None
            yield process, process.stdout.readline().strip()
        finally:
            process.terminate()
            process.wait(60)


def listening_sockets(process_id: int) -> set[tuple[str, int]]:
    """Local addresses and ports of a process's listening TCP sockets, as the kernel lists them."""
    inodes = set()
    for descriptor in Path(f"/proc/{process_id}/fd").iterdir():
        with contextlib.suppress(OSError):
            match = re.fullmatch(r"socket:\[(\d+)\]", os.readlink(descriptor))
            inodes |= {match[1]} if match else set()
    found = set()
    for table, family in (("tcp", socket.AF_INET), ("tcp6", socket.AF_INET6)):
        for line in Path(f"/proc/{process_id}/net/{table}").read_text(encoding="ascii").splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and fields[9] in inodes:
                address, port = fields[1].split(":")
                words = bytes.fromhex(address)
                packed = b"".join(words[i : i + 4][::-1] for i in range(0, len(words), 4))
                found.add((socket.inet_ntop(family, packed), int(port, 16)))
    return found


def test_serve_prints_its_address_and_listens_on_loopback_only(tmp_path: Path) -> None:
    with serving(tmp_path / "home", "--port", "0") as (process, line):
        address = re.fullmatch(r"vfix is at (http://127\.0\.0\.1:(\d+)/\?token=[A-Za-z0-9_-]{43})", line)
        assert address, line
        opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(), urllib.request.ProxyHandler({}))
        with opener.open(address[1], timeout=60) as page:
            assert page.status == 200
            assert page.url == f"http://127.0.0.1:{address[2]}/"
            assert b"Not for clinical use" in page.read()
        if sys.platform == "linux":
            assert {address for address, _ in listening_sockets(process.pid)} == {"127.0.0.1"}
        process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)
        assert process.wait(60) == 0
        with pytest.raises(OSError, match=r"."):
            socket.create_connection(("127.0.0.1", int(address[2])), timeout=2).close()


@pytest.mark.skipif(sys.platform != "linux", reason="sockets are read from /proc")
def test_idle_connections_stop_nobody_else(tmp_path: Path) -> None:
    """More connections than descriptors, without a token and without a request, at both ports (HAZ-27, HAZ-30)."""
    import resource

    limit = 400
    few = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit))}
    log = tmp_path / "log"
    with (
        log.open("w") as stderr,
        serving(tmp_path / "home", "--port", "0", stderr=stderr, **few) as (process, line),
        contextlib.ExitStack() as idle,
    ):
        port, token = int(line.rsplit(":", 1)[1].split("/")[0]), line.rsplit("=", 1)[1]
        headers = [("Host", f"127.0.0.1:{port}"), ("Authorization", f"Bearer {token}"), ("Connection", "close")]
        eventually(lambda: len(listening_sockets(process.pid)) == 2)
        assert knock(port, "GET", "/static/icon.svg", headers).status == 200
        for _, idle_port in sorted(listening_sockets(process.pid)):
            for _ in range(limit):
                idle.enter_context(socket.create_connection(("127.0.0.1", idle_port), timeout=60))
        for _ in range(3):
            assert knock(port, "GET", "/static/icon.svg", headers).status == 200
        assert knock(port, "GET", "/scene/ws?tab=others-work", [*headers[:2], *upgrade()]).status == 101
    assert log.stat().st_size < 50_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--host", "0.0.0.0"], "--allow-remote"),
        (["--host", "192.0.2.7"], "--allow-remote"),
        (["--host", "0.0.0.0", "--allow-remote"], "VFIX_TOKEN"),
        (["--port", "99999"], "99999"),
    ],
)
def test_serve_refuses(tmp_path: Path, arguments: list[str], words: str) -> None:
    command = [sys.executable, "-m", "app.cli", "serve", "--no-browser", *arguments]
    done = subprocess.run(
        command, cwd=ROOT, env=environment(tmp_path), capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert not any(tmp_path.iterdir())


BROWSER = """
import json, os, pathlib, sys, urllib.parse, urllib.request
page = pathlib.Path(urllib.request.url2pathname(urllib.parse.urlsplit(sys.argv[2]).path))
told = {"arguments": sys.argv}
if page.is_file():
    told |= {"mode": page.stat().st_mode & 0o777, "text": page.read_text(), "page": str(page)}
pathlib.Path(sys.argv[1]).write_text(json.dumps(told))
"""
OPEN = """
import sys, types
from app.commands.serve import _open_browser
server = types.SimpleNamespace(started=True, should_exit=True)
_open_browser(server, sys.argv[1])
"""


def test_the_page_that_leads_to_the_address_stays_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slow browser finds it; it goes while the planner runs on."""
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(serve, "PAGE_STAYS_S", 0.5)
    opened: list[float] = []
    monkeypatch.setattr("webbrowser.open", lambda _: opened.append(time.monotonic()))
    server: Any = SimpleNamespace(started=True, should_exit=False)
    serve._open_browser(server, "http://127.0.0.1:1/?token=x")
    assert time.monotonic() - opened[0] >= 0.5
    assert list(tmp_path.iterdir()) == []


def test_the_browser_s_command_line_does_not_hold_the_token(tmp_path: Path) -> None:
    """Every user of a machine reads every command line (HAZ-27); a file of one's own leads to the address."""
    token = "secret-of-the-planner"
    (tmp_path / "browser.py").write_text(BROWSER, encoding="utf-8")
    told_file = tmp_path / "told.json"
    browser = f"{sys.executable} {tmp_path / 'browser.py'} {told_file} %s"
    home = tmp_path / "home"
    home.mkdir()
    env = {**environment(home), "BROWSER": browser, "HOME": str(home), "USERPROFILE": str(home)}
    command = [sys.executable, "-c", OPEN, f"http://127.0.0.1:1/?token={token}"]
    subprocess.run(command, cwd=ROOT, env=env, check=True)
    told = json.loads(told_file.read_text(encoding="utf-8"))
    assert token not in " ".join(told["arguments"])
    assert f'content="0; url=http://127.0.0.1:1/?token={token}"' in told["text"]
    if os.name == "posix":
        assert told["mode"] == 0o600
    assert not Path(told["page"]).exists()
    assert list(home.iterdir()) == []
    home.rmdir()
    without = subprocess.run(command, cwd=ROOT, env=env, check=True, capture_output=True, text=True)
    assert "open the address above yourself" in without.stderr
    assert "Traceback" not in without.stderr


def test_a_taken_port_is_left_or_named(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        settings = Settings(home=tmp_path, port=taken.getsockname()[1])
        with pytest.raises(InputError, match="--port 0"):
            bind(settings, may_move=False)
        with bind(settings, may_move=True) as moved:
            assert moved.getsockname()[0] == "127.0.0.1"
            assert moved.getsockname()[1] != settings.port
