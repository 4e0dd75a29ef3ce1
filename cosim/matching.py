"""Which ports of a controller and of a body belong together: those of one name, or those named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from cosim.errors import nearest
from cosim.participant import Causality, Port
from cosim.units import unit

_OPPOSITE: Final = {
    Causality.INPUT: Causality.OUTPUT,
    Causality.OUTPUT: Causality.INPUT,
}


@dataclass(frozen=True)
class PortName:
    """What a body's port is called in an FMU.

    Attributes
    ----------
    variable : str
        Name of the FMU's port.
    unit : str or None
        Its unit, where the FMU declares none or a wrong one.
    """

    variable: str
    unit: str | None = None


@dataclass(frozen=True)
class Fault:
    """What keeps a controller from driving a body.

    Attributes
    ----------
    text : str
        To be read after "FMU X".
    settings : tuple of str
        As of `cosim.errors.CosimError`.
    """

    text: str
    settings: tuple[str, ...]


@dataclass(frozen=True)
class Matching:
    """Ports that belong together.

    Attributes
    ----------
    pairs : list of (str, str)
        A controller's port and the body's.
    faults : list of Fault
        What keeps the controller from driving the body.
    """

    pairs: list[tuple[str, str]]
    faults: list[Fault]


def match(
    controller: Mapping[str, Port], body: Mapping[str, Port], names: Mapping[str, PortName]
) -> Matching:
    """Find what each port of a controller connects to.

    Parameters
    ----------
    controller, body : mapping
        Their ports, by name.
    names : mapping
        By port of the body, which has to have it: its name in the controller, where that differs.

    Returns
    -------
    Matching
        A body's input that is not driven keeps its neutral value. An output of the controller that
        the body does not take belongs to nothing, and is no fault.
    """
    named = _named(controller, body, names)
    alike = _alike(controller, body, names, {variable for variable, _ in named.pairs})
    pairs = [*named.pairs, *alike.pairs]
    undriven = []
    if not any(body[name].causality is Causality.INPUT for _, name in pairs) and not named.faults:
        gives = sorted(n for n, port in controller.items() if port.causality is Causality.OUTPUT)
        undriven.append(
            Fault(
                f"cannot drive the body: it has neither {_inputs(body)}; its outputs are: "
                f"{', '.join(gives) or 'none'}. Another name is mapped in names",
                ("names",),
            )
        )
    return Matching(pairs, [*named.faults, *undriven, *alike.faults])


def _inputs(body: Mapping[str, Port]) -> str:
    """What a controller may drive."""
    inputs = [port for port in body.values() if port.causality is Causality.INPUT]
    return " nor ".join(
        f"an output {port.name} ({'no unit' if port.unit is None else port.unit.symbol})"
        for port in inputs
    )


def _named(
    controller: Mapping[str, Port], body: Mapping[str, Port], names: Mapping[str, PortName]
) -> Matching:
    """Match ports that are named."""
    pairs, faults = [], []
    for port, name in names.items():
        wanted = _OPPOSITE[body[port].causality]
        fitting = [n for n, p in controller.items() if p.causality is wanted]
        if name.variable in fitting:
            pairs.append((name.variable, port))
        else:
            faults.append(
                Fault(
                    f"has no {wanted.value} {name.variable!r}, which names.{port} names; "
                    f"{nearest(name.variable, fitting)}",
                    (f"names.{port}",),
                )
            )
    return Matching(pairs, faults)


def _alike(
    controller: Mapping[str, Port],
    body: Mapping[str, Port],
    names: Mapping[str, PortName],
    done: set[str],
) -> Matching:
    """Match the others by their own name; an input that is driven by a named port is taken."""
    pairs, faults = [], []
    offered = [n for n, port in body.items() if port.causality is Causality.OUTPUT]
    for variable, port in controller.items():
        if variable in done:
            continue
        if port.causality is Causality.OUTPUT:
            driven = variable in body and body[variable].causality is Causality.INPUT
            if driven and variable not in names:
                pairs.append((variable, variable))
        elif variable in offered:
            pairs.append((variable, variable))
        else:
            faults.append(
                Fault(
                    f"has an input {variable!r} that the body does not give; "
                    f"{nearest(variable, offered)}. Another name is mapped in names",
                    ("names",),
                )
            )
    return Matching(pairs, faults)


def with_units(ports: Mapping[str, Port], names: Mapping[str, PortName]) -> dict[str, Port]:
    """Ports of a controller, with the units that `names` gives in place of its own."""
    units = {name.variable: unit(name.unit) for name in names.values() if name.unit is not None}
    return {
        variable: replace(port, unit=units.get(variable, port.unit))
        for variable, port in ports.items()
    }
