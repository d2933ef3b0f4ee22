"""The Host and Origin values that the planner accepts, compared exactly."""

from app.settings import Settings
from vfix_engine.errors import InputError

_SAME_MACHINE_NAMES: dict[str, tuple[str, ...]] = {
    "127.0.0.1": ("127.0.0.1", "localhost"),
    "localhost": ("localhost", "127.0.0.1"),
    "::1": ("[::1]", "localhost"),
}
_WILDCARDS = frozenset({"0.0.0.0", "::", "*", ""})


def allowed_hosts(settings: Settings) -> frozenset[str]:
    """Accepted values of the Host header, such as '127.0.0.1:8765'.

    Raises InputError for a wildcard address: a page that answers to any name can be reached by DNS rebinding.
    """
    if settings.host in _WILDCARDS:
        raise InputError(f"host {settings.host!r} listens on every address; name the one address to listen on.")
    names = _SAME_MACHINE_NAMES.get(settings.host, (_bracketed(settings.host),))
    with_port = {f"{name}:{settings.port}" for name in names}
    return frozenset(with_port | (set(names) if settings.port == 80 else set()))


def base_url(settings: Settings) -> str:
    """Address of the page, without the token."""
    return f"http://{_bracketed(settings.host)}:{settings.port}"


def login_url(settings: Settings) -> str:
    """Address of the page with its token: opens the page and leaves a cookie."""
    return f"{base_url(settings)}/?token={settings.token}"


def with_port(host: str, port: int) -> str:
    """Return a Host header with its port replaced, or added if it has none."""
    name, colon, old = host.rpartition(":")
    return f"{name if colon and old.isdigit() else host}:{port}"


def cookie_name(settings: Settings) -> str:
    """Name of the cookie, with the port: cookies do not depend on ports, and planners may share a machine."""
    return f"vfix_token_{settings.port}"


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
