"""viser's client for the page: only its canvas, connected to the relay."""

import functools
from pathlib import Path

import viser

# Scripts that expose the canvas to the page and reconnect to a busy planner; both must run before viser's script.
_BEFORE = ("announce.js", "patience.js")
_FOLDER = Path(__file__).resolve().parent.parent / "web" / "js" / "scene-layer"

# The client reads its server from `?websocket=`, and reconnects only while its document has the focus, which an iframe
# often does not have.
_SCRIPT = """
(() => {
  const given = new URLSearchParams(location.search);
  const kept = new URLSearchParams();
  for (const name of ["tab", "fixedDpr"]) if (given.has(name)) kept.set(name, given.get(name));
  const tab = encodeURIComponent(given.get("tab") ?? "");
  kept.set("websocket", `ws://${location.host}/scene/ws?tab=${tab}`);
  history.replaceState(null, "", `?${kept}`);
  document.hasFocus = () => true;
})();
"""

# Hides viser's panel (floating, docked, or as a sheet on a narrow screen) and its notifications.
_STYLE = """
html, body { overscroll-behavior: none; }
[data-floating-window], [data-dock-region], .mantine-Paper-root, .mantine-Notifications-root {
  display: none !important;
}
"""


@functools.cache
def scene_page() -> str:
    """Return viser's single-file client with the scripts and style of vfix before its own."""
    page = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    before, script_tag, after = page.partition("<script")
    if not script_tag:
        raise RuntimeError("viser's client has no script; the installed version is not the pinned one.")
    ours = [_SCRIPT, *((_FOLDER / name).read_text(encoding="utf-8") for name in _BEFORE)]
    scripts = "".join(f"<script>{script}</script>" for script in ours)
    return f"{before}<style>{_STYLE}</style>{scripts}{script_tag}{after}"
