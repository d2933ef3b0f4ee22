"""The public port: guard, page, scene relay.

Every request, HTTP or WebSocket, passes `guard.Guard` before anything else sees it (deny by default).
The scene's server listens on loopback with its own secret and is reached only through `relay`.
"""
