// Phases that couple: the incremental inductances and their derivatives as matrices over the
// phases, and what follows from them where phases alone divide by their own.
//
// Everything here is a function of the number of phases alone, so it is compiled once for all
// machine models. A plant without pairs never comes here.
#pragma once

#include <array>

#include "srm/base/symmetric.hpp"
#include "srm/plant/moving.hpp"
#include "srm/plant/pair_piece.hpp"
#include "srm/plant/state.hpp"

namespace srm {

/// The links of the phases that flow, and the matrix of the inductances.
template <int N>
struct Links {
  std::array<Link, N*(N - 1)> of{};
  int n = 0;
  Square<double, N> factored{};  // once the rates are known

  const Link* begin() const { return of.data(); }
  const Link* end() const { return of.data() + n; }
  Link* begin() { return of.data(); }
  Link* end() { return of.data() + n; }
};

template <int N>
using Jets = std::array<Jet<double>, N>;

inline void add(Jet<double>& m, const Jet<double>& more) {
  m.psi += more.psi;
  m.tau += more.tau;
  m.L_inc += more.L_inc;
  m.psi_theta += more.psi_theta;
  m.tau_theta += more.tau_theta;
  m.L_i += more.L_i;
  m.L_theta += more.L_theta;
  m.psi_theta_2 += more.psi_theta_2;
}

/// Adds the pairs of phases that both flow to the magnetics of the phases alone.
template <int N>
[[gnu::noinline]] void add_pairs(const Coupling<double>& coupling, PairPieces& pieces,
                                 const std::array<bool, N>& flows, const std::array<double, N>& i,
                                 double theta_e, Jets<N>& jets, Links<N>& links) {
  links.n = 0;
  for (int n = 0; n < coupling.n_pairs(); ++n) {
    const int k = coupling.first[n], l = coupling.second[n];
    if (!flows[k] || !flows[l]) continue;
    const PairJet pair = pieces[n].jet(coupling, n, i[k], i[l], theta_e);
    add(jets[k], pair.first);
    add(jets[l], pair.second);
    links.of[links.n++] = pair.link;
  }
}

/// The matrix of the inductances, with `more` on its diagonal, factored for the phases that flow.
template <int N>
void factor(const std::array<bool, N>& flows, const Jets<N>& jets, const Links<N>& links,
            const std::array<double, N>& more, Square<double, N>& M) {
  M = {};
  for (int k = 0; k < N; ++k) M[k][k] = jets[k].L_inc + more[k];
  for (const Link& pair : links) {
    M[pair.first][pair.second] += pair.L;
    M[pair.second][pair.first] += pair.L;
  }
  factor<double, N>(flows, M);
}

/// The bend of the magnetisation along changes d of the currents, which are zero where no current
/// flows: sum over l, m of d2psi_k/(di_l di_m) d_l d_m [Wb].
template <int N>
std::array<double, N> bent(const Jets<N>& jets, const Links<N>& links,
                           const std::array<double, N>& d) {
  std::array<double, N> sum;
  for (int k = 0; k < N; ++k) sum[k] = jets[k].L_i * d[k] * d[k];
  for (const Link& pair : links) {
    const double a = d[pair.first], b = d[pair.second];
    sum[pair.first] += (2 * pair.L_first * a + pair.L_second * b) * b;
    sum[pair.second] += (2 * pair.L_second * b + pair.L_first * a) * a;
  }
  return sum;
}

/// The rows of dL/dtheta_m times changes of the currents.
template <int N>
std::array<double, N> turned(const Jets<N>& jets, const Links<N>& links,
                             const std::array<double, N>& d) {
  std::array<double, N> sum;
  for (int k = 0; k < N; ++k) sum[k] = jets[k].L_theta * d[k];
  for (const Link& pair : links) {
    sum[pair.first] += pair.L_theta * d[pair.second];
    sum[pair.second] += pair.L_theta * d[pair.first];
  }
  return sum;
}

/// Second derivatives of the currents, as `bend` for phases alone (sim/step.hpp). links: factored.
template <int N>
[[gnu::noinline]] std::array<double, N> bends(const std::array<bool, N>& flows, const Jets<N>& jets,
                                              const Links<N>& links, const std::array<Moving, N>& i,
                                              const std::array<Moving, N>& v, const Moving& omega) {
  std::array<double, N> rate, x;
  for (int k = 0; k < N; ++k) rate[k] = i[k].rate;
  const auto along = bent<N>(jets, links, rate), across = turned<N>(jets, links, rate);
  for (int k = 0; k < N; ++k) {
    const double psi_theta_rate = 2 * across[k] + jets[k].psi_theta_2 * omega.now;
    x[k] = v[k].rate - along[k] - omega.rate * jets[k].psi_theta - omega.now * psi_theta_rate;
  }
  solve<double, N>(flows, links.factored, x);
  return x;
}

/// Newton's corrections of the currents where the flux linkages lack `left`, as `correction` for
/// phases alone. more: h R/4 of each.
template <int N>
[[gnu::noinline]] std::array<double, N> joint_corrections(const std::array<bool, N>& flows,
                                                          const Jets<N>& jets,
                                                          const Links<N>& links,
                                                          const std::array<double, N>& more,
                                                          const std::array<double, N>& left) {
  Square<double, N> M;
  factor<N>(flows, jets, links, more, M);
  std::array<double, N> d = left;
  solve<double, N>(flows, M, d);
  std::array<double, N> less = bent<N>(jets, links, d);
  for (double& x : less) x /= 2;
  solve<double, N>(flows, M, less);
  for (int k = 0; k < N; ++k) d[k] -= less[k];
  return d;
}

/// The magnetics at currents and an angle that are a little farther on.
template <int N>
[[gnu::noinline]] void move_all(Jets<N>& jets, Links<N>& links, const std::array<double, N>& d,
                                double dtheta) {
  const auto across = turned<N>(jets, links, d);
  for (int k = 0; k < N; ++k) {
    Jet<double>& m = jets[k];
    m.tau += d[k] * (m.psi_theta + across[k] / 2) + dtheta * m.tau_theta;
    m.tau_theta += d[k] * m.psi_theta_2;
    m.psi_theta += across[k] + dtheta * m.psi_theta_2;
    m.L_inc += d[k] * m.L_i + dtheta * m.L_theta;
  }
  for (Link& pair : links) {
    const double a = d[pair.first], b = d[pair.second];
    jets[pair.first].L_inc += b * pair.L_first;
    jets[pair.second].L_inc += a * pair.L_second;
    pair.L += a * pair.L_first + b * pair.L_second + dtheta * pair.L_theta;
  }
}

/// What the phases that flow induce in phase k, which does not: the rate of its flux linkage [V].
/// rate: of the currents [A/s].
template <int N>
[[gnu::noinline]] double induced(const Coupling<double>& coupling, PairPieces& pieces,
                                 const std::array<bool, N>& flows, const std::array<Moving, N>& i,
                                 double theta_e, double omega_m, int k) {
  double v = 0;
  for (int n = 0; n < coupling.n_pairs(); ++n) {
    const int a = coupling.first[n], b = coupling.second[n];
    if (a != k && b != k) continue;
    const int other = a == k ? b : a;
    if (!flows[other]) continue;
    v += pieces[n].induced(coupling, n, i[a].now, i[b].now, i[other].rate, theta_e, omega_m);
  }
  return v;
}

/// False where the phases that flow cannot induce as much as opposes a current in phase k, which
/// has none. drive: what drives one through it, without them [V].
template <int N>
bool may_open(const Coupling<double>& coupling, const PairPieces& pieces,
              const std::array<bool, N>& flows, const std::array<Moving, N>& i, double omega_m,
              int k, double drive) {
  for (int n = 0; n < coupling.n_pairs(); ++n) {
    const int a = coupling.first[n], b = coupling.second[n];
    if (a != k && b != k) continue;
    const Moving& other = i[a == k ? b : a];
    if (!flows[a == k ? b : a]) continue;
    if (other.now > i_last(coupling)) return true;
    drive += pieces[n].most_induced(other.rate, omega_m);
  }
  return drive > 0;
}

}  // namespace srm
