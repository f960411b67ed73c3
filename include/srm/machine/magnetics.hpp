// What every machine model answers: all magnetic quantities of one phase, from one co-energy
// function.
#pragma once

#include <concepts>

#include "srm/base/angle.hpp"

namespace srm {

/// One phase at a current and an electrical angle. Angle derivatives are per mechanical radian, so
/// that tau is shaft torque and omega_m * psi_theta is the back-EMF.
template <Real T>
struct Magnetics {
  T psi;        // flux linkage dW_c/di [Wb]
  T W_c;        // co-energy [J]
  T tau;        // torque dW_c/dtheta_m [N m]
  T L_inc;      // incremental inductance dpsi/di [H]
  T psi_theta;  // dpsi/dtheta_m [Wb/rad]
};

/// Of its greatest current: a phase with less makes 1e-5 of its greatest torque, and counts as one
/// without current where a law asks whether it has to start.
template <Real T>
inline constexpr T no_current_part = T(0.003);

/// The same without the co-energy, and how it changes: all partial derivatives of the co-energy to
/// order 2, and those of order 3 that a rate of change needs.
template <Real T>
struct Jet {
  T psi{};          // [Wb]
  T tau{};          // [N m]
  T L_inc{};        // [H]
  T psi_theta{};    // dpsi/dtheta_m [Wb/rad]
  T tau_theta{};    // dtau/dtheta_m [N m/rad]
  T L_i{};          // dL_inc/di [H/A]
  T L_theta{};      // dL_inc/dtheta_m [H/rad]
  T psi_theta_2{};  // d2psi/dtheta_m2 [Wb/rad^2]
};

/// A machine is its magnetics: `at` is the single place where flux, torque, inductance and
/// back-EMF come from, so none of them can contradict another. The model covers currents >= 0 and
/// every angle in [0, 2 pi).
template <class M>
concept Machine = requires(const M machine, typename M::Scalar i, typename M::Scalar theta_e) {
  requires Real<typename M::Scalar>;
  { machine.N_r } -> std::convertible_to<int>;
  { machine.at(i, theta_e) } -> std::same_as<Magnetics<typename M::Scalar>>;
};

/// What the plant asks of a machine besides: `jet`, the derivatives of `at`.
template <class M>
concept Motor = Machine<M> && requires(const M machine, double i, double theta_e) {
  { machine.jet(i, theta_e) } -> std::same_as<Jet<double>>;
};

}  // namespace srm
