// The scalar of the core, and the few elementary functions it needs, without libm.
//
// libm differs between targets in the last bit; these give the same bits on x86-64, Arm Cortex-M
// and WebAssembly as long as the compiler does not contract a*b+c (-ffp-contract=off).
#pragma once

#include <concepts>
#include <cstdint>

namespace srm {

/// float on the target, double on the desk.
template <class T>
concept Real = std::same_as<T, float> || std::same_as<T, double>;

template <Real T>
inline constexpr T pi = T(3.14159265358979323846);
template <Real T>
inline constexpr T two_pi = T(6.28318530717958647693);

template <Real T>
constexpr T abs(T x) {
  if constexpr (std::same_as<T, float>) {
    return __builtin_fabsf(x);
  } else {
    return __builtin_fabs(x);
  }
}

/// And finite.
template <Real T>
constexpr bool is_positive(T x) {
  return x > T(0) && x - x == T(0);
}

template <Real T>
constexpr T min(T a, T b) {
  return b < a ? b : a;
}

template <Real T>
constexpr T max(T a, T b) {
  return a < b ? b : a;
}

/// x held within [lo, hi]; lo where x is NaN, so that no bad input passes.
template <Real T>
constexpr T clamp(T x, T lo, T hi) {
  return x > lo ? (x < hi ? x : hi) : lo;
}

/// True for every number except NaN and the infinities, also under any optimisation of comparisons.
template <Real T>
constexpr bool is_finite(T x) {
  return x - x == T(0);
}

/// Greatest integer not above x, for |x| < 2^31.
template <Real T>
constexpr T floor(T x) {
  const T whole = static_cast<T>(static_cast<std::int32_t>(x));
  return x < whole ? whole - T(1) : whole;
}

/// Square root, correctly rounded by the instruction that every target has.
inline float sqrt(float x) { return __builtin_sqrtf(x); }
inline double sqrt(double x) { return __builtin_sqrt(x); }

/// A number of which the last bits are units: added to x, it leaves x rounded to an integer there.
template <Real T>
inline constexpr T to_units = std::same_as<T, float> ? T(12582912)
                                                     : T(6755399441055744);  // 1.5 2^23

/// 2^n from to_units + n, for n within the normal exponents.
template <Real T>
constexpr T power_of_two(T units_and_n) {
  if constexpr (std::same_as<T, float>) {
    return __builtin_bit_cast(float, (__builtin_bit_cast(std::uint32_t, units_and_n) + 127) << 23);
  } else {
    return __builtin_bit_cast(double, (__builtin_bit_cast(std::uint64_t, units_and_n) + 1023)
                                          << 52);
  }
}

/// e^x to within 2 ulp; 0 below -80 and e^80 above 80, which no physical exponent here reaches.
///
/// x = n ln 2 + r with |r| <= ln(2)/2, then the Taylor series of e^r: 7 terms leave 5e-9 (float),
/// 13 leave 4e-18 (double). ln 2 is split in two so that n ln 2 is exact in its leading part
/// (Cody and Waite, Software Manual for the Elementary Functions, 1980, ch. 6). The terms are
/// summed in pairs, then pairs of pairs (Estrin): the chain of dependent operations is what takes
/// time.
template <Real T>
constexpr T exp(T x) {
  if (!(x > T(-80))) return T(0);
  if (x > T(80)) x = T(80);
  const T shifted = x * T(1.44269504088896340736) + to_units<T>;
  const T n = shifted - to_units<T>;
  if constexpr (std::same_as<T, float>) {
    const T r = (x - n * 0.693359375F) - n * -2.12194440e-4F;
    const T s = r * r;
    const T low = (T(1) + r) + s * (T(1.0 / 2) + r * T(1.0 / 6));
    const T high = (T(1.0 / 24) + r * T(1.0 / 120)) + s * (T(1.0 / 720) + r * T(1.0 / 5040));
    return (low + s * s * high) * power_of_two(shifted);
  } else {
    const T r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10;
    const T s = r * r, q = s * s;
    const T t0 = (1 + r) + s * (1.0 / 2 + r * (1.0 / 6));
    const T t4 = (1.0 / 24 + r * (1.0 / 120)) + s * (1.0 / 720 + r * (1.0 / 5040));
    const T t8 = (1.0 / 40320 + r * (1.0 / 362880)) + s * (1.0 / 3628800 + r * (1.0 / 39916800));
    const T t12 = 1.0 / 479001600 + r * (1.0 / 6227020800);
    return ((t0 + q * t4) + q * q * (t8 + q * t12)) * power_of_two(shifted);
  }
}

}  // namespace srm
