// What several control laws are made of, in the precision of the law.
#pragma once

#include "bindings.hpp"
#include "srm/control/conduction.hpp"
#include "srm/control/mean_torque.hpp"
#include "srm/control/sharing.hpp"

namespace bound {

template <srm::Real T, std::size_t n>
std::array<T, n> in_precision(const std::array<double, n>& values) {
  std::array<T, n> out;
  for (std::size_t j = 0; j < n; ++j) out[j] = T(values[j]);
  return out;
}

template <srm::Real T>
srm::Conduction<T> in_precision(const srm::Conduction<double>& c) {
  return {T(c.theta_on), T(c.theta_off), T(c.omega_start)};
}

template <srm::Real T>
srm::MeanTorque<T> in_precision(const srm::MeanTorque<double>& m) {
  return {T(m.tau_max), in_precision<T>(m.i_ref)};
}

template <srm::Real T>
srm::Sharing<T> in_precision(const srm::Sharing<double>& s) {
  return {s.shape, T(s.theta_on), T(s.theta_ov), in_precision<T>(s.table)};
}

/// The controller of a law that holds a fixed current instead of a torque. It motors in the
/// positive sense, and has no torque reference to record.
inline AnyController without_reference(AnyController controller) {
  std::visit(
      [](auto& step) {
        step = [inner = std::move(step)](const auto& y, double) {
          auto orders = inner(y, 1);
          orders.tau_ref = 0;
          return orders;
        };
      },
      controller.step);
  return controller;
}

}  // namespace bound
