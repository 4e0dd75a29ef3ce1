"""Anderson acceleration of a linear problem."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from softbody_core.ground.anderson import Anderson


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 6))
def test_anderson_solves_a_linear_problem_like_gmres(seed, size):
    """Walker & Ni 2011: with everything kept it is GMRES, which needs as many steps as unknowns."""
    generator = np.random.default_rng(seed)
    noise = generator.normal(size=(size, size))
    matrix = np.eye(size) + 0.5 * noise / np.linalg.norm(noise, 2)
    b, x = generator.normal(size=(2, size))
    exact, accelerate = np.linalg.solve(matrix, b), Anderson(size)
    far = np.linalg.norm(x - exact)
    for _ in range(size + 1):
        x = accelerate.next(x, b - matrix @ x)
    # 1e-10 of regularization, times the condition of differences that are nearly parallel (1e-7 in
    # the worst of 4000 seeds); without acceleration up to 2^−(size + 1), 8e-3 at best, remains
    assert np.linalg.norm(x - exact) < 1e-5 * far
