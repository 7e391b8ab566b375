"""Simulations as a command line names them: a few options, and `NAME=VALUE` for any other value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from pondwatch.core.errors import Invalid

from .radio import RadioSpec
from .spec import SimulationSpec

_TRUTH = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


def specs_of(named: Mapping[str, Any], settings: Sequence[str]) -> tuple[SimulationSpec, RadioSpec]:
    """What to simulate and how it arrives.

    Args:
        named: values of the simulation by name.
        settings: `NAME=VALUE`; these win. A name is one of `SimulationSpec` or of `RadioSpec`.

    Raises:
        Invalid: a name that is in neither, or a value of another kind or out of its range.
    """
    of_spec, of_radio = dict(named), {}
    defaults = _defaults(SimulationSpec()), _defaults(RadioSpec())
    for setting in settings:
        name, equals, text = setting.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or (name not in defaults[0] and name not in defaults[1]):
            known = ", ".join(sorted(defaults[0] | defaults[1]))
            raise Invalid(f"--set {setting!r}: must be NAME=VALUE with one of {known}.", field=name)
        if name in defaults[0]:
            of_spec[name] = _value(name, text.strip(), defaults[0][name])
        else:
            of_radio[name] = _value(name, text.strip(), defaults[1][name])
    spec = SimulationSpec(**of_spec)
    spec.check()
    return spec, RadioSpec(**of_radio)


def _defaults(spec: SimulationSpec | RadioSpec) -> dict[str, Any]:
    plain = ((field.name, getattr(spec, field.name)) for field in fields(spec))
    return {name: value for name, value in plain if isinstance(value, bool | int | float | str)}


def _value(name: str, text: str, default: Any) -> Any:
    """The text as a value of the default's kind."""
    try:
        return _TRUTH[text.lower()] if isinstance(default, bool) else type(default)(text)
    except (KeyError, ValueError):
        raise Invalid(f"{name} must be of the kind of {default!r}, and is {text!r}.", field=name) from None
