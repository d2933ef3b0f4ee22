"""Security headers of all responses."""

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
    """Return the source of the planner's WebSockets, since not every browser includes them in 'self'."""
    return "" if host is None else f" ws://{host}"


def page_policy(host: str | None) -> str:
    """Content security policy of the planner's pages: its own script files only, no inline script, no other host."""
    return _policy(
        "default-src 'self'",
        "script-src 'self'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        f"connect-src 'self'{_sockets(host)}",
        "frame-src 'self'",
    )


def scene_policy(host: str | None) -> str:
    """Content security policy of viser's client, one file that unpacks its own scripts; no other host.

    Its sandbox applies inside and outside of the page's frame: no windows, no downloads, no forms, no navigation of the
    outer page. The page accesses its frame, so both have one origin.
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
    """Set the security headers of one response; a route's caching headers stay.

    host: the Host header of the request, None if it is not an accepted one.
    """
    is_scene = path.startswith("/scene/")
    headers["Content-Security-Policy"] = scene_policy(host) if is_scene else page_policy(host)
    headers["X-Content-Type-Options"] = "nosniff"
    headers["Referrer-Policy"] = "no-referrer"
    headers["Cross-Origin-Opener-Policy"] = "same-origin"
    headers["Cross-Origin-Resource-Policy"] = "same-origin"
    headers["X-Frame-Options"] = "SAMEORIGIN"
    headers.setdefault("Cache-Control", "no-cache" if path.startswith("/static/") else "no-store")
