"""The messages that a scene may send: camera, click and drag, each exactly as viser defines it.

All other messages of viser's client are refused: uploads, browser storage, the public share tunnel, values of controls,
rendered pictures. Classes and fields are named as in viser; a test ties them to the pinned version.
"""

from typing import Annotated, Literal

import msgspec

_Pair = tuple[float, float]
_Triple = tuple[float, float, float]
_Word = Annotated[str, msgspec.Meta(max_length=200)]


class _Message(msgspec.Struct, tag_field="type", tag=True, forbid_unknown_fields=True):
    """A message encoded as one map, whose 'type' is the name of its class."""


class ViewerCameraMessage(_Message):
    wxyz: tuple[float, float, float, float]
    position: _Triple
    fov: float
    near: float
    far: float
    image_height: int
    image_width: int
    look_at: _Triple
    up_direction: _Triple


class ScenePointerMessage(_Message):
    event_type: Literal["click"]
    ray_origin: _Triple
    ray_direction: _Triple
    screen_pos: tuple[_Pair]
    modifier: _Word | None


class SceneNodeDragMessage(_Message):
    phase: Literal["start", "update", "end"]
    name: _Word
    instance_index: int | None
    start_position: _Triple
    start_screen_pos: _Pair
    end_position: _Triple
    end_screen_pos: _Pair
    button: Literal["left", "middle", "right"]
    modifier: _Word | None
    owner: _Word = ""


ALLOWED_MESSAGES = (ViewerCameraMessage, ScenePointerMessage, SceneNodeDragMessage)
_DECODER = msgspec.msgpack.Decoder(ViewerCameraMessage | ScenePointerMessage | SceneNodeDragMessage)


def is_allowed(data: bytes) -> bool:
    """Return whether a WebSocket frame of a browser is exactly one of the allowed messages."""
    try:
        _DECODER.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return False
    return True
