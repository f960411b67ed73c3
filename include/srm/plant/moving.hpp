// A quantity and its rate of change: what is written for values serves for their rates too.
#pragma once

namespace srm {

struct Moving {
  double now{}, rate{};  // rate: per second

  constexpr Moving() = default;
  constexpr Moving(double value) : now(value) {}  // NOLINT: a constant is a quantity too
  constexpr Moving(double value, double per_second) : now(value), rate(per_second) {}

  constexpr Moving& operator+=(const Moving& b) {
    now += b.now;
    rate += b.rate;
    return *this;
  }
};

constexpr Moving operator+(const Moving& a, const Moving& b) {
  return {a.now + b.now, a.rate + b.rate};
}
constexpr Moving operator-(const Moving& a, const Moving& b) {
  return {a.now - b.now, a.rate - b.rate};
}
constexpr Moving operator-(const Moving& a) { return {-a.now, -a.rate}; }
constexpr Moving operator*(double a, const Moving& b) { return {a * b.now, a * b.rate}; }
constexpr Moving operator*(const Moving& a, const Moving& b) {
  return {a.now * b.now, a.now * b.rate + a.rate * b.now};
}

/// The integral over a time h, from values and rates at both ends: exact for cubics.
constexpr double integral(const Moving& a, const Moving& b, double h) {
  return h / 2 * (a.now + b.now + h / 6 * (a.rate - b.rate));
}

/// The integral of the square, of the cubic polynomial with these values and rates: exact, so that
/// what is left of it less its mean is too.
constexpr double integral_of_square(const Moving& a, const Moving& b, double h) {
  const double s = h * a.rate, t = h * b.rate;
  const double ends = a.now * (156 * a.now + 108 * b.now + 44 * s - 26 * t) +
                      b.now * (156 * b.now + 26 * s - 44 * t);
  return h / 420 * (ends + 4 * (s * s + t * t) - 6 * s * t);
}

}  // namespace srm
