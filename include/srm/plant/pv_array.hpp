// A photovoltaic array on a dc-link capacitor, behind a blocking diode: one diode, two resistors.
//
//   i = I_L - I_0 (exp(v_d/a) - 1) - G_sh v_d,   v_d = u + v_block + R_s i,   C du/dt = i - i_dc
//
// Irradiance G and cell temperature T act as De Soto, Klein and Beckman say (Solar Energy 80, 2006,
// 78): I_L and G_sh are proportional to G, a to T, I_0 to T^3 exp(-E_g/(k T)).
//
// The equation is explicit in w + ln w = q (base/wright_omega.hpp). With R = R_s/(1 + R_s G_sh),
// v_0 = (u + v_block + R_s (I_L + I_0))/(1 + R_s G_sh) - R I_0, which is v_d + R I_0 (exp(v_d/a) - 1):
//
//   a w = R I_0 exp(v_d/a)   gives   w + ln w = (v_0 + R I_0)/a + ln(R I_0/a),
//   v_d = v_0 + R I_0 - a w,   i = (v_d - u - v_block)/R_s.
#pragma once

#include <cmath>

#include "srm/base/fields.hpp"
#include "srm/base/wright_omega.hpp"
#include "srm/plant/course.hpp"
#include "srm/plant/feed.hpp"

namespace srm {

struct PvArray {
  double I_L;      // photo current at 1000 W/m^2 and 25 degC [A]
  double I_0;      // saturation current there [A]
  double R_s;      // series resistance [ohm]
  double R_sh;     // shunt resistance there [ohm]
  double a;        // voltage scale of the diode there [V]
  double alpha;    // of the photo current [A/K]
  double v_block;  // of the blocking diode while it conducts [V]
  double C;        // of the dc link [F]
  double u_start;  // voltage of the dc link at the start [V]
  Course poa_global;  // irradiance on the array [W/m^2]
  Course temp_cell;   // [degC]
  SRM_FIELDS(I_L, I_0, R_s, R_sh, a, alpha, v_block, C, u_start, poa_global, temp_cell)

  /// The current of the array alone at voltage u of its terminals: negative above its open-circuit
  /// voltage [A].
  double current(double u, double G, double T_degC) const {
    constexpr double T_ref = 298.15;                            // [K]
    constexpr double gap = 1.121 / (8.617333262e-05 * T_ref);   // of silicon, over k T_ref
    constexpr double gap_slope = -0.0002677;                    // [1/K]
    const double g = G > 0 ? G / 1000 : 0, dT = T_degC + 273.15 - T_ref;
    const double t = 1 + dT / T_ref;
    const double photo = g * (I_L + alpha * dT);
    const double scale = a * t;
    const double ln_rise = gap - gap * (1 + gap_slope * dT) / t;  // of I_0, its factor t^3 apart
    const double shunted = 1 + R_s * g / R_sh;
    const double saturation = I_0 * t * t * t * std::exp(ln_rise);
    const double v = (u + R_s * (photo + saturation)) / shunted;  // v_0 + R I_0
    const double w = wright_omega.at(v / scale + std::log(R_s * saturation / (shunted * scale)));
    return (v - scale * w - u) / R_s;
  }

  double start() const { return u_start; }
  Feed feed(double u, double i_dc, Moment m) const {
    const double found = current(u + v_block, poa_global.at(m), temp_cell.at(m));
    const double i = found > 0 ? found : 0;
    return {(i - i_dc) / C, i, (u + v_block) * i, v_block * i};
  }
  double stored(double u) const { return C * u * u / 2; }
  double next(double t) const {
    const double sun = poa_global.next(t), heat = temp_cell.next(t);
    return sun < heat ? sun : heat;
  }
  double forced(double u, double) const { return u; }
};

}  // namespace srm
