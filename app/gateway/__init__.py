"""The one public door: guard, page, scene relay.

Every request, HTTP or WebSocket, passes `guard.Guard` before anything else sees it (deny by default).
The scene's own server listens on loopback behind a second lock and is reached only through `relay`.
"""
