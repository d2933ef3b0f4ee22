"""Contents of a run's events as JSON: exact, and safe to read because no code named in the file is run.

Arrays are written as bytes. Records of this library (dataclasses and named tuples, such as a worker's plan) are
written as their class name and their fields; only records of this library are created on reading, and of modules that
are already loaded. A field of a dataclass with ``DERIVED`` as its metadata is not written.
"""

from __future__ import annotations

import base64
import sys
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np

from ..errors import InputError
from ..moved import current_class

_ROOT = "vfix_engine."
_CLASS, _ARRAY, _TUPLE = "§class", "§array", "§tuple"
_DERIVED = "derived"
DERIVED = {_DERIVED: True}  # metadata of a field that follows from the others; it has its default after reading


def to_plain(value: Any) -> Any:
    """Convert to values for JSON; the inverse is ``from_plain``. Raises InputError for unsupported types."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.ndarray):
        data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
        return {_ARRAY: data, "dtype": value.dtype.str, "shape": list(value.shape)}
    if isinstance(value, np.generic):
        return value.item()
    if is_dataclass(value) and not isinstance(value, type):
        return _record(value, [one.name for one in fields(value) if _DERIVED not in one.metadata])
    if isinstance(value, tuple):
        names = getattr(value, "_fields", None)
        return {_TUPLE: [to_plain(one) for one in value]} if names is None else _record(value, list(names))
    if isinstance(value, list):
        return [to_plain(one) for one in value]
    if isinstance(value, Mapping):
        return {str(key): to_plain(one) for key, one in value.items()}
    raise InputError(f"a run has no place for a {type(value).__name__}")


def from_plain(value: Any) -> Any:
    """Return the value that ``to_plain`` converted. Raises InputError for an unknown record."""
    if isinstance(value, list):
        return [from_plain(one) for one in value]
    if not isinstance(value, dict):
        return value
    if _ARRAY in value:
        data = np.frombuffer(base64.b64decode(value[_ARRAY]), dtype=np.dtype(value["dtype"]))
        return data.reshape(value["shape"]).copy()
    if _TUPLE in value:
        return tuple(from_plain(one) for one in value[_TUPLE])
    if _CLASS in value:
        return _made(_class_of(value[_CLASS]), {name: from_plain(one) for name, one in value["fields"].items()})
    return {key: from_plain(one) for key, one in value.items()}


def _record(value: Any, names: list[str]) -> dict[str, Any]:
    kind = type(value)
    inside = {name: to_plain(getattr(value, name)) for name in names}
    return {_CLASS: f"{kind.__module__}.{kind.__qualname__}", "fields": inside}


def _class_of(name: str) -> Any:
    """Return a record's class, from this library or from a module that the reading program has loaded."""
    module, kind = current_class(name)
    try:
        found = getattr(import_module(module) if module.startswith(_ROOT) else sys.modules[module], kind)
    except (ImportError, KeyError, AttributeError) as error:
        raise InputError(f"the run has a record '{name:.80}', which is not known here") from error
    if not (isinstance(found, type) and (is_dataclass(found) or hasattr(found, "_fields"))):
        raise InputError(f"the run has '{name:.80}' where a record is to be")
    return found


def _made(kind: Any, values: dict[str, Any]) -> Any:
    """Create the record with exactly these values, without its constructor, which might normalise them again.

    A field that came after the record was written has its default, which leaves a drive as it was without the field.
    """
    if hasattr(kind, "_fields"):
        return kind(**values)
    one = object.__new__(kind)
    for field in fields(kind):
        value = values.get(field.name, field.default)
        if value is MISSING:
            raise InputError(f"a record of the class {kind.__name__} lacks '{field.name}'")
        object.__setattr__(one, field.name, value)
    return one
