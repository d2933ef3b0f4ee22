"""Records packed into one array, with named views for Python and compiled code.

A record is a ``NamedTuple`` whose annotations give the shapes of its fields: ``q: Annotated[Array, "n"]``.
Offsets, total size and views are derived from these annotations.
"""

from __future__ import annotations

from typing import Any, NamedTuple, get_args, get_type_hints

import numpy as np

from ..arrays import Array
from .compiled import shared
from .views import view


class Packing(NamedTuple):
    """Layout of a record; ``sizes`` are the values of the names in its shapes, in the order of ``names``.

    views(array, *sizes): the record with views of ``array`` as its fields; a field of shape () is a number. For Python
        and compiled code.
    size(*sizes): length of the array.
    places(*sizes): name → (first, last, shape) of each field.
    """

    views: Any
    size: Any
    places: Any


def packing(record: type[Any], *names: str) -> Packing:
    """Return the packing of a record (a NamedTuple class) whose shapes are integers and expressions of ``names``."""
    shapes = {name: get_args(hint)[1:] for name, hint in get_type_hints(record, include_extras=True).items()}
    lines, values, places, offset = [], [], [], "0"
    for i, (name, shape) in enumerate(shapes.items()):
        if not shape:
            raise TypeError(f"{record.__name__}.{name} has no shape")
        sizes = [str(size) for size in shape if size != ()]
        lines.append(f"    o{i} = {offset}")
        values.append(f"view(array, o{i}, ({', '.join(sizes)},))" if sizes else f"array[o{i}]")
        places.append(f"'{name}': (o{i}, o{i + 1}, ({''.join(f'{size}, ' for size in sizes)}))")
        offset = f"o{i} + " + (" * ".join(f"({size})" for size in sizes) or "1")
    arguments = ", ".join(names)
    body = "\n".join(lines)
    source = (
        f"def views(array, {arguments}):\n{body}\n    return record({', '.join(values)})\n"
        f"def size({arguments}):\n{body}\n    return {offset}\n"
        f"def places({arguments}):\n{body}\n    o{len(shapes)} = {offset}\n    return {{{', '.join(places)}}}\n"
    )
    made: dict[str, Any] = {"view": view, "record": record}
    exec(source, made)
    return Packing(shared(made["views"]), shared(made["size"]), made["places"])


def packed(record: Any) -> Array:
    """Pack the fields of a record into one array, in the order of ``views``."""
    return np.concatenate([np.ravel(np.asarray(value, dtype=np.float64)) for value in record])
