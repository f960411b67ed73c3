"""The incremental predictive law against L. Wang's textbook example and plain linear algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reluctance import _core_parts

# L. Wang, Model Predictive Control System Design and Implementation Using MATLAB, 2009, ch. 1.
A_M, B_M, C_M, N_P, N_C = 0.8, 0.1, 1.0, 10, 4
DX, Y, REFERENCE = 0.1, 0.2, 1.0


def increments(r_w, *, a=A_M, b=B_M, c=(C_M,) * N_P, N_c=N_C):
    """dU of the core's law: it works in levels, whose differences are the increments."""
    displacement = np.array(
        _core_parts.incremental_mpc(
            N_p=N_P, N_c=N_c, r_w=1.0, a=a, b=b, c=list(c), error_free=[0.0] * N_P
        )[-1]
    )
    error = REFERENCE - (Y + np.array(c) * displacement * DX)
    *H, f, _ = _core_parts.incremental_mpc(
        N_p=N_P, N_c=N_c, r_w=r_w, a=a, b=b, c=list(c), error_free=list(error)
    )
    levels = np.linalg.solve(np.array(H), -np.array(f))
    return np.diff(levels, prepend=0.0)


def textbook(r_w, *, a=A_M, b=B_M, N_c=N_C):
    """dU from the augmented matrices, as the book builds them."""
    A = np.array([[a, 0], [C_M * a, 1]])
    B = np.array([[b], [C_M * b]])
    C = np.array([[0.0, 1.0]])
    powers = [np.linalg.matrix_power(A, j) for j in range(N_P + 1)]
    F = np.vstack([C @ p for p in powers[1:]])
    Phi = np.zeros((N_P, N_c))
    for row in range(N_P):
        for column in range(min(row + 1, N_c)):
            Phi[row, column] = (C @ powers[row - column] @ B)[0, 0]
    H = Phi.T @ Phi + r_w * np.eye(N_c)
    return np.linalg.solve(H, Phi.T @ (REFERENCE - F @ np.array([DX, Y]))), Phi, F


@pytest.mark.parametrize(
    ("r_w", "expected"),
    [(0.0, [7.2, -6.4, 0.0, 0.0]), (10.0, [0.1269, 0.1034, 0.0829, 0.0650])],
)
def test_law_gives_the_published_increments(r_w, expected):
    assert increments(r_w) == pytest.approx(expected, abs=6e-5)


def test_textbook_matrices_are_the_published_ones():
    _, Phi, F = textbook(0.0)
    assert (Phi.T @ Phi)[0, 0] == pytest.approx(1.1541, abs=5e-5)
    assert (Phi.T @ F)[0] == pytest.approx([9.2325, 3.2147], abs=5e-5)


@given(
    r_w=st.floats(0.01, 100),
    a=st.floats(0, 0.95),
    b=st.floats(0.05, 2),
    N_c=st.integers(1, N_P),
)
def test_law_equals_the_augmented_matrices(r_w, a, b, N_c):
    expected, _, _ = textbook(r_w, a=a, b=b, N_c=N_c)
    assert increments(r_w, a=a, b=b, N_c=N_c) == pytest.approx(expected, rel=1e-6, abs=1e-8)
