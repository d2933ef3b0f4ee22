"""The query on a GPU: Kwok 2013, eq. 1-9 and section III.A.3, in float64 through numba-cuda (extra ``gpu``).

The kernel evaluates ``section.signed_distance``, the same function that is the reference for the CPU's query. As in
the paper a thread processes a few vertices, and the segments of the window are in shared memory. A thread skips
segments whose ball is farther away than a distance already found, and stops at a vertex that is inside a segment.
Each block returns its deepest vertex; the CPU selects the deepest of these few. So a query is one copy to the GPU, one
kernel and one copy back.

The kernel is in ``gpu_kernel.py``, and numba's CUDA part is loaded only when a query is created. With
NUMBA_ENABLE_CUDASIM=1, set before Python starts, numba simulates it on the CPU, thread by thread, for tests.
"""

from __future__ import annotations

import importlib
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, IntArray
from ...errors import InputError, VfixError
from .query import Deviations, Query

if TYPE_CHECKING:  # the query does not depend on the robots' libraries at run time
    from ...robots.snake_surface import LinkVertices
    from ..packed import PackedPathway


THREADS = 128  # per block
MOST_BLOCKS = 512  # per link; with more vertices a thread processes several
ASKED = 14  # inputs per link and pose: its frame row by row, first and last segment
FOUND = 3  # results per block: depth, vertex, segment


class GpuUnavailable(VfixError):
    """There is no GPU, or a library that numba needs to use it is not installed."""


def available() -> bool:
    """Whether there is a GPU that numba can use; the simulator does not count."""
    try:
        cuda = importlib.import_module("numba.cuda")
        return not _simulated() and bool(cuda.is_available())
    except Exception:  # numba's CUDA part fails in many ways if a driver or toolkit is missing or incomplete
        return False


def name() -> str:
    """Name of the GPU.

    Raises:
        GpuUnavailable: there is none.
    """
    cuda = _cuda()
    if _simulated():
        return "numba's simulator"
    device = cuda.get_current_device().name
    return str(device.decode() if isinstance(device, bytes) else device)


class GpuQuery:
    """As ``query.Query``, on a GPU: queries one snake's vertices, which stay in GPU memory, for any pathway and pose.

    Not thread-safe.
    """

    def __init__(self, snake_vertices: LinkVertices, threads: int = THREADS) -> None:
        """``threads``: per block, a power of two.

        Raises:
            GpuUnavailable: there is neither a GPU nor a simulator.
            InputError: a vertex is not finite, a link has none, or the number of threads is not supported.
        """
        if not 1 <= threads <= 1024 or threads & (threads - 1):
            raise InputError(f"a block has a power of two of threads, up to 1024, not {threads}")
        self.vertices, self._threads = snake_vertices, threads
        points, start = np.array(snake_vertices.points, dtype=np.float64), np.array(snake_vertices.start)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise InputError("vertices of a snake are finite points (V, 3) in mm")
        if len(start) < 2 or start[0] != 0 or start[-1] != len(points) or np.diff(start).min() < 1:
            raise InputError("a link has no vertices")
        # Poses and windows are validated by a CPU query with one vertex per link.
        corners = type(snake_vertices)(points[start[:-1]], np.arange(len(start), dtype=np.int64))
        self._judge = Query(corners)
        self.links = len(start) - 1
        self._cuda = _cuda()
        self._kernel = importlib.import_module(".gpu_kernel", __package__).deviation_kernel(threads)
        self._blocks = min(-(-int(np.diff(start).max()) // threads), MOST_BLOCKS)
        self._stream = self._cuda.stream()
        self._points = self._cuda.to_device(points)
        self._start = self._cuda.to_device(start.astype(np.int64))
        self._sent: tuple[Any, Any] | None = None  # vertices in the patient frame, on host and device
        self._packed: PackedPathway | None = None
        self._workspace: _Workspace | None = None
        self._grid: tuple[int, Any] | None = None

    def deviations(self, packed: PackedPathway, frames: ArrayLike, windows: ArrayLike | tuple[int, int]) -> Deviations:
        """Deviation d_l of each link in mm (Kwok 2013, eq. 9), with a vertex and a segment that cause it.

        Arguments, shapes and errors are those of ``Query.deviations``. A pathway is copied to the GPU if it is another
        object than the previous one, or if its arrays are writable.
        """
        poses, window = self._judge.checked(packed, frames, windows)
        found = self._asked(packed, poses, window, self._points)
        return found if np.ndim(frames) == 4 else Deviations(*(each[0] for each in found))

    def deviations_of(
        self, points: ArrayLike, packed: PackedPathway, windows: ArrayLike | tuple[int, int]
    ) -> Deviations:
        """Deviations of vertices (V, 3) given in the patient frame in mm, in the order of the snake's own.

        They are copied at every call, as in the paper.

        Raises:
            InputError: points of another shape or not finite; an empty window.
        """
        places = np.asarray(points, dtype=np.float64)
        if places.shape != self._points.shape or not np.isfinite(places).all():
            raise InputError(f"vertices are finite and {self._points.shape} in mm, not {places.shape}")
        at_rest = np.tile(np.eye(4)[:3], (self.links, 1, 1))
        poses, window = self._judge.checked(packed, at_rest, windows)
        if self._sent is None:
            self._sent = self._cuda.pinned_array(places.shape), self._cuda.device_array(places.shape)
        sent, there = self._sent
        sent[:] = places
        there.copy_to_device(sent, self._stream)
        found = self._asked(packed, poses, window, there)
        return Deviations(*(each[0] for each in found))

    def _asked(self, packed: PackedPathway, poses: Array, window: IntArray, points: Any) -> Deviations:
        """Compute the deviations (K, L) of the poses (K, L, 3, 4)."""
        count, links = len(poses), self.links
        if self._workspace is None or not self._workspace.fits(count, packed):
            self._workspace, self._packed = _Workspace(self._cuda, count, links, self._blocks, packed), None
        buffers, stream = self._workspace, self._stream
        buffers.asked[:count, :, :12] = poses.reshape(count, links, 12)
        buffers.asked[:count, :, 12:] = window
        anew = self._packed is not packed or packed.rows.flags.writeable or packed.polar.flags.writeable
        buffers.send(packed if anew else None, stream)
        self._packed = packed
        self._launch(count * links)(
            points,
            self._start,
            buffers.asked_there,
            buffers.rows_there,
            buffers.polar_there,
            buffers.found_there,
        )
        received = buffers.receive(count * links, stream)
        deepest = received[:, :, 0].argmax(axis=1)  # of equal ones the first
        best = received[np.arange(count * links), deepest].reshape(count, links, FOUND)
        return Deviations(best[:, :, 0].copy(), best[:, :, 1].astype(np.int64), best[:, :, 2].astype(np.int64))

    def _launch(self, links: int) -> Any:
        """Kernel configured for that many links, over all poses."""
        if self._grid is None or self._grid[0] != links:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that few vertices underuse the GPU
                self._grid = links, self._kernel[(links, self._blocks), self._threads, self._stream]
        return self._grid[1]


class _Workspace:
    """Host and device memory for up to that many poses with a pathway of a given size.

    Poses, rows and radii are contiguous, so that all changes are sent in one copy.
    """

    def __init__(self, cuda: Any, poses: int, links: int, blocks: int, packed: PackedPathway) -> None:
        self._shapes = packed.rows.shape, packed.polar.shape
        self._head = poses * links * ASKED
        rows = packed.rows.size
        size = self._head + rows + packed.polar.size
        self._here, self._there = cuda.pinned_array(size), cuda.device_array(size)
        self.asked: Array = self._here[: self._head].reshape(poses, links, ASKED)
        self._asked_flat = self._there[: self._head]
        self.asked_there = self._asked_flat.reshape(poses * links, ASKED)
        self.rows_there = self._there[self._head : self._head + rows].reshape(*packed.rows.shape)
        self.polar_there = self._there[self._head + rows :].reshape(*packed.polar.shape)
        self._found: Array = cuda.pinned_array((poses * links, blocks, FOUND))
        self.found_there = cuda.device_array((poses * links, blocks, FOUND))

    def fits(self, poses: int, packed: PackedPathway) -> bool:
        return poses <= len(self.asked) and (packed.rows.shape, packed.polar.shape) == self._shapes

    def send(self, packed: PackedPathway | None, stream: Any) -> None:
        """Send the inputs, and the pathway if given, in one copy."""
        if packed is None:
            self._asked_flat.copy_to_device(self._here[: self._head], stream)
            return
        self._here[self._head :] = np.concatenate([packed.rows.ravel(), packed.polar.ravel()])
        self._there.copy_to_device(self._here, stream)

    def receive(self, links: int, stream: Any) -> Array:
        """Wait for the GPU and return the results of that many links, (links, blocks, 3)."""
        there, here = self.found_there, self._found
        if links < len(here):
            there, here = there[:links], here[:links]
        there.copy_to_host(here, stream)
        stream.synchronize()
        return here


def _cuda() -> Any:
    """Import numba's CUDA part.

    Raises:
        GpuUnavailable: there is neither a GPU nor a simulator.
    """
    try:
        cuda = importlib.import_module("numba.cuda")
        usable = _simulated() or bool(cuda.is_available())
    except Exception as error:
        raise GpuUnavailable(f"numba cannot use a GPU here: {error}") from error
    if not usable:
        raise GpuUnavailable("numba finds no GPU here; it takes a driver, a CUDA toolkit and pip install 'vfix[gpu]'")
    return cuda


def _simulated() -> bool:
    return bool(importlib.import_module("numba").config.ENABLE_CUDASIM)
