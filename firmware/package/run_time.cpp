// The C interface over the parameters that may change at run time: ranges, and the image of a set.
#include <bit>

#include "_standard.hpp"
#include "reluctance_parameters.h"
#include "srm/base/crc32.hpp"
#include "state.hpp"

namespace {

using reluctance::n_run_time;
using reluctance::run_time;
using reluctance::State;
using reluctance::state_of;

static_assert(n_run_time == RELUCTANCE_PARAMETERS);

constexpr uint32_t image_version = 2;
constexpr int first = 3;  // value in an image, after version, fingerprint and number

bool known(int32_t number) { return number >= 0 && number < n_run_time; }

/// Written so that NaN fails.
bool in_range(int32_t number, float value) {
  return value >= run_time[number].least && value <= run_time[number].most;
}

bool same(const char* a, const char* b) {
  while (*a != '\0' && *a == *b) ++a, ++b;
  return *a == *b;
}

}  // namespace

int32_t reluctance_parameter_count(void) { return n_run_time; }

reluctance_parameter_answer reluctance_parameter_describe(int32_t number,
                                                          reluctance_parameter* to) {
  if (!known(number)) return RELUCTANCE_PARAMETER_UNKNOWN;
  const auto& of = run_time[number];
  *to = {of.name, of.unit, of.least, of.most, of.built};
  return RELUCTANCE_PARAMETER_OK;
}

int32_t reluctance_parameter_find(const char* name) {
  for (int32_t number = 0; number < n_run_time; ++number) {
    if (same(name, run_time[number].name)) return number;
  }
  return -1;
}

float reluctance_parameter_get(const reluctance_controller* controller, int32_t number) {
  return known(number) ? state_of(controller).control.parameter[number] : 0.0F;
}

reluctance_parameter_answer reluctance_parameter_set(reluctance_controller* controller,
                                                     int32_t number, float value) {
  if (!known(number)) return RELUCTANCE_PARAMETER_UNKNOWN;
  if (!in_range(number, value)) return RELUCTANCE_PARAMETER_OUT_OF_RANGE;
  State& x = state_of(controller);
  x.control.parameter[number] = value;
  ++x.changes;
  return RELUCTANCE_PARAMETER_OK;
}

void reluctance_parameter_save(const reluctance_controller* controller,
                               reluctance_parameter_image* image) {
  image->word[0] = image_version;
  image->word[1] = reluctance_fingerprint();
  image->word[2] = n_run_time;
  for (int n = 0; n < n_run_time; ++n) {
    image->word[first + n] = std::bit_cast<uint32_t>(state_of(controller).control.parameter[n]);
  }
  image->word[first + n_run_time] = srm::crc32(image->word, first + n_run_time);
}

reluctance_parameter_answer reluctance_parameter_load(reluctance_controller* controller,
                                                      const reluctance_parameter_image* image) {
  if (image->word[first + n_run_time] != srm::crc32(image->word, first + n_run_time)) {
    return RELUCTANCE_PARAMETER_DAMAGED;
  }
  if (image->word[0] != image_version || image->word[1] != reluctance_fingerprint() ||
      image->word[2] != n_run_time) {
    return RELUCTANCE_PARAMETER_OTHER_DRIVE;
  }
  for (int n = 0; n < n_run_time; ++n) {
    if (!in_range(n, std::bit_cast<float>(image->word[first + n]))) {
      return RELUCTANCE_PARAMETER_OUT_OF_RANGE;
    }
  }
  State& x = state_of(controller);
  for (int n = 0; n < n_run_time; ++n) {
    x.control.parameter[n] = std::bit_cast<float>(image->word[first + n]);
  }
  ++x.changes;
  return RELUCTANCE_PARAMETER_OK;
}
