// Arrays between Python and the core.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <initializer_list>
#include <vector>

namespace bound {

namespace nb = nanobind;

/// Read-only arrays from Python, in C order.
template <int dimensions>
using Array = nb::ndarray<const double, nb::ndim<dimensions>, nb::c_contig, nb::device::cpu>;

/// A numpy array that owns its values.
template <class V>
nb::ndarray<nb::numpy, V> numpy(std::vector<V> values, std::initializer_list<std::size_t> shape) {
  auto* data = new std::vector<V>(std::move(values));
  nb::capsule owner(data, [](void* p) noexcept { delete static_cast<std::vector<V>*>(p); });
  return nb::ndarray<nb::numpy, V>(data->data(), shape, owner);
}

}  // namespace bound
