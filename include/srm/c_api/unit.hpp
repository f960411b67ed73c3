// A drive, a power stage or a controller behind one face without types: what a handle of the C
// interface stands for. Mock-up units and batches of environments use it directly.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "srm/c_api/reluctance.h"

namespace srm::c_api {

/// What a call came to: a status, and a name where one explains it.
struct Outcome {
  srm_status status = SRM_OK;
  std::string what{};
};

class Unit {
 public:
  virtual ~Unit() = default;

  virtual Outcome start() = 0;
  virtual void reset() = 0;
  virtual Outcome advance(double t_stop, double& reached) = 0;
  virtual Outcome sample() = 0;

  virtual const std::vector<std::string>& names(srm_table table) const = 0;
  /// Values and names of a table have the same length.
  virtual Outcome read(srm_table table, double* values) = 0;
  virtual Outcome write(srm_table table, std::size_t first, const double* values,
                        std::size_t count) = 0;
  virtual Outcome take(srm_table table, double* rows, std::size_t capacity, std::size_t& count) = 0;

  virtual std::size_t state_size() const = 0;
  virtual Outcome save(unsigned char* bytes) = 0;
  virtual Outcome restore(const unsigned char* bytes) = 0;
};

}  // namespace srm::c_api
