// Drives for learning that are stepped together, whatever they are.
#pragma once

#include "bindings.hpp"
#include "srm/sim/environment.hpp"

namespace bound {

/// Drives that share machine model, number of phases and rules, whatever those are.
class Batch {
 public:
  virtual ~Batch() = default;

  /// The numbers that an episode begins with, by name.
  virtual std::vector<std::pair<std::string, double>> numbers() const = 0;
  virtual int observed() const = 0;
  virtual void start(int j, const std::vector<double>& drawn) = 0;
  virtual void observe(float* to) const = 0;
  virtual void step(const double* actions, const bool* waiting, float* observations, double* prices,
                    bool* tripped) = 0;
  virtual void obey(const double* orders, float* observations, double* prices, bool* tripped) = 0;
  virtual std::vector<double> figures(int j) const = 0;
  virtual std::vector<double> sample(int j) const = 0;

  int size = 0, n_phases = 0, order_columns = 0;
};

/// What a batch is made of.
struct BatchParts {
  int count;
  const AnyMachine& machine;
  int n_phases;
  double R;
  const srm::Source& source;
  const srm::Bridge& bridge;
  const srm::Shaft& shaft;
  double theta_m, reference;
  const srm::Rules& rules;
  const std::vector<std::string>& drawn;
};

template <Forms here>
std::unique_ptr<Batch> made_batch(const BatchParts& given);

}  // namespace bound
