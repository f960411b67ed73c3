// Drives for learning behind one interface.
#pragma once

#include "simulation.hpp"
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

/// Drives that share all but the numbers named in `drawn`.
using MakesBatch = std::unique_ptr<Batch>(int count, int n_phases, const SimulationParts& of,
                                          const srm::Rules& rules,
                                          const std::vector<std::string>& drawn);

}  // namespace bound
