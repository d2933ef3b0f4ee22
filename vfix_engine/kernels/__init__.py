"""Infrastructure of compiled code: decorators, cache on disk, packed arrays, preparation before the first start."""

import os

from ..errors import VfixError

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
    # Without compilation, integers have no fixed width and their arithmetic differs.
    raise VfixError("NUMBA_DISABLE_JIT is set; vfix needs its kernels compiled: unset it and start again")
