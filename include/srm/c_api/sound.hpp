// Which parameters make a drive that can run: nothing divides by zero or leaves a table.
//
// Python's checks are stricter and say more; these keep a program in C, a page or an importer of a
// mock-up unit, which set numbers by hand, from undefined behaviour.
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>
#include <variant>

#include "srm/control/guard/diagnosis.hpp"
#include "srm/control/guard/protection.hpp"
#include "srm/control/guard/sequence.hpp"
#include "srm/control/law/paper_mpc.hpp"
#include "srm/control/part/reference_profile.hpp"
#include "srm/control/part/sharing.hpp"
#include "srm/sim/simulation.hpp"
#include "srm/sim/supervision.hpp"

namespace srm::c_api {

/// The name of what is wrong; null where nothing is.
using Fault = const char*;

/// N: phases.
template <Real T>
Fault fault(const ReferenceProfile<T>& g, int N) {
  const long cells = static_cast<long>(g.first.rows) * g.first.columns;
  const bool sizes = g.first.rows >= 2 && g.first.columns >= 1 && g.omega.size >= 1 &&
                     cells <= g.first.values.size &&
                     g.first.values.size % (cells * g.omega.size) == 0 &&
                     (g.mutual.size == 0 || g.mutual.size == g.first.values.size);
  if (!sizes) return "guide";
  const long sets = g.first.values.size / (cells * g.omega.size);
  if (g.mirrored.size == 0 ? sets != 1 : g.mirrored.size != N || sets < N) return "guide";
  for (int k = 0; k < g.mirrored.size; ++k) {
    if (g.mirrored[k] >= sets) return "guide";
  }
  return is_positive(g.first.level_max) && is_positive(g.u_dc) ? nullptr : "guide";
}

inline Fault fault(const Course& c) {
  if (c.t.empty() || c.t.size() != c.value.size()) return "points of a course";
  for (std::size_t j = 1; j < c.t.size(); ++j) {
    if (!(c.t[j] >= c.t[j - 1])) return "times of a course";
  }
  return nullptr;
}

inline Fault fault(const Pump& p) {
  if (p.tau.empty()) return nullptr;
  const bool sizes = p.columns >= 2 && p.tau.size() % static_cast<std::size_t>(p.columns) == 0 &&
                     p.rise.size() == p.tau.size();
  return sizes && is_positive(p.s_step) && is_positive(p.H_step) ? fault(p.H_static) : "pump";
}

inline Fault fault(const StiffSource& s) {
  if (const Fault f = fault(s.u_dc)) return f;
  for (const double u : s.u_dc.value) {
    if (!is_positive(u)) return "u_dc of the source";  // a link held at 0 V: no step gets on
  }
  return nullptr;
}
inline Fault fault(const Battery& s) {
  return is_positive(s.R) && is_positive(s.C) ? fault(s.E) : "R, C of the source";
}
inline Fault fault(const PvArray& s) {
  if (!is_positive(s.R_s) || !is_positive(s.R_sh) || !is_positive(s.a) || !is_positive(s.C)) {
    return "R_s, R_sh, a, C of the source";
  }
  const Fault sun = fault(s.poa_global);
  return sun ? sun : fault(s.temp_cell);
}

inline Fault fault(const Shaft& s) {
  if (!is_positive(s.J)) return "J of the shaft";
  if (const Fault f = fault(s.tau_0)) return f;
  if (const Fault f = fault(s.omega)) return f;
  return fault(s.pump);
}

template <Machine M, int N>
Fault fault(const Plant<M, N>& p) {
  if (const Fault f = p.machine.fault()) return f;
  if (const Fault f = p.coupling.fault(N)) return f;
  if (!(p.R >= 0)) return "R";
  if (const Fault f = fault(p.shaft)) return f;
  return std::visit([](const auto& source) { return fault(source); }, p.source);
}

inline Fault fault(const Sampling& s) {
  if (!is_positive(s.T_s) || s.T_s > 1) return "T_s";
  if (s.delay < 0 || s.delay > 1) return "delay";
  if (s.adc_bits < 0 || s.adc_bits > 30) return "adc_bits";
  if (s.adc_bits > 0 && !is_positive(s.i_range)) return "i_range";
  return s.rotor.counts < 0 ? "encoder_counts" : nullptr;
}

inline Fault fault(const Resolution& r) {
  const bool fine = is_positive(r.dt_max) && is_positive(r.scale.i) && is_positive(r.scale.u_dc);
  return fine ? nullptr : "dt_max, scale";
}

/// The law: its machine, guide, sharing function, horizons and delay, where it has them.
template <class Law>
Fault fault_of_law(const Law& law) {
  if constexpr (requires { law.machine; }) {
    if (const Fault f = law.machine.fault()) return f;
  }
  if constexpr (requires { law.machine.pairs; }) {
    if (const Fault f = law.machine.pairs.fault(Law::n_phases)) return f;
  }
  if constexpr (requires { law.guide; }) {
    if (const Fault f = fault(law.guide, Law::n_phases)) return f;
  }
  if constexpr (requires { law.sharing; }) {
    if (!law.sharing.template is_feasible<Law::n_phases>()) return "sharing";
  }
  if constexpr (requires { law.is_consistent(); }) {
    if (!law.is_consistent()) return "values for each speed of the guide";
  }
  if constexpr (requires { law.table.is_consistent(); }) {
    if (!law.table.is_consistent()) return "table of pulses";
  }
  if constexpr (requires { law.horizon; }) {
    if (law.horizon < 1 || law.horizon > Law::horizon_max) return "horizon";
  }
  if constexpr (requires { law.T_s; }) {
    if (!is_positive(law.T_s)) return "T_s of the law";
  }
  if constexpr (requires { law.delay; }) {
    if (!(law.delay == 0 || law.delay == 1)) return "delay of the law";
  }
  return nullptr;
}

/// Its horizons are capacities of its tables too.
template <Machine M, int N, int Np_max, int Nc_max>
Fault fault_of_law(const PaperMpc<M, N, Np_max, Nc_max>& law) {
  if (const Fault f = law.machine.fault()) return f;
  if (const Fault f = fault(law.guide, N)) return f;
  if (law.N_p < 1 || law.N_p > Np_max) return "N_p";
  if (law.N_c < 1 || law.N_c > Nc_max || law.N_c > law.N_p) return "N_c";
  return is_positive(law.T_s) ? nullptr : "T_s of the law";
}

template <Real T>
Fault fault(const Protection<T>& p) {
  if (!is_positive(p.flux.T_s)) return "T_s of the protection";
  return p.delay == 0 || p.delay == 1 ? nullptr : "delay of the protection";
}

template <Real T>
Fault fault(const Diagnosis<T>& d) {
  if (!(d.theta_error >= 0 && d.theta_error <= pi<T>)) return "theta_error of the diagnosis";
  return d.patience >= 1 && d.likeness.recent >= 0 ? nullptr : "patience, recent of the diagnosis";
}

template <Real T>
Fault fault(const FluxAngle<T>& f) {
  if (!f.on()) return nullptr;
  if (!(f.theta_step > T(0) && f.theta_step <= two_pi<T>)) return "theta_step of the flux angle";
  return f.alike >= T(1) && f.psi_error > T(0) ? nullptr : "alike, psi_error of the flux angle";
}

template <Real T>
Fault fault(const Sequence<T>& s) {
  if (!is_positive(s.T_s)) return "T_s of the sequence";
  return s.n_calibrate >= 1 && s.n_settle >= 0 ? nullptr : "n_calibrate, n_settle";
}

template <int N>
Fault fault(const Supervision& s) {
  if (!is_positive(s.T_s)) return "T_s of the supervision";
  if (s.phase < 0 || s.phase >= N) return "phase of the trouble";
  for (const Course* course : {&s.enable, &s.clear, &s.troubled}) {
    if (const Fault f = fault(*course)) return f;
  }
  return nullptr;
}

}  // namespace srm::c_api
