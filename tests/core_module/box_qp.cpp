// Python view of the box-constrained quadratic program, one problem or a batch of equal size.
#include "srm/control/part/box_qp.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"

namespace bound {

namespace {

constexpr int capacity = 24;

const char* name(srm::QpStatus status) {
  switch (status) {
    case srm::QpStatus::solved:
      return "solved";
    case srm::QpStatus::iteration_limit:
      return "iteration_limit";
    case srm::QpStatus::not_positive_definite:
      return "not_positive_definite";
    case srm::QpStatus::invalid:
      return "invalid";
  }
  return "invalid";
}

/// Problems side by side, row after row.
struct Batch {
  int n;
  const double *H, *f, *lo, *hi, *start;  // start may be null: zero
  int max_iterations;                     // negative: the default
};

struct Solutions {
  std::vector<double> x;
  std::vector<srm::QpStatus> status;
  std::vector<int> iterations;
};

template <srm::Real T>
Solutions solve_all(const Batch& batch, std::size_t n_problems) {
  const std::size_t n = static_cast<std::size_t>(batch.n);
  Solutions out;
  out.x.reserve(n_problems * n);
  srm::BoxQp<T, capacity> qp;
  qp.n = batch.n;
  const int limit =
      batch.max_iterations < 0 ? srm::box_qp_iteration_limit(batch.n) : batch.max_iterations;
  for (std::size_t p = 0; p < n_problems; ++p) {
    std::array<T, capacity> start{};
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t at = p * n + i;
      for (std::size_t j = 0; j < n; ++j) qp.H[i][j] = static_cast<T>(batch.H[at * n + j]);
      qp.f[i] = static_cast<T>(batch.f[at]);
      qp.lo[i] = static_cast<T>(batch.lo[at]);
      qp.hi[i] = static_cast<T>(batch.hi[at]);
      if (batch.start != nullptr) start[i] = static_cast<T>(batch.start[at]);
    }
    const srm::BoxQpSolution<T, capacity> solution = srm::solve(qp, start, limit);
    for (std::size_t i = 0; i < n; ++i) out.x.push_back(static_cast<double>(solution.x[i]));
    out.status.push_back(solution.status);
    out.iterations.push_back(solution.iterations);
  }
  return out;
}

Solutions solve_all(const Batch& batch, std::size_t n_problems, const std::string& precision) {
  if (precision == "double") return solve_all<double>(batch, n_problems);
  if (precision == "single") return solve_all<float>(batch, n_problems);
  const std::string message = "precision = " + precision + ", need double or single";
  throw nb::value_error(message.c_str());
}

void require(bool holds, const char* message) {
  if (!holds) throw nb::value_error(message);
}

/// Rows, columns of the last two axes, and the same for the optional start.
template <int dimensions>
Batch checked(const Array<dimensions + 1>& H, const Array<dimensions>& f,
              const Array<dimensions>& lo, const Array<dimensions>& hi,
              const std::optional<Array<dimensions>>& start, int max_iterations) {
  const std::size_t n = f.shape(dimensions - 1);
  require(n >= 1 && n <= capacity, "f has a wrong length, need 1 to 24 variables");
  require(H.shape(dimensions) == n, "H and f differ in size; give H as (..., n, n), f as (..., n)");
  for (std::size_t axis = 0; axis < dimensions; ++axis) {
    const std::size_t size = f.shape(axis);
    require(H.shape(axis) == size && lo.shape(axis) == size && hi.shape(axis) == size &&
                (!start || start->shape(axis) == size),
            "H, f, lo, hi and start differ in size; give H as (..., n, n), the others as (..., n)");
  }
  return {static_cast<int>(n), H.data(),  f.data(),
          lo.data(),           hi.data(), start ? start->data() : nullptr,
          max_iterations};
}

nb::tuple box_qp(const Array<2>& H, const Array<1>& f, const Array<1>& lo, const Array<1>& hi,
                 const std::string& precision, const std::optional<Array<1>>& start,
                 int max_iterations) {
  const Batch batch = checked<1>(H, f, lo, hi, start, max_iterations);
  Solutions out = solve_all(batch, 1, precision);
  return nb::make_tuple(numpy(std::move(out.x), {f.shape(0)}), name(out.status[0]),
                        out.iterations[0]);
}

nb::tuple box_qp_batch(const Array<3>& H, const Array<2>& f, const Array<2>& lo, const Array<2>& hi,
                       const std::string& precision, const std::optional<Array<2>>& start,
                       int max_iterations) {
  const Batch batch = checked<2>(H, f, lo, hi, start, max_iterations);
  const std::size_t n_problems = f.shape(0);
  Solutions out = solve_all(batch, n_problems, precision);
  nb::list status;
  for (const srm::QpStatus s : out.status) status.append(name(s));
  return nb::make_tuple(numpy(std::move(out.x), {n_problems, f.shape(1)}), status,
                        numpy(std::move(out.iterations), {n_problems}));
}

}  // namespace

void bind_box_qp(nb::module_& m) {
  using namespace nb::literals;
  m.def("box_qp", &box_qp, "H"_a, "f"_a, "lo"_a, "hi"_a, "precision"_a = "double",
        "start"_a = nb::none(), "max_iterations"_a = -1,
        R"(Minimum of 1/2 x'Hx + f'x on lo <= x <= hi, by the controller's active-set method.

Parameters
----------
H : array, shape (n, n)
    Symmetric positive definite; n from 1 to 24.
f, lo, hi : array, shape (n,)
    Gradient at zero and bounds. Equal bounds fix a variable, infinite ones free it.
precision : {"double", "single"}
    Scalar of the computation.
start : array, shape (n,), optional
    Warm start, clipped to the box; zero by default.
max_iterations : int
    Iteration limit; negative takes the controller's own.

Returns
-------
x : ndarray, shape (n,)
    Within the bounds whatever the status.
status : str
    "solved", "iteration_limit", "not_positive_definite" or "invalid".
iterations : int
    Factorisations used.

Raises
------
ValueError
    If shapes do not agree or the precision is unknown.)");
  m.def("box_qp_batch", &box_qp_batch, "H"_a, "f"_a, "lo"_a, "hi"_a, "precision"_a = "double",
        "start"_a = nb::none(), "max_iterations"_a = -1,
        R"(`box_qp` for n_problems problems of equal size.

Parameters
----------
H : array, shape (n_problems, n, n)
f, lo, hi : array, shape (n_problems, n)
precision, start, max_iterations
    As for `box_qp`; start has shape (n_problems, n).

Returns
-------
x : ndarray, shape (n_problems, n)
status : list of str
iterations : ndarray of int, shape (n_problems,)

Raises
------
ValueError
    If shapes do not agree or the precision is unknown.)");
}

}  // namespace bound
