"""Routes of the page: its HTML shell, the scripts of the tabs, and the documentation of the REST routes."""

import html
import re
from pathlib import Path
from typing import Any

from fastapi import APIRouter, HTTPException, Request
from starlette.responses import FileResponse, HTMLResponse

from app.tabs.registry import specs

_MODULE = re.compile(r"[a-z][a-z0-9-]*\.js")  # no path, no hidden file, nothing but scripts
WEB_DIR = Path(__file__).resolve().parent.parent / "web"


def page_router() -> APIRouter:
    """Routes / (the shell), /tabs/ (the tabs' panels) and /docs (the REST routes, without other hosts)."""
    router = APIRouter(include_in_schema=False)

    @router.get("/")
    async def shell() -> FileResponse:
        return FileResponse(WEB_DIR / "index.html", media_type="text/html")

    @router.get("/tabs/{name}/{module}")
    async def panel(name: str, module: str) -> FileResponse:
        """Return a script of a tab's folder: its panel, or a module that it imports."""
        folder = next((spec.folder for spec in specs() if spec.name == name), None)
        if folder is None or _MODULE.fullmatch(module) is None or not (folder / module).is_file():
            raise HTTPException(404, "There is no such panel.")
        return FileResponse(folder / module, media_type="text/javascript", headers={"Cache-Control": "no-cache"})

    @router.get("/docs")
    async def docs(request: Request) -> HTMLResponse:
        return HTMLResponse(_docs_page(request.app.openapi()))

    return router


def _docs_page(schema: dict[str, Any]) -> str:
    operations = [
        _operation(method, path, operation)
        for path, methods in schema["paths"].items()
        for method, operation in methods.items()
    ]
    title = html.escape(f"{schema['info']['title']} {schema['info']['version']}")
    intro = html.escape(schema["info"].get("description", ""))
    return _DOCS.format(title=title, intro=intro, operations="\n".join(operations))


def _operation(method: str, path: str, operation: dict[str, Any]) -> str:
    head = f"<h2><b>{html.escape(method.upper())}</b> <code>{html.escape(path)}</code></h2>"
    summary = f"<p>{html.escape(operation.get('description') or operation.get('summary', ''))}</p>"
    rows = [
        (parameter["name"], parameter["in"], _kind(parameter.get("schema", {})), parameter.get("required", False))
        for parameter in operation.get("parameters", ())
    ]
    body = operation.get("requestBody", {})
    rows += [
        ("body", content_type, _kind(content.get("schema", {})), body.get("required", False))
        for content_type, content in body.get("content", {}).items()
    ]
    answers = ", ".join(
        f"<code>{html.escape(status)}</code> {html.escape(answer.get('description', ''))}"
        for status, answer in operation.get("responses", {}).items()
    )
    return f"<section>{head}{summary}{_table(rows)}<p>Answers: {answers}</p></section>"


def _table(rows: list[tuple[str, str, str, bool]]) -> str:
    if not rows:
        return ""
    lines = "".join(
        f"<tr><td><code>{html.escape(name)}</code></td><td>{html.escape(place)}</td><td>{html.escape(kind)}</td>"
        f"<td>{'required' if required else ''}</td></tr>"
        for name, place, kind, required in rows
    )
    return f"<table>{lines}</table>"


def _kind(schema: dict[str, Any]) -> str:
    if "$ref" in schema:
        return str(schema["$ref"]).rsplit("/", 1)[-1]
    if "anyOf" in schema:
        return " or ".join(_kind(choice) for choice in schema["anyOf"])
    if schema.get("type") == "array":
        return f"list of {_kind(schema.get('items', {}))}"
    return str(schema.get("type", "any"))


_DOCS = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}: REST routes</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; max-width: 58rem; margin: 2rem auto; padding: 0 1rem; color: #1c2530; }}
section {{ border-top: 1px solid #d5dde5; padding: 0.5rem 0; }}
h2 {{ font-size: 1rem; margin: 0.5rem 0; }}
h2 b {{ display: inline-block; min-width: 4.5rem; color: #0b6a8f; }}
table {{ border-collapse: collapse; }}
td {{ padding: 0.15rem 1.2rem 0.15rem 0; vertical-align: top; }}
code {{ background: #eef2f6; padding: 0 0.25rem; border-radius: 3px; }}
</style></head>
<body><h1>{title}</h1><p>{intro}</p>
<p>Machine-readable: <a href="/openapi.json">/openapi.json</a>.
A script sends the planner's token as <code>Authorization: Bearer TOKEN</code>.</p>
{operations}
</body></html>
"""
