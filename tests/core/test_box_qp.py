"""Box-constrained quadratic program of the controller: optimality, feasibility, termination."""

from collections.abc import Callable

import daqp
import numpy as np
import pytest
from numpy.typing import NDArray

from reluctance import _core_parts

Array = NDArray[np.float64]
Problem = tuple[Array, Array, Array, Array]  # H (p, n, n), f, lo, hi (p, n)

SIZES = (2, 3, 4, 6, 9, 12, 18, 24)
PER_CASE = 200  # 7 families x 8 sizes x 200 = 11 200 problems
EPS_SINGLE = float(np.finfo(np.float32).eps)


def spectrum(rng: np.random.Generator, p: int, n: int, cond_max: float) -> Array:
    """Random orthogonal basis, eigenvalues log-uniform, condition number up to cond_max."""
    basis, _ = np.linalg.qr(rng.standard_normal((p, n, n)))
    eigenvalues = cond_max ** -rng.uniform(0, 1, (p, n))
    H = (basis * eigenvalues[:, None, :]) @ basis.transpose(0, 2, 1)
    return np.asarray((H + H.transpose(0, 2, 1)) / 2)


def boxes(rng: np.random.Generator, p: int, n: int) -> tuple[Array, Array]:
    centre = rng.standard_normal((p, n))
    width = 10 ** rng.uniform(-2, 1, (p, n))
    return centre - width, centre + width


def around(rng: np.random.Generator, H: Array, lo: Array, hi: Array) -> Array:
    """f whose unconstrained minimum lies around the box, in it or out of it."""
    p, n = lo.shape
    target = (lo + hi) / 2 + rng.standard_normal((p, n)) * (hi - lo)
    return np.asarray(-np.einsum("pij,pj->pi", H, target))


def dense(rng: np.random.Generator, p: int, n: int) -> Problem:
    H, (lo, hi) = spectrum(rng, p, n, 1e4), boxes(rng, p, n)
    return H, around(rng, H, lo, hi), lo, hi


def torque_like(rng: np.random.Generator, p: int, n: int) -> Problem:
    """One torque row per three inputs, r_w on the diagonal, voltages within +-1."""
    G = rng.standard_normal((p, -(-n // 3), n))
    H = G.transpose(0, 2, 1) @ G + 10 ** rng.uniform(-3, -1, (p, 1, 1)) * np.eye(n)
    f = np.asarray(-np.einsum("pmi,pm->pi", G, 3 * rng.standard_normal(G.shape[:2])))
    return H, f, np.full((p, n), -1.0), np.full((p, n), 1.0)


def duplicated(rng: np.random.Generator, p: int, n: int) -> Problem:
    """Equal columns, told apart by r_w alone."""
    G = np.repeat(rng.standard_normal((p, n, -(-n // 2))), 2, axis=2)[:, :, :n]
    H = G.transpose(0, 2, 1) @ G + 1e-3 * n * np.eye(n)
    lo, hi = boxes(rng, p, n)
    return H, around(rng, H, lo, hi), lo, hi


def pinned(rng: np.random.Generator, p: int, n: int) -> Problem:
    """lo == hi in about a third of the variables."""
    H, f, lo, hi = dense(rng, p, n)
    return H, f, lo, np.where(rng.uniform(size=(p, n)) < 0.33, lo, hi)


def degenerate(rng: np.random.Generator, p: int, n: int) -> Problem:
    """Optimum on bounds of which about half have a multiplier of zero."""
    H, (lo, hi) = spectrum(rng, p, n, 1e4), boxes(rng, p, n)
    side = rng.integers(0, 3, (p, n))
    optimum = np.choose(side, [lo, rng.uniform(lo, hi), hi])
    multiplier = rng.integers(0, 2, (p, n)) * rng.uniform(0, 1, (p, n))
    gradient = np.choose(side, [multiplier, 0 * multiplier, -multiplier])
    return H, np.asarray(gradient - np.einsum("pij,pj->pi", H, optimum)), lo, hi


def ill_scaled(rng: np.random.Generator, p: int, n: int) -> Problem:
    """Rows and columns scaled apart by up to 100, the Hessian's diagonal by up to 1e4."""
    unit = 10 ** rng.uniform(-1, 1, (p, n))
    H, f, lo, hi = torque_like(rng, p, n)
    return H * unit[:, :, None] * unit[:, None, :], f * unit, lo / unit, hi / unit


def interior(rng: np.random.Generator, p: int, n: int) -> Problem:
    """Unconstrained minimum inside; some bounds infinite."""
    H = spectrum(rng, p, n, 1e4)
    optimum = rng.standard_normal((p, n))
    lo, hi = optimum - 10 ** rng.uniform(-3, 1, (p, n)), optimum + 10 ** rng.uniform(-3, 1, (p, n))
    lo[:, 0], hi[:, -1] = -np.inf, np.inf
    return H, np.asarray(-np.einsum("pij,pj->pi", H, optimum)), lo, hi


FAMILIES: list[Callable[[np.random.Generator, int, int], Problem]] = [
    dense,
    torque_like,
    duplicated,
    pinned,
    degenerate,
    ill_scaled,
    interior,
]
every_family = pytest.mark.parametrize("family", FAMILIES, ids=lambda f: f.__name__)


def starts(rng: np.random.Generator, lo: Array, hi: Array) -> Array:
    """A third each: zero, a random point, a random vertex (10 off where a bound is infinite)."""
    low = np.where(np.isinf(lo), np.minimum(hi, 0) - 10, lo)
    high = np.where(np.isinf(hi), np.maximum(low, 0) + 10, hi)
    vertex = np.where(rng.uniform(size=lo.shape) < 0.5, low, high)
    inside = low + rng.uniform(size=lo.shape) * (high - low)
    which = rng.integers(0, 3, (lo.shape[0], 1))
    return np.asarray(np.choose(which, [0 * vertex, inside, vertex]))


def objective(H: Array, f: Array, x: Array) -> Array:
    return np.asarray(np.einsum("pi,pij,pj->p", x, H, x) / 2 + (f * x).sum(axis=1))


def kkt_residual(problem: Problem, x: Array) -> Array:
    """Gradient where it may not be: on free variables, and out of the box on bounds; relative.

    The unit is the rounding unit of the gradient, sum_j |H_ij x_j| + |f_i|.
    """
    H, f, lo, hi = problem
    g = np.einsum("pij,pj->pi", H, x) + f
    unit = np.einsum("pij,pj->pi", abs(H), abs(x)) + abs(f)
    wrong = np.where(x > lo, np.maximum(g, 0), 0) + np.where(x < hi, np.maximum(-g, 0), 0)
    # sqrt(H_ii) sum sqrt(H_jj)|x_j| bounds the sum and is what the solver's tolerance is made of.
    root = np.sqrt(np.einsum("pii->pi", H))
    unit = np.maximum(unit, root * (root * abs(x)).sum(axis=1, keepdims=True))
    return np.asarray((wrong / unit).max(axis=1))


def assert_inside(x: Array, lo: Array, hi: Array) -> None:
    assert np.all((lo <= x) & (x <= hi))


@every_family
def test_solution_is_that_of_daqp(family: Callable[..., Problem]) -> None:
    rng = np.random.default_rng(1)
    for n in SIZES:
        H, f, lo, hi = problem = family(rng, PER_CASE, n)
        x, status, iterations = _core_parts.box_qp_batch(H, f, lo, hi, start=starts(rng, lo, hi))
        assert set(status) == {"solved"}
        assert_inside(x, lo, hi)
        assert kkt_residual(problem, x).max() < 1e-13
        reference = np.empty_like(x)
        for p in range(PER_CASE):
            reference[p], _, flag, _ = daqp.solve(
                H[p], f[p], np.empty((0, n)), hi[p], lo[p], np.zeros(n, dtype=np.int32)
            )
            assert flag == 1
        # cond 1e4 times the rounding unit is 2e-12, and both solvers err.
        assert np.all(abs(x - reference).max(axis=1) < 1e-10 * abs(x).max(axis=1))
        reference = np.clip(reference, lo, hi)
        value = objective(H, f, x)
        size = np.einsum("pi,pij,pj->p", x, H, x) / 2 + abs(f * x).sum(axis=1)
        above = (value - objective(H, f, reference)) / size
        assert above.max() < 1e-14  # never worse than DAQP beyond rounding
        assert above.min() > -1e-10  # and better by no more than DAQP's own error in x
        assert iterations.max() < 10 + 2 * n  # the default limit is never met


@every_family
def test_single_precision_agrees_with_double(family: Callable[..., Problem]) -> None:
    """The same numbers in float: x within 4 eps cond(H) max|x, start|, cond <= 1e3.

    The ridge brings every family to that condition number; it is the rule for the controller.
    """
    rng = np.random.default_rng(2)
    for n in SIZES:
        H, f, lo, hi = family(rng, PER_CASE, n)
        if family is ill_scaled:
            unit = np.sqrt(np.einsum("pii->pi", H))  # scaling changes neither solution nor pivots
            H, f = H / unit[:, :, None] / unit[:, None, :], f / unit
            lo, hi = lo * unit, hi * unit
        top = np.linalg.eigvalsh(H)[:, -1]
        H = H + 1e-3 * top[:, None, None] * np.eye(n)
        H, f, lo, hi = (v.astype(np.float32).astype(float) for v in (H, f, lo, hi))
        start = starts(rng, lo, hi).astype(np.float32).astype(float)
        x, _, _ = _core_parts.box_qp_batch(H, f, lo, hi, start=start)
        x_single, status, iterations = _core_parts.box_qp_batch(H, f, lo, hi, "single", start)
        assert set(status) == {"solved"}
        assert iterations.max() < 10 + 2 * n
        assert_inside(x_single, lo, hi)
        eigenvalues = np.linalg.eigvalsh(H)
        cond = eigenvalues[:, -1] / eigenvalues[:, 0]
        assert cond.max() < 1.1e3
        length = np.maximum(abs(x).max(axis=1), abs(start).max(axis=1))
        error = abs(x_single - x).max(axis=1) / (EPS_SINGLE * cond * length)
        assert error.max() < 4


@every_family
def test_stopping_early_is_safe(family: Callable[..., Problem]) -> None:
    """After any number of iterations x is in the box and the objective has not risen."""
    rng = np.random.default_rng(3)
    n = 6
    H, f, lo, hi = family(rng, PER_CASE, n)
    start = starts(rng, lo, hi)
    for precision, eps in (("double", 2.3e-16), ("single", EPS_SINGLE)):
        before = objective(H, f, np.clip(start, lo, hi))
        size = abs(before)
        stopped = 0
        for limit in range(1 + 10 + 2 * n):
            x, status, iterations = _core_parts.box_qp_batch(H, f, lo, hi, precision, start, limit)
            assert set(status) <= {"solved", "iteration_limit"}
            assert iterations.max() <= limit
            stopped += status.count("iteration_limit")
            if precision == "double":
                assert_inside(x, lo, hi)
            else:  # the box itself is rounded
                assert_inside(x, lo.astype(np.float32), hi.astype(np.float32))
            value = objective(H, f, x)
            size = np.maximum(size, np.einsum("pi,pij,pj->p", x, H, x) + abs(f * x).sum(axis=1))
            assert np.all(value <= before + 10 * eps * size)
            before = value
        assert stopped > PER_CASE
        assert set(status) == {"solved"}


def test_start_at_the_solution_is_recognised() -> None:
    """The solution costs one factorisation at most, and none where it is a vertex."""
    rng = np.random.default_rng(4)
    H, f, lo, hi = torque_like(rng, 1000, 6)
    x, _, _ = _core_parts.box_qp_batch(H, f, lo, hi)
    again, status, iterations = _core_parts.box_qp_batch(H, f, lo, hi, start=x)
    assert set(status) == {"solved"}
    assert iterations.max() == 1
    assert abs(again - x).max() < 1e-12
    f_steep = f + 100 * np.sign(f)  # a linear term that outweighs H sends x to a vertex
    x, _, _ = _core_parts.box_qp_batch(H, f_steep, lo, hi)
    vertex = np.all((x == lo) | (x == hi), axis=1)
    assert vertex.sum() > 10
    _, _, iterations = _core_parts.box_qp_batch(
        H[vertex], f_steep[vertex], lo[vertex], hi[vertex], start=x[vertex]
    )
    assert iterations.max() == 0


def test_batch_is_the_single_problem_repeated() -> None:
    rng = np.random.default_rng(5)
    H, f, lo, hi = dense(rng, 20, 4)
    x, status, iterations = _core_parts.box_qp_batch(H, f, lo, hi)
    for p in range(20):
        one, name, count = _core_parts.box_qp(H[p], f[p], lo[p], hi[p])
        assert np.array_equal(one, x[p])
        assert (name, count) == (status[p], iterations[p])


@pytest.mark.parametrize("precision", ["double", "single"])
def test_indefinite_hessian_is_reported(precision: str) -> None:
    H = np.array([[1.0, 2.0], [2.0, 1.0]])
    lo, hi = -np.ones(2), np.ones(2)
    x, status, _ = _core_parts.box_qp(H, np.array([0.3, 0.1]), lo, hi, precision)
    assert status == "not_positive_definite"
    assert_inside(x, lo, hi)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("precision", ["double", "single"])
def test_bad_numbers_neither_hang_nor_leave_the_box(bad: float, precision: str) -> None:
    """One bad entry anywhere in H or f: never `solved`."""
    rng = np.random.default_rng(6)
    n = 4
    for _ in range(20):
        H, f, lo, hi = (v[0] for v in torque_like(rng, 1, n))
        start = rng.choice([-1.0, 0.0, 1.0], n)
        for i in range(n):
            wrong = f.copy()
            wrong[i] = bad
            x, status, _ = _core_parts.box_qp(H, wrong, lo, hi, precision, start)
            assert status == "invalid"
            assert_inside(x, lo, hi)
            for j in range(n):
                worse = H.copy()
                worse[i, j] = worse[j, i] = bad
                x, status, _ = _core_parts.box_qp(worse, f, lo, hi, precision, start)
                assert status != "solved"
                assert_inside(x, lo, hi)


def test_bounds_that_are_no_box_are_refused() -> None:
    H, f = np.eye(2), np.zeros(2)
    for lo, hi in ([1.0, -1.0], [np.nan, 1.0], [0.0, np.nan]):
        _, status, iterations = _core_parts.box_qp(H, f, np.array([0.0, lo]), np.array([1.0, hi]))
        assert (status, iterations) == ("invalid", 0)


def test_sizes_that_do_not_agree_are_refused() -> None:
    v = np.zeros(3)
    with pytest.raises(ValueError, match="differ in size"):
        _core_parts.box_qp(np.eye(2), v, v, v)
    with pytest.raises(ValueError, match="differ in size"):
        _core_parts.box_qp(np.eye(3), v, v, np.zeros(2))
    with pytest.raises(ValueError, match="1 to 24"):
        _core_parts.box_qp(np.eye(25), np.zeros(25), np.zeros(25), np.ones(25))
    with pytest.raises(ValueError, match="precision = half"):
        _core_parts.box_qp(np.eye(3), v, v, v, "half")
