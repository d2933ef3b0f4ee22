"""What compiled code needs: the decorator, the cache on disk, packed arrays, preparation at a first start."""

import os

from ..errors import VfixError

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
    # Uncompiled, the kernels' whole numbers have no width and their arithmetic is another.
    raise VfixError("NUMBA_DISABLE_JIT is set; vfix needs its kernels compiled: unset it and start again")
