"""Where the planner keeps its data and how it may be reached: one frozen value, handed in, never a global."""

import os
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import platformdirs

from vfix_engine.errors import InputError

LOOPBACK_HOSTS = frozenset({"127.0.0.1", "localhost", "::1"})
MIN_TOKEN_LENGTH = 16


class LinkAddress(NamedTuple):
    """Where OpenIGTLink is spoken. name: of the tracked tool, '' where there is none."""

    host: str
    port: int
    name: str = ""


def default_home() -> Path:
    """The user's data folder of this platform."""
    return Path(platformdirs.user_data_dir("vfix", appauthor=False))


def new_token() -> str:
    """A fresh secret of 256 bits, safe in an address."""
    return secrets.token_urlsafe(32)


@dataclass(frozen=True)
class Settings:
    """Settings of one running planner.

    home: folder that holds every case, plan and recording.
    host, port: the one public address; port 0 asks the system for a free one.
    token: the secret every request must carry. It is fresh at each start unless VFIX_TOKEN names one.
    allow_remote: an address other than loopback was asked for explicitly.
    igtl: where others are told of the open plan by OpenIGTLink; None for nowhere.
    tracker: of a tracking server that speaks OpenIGTLink; None for none.
    """

    home: Path
    host: str = "127.0.0.1"
    port: int = 8765
    token: str = field(default_factory=new_token, repr=False)
    allow_remote: bool = False
    igtl: LinkAddress | None = None
    tracker: LinkAddress | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise InputError(f"port {self.port} is not between 0 and 65535.")
        if len(self.token) < MIN_TOKEN_LENGTH or not self.token.isascii() or not self.token.isprintable():
            raise InputError(f"the token must be at least {MIN_TOKEN_LENGTH} printable ASCII characters long.")
        if not set(self.token) <= _TOKEN_CHARACTERS:
            raise InputError("the token may hold letters, digits, '-', '_', '.' and '~' only.")
        if not self.is_loopback and not self.allow_remote:
            raise InputError(
                f"host {self.host} can be reached from the network; "
                "use 127.0.0.1, or say --allow-remote together with a token of your own in VFIX_TOKEN."
            )

        if self.igtl is not None and self.igtl.host not in LOOPBACK_HOSTS and not self.allow_remote:
            raise InputError(
                f"OpenIGTLink on {self.igtl.host} can be reached from the network, and it asks nobody for a token; "
                "use a port alone, or say --allow-remote where the network is trusted."
            )

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach the planner."""
        return self.host in LOOPBACK_HOSTS

    @property
    def database_path(self) -> Path:
        """SQLite file of the embedded store."""
        return self.home / "vfix.sqlite3"

    @property
    def database_copies(self) -> tuple[Path, ...]:
        """Copies of the database from before upgrades, the newest last."""
        path = self.database_path
        return tuple(sorted(path.parent.glob(f"{path.stem}-*{path.suffix}"), key=lambda copy: copy.stat().st_mtime))

    @property
    def files_dir(self) -> Path:
        """Folder of the content-addressed files."""
        return self.home / "files"

    @property
    def runs_dir(self) -> Path:
        """Folder of the content-addressed files of recorded runs."""
        return self.home / "runs"

    @property
    def derived_dir(self) -> Path:
        """Folder of files that are computed from others, and can be computed again."""
        return self.home / "derived"

    @property
    def drives_dir(self) -> Path:
        """Recordings of the drives that go on."""
        return self.home / "drives"

    @property
    def temporary_dir(self) -> Path:
        """Folder of all that does not outlive the planner: uploads, and what the workers decode."""
        return self.home / "tmp"

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] | None = None, **overrides: Any) -> "Settings":
        """Settings from VFIX_HOME, VFIX_HOST, VFIX_PORT and VFIX_TOKEN; `overrides` that are not None win.

        Raises InputError when a value cannot be used.
        """
        environment = os.environ if environment is None else environment
        values: dict[str, Any] = {"home": environment.get("VFIX_HOME") or default_home()}
        if environment.get("VFIX_HOST"):
            values["host"] = environment["VFIX_HOST"]
        if environment.get("VFIX_PORT"):
            values["port"] = _port(environment["VFIX_PORT"])
        if environment.get("VFIX_TOKEN"):
            values["token"] = environment["VFIX_TOKEN"]
        values.update({name: value for name, value in overrides.items() if value is not None})
        values["home"] = Path(values["home"]).expanduser().resolve()
        return cls(**values)


_TOKEN_CHARACTERS = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.~")


def link_address(text: str) -> LinkAddress:
    """The address of a server of OpenIGTLink: 'PORT' on this machine, or 'HOST:PORT'. Raises InputError."""
    host, _, port = text.rpartition(":")
    return LinkAddress(host.strip("[]") or "127.0.0.1", _link_port(port, text))


def tracker_address(text: str) -> LinkAddress:
    """The address of a tracking server and the name of a transform of it: 'HOST:PORT/NAME'. Raises InputError."""
    where, slash, name = text.partition("/")
    host, _, port = where.rpartition(":")
    if not slash or not name.isascii() or not 0 < len(name) <= _LINK_NAME:
        raise InputError(
            f"a tracker is named as HOST:PORT/NAME, such as localhost:18944/StylusTipToReference, with a name of up to "
            f"{_LINK_NAME} ASCII characters; {text!r:.60} is not."
        )
    return LinkAddress(host.strip("[]") or "127.0.0.1", _link_port(port, text), name)


_LINK_NAME = 20  # [byte] of a message of OpenIGTLink


def _link_port(port: str, text: str) -> int:
    if not port.isdecimal() or not 0 < int(port) <= 65535:
        raise InputError(f"{text!r:.60} names no port between 1 and 65535, such as 18944.")
    return int(port)


def _port(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(f"VFIX_PORT is {text!r}, which is not a number.") from None
