"""The verbs of the command line: one module per verb.

A module gives `add_parser(subparsers) -> argparse.ArgumentParser` and `run(args) -> int | None`.
It is imported only when its verb is asked for, so what it needs may be heavy.
With `--json` it prints one JSON object on stdout and nothing else there; words for people go to stderr.
"""
