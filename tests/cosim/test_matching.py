from __future__ import annotations

import pytest

from cosim import Causality, Port, UnitError, unit
from cosim.matching import PortName, match, with_units
from cosim.soft_body import body_ports
from tests.cosim.helpers import port

IN, OUT = Causality.INPUT, Causality.OUTPUT


def ports(*rows: tuple[str, Causality]) -> dict[str, Port]:
    return {name: port(name, None, causality) for name, causality in rows}


def test_ports_of_one_name_and_opposite_causality_belong_together() -> None:
    controller_ports = ports(("delta_p", OUT), ("volume", IN), ("phase", OUT), ("flow", OUT))
    matching = match(controller_ports, body_ports(), {})
    assert matching.pairs == [("delta_p", "delta_p"), ("volume", "volume")]
    assert matching.faults == []


def test_a_named_port_comes_before_one_of_the_same_name() -> None:
    controller_ports = ports(("delta_p", OUT), ("Paw", OUT), ("volume", IN), ("V", IN))
    names = {"delta_p": PortName("Paw"), "volume": PortName("V")}
    matching = match(controller_ports, body_ports(), names)
    # The body's input is taken; its output may go to two.
    assert matching.pairs == [("Paw", "delta_p"), ("V", "volume"), ("volume", "volume")]
    assert matching.faults == []


def test_a_controller_may_be_driven_by_nothing() -> None:
    assert match(ports(("n", OUT)), body_ports(), {}).pairs == [("n", "n")]


@pytest.mark.parametrize("rows", [[], [("volume", IN)], [("delta_p", IN), ("Paw", OUT)]])
def test_what_drives_nothing_is_a_fault(rows: list[tuple[str, Causality]]) -> None:
    assert match(ports(*rows), body_ports(), {}).faults[0].text.startswith("cannot drive the body")


def test_faults_of_names_come_first_and_stand_for_what_follows_from_them() -> None:
    controller_ports = ports(("Paw", OUT), ("heart_rate", IN))
    faults = match(controller_ports, body_ports(), {"delta_p": PortName("Pow")}).faults
    assert len(faults) == 2
    assert faults[0].text.startswith("has no output 'Pow', which names.delta_p names; did ")
    assert faults[1].text.startswith("has an input 'heart_rate' that the body does not give")


def test_units_that_are_given_stand_for_the_others() -> None:
    controller_ports = {"V": port("V", "L", IN), "Paw": port("Paw", None, OUT)}
    given = with_units(
        controller_ports, {"volume": PortName("V", "mL"), "delta_p": PortName("Paw", "hPa")}
    )
    assert (given["V"].unit, given["Paw"].unit) == (unit("mL"), unit("hPa"))
    assert with_units(controller_ports, {"volume": PortName("V")}) == controller_ports


def test_a_unit_that_is_unknown_is_refused() -> None:
    with pytest.raises(UnitError, match="'puff' is not known"):
        with_units({"V": port("V", None, IN)}, {"volume": PortName("V", "puff")})
