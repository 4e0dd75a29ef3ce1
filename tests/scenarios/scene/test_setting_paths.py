"""Messages of cosim name settings; a user of a scenario reads where these are."""

from __future__ import annotations

import pytest

from cosim import CouplingError, FmuTimeoutError, WiringError
from cosim.errors import CosimError
from scenarios.scene.setting_paths import errors_with_paths, with_paths


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (FmuTimeoutError("raise time_limit. [ok] time_limit", ["time_limit"]), "raise controller."),
        (CouplingError("raise tolerance", ["tolerance"]), "raise coupling.tolerance"),
        (CouplingError("algorithm x fails", ["algorithm"]), "coupling.algorithm x fails"),
        (
            CouplingError("a communication step of 1 s", ["communication step"]),
            "a communication step (coupling.step) of 1 s",
        ),
        (WiringError("mapped in names", ["names"]), "mapped in [controller.ports]"),
        (WiringError("which names.n names", ["names.n"]), "which controller.ports.n names"),
    ],
)
def test_an_error_names_the_path_and_stays_what_it_is(error: CosimError, message: str) -> None:
    with pytest.raises(type(error)) as caught, errors_with_paths(), errors_with_paths():
        raise error
    assert str(caught.value).startswith(message)
    assert str(caught.value).count(".time_limit") <= 1  # a log is left as it is


def test_a_file_that_is_named_like_a_setting_keeps_its_name() -> None:
    text = with_paths("FMU a/time_limit.fmu: raise time_limit.", ["time_limit"])
    assert text == "FMU a/time_limit.fmu: raise controller.time_limit."
