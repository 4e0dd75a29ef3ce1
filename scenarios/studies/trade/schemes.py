"""A scenario with another scheme, or with another value of the scheme's own accuracy."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

from scenarios.errors import ScenarioError
from scenarios.scene.scenario import Draft
from scenarios.scene.tables import choose
from softbody_core import INTEGRATORS
from softbody_core.integrators import Integrator

_NO_CONTROL: Final = 1e3
"""A tolerance that no step exceeds, so that none is repeated: a body moves by less than itself."""

_SOLVED: Final = 1e-6
"""Accuracy of implicit stages at the longest step, of the radius: a tenth of what the step errs."""


def with_integrator(draft: Draft, method: str) -> Draft:
    """Change the scheme; the options in the scenario stay with the scheme that they are for."""
    if isinstance(draft.read("integrator"), choose(method, INTEGRATORS, "integrator")):
        return draft
    return draft.changed({"integrator": {"method": method}})


def with_inner_step(draft: Draft, share: float) -> Draft | None:
    """Set the inner step to a share of the longest that the scheme takes by itself.

    That is the stability limit for an explicit scheme. For an implicit one it is the communication
    step; error control is off, and stages are solved as far as the error of the step is worth. For
    a quasi-static one it is the spacing of the shapes that it works out.

    Parameters
    ----------
    draft : Draft
        With the scheme.
    share : float
        More than 0 and at most 1.

    Returns
    -------
    Draft or None
        None for a scheme without inner steps, but at share 1.
    """
    if not 0 < share <= 1:
        raise ScenarioError(f"dt = {share:g}: expected a share, more than 0 and at most 1")
    integrator = draft.read("integrator")
    options = _options(integrator)
    if "safety" in options:
        changes = {"integrator.safety": share * options["safety"]}
        if options["max_substep"] is not None:
            changes["integrator.max_substep"] = share * options["max_substep"]
    elif "max_step" in options:
        changes = {
            "integrator.max_step": share * draft.read("coupling").step,
            "integrator.tolerance": _NO_CONTROL,
        }
        if "solver_accuracy" in options:
            changes["integrator.solver_accuracy"] = _SOLVED * share**2 / _NO_CONTROL
        if "max_iterations" in options:
            changes["integrator.max_iterations"] = 200
    elif "spacing" in options:
        changes = {"integrator.spacing": share * options["spacing"]}
    else:
        return draft if share == 1 else None
    return draft.changed({"integrator.method": _name_of(integrator), **changes})


def with_tolerance(draft: Draft, tolerance: float) -> Draft | None:
    """Set the tolerance; None for a scheme without one."""
    if "tolerance" not in _options(draft.read("integrator")):
        return None
    return draft.changed({"integrator.tolerance": tolerance})


def _options(integrator: Any) -> dict[str, Any]:
    """Options of a scheme, and their values."""
    return {f.name: getattr(integrator, f.name) for f in dataclasses.fields(integrator)}


def _name_of(integrator: Integrator) -> str:
    return next(name for name, kind in INTEGRATORS.items() if type(integrator) is kind)
