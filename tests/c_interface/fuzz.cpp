// Random sequences of calls of the C interface with good and bad arguments: every one is answered.
//
//   fuzz SEQUENCES SEED BLOB...
//
// Built with sanitizers: a wild pointer, a leak or undefined behaviour ends it. A number of a blob
// may be changed with the checksum corrected, so that the checks of parameters are reached too.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "srm/c_api/implementation.hpp"

namespace {

using Bytes = std::vector<unsigned char>;
std::mt19937_64 random_bits;
std::map<srm_status, long> seen;

int below(int n) { return int(random_bits() % std::uint64_t(n)); }

double any_number() {
  constexpr double special[] = {0,
                                -0.0,
                                1,
                                -1,
                                0.5,
                                1e-9,
                                1e9,
                                1e30,
                                1e300,
                                -1e300,
                                240,
                                2.0e-5,
                                41,
                                3,
                                std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()};
  if (below(3) == 0) return std::ldexp(double(std::int64_t(random_bits())), -below(90));
  return special[below(int(std::size(special)))];
}

srm_status counted(srm_status status) {
  ++seen[status];
  if (status < SRM_INTERNAL + 1 || status > SRM_MORE) {
    std::printf("status %d: %s\n", int(status), srm_last_error());
    std::exit(1);
  }
  return status;
}

void damage(Bytes& blob) {
  switch (below(5)) {
    case 0:
      blob.resize(std::size_t(below(int(blob.size()) + 1)));
      return;
    case 1:
      if (!blob.empty()) blob[std::size_t(below(int(blob.size())))] ^= 1 << below(8);
      return;
    default: {  // some numbers, with the checksum that belongs to them
      if (blob.size() < 88) return;
      for (int n = below(3); n >= 0; --n) {
        const double value = any_number();
        const int numbers = int(blob.size()) / 8 - 11;
        std::memcpy(&blob[std::size_t(88 + 8 * below(numbers))], &value, 8);
      }
      const std::string_view all(reinterpret_cast<const char*>(blob.data()), blob.size());
      using namespace srm::c_api;
      const std::uint64_t sum = hashed(hashed(hash_start, all.substr(0, 80)), all.substr(88));
      std::memcpy(&blob[80], &sum, 8);
    }
  }
}

srm_unit some_unit(const std::vector<srm_unit>& units) {
  if (units.empty() || below(20) == 0) return srm_unit(random_bits());
  return units[std::size_t(below(int(units.size())))];
}

/// A call with arguments that are mostly good.
void call(std::vector<srm_unit>& units, std::vector<Bytes>& states) {
  const srm_unit unit = some_unit(units);
  const srm_table table = below(12) == 0 ? int(random_bits()) : below(9);
  int32_t count = 0, index = 0;
  const bool known = srm_count(unit, table, &count) == SRM_OK;
  std::vector<double> row(known ? std::size_t(count) : 10);
  index = below(count + 2) - 1;
  switch (below(16)) {
    case 0:
      counted(srm_start(unit));
      return;
    case 1:
      if (below(6) == 0) counted(srm_reset(unit));
      return;
    case 2:
      if (below(8) == 0) counted(srm_free(unit));
      return;
    case 3: {
      const char* name = nullptr;
      if (counted(srm_name(unit, table, index, &name)) == SRM_OK) {
        counted(srm_find(unit, table, name, &index));
      }
      return;
    }
    case 4: {
      double value = 0;
      counted(srm_get(unit, table, index, &value));
      return;
    }
    case 5:
      counted(srm_set(unit, table, index, any_number()));
      return;
    case 6:
      counted(srm_read(unit, table, row.data(), row.size() - (below(20) == 0 ? 1 : 0)));
      return;
    case 7:
      if (srm_read(unit, table, row.data(), row.size()) == SRM_OK && !row.empty()) {
        if (below(2)) row[std::size_t(below(int(row.size())))] = any_number();
      }
      counted(srm_write(unit, table, row.data(), row.size()));
      return;
    case 8: {
      const double legs[3] = {double(below(3) - 1), double(below(3) - 1), double(below(4) - 1)};
      counted(srm_write(unit, SRM_LEG, legs, 3));
      return;
    }
    case 9:
    case 10:
      counted(srm_sample(unit));
      return;
    case 11: {
      static std::vector<double> rows(20000 * 64);
      std::size_t taken = 0;
      counted(srm_take(unit, table, rows.data(), below(8) == 0 ? 0 : 20000, &taken));
      return;
    }
    case 12: {
      std::size_t size = 0;
      if (srm_state_size(unit, &size) != SRM_OK) return;
      Bytes state(size);
      if (counted(srm_save(unit, state.data(), size)) == SRM_OK) {
        if (below(10) == 0) state[std::size_t(below(int(size)))] ^= 4;
        states.push_back(std::move(state));
      }
      return;
    }
    case 13:
      if (states.empty()) return;
      {
        const Bytes& state = states[std::size_t(below(int(states.size())))];
        counted(srm_restore(unit, state.data(), state.size()));
      }
      return;
    default: {
      double t[64] = {}, reached = 0;
      if (srm_count(unit, SRM_WAVEFORM, &count) == SRM_OK && count <= 64) {
        srm_read(unit, SRM_WAVEFORM, t, std::size_t(count));
      }
      const double stop =
          below(15) == 0 ? std::min(any_number(), t[0] + 1e-4) : t[0] + 1e-6 * double(below(200));
      counted(srm_advance(unit, stop, below(5) == 0 ? nullptr : &reached));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  std::vector<Bytes> blobs;
  for (int j = 3; j < argc; ++j) {
    std::ifstream file(argv[j], std::ios::binary);
    blobs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  const long sequences = std::atol(argv[1]);
  const unsigned long seed = std::strtoul(argv[2], nullptr, 10);
  long calls = 0;
  for (long j = 0; j < sequences; ++j) {
    random_bits.seed(seed * 1000003 + std::uint64_t(j));
    std::vector<srm_unit> units;
    std::vector<Bytes> states;
    for (int n = 10 + below(40); n > 0; --n, ++calls) {
      if (units.size() < 4 && below(8) == 0) {
        Bytes blob = blobs[std::size_t(below(int(blobs.size())))];
        if (below(3) == 0) damage(blob);
        srm_unit unit = 0;
        const srm_part part = below(30) == 0 ? 7 : below(3);
        if (counted(srm_create(blob.data(), blob.size(), part, &unit)) == SRM_OK) {
          units.push_back(unit);
          if (below(4)) counted(srm_start(unit));
        }
      } else {
        call(units, states);
      }
    }
    for (const srm_unit unit : units) srm_free(unit);
  }
  std::printf("%ld sequences, %ld calls\n", sequences, calls);
  for (const auto& [status, n] : seen)
    std::printf("%4d %9ld  %s\n", int(status), n, srm_text(status));
  return 0;
}
