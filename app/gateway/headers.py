"""Security headers of every answer."""

from starlette.datastructures import MutableHeaders

_COMMON_POLICY = (
    "object-src 'none'",
    "base-uri 'none'",
    "form-action 'self'",
    "frame-ancestors 'self'",
)


def _policy(*directives: str) -> str:
    return "; ".join((*directives, *_COMMON_POLICY))


def _sockets(host: str | None) -> str:
    """Our own WebSockets by name: not every browser counts them to 'self'."""
    return "" if host is None else f" ws://{host}"


def page_policy(host: str | None) -> str:
    """Policy of our own pages: scripts from our own files only, no inline script, no other host."""
    return _policy(
        "default-src 'self'",
        "script-src 'self'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        f"connect-src 'self'{_sockets(host)}",
        "frame-src 'self'",
    )


def scene_policy(host: str | None) -> str:
    """Policy of viser's client, one file that unpacks and builds its own scripts; it reaches no other host either.

    Its sandbox holds in the page's frame and outside of it: no windows, no downloads, no forms, no going elsewhere with
    the page around it. The page speaks with its frame, so they stay of one origin.
    """
    return _policy(
        "sandbox allow-scripts allow-same-origin",
        "default-src 'none'",
        "script-src 'unsafe-inline' 'unsafe-eval' blob:",
        "worker-src blob:",
        "style-src 'unsafe-inline'",
        "font-src data:",
        "img-src 'self' data: blob:",
        f"connect-src 'self' data: blob:{_sockets(host)}",
    )


def secure(headers: MutableHeaders, path: str, host: str | None) -> None:
    """Set the headers on one answer to `host` (None: not one of ours); what a route says about caching stays."""
    is_scene = path.startswith("/scene/")
    headers["Content-Security-Policy"] = scene_policy(host) if is_scene else page_policy(host)
    headers["X-Content-Type-Options"] = "nosniff"
    headers["Referrer-Policy"] = "no-referrer"
    headers["Cross-Origin-Opener-Policy"] = "same-origin"
    headers["Cross-Origin-Resource-Policy"] = "same-origin"
    headers["X-Frame-Options"] = "SAMEORIGIN"
    headers.setdefault("Cache-Control", "no-cache" if path.startswith("/static/") else "no-store")
