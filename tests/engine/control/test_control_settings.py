"""Settings: every value in range or refused, clamped where a person moves a slider."""

import math
from typing import Any

import pytest

from vfix_engine.control import ControlSettings
from vfix_engine.control.settings import RETIRED
from vfix_engine.errors import InputError


def test_every_field_has_a_bound_that_its_default_meets() -> None:
    assert set(ControlSettings.bounds()) == set(ControlSettings().to_dict())


@pytest.mark.parametrize("name", list(ControlSettings.bounds()))
@pytest.mark.parametrize("value", [math.nan, math.inf, -1e9, 1e9])
def test_nonsense_is_refused(name: str, value: float) -> None:
    """HAZ-05."""
    with pytest.raises(InputError, match=name):
        ControlSettings(**{name: value})


@pytest.mark.parametrize("value", [True, "1", None])
def test_what_is_no_number_is_no_setting(value: Any) -> None:
    """HAZ-05: a true is no millimetre."""
    for make in (ControlSettings, ControlSettings().clamped):
        with pytest.raises(InputError, match="margin_mm"):
            make(margin_mm=value)


def test_an_integer_beyond_every_float_is_refused_or_clamped() -> None:
    with pytest.raises(InputError, match="margin_mm"):
        ControlSettings(margin_mm=10**400)
    assert ControlSettings().clamped(margin_mm=10**400).margin_mm == ControlSettings.bounds()["margin_mm"].high


@pytest.mark.parametrize("name", list(ControlSettings.bounds()))
def test_a_slider_is_clamped(name: str) -> None:
    bound = ControlSettings.bounds()[name]
    assert getattr(ControlSettings().clamped(**{name: 1e12}), name) == bound.high
    assert getattr(ControlSettings().clamped(**{name: -1e12}), name) == bound.low
    with pytest.raises(InputError):
        ControlSettings().clamped(**{name: math.nan})


def test_round_trip_and_unknown_names() -> None:
    settings = ControlSettings(margin_mm=0.5)
    assert ControlSettings.from_dict(settings.to_dict()) == settings
    with pytest.raises(InputError, match="margn"):
        ControlSettings.from_dict({"margn": 1.0})


@pytest.mark.parametrize("value", [0.0, 2.0, 10.0])
def test_a_retired_name_of_an_older_plan_is_passed_over(value: float) -> None:
    assert ControlSettings.from_dict({"group_flat_mm": value, "margin_mm": 0.5}) == ControlSettings(margin_mm=0.5)
    with pytest.raises(InputError, match="unknown settings: group_flat;"):  # that one name, nothing like it
        ControlSettings.from_dict({"group_flat_mm": value, "group_flat": value})
    with pytest.raises(InputError, match="no setting is called"):  # and nobody sets it any more
        ControlSettings().clamped(group_flat_mm=value)
    assert not RETIRED & set(ControlSettings.bounds())
