"""viser's client as the page embeds it: the canvas alone, talking to our relay."""

import functools
from pathlib import Path

import viser

# The client reads its server from `?websocket=`, and looks for a lost server only while its document has the
# focus, which a frame often has not.
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

# viser's panel, floating, docked or as a narrow screen's sheet, and its notices are not part of our page.
_STYLE = """
html, body { overscroll-behavior: none; }
[data-floating-window], [data-dock-region], .mantine-Paper-root, .mantine-Notifications-root {
  display: none !important;
}
"""


@functools.cache
def scene_page() -> str:
    """viser's single-file client with our script and style ahead of its own."""
    page = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    before, script_tag, after = page.partition("<script")
    if not script_tag:
        raise RuntimeError("viser's client has no script; the installed version is not the pinned one.")
    return f"{before}<style>{_STYLE}</style><script>{_SCRIPT}</script>{script_tag}{after}"
