"""Start the planner: create its private environment if there is none yet, then serve the page.

    python3 scripts/start.py                 set up, start, open the browser
    python3 scripts/start.py --setup-only    set up and stop
    python3 scripts/start.py --port 9000     further options go to `vfix serve`

Needs Python 3.11 or newer and nothing else.
"""

import os
import sys

from environment import SetUpFailed, ensure_environment, run_in_environment, use_new_enough_python


def main(arguments: "list[str]") -> int:
    """Set up and serve; return the exit status."""
    if "-h" in arguments or "--help" in arguments:
        print(__doc__)
        return 0
    try:
        use_new_enough_python()
        python = ensure_environment(with_tests=False)
    except SetUpFailed as reason:
        print(f"vfix: {reason}", file=sys.stderr)
        return 1
    if "--setup-only" in arguments:
        print("The environment is ready.")
        return 0
    command = ["-m", "app.cli", "serve", *arguments]
    if os.name == "posix":  # become the planner, so that stopping this process stops it
        os.chdir(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
        os.execv(str(python), [str(python), *command])
    return run_in_environment(python, *command)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
