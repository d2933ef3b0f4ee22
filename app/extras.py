"""What `pip install vfix` leaves out: the page, the store and the server, which the extra `app` brings."""

from importlib.util import find_spec

from vfix_engine.errors import VfixError

# Names to import of the packages of the extra `app` in pyproject.toml.
APP_MODULES = (
    "alembic",
    "fastapi",
    "fastcrc",
    "pydantic",
    "python_multipart",
    "sqlalchemy",
    "starlette",
    "uvicorn",
    "viser",
    "websockets",
)


class AppMissing(VfixError):
    """Something needs the page, the store or the server, and they are not installed."""


def missing_modules() -> tuple[str, ...]:
    """Those of `APP_MODULES` that are not installed; nothing is imported."""
    return tuple(name for name in APP_MODULES if find_spec(name) is None)


def has_app() -> bool:
    """Whether the page, the store and the server are installed."""
    return not missing_modules()


class ExtraMissing(VfixError):
    """Something needs packages of an extra that is not installed."""


def need_extra(what: str, extra: str) -> ExtraMissing:
    """The error of ``what``, the subject of a sentence, which needs the packages of an extra."""
    return ExtraMissing(f"{what} needs more packages (pip install 'vfix[{extra}]').")


def need_app(what: str) -> AppMissing:
    """The error of ``what``, the subject of a sentence, which needs the extra."""
    return AppMissing(f"{what} needs the page, the store and the server: pip install 'vfix[app]'.")
