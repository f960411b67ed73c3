// A photovoltaic array on a dc-link capacitor, behind a blocking diode: one diode, two resistors.
//
//   i = I_L - I_0 exp(v_d/a) - G_sh v_d,   v_d = u + v_block + R_s i,   C du/dt = i - i_dc
//
// Irradiance G and cell temperature T act as De Soto, Klein and Beckman say (Solar Energy 80, 2006,
// 78): I_L and G_sh are proportional to G, a to T, I_0 to T^3 exp(-E_g/(k T)). The -1 behind the
// exponential is left out: it is I_0, below 1e-6 of the short-circuit current.
//
// The equation is explicit in w + ln w = q (plant/wright_omega.hpp). With s = 1 + R_s G_sh, R =
// R_s/s and v = (u + v_block + R_s I_L)/s, which is v_d + R I_0 exp(v_d/a):
//
//   a w = R I_0 exp(v_d/a)   gives   w + ln w = v/a + ln(R I_0/a),   i = (v - a w - u -
//   v_block)/R_s.
#pragma once

#include "srm/base/fields.hpp"
#include "srm/plant/course.hpp"
#include "srm/plant/feed.hpp"
#include "srm/plant/wright_omega.hpp"

namespace srm {

struct PvArray {
  static constexpr const char* about =
      "A photovoltaic array of one diode on a dc-link capacitor: numbers at 1000 W/m^2 and 25 "
      "degC, irradiance and cell temperature over time.";
  double I_L;         // photo current at 1000 W/m^2 and 25 degC [A]
  double R_s;         // series resistance [ohm]
  double R_sh;        // shunt resistance there [ohm]
  double a;           // voltage scale of the diode there [V]
  double alpha;       // of the photo current [A/K]
  double v_block;     // of the blocking diode while it conducts [V]
  double C;           // of the dc link [F]
  double u_start;     // voltage of the dc link at the start [V]
  double ln_ref;      // ln(R_s I_0/a) with the saturation current at 25 degC
  Course poa_global;  // irradiance on the array [W/m^2]
  Course temp_cell;   // [degC]
  SRM_FIELDS(I_L, R_s, R_sh, a, alpha, v_block, C, u_start, ln_ref, poa_global, temp_cell)

  /// The array alone.
  struct Point {
    double i;      // negative above the open-circuit voltage [A]
    double slope;  // di/du [A/V]
  };
  /// At voltage u of its terminals.
  Point at(double u, double G, double T_degC) const {
    constexpr double T_ref = 298.15;                           // [K]
    constexpr double gap = 1.121 / (8.617333262e-05 * T_ref);  // of silicon, over k T_ref
    constexpr double gap_slope = -0.0002677;                   // [1/K]
    const double g = G > 0 ? G / 1000 : 0, dT = T_degC + 273.15 - T_ref;
    const double t = 1 + dT / T_ref, scale = a * t;
    const double shunted = 1 + R_s / R_sh * g;
    const double v = (u + R_s * g * (I_L + alpha * dT)) / shunted;
    // ln(R I_0/a), of which I_0 brings t^3 and a brings 1/t
    const double q = ln_ref + gap - gap * (1 + gap_slope * dT) / t + 2 * ln(t) - ln(shunted);
    const double w = wright_omega.at(v / scale + q);
    const double slope = (1 / (shunted * (1 + w)) - 1) / R_s;  // di/du; dw/dq = w/(1 + w)
    return {(v - scale * w - u) / R_s, slope};
  }

  double current(double u, double G, double T_degC) const { return at(u, G, T_degC).i; }

  double start() const { return u_start; }
  Feed feed(double u, const Moving& i_dc, Moment m) const {
    const Point array = at(u + v_block, poa_global.at(m), temp_cell.at(m));
    const bool blocks = !(array.i > 0);
    const double i_now = blocks ? 0 : array.i;
    const double du = (i_now - i_dc.now) / C;
    const Moving i = blocks ? Moving{} : Moving{i_now, array.slope * du + weather_rate(u, m)};
    return {1 / C * (i - i_dc), i, i - i_dc, Moving{u + v_block, du} * i, v_block * i};
  }
  double stored(double u) const { return C * u * u / 2; }
  double next(double t) const {
    const double sun = poa_global.next(t), heat = temp_cell.next(t);
    return sun < heat ? sun : heat;
  }
  double forced(double u, double) const { return u; }

 private:
  /// How the current changes at constant voltage, where irradiance or temperature do [A/s].
  double weather_rate(double u, Moment m) const {
    const Moving G = poa_global.moving(m), T = temp_cell.moving(m);
    if (G.rate == 0 && T.rate == 0) return 0;
    constexpr double dt = 1e-6;  // [s]
    const double after = current(u + v_block, G.now + dt * G.rate, T.now + dt * T.rate);
    return (after - current(u + v_block, G.now, T.now)) / dt;
  }

  /// ln x near 1 by the series of the inverse hyperbolic tangent: to 3e-8 from 0.75 to 1.35.
  static double ln(double x) {
    const double y = (x - 1) / (x + 1), z = y * y;
    return y * (2 + z * (2.0 / 3 + z * (2.0 / 5 + z * (2.0 / 7))));
  }
};

}  // namespace srm
