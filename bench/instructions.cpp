// A drive from its blob, run to an end: what bench/instructions.py counts.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "srm/c_api/reluctance.h"

namespace {

void check(srm_status status) {
  if (status >= 0) return;
  std::fprintf(stderr, "%d: %s\n", status, srm_last_error());
  std::exit(1);
}

}  // namespace

/// instructions BLOB END
int main(int, char** argument) {
  std::ifstream file(argument[1], std::ios::binary);
  const std::vector<char> blob{std::istreambuf_iterator<char>(file), {}};
  const double end = std::atof(argument[2]);
  srm_unit unit;
  check(srm_create(blob.data(), blob.size(), SRM_DRIVE, &unit));
  check(srm_start(unit));
  std::vector<double> rows(20000 * 100);
  for (srm_status status = SRM_MORE; status == SRM_MORE;) {
    double reached = 0;
    status = srm_advance(unit, end, &reached);
    check(status);
    for (const srm_table table : {SRM_WAVEFORM, SRM_PERIOD}) {
      std::size_t taken = 0;
      check(srm_take(unit, table, rows.data(), table == SRM_WAVEFORM ? 20000 : 1000, &taken));
    }
  }
  std::int32_t columns = 0;
  check(srm_count(unit, SRM_WAVEFORM, &columns));
  std::vector<double> row(static_cast<std::size_t>(columns));
  check(srm_read(unit, SRM_WAVEFORM, row.data(), row.size()));
  for (const double value : row) std::printf("%.12g ", value);
  std::printf("\n");
}
