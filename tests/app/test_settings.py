"""Settings: where they come from and what is refused."""

from pathlib import Path

import pytest

from app.gateway.addresses import allowed_hosts, login_url
from app.settings import Settings
from vfix_engine.errors import InputError

TOKEN = "a-token-of-our-own"


def test_defaults_are_loopback_with_a_fresh_token() -> None:
    first, second = Settings.from_environment({}), Settings.from_environment({})
    assert first.host == "127.0.0.1"
    assert first.port == 8765
    assert first.is_loopback
    assert len(first.token) >= 43
    assert first.token != second.token
    assert first.token not in repr(first)


def test_the_environment_and_what_overrides_it(tmp_path: Path) -> None:
    environment = {"VFIX_HOME": str(tmp_path), "VFIX_PORT": "9000", "VFIX_TOKEN": TOKEN, "VFIX_HOST": "localhost"}
    settings = Settings.from_environment(environment, port=9001, host=None)
    assert settings == Settings(home=tmp_path.resolve(), host="localhost", port=9001, token=TOKEN)


@pytest.mark.parametrize(
    ("environment", "words"),
    [
        ({"VFIX_PORT": "http"}, "VFIX_PORT"),
        ({"VFIX_PORT": "70000"}, "70000"),
        ({"VFIX_TOKEN": "short"}, "16"),
        ({"VFIX_TOKEN": "with spaces and; semicolons"}, "may hold"),
        ({"VFIX_TOKEN": "snow\N{SNOWMAN}" * 8}, "ASCII"),
        ({"VFIX_HOST": "192.0.2.7"}, "--allow-remote"),
        ({"VFIX_HOST": "0.0.0.0"}, "--allow-remote"),
    ],
)
def test_what_is_refused(environment: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Settings.from_environment(environment)


@pytest.mark.parametrize(
    ("host", "names"),
    [
        ("127.0.0.1", {"127.0.0.1:8765", "localhost:8765"}),
        ("localhost", {"127.0.0.1:8765", "localhost:8765"}),
        ("::1", {"[::1]:8765", "localhost:8765"}),
        ("192.0.2.7", {"192.0.2.7:8765"}),
        ("2001:db8::7", {"[2001:db8::7]:8765"}),
    ],
)
def test_the_names_it_answers_to(host: str, names: set[str]) -> None:
    assert allowed_hosts(Settings(home=Path(), host=host, token=TOKEN, allow_remote=True)) == names


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_wildcard_address_has_no_name(host: str) -> None:
    with pytest.raises(InputError, match="name the one address"):
        allowed_hosts(Settings(home=Path(), host=host, token=TOKEN, allow_remote=True))


def test_the_address_with_its_token() -> None:
    assert login_url(Settings(home=Path(), host="::1", token=TOKEN)) == f"http://[::1]:8765/?token={TOKEN}"
