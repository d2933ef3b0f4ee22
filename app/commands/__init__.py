"""The verbs of the command line: one module per verb.

A module gives `add_parser(subparsers) -> argparse.ArgumentParser` and `run(args) -> int | None`.
It is imported only when its verb is used, so it may have slow imports.
With `--json` it prints exactly one JSON object on stdout; messages go to stderr.
"""
