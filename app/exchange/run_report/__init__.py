"""The printable report on one or several runs."""
