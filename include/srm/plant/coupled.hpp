// Phases that couple: the incremental inductances and their derivatives as matrices over the
// phases, and what follows from them where phases alone divide by their own.
//
// Everything here is a function of the number of phases alone, so it is compiled once for all
// machine models. A plant without pairs never comes here.
#pragma once

#include <array>

#include "srm/base/symmetric.hpp"
#include "srm/machine/coupling.hpp"
#include "srm/plant/moving.hpp"
#include "srm/plant/state.hpp"

namespace srm {

/// What the pairs have beyond the derivatives of each phase: those that belong to two phases. Of a
/// row k and a column l that differ.
template <int N>
struct Links {
  Square<double, N> L{};        // dpsi_k/di_l [H]
  Square<double, N> L_theta{};  // its derivative in theta_m [H/rad]
  Square<double, N> L_i{};      // d2psi_k/(di_k di_l) [H/A]
};

template <int N>
using Jets = std::array<Jet<double>, N>;

/// Adds the pairs of phases that both flow to the magnetics of the phases alone. Half of the torque
/// of a pair counts to each of its phases.
template <int N>
[[gnu::noinline]] void add_pairs(const Coupling<double>& coupling, const std::array<bool, N>& flows,
                                 const std::array<double, N>& i, double theta_e, Jets<N>& jets,
                                 Links<N>& links) {
  for (int n = 0; n < coupling.n_pairs(); ++n) {
    const int k = coupling.first[n], l = coupling.second[n];
    if (!flows[k] || !flows[l]) continue;
    const PairJet<double> g = coupling.jet(n, i[k], i[l], theta_e);
    Jet<double>& first = jets[k];
    Jet<double>& second = jets[l];
    first.psi += g.at.psi_first;
    second.psi += g.at.psi_second;
    first.L_inc += g.at.L_first;
    second.L_inc += g.at.L_second;
    first.psi_theta += g.at.psi_theta_first;
    second.psi_theta += g.at.psi_theta_second;
    first.L_i += g.W_aaa;
    second.L_i += g.W_bbb;
    first.L_theta += g.L_theta_first;
    second.L_theta += g.L_theta_second;
    first.psi_theta_2 += g.psi_theta_2_first;
    second.psi_theta_2 += g.psi_theta_2_second;
    for (Jet<double>* m : {&first, &second}) {
      m->tau += g.at.tau / 2;
      m->tau_theta += g.at.tau_theta / 2;
    }
    links.L[k][l] = links.L[l][k] = g.at.L_mutual;
    links.L_theta[k][l] = links.L_theta[l][k] = g.L_theta_mutual;
    links.L_i[k][l] = g.W_aab;
    links.L_i[l][k] = g.W_abb;
  }
}

/// Solves (L + diag(more)) y = x for the phases that flow; y is zero for the others. L is symmetric
/// and positive definite.
template <int N>
[[gnu::noinline]] std::array<double, N> solved(const std::array<bool, N>& flows,
                                               const Jets<N>& jets, const Links<N>& links,
                                               const std::array<double, N>& more,
                                               const std::array<double, N>& x) {
  Square<double, N> M{};
  for (int k = 0; k < N; ++k) {
    if (!flows[k]) continue;
    M[k] = links.L[k];
    M[k][k] = jets[k].L_inc + more[k];
  }
  return srm::solved<double, N>(flows, M, x);
}

/// The bend of the magnetisation along changes d of the currents: sum over l, m of d2psi_k/(di_l
/// di_m) d_l d_m [Wb].
template <int N>
std::array<double, N> bent(const std::array<bool, N>& flows, const Jets<N>& jets,
                           const Links<N>& links, const std::array<double, N>& d) {
  std::array<double, N> sum{};
  for (int k = 0; k < N; ++k) {
    if (!flows[k]) continue;
    sum[k] = jets[k].L_i * d[k] * d[k];
    for (int l = 0; l < N; ++l) {
      if (l == k || !flows[l]) continue;
      sum[k] += (2 * links.L_i[k][l] * d[k] + links.L_i[l][k] * d[l]) * d[l];
    }
  }
  return sum;
}

/// The rows of dL/dtheta_m times changes of the currents.
template <int N>
std::array<double, N> turned(const std::array<bool, N>& flows, const Jets<N>& jets,
                             const Links<N>& links, const std::array<double, N>& d) {
  std::array<double, N> sum{};
  for (int k = 0; k < N; ++k) {
    if (!flows[k]) continue;
    sum[k] = jets[k].L_theta * d[k];
    for (int l = 0; l < N; ++l) {
      if (l != k && flows[l]) sum[k] += links.L_theta[k][l] * d[l];
    }
  }
  return sum;
}

/// Second derivatives of the currents, as `bend` for phases alone (sim/step.hpp).
template <int N>
[[gnu::noinline]] std::array<double, N> bends(const std::array<bool, N>& flows, const Jets<N>& jets,
                                              const Links<N>& links, const std::array<Moving, N>& i,
                                              const std::array<Moving, N>& v, const Moving& omega) {
  std::array<double, N> rate{};
  for (int k = 0; k < N; ++k) rate[k] = i[k].rate;
  const auto along = bent<N>(flows, jets, links, rate),
             across = turned<N>(flows, jets, links, rate);
  std::array<double, N> x{};
  for (int k = 0; k < N; ++k) {
    const double psi_theta_rate = 2 * across[k] + jets[k].psi_theta_2 * omega.now;
    x[k] = v[k].rate - along[k] - omega.rate * jets[k].psi_theta - omega.now * psi_theta_rate;
  }
  return solved<N>(flows, jets, links, {}, x);
}

/// Newton's corrections of the currents where the flux linkages lack `left`, as `correction` for
/// phases alone. more: h R/4 of each.
template <int N>
[[gnu::noinline]] std::array<double, N> joint_corrections(const std::array<bool, N>& flows,
                                                          const Jets<N>& jets,
                                                          const Links<N>& links,
                                                          const std::array<double, N>& more,
                                                          const std::array<double, N>& left) {
  std::array<double, N> d = solved<N>(flows, jets, links, more, left);
  std::array<double, N> half = bent<N>(flows, jets, links, d);
  for (double& x : half) x /= 2;
  const auto less = solved<N>(flows, jets, links, more, half);
  for (int k = 0; k < N; ++k) d[k] -= less[k];
  return d;
}

/// The magnetics at currents and an angle that are a little farther on.
template <int N>
[[gnu::noinline]] void move_all(const std::array<bool, N>& flows, Jets<N>& jets, Links<N>& links,
                                const std::array<double, N>& d, double dtheta) {
  const auto across = turned<N>(flows, jets, links, d);
  for (int k = 0; k < N; ++k) {
    if (!flows[k]) continue;
    Jet<double>& m = jets[k];
    m.tau += d[k] * (m.psi_theta + across[k] / 2) + dtheta * m.tau_theta;
    m.tau_theta += d[k] * m.psi_theta_2;
    m.psi_theta += across[k] + dtheta * m.psi_theta_2;
    m.L_inc += d[k] * m.L_i + dtheta * m.L_theta;
    for (int l = 0; l < N; ++l) {
      if (l == k || !flows[l]) continue;
      m.L_inc += d[l] * links.L_i[k][l];
      links.L[k][l] +=
          d[k] * links.L_i[k][l] + d[l] * links.L_i[l][k] + dtheta * links.L_theta[k][l];
    }
  }
}

/// What the phases that flow induce in phase k, which does not: the rate of its flux linkage [V].
/// rate: of the currents [A/s].
template <int N>
[[gnu::noinline]] double induced(const Coupling<double>& coupling, const std::array<bool, N>& flows,
                                 const std::array<Moving, N>& i, double theta_e, double omega_m,
                                 int k) {
  double v = 0;
  for (int n = 0; n < coupling.n_pairs(); ++n) {
    const int a = coupling.first[n], b = coupling.second[n];
    if ((a != k && b != k) || !flows[a == k ? b : a]) continue;
    const PairMagnetics<double> m = coupling.at(n, i[a].now, i[b].now, theta_e);
    const double psi_theta = a == k ? m.psi_theta_first : m.psi_theta_second;
    v += m.L_mutual * i[a == k ? b : a].rate + omega_m * psi_theta;
  }
  return v;
}

}  // namespace srm
