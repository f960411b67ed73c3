// Small things that everything stands on: angles and tables over them, linear systems, check sums,
// and the memory of parameters in another precision.
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "errors.hpp"
#include "srm/base/angle.hpp"
#include "srm/base/crc32.hpp"
#include "srm/base/symmetric.hpp"
#include "srm/base/table.hpp"
#include "srm/sim/columns.hpp"
#include "srm/sim/tables.hpp"
#include "within.hpp"

using namespace srm;

namespace {

/// Angles within a turn, at its edges too; phases behind each other; windows across zero.
double angles() {
  double worst = 0;
  const double below = std::nextafter(two_pi<double>, 0.0);
  for (double theta :
       {-1e5, -13.0, -two_pi<double>, -1e-17, 0.0, 3.0, below, two_pi<double>, 99.0, 999999.0}) {
    const double at = wrap(theta);
    worst = worst_of({worst, unless(at >= 0 && at < two_pi<double>),
                      off(std::cos(at), std::cos(theta)), off(std::sin(at), std::sin(theta))});
  }
  worst = worst_of({worst, off(wrap(1e6), 0), off(wrap(-1e6), 0), off(wrap(std::nan("")), 0),
                    off(wrap(below), below)});
  for (double theta = 0; theta < turn; theta += 0.1) {
    for (int k = 0; k < 5; ++k) {
      const double expected = wrap(theta - k * turn / 5);
      worst = worst_of({worst, off(phase_angle<5>(theta, k), expected),
                        off(phase_angle_in_turn<5>(theta, k), expected),
                        off(std::cos(phase_angle<5>(theta + 9 * turn, k)), std::cos(expected))});
    }
  }
  for (float theta :
       {0.0F, std::nextafter(two_pi<float> / 3, 0.0F), std::nextafter(two_pi<float>, 0.0F)}) {
    for (int k = 0; k < 3; ++k) {
      worst = worst_of({worst, unless(phase_angle<3>(theta, k) < two_pi<float> &&
                                      phase_angle_in_turn<3>(theta, k) < two_pi<float>)});
    }
  }
  return worst_of(
      {worst,
       unless(conducts(6.1, -0.3, 1.0) && conducts(0.0, -0.3, 1.0) && !conducts(1.0, -0.3, 1.0)),
       unless(conducts(2.0, 2.0, 1.0) && !conducts(1.5, 2.0, 1.0))});
}

/// A table over the root of the level, and over the angle in a circle.
double angle_tables() {
  constexpr int rows = 4, columns = 5;
  std::vector<double> values(rows * columns);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column)
      values[static_cast<std::size_t>(row * columns + column)] = row * (1 + column * column);
  }
  const AngleTable<double> table{{values.data(), rows * columns}, rows, columns, 9};
  double worst = 0;
  for (double level = -1; level < 12; level += 0.37) {
    const double row = std::sqrt(std::fmin(std::fmax(level / 9, 0), 1)) * 3;
    for (double x = 0; x < columns; x += 0.19) {
      const int left = static_cast<int>(x), right = left + 1 < columns ? left + 1 : 0;
      const double expected = row * (1 + left * left + (x - left) * (right * right - left * left));
      worst = worst_of({worst, off(table.at(level).at(x * two_pi<double> / columns), expected)});
    }
  }
  return worst_of({worst, off(table.at(9).at(std::nextafter(two_pi<double>, 0.0)), 3)});
}

/// A solution over the rows that are taken, zero elsewhere.
double systems() {
  double worst = 0;
  for (int which = 0; which < 16; ++which) {
    const std::array<bool, 4> taken{(which & 1) != 0, (which & 2) != 0, (which & 4) != 0,
                                    (which & 8) != 0};
    Square<double, 4> M;
    std::array<double, 4> x{1, -2, 3, 0.5};
    for (int j = 0; j < 4; ++j) {
      for (int k = 0; k < 4; ++k) M[j][k] = (j == k ? 5 : 0) + std::cos(j * k + 0.3 * (j + k));
    }
    const auto y = solved<double, 4>(taken, M, x);
    for (int j = 0; j < 4; ++j) {
      double sum = 0;
      for (int k = 0; k < 4; ++k) sum += M[j][k] * y[k];
      worst = worst_of({worst, taken[j] ? off(sum, x[j]) : off(y[j], 0)});
    }
  }
  return worst;
}

/// CRC-32 of "12345678" as the zlib has it, at once and in two parts.
double check_sums() {
  std::uint32_t word[2];
  std::memcpy(word, "12345678", 8);
  return unless(crc32(word, 2) == 0x9AE0DAAF && crc32(word + 1, 1, crc32(word, 1)) == 0x9AE0DAAF &&
                crc32(word, 0) == 0);
}

template <class T>
struct Parameters {
  T gain;
  int count;
  std::array<T, 2> pair;
  View<T> table;
  SRM_FIELDS(gain, count, pair, table)
};

/// Parameters in another precision, with a table of their own that lives as long as its owner.
double precisions() {
  std::vector<double> numbers{1.5, 2.5, 1.0 / 3};
  const Parameters<double> from{0.1, 7, {1, 2}, {numbers.data(), 3}};
  Parameters<float> to{};
  std::shared_ptr<const void> owner;
  {
    Tables memory;
    assign(to, from, memory);
    owner = memory.owner();
  }
  numbers.assign(3, 0);
  double worst =
      worst_of({unless(to.gain == 0.1F && to.count == 7 && to.pair[1] == 2 && to.table.size == 3),
                unless(to.table[0] == 1.5F && to.table[2] == static_cast<float>(1.0 / 3))});
  return worst;
}

struct Row {
  double t;
  std::array<int, 2> pair;
  SRM_FIELDS(t, pair)
};

/// A struct as a row of numbers, and back; a name for each.
double rows() {
  const Row row{0.5, {3, -4}};
  double number[3];
  Row back{};
  const std::vector<std::string> names = column_names(row);
  return worst_of({off(columns_of(row), 3), unless(write_columns(row, number) == number + 3),
                   off(number[2], -4), unless(read_columns(back, number) == number + 3),
                   off(back.pair[0], 3), off(back.t, 0.5),
                   unless(names.size() == 3 && names[0] == "t" && names[2] == "pair_1")});
}

template <int n>
struct Bytes {
  std::array<unsigned char, n> byte;
};

template <int n>
bool keeps() {
  Tables memory;
  std::array<const Bytes<n>*, 20> kept{};
  for (int j = 0; j < 20; ++j) {
    Bytes<n> one;
    one.byte.fill(static_cast<unsigned char>(j + 1));
    kept[j] = memory.keep_one(one);
    if (kept[j] == nullptr) return false;
  }
  for (int j = 0; j < 20; ++j) {
    for (const unsigned char byte : kept[j]->byte) {
      if (byte != j + 1) return false;
    }
  }
  return true;
}

}  // namespace

int main() {
  check("angles within a turn", angles(), 1e-9);
  check("tables over level and angle", angle_tables(), 1e-12);
  check("systems over some of the phases", systems(), 1e-12);
  check("check sums", check_sums(), 0);
  check("parameters in another precision", precisions(), 0);
  check("rows of numbers", rows(), 0);
  check("values of any size are kept",
        unless(keeps<1>() && keeps<24>() && keeps<48>() && keeps<200>()), 0);
  return failures == 0 ? 0 : 1;
}
