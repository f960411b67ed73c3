// What both versions of the Functional Mock-up Interface share: an instance of the unit of one
// drive.
//
// The generated source of a unit defines, before it includes fmi2.hpp or fmi3.hpp, the kind of the
// drive (c_api/kinds.hpp) and
//   namespace drive { const unsigned char blob[]; const std::size_t size; const srm_part part;
//                     const double T_s; const char token[]; }
// A value reference is 65536 times the table plus the index plus 1 (c_api/reluctance.h); 0 is time.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "srm/c_api/implementation.hpp"

namespace srm::fmi {

using Bytes = std::vector<unsigned char>;
using Reference = std::uint32_t;

/// The table that a reference is in, perhaps none that there is, and the index there.
struct Entry {
  srm_table table;
  std::size_t index;
};
inline Entry entry(Reference r) {
  return {static_cast<srm_table>((r - 1) / 65536), (r - 1) % 65536};
}

class Instance {
 public:
  double t_start = 0;  // of the experiment [s]
  double t = 0;        // since then [s]
  bool ended = false;  // diverged: the simulation is to end
  std::string why;     // of the last fault

  Instance() : made_(c_api::made(drive::blob, drive::size, drive::part)) {}

  bool is_made() const { return made_.unit != nullptr; }

  bool start() { return started_ || (started_ = fine(unit().start())); }

  void reset() {
    made_ = c_api::made(drive::blob, drive::size, drive::part);  // the start values
    started_ = ended = false;
    t = t_start = 0;
    last_sample_ = -1;
  }

  /// Values of references into numbers of any type.
  template <class V>
  bool get(const Reference* references, std::size_t n, V* values) {
    const bool early = !started_ && needs_start(references, n);
    if (early && !fine(unit().start())) return false;
    bool good = true;
    srm_table read = -1;
    for (std::size_t j = 0; j < n && good; ++j) {
      if (references[j] == 0) {
        values[j] = static_cast<V>(t_start + t);
        continue;
      }
      const Entry e = entry(references[j]);
      good = is_known(e);
      if (good && e.table != read) {
        row_.resize(unit().names(e.table).size());
        good = fine(unit().read(e.table, row_.data()));
        read = e.table;
      }
      if (good) values[j] = static_cast<V>(row_[e.index]);
    }
    if (early) unit().reset();
    return good;
  }

  template <class V>
  bool set(const Reference* references, std::size_t n, const V* values) {
    for (std::size_t j = 0; j < n; ++j) {
      const Entry e = entry(references[j]);
      const double value = static_cast<double>(values[j]);
      if (references[j] == 0 || !is_known(e)) return refused("no variable has this reference");
      if (!fine(unit().write(e.table, e.index, &value, 1))) return false;
    }
    return true;
  }

  /// From t_now, of the importer, by h [s].
  bool step(double t_now, double h) {
    if (!started_) return refused("step before the end of initialisation");
    if (ended) return refused("the unit has diverged; reset it");
    const double from = t_now - t_start, to = from + h;
    if (!(h > 0) || !is_finite(to)) return refused("a step needs a positive length");
    if (!(std::fabs(from - t) <= 1e-3 * h)) {  // more than the rounding of an importer's clock
      char text[80];
      std::snprintf(text, sizeof text, "a step from %.9g s, the unit is at %.9g s", t_now,
                    t_start + t);
      return refused(text);
    }
    if (drive::part == SRM_CONTROLLER) return control(to);
    if (drive::part == SRM_STAGE && !sample_due(from)) return false;
    c_api::Outcome outcome{SRM_MORE};
    while (outcome.status == SRM_MORE) {
      outcome = unit().advance(to, t);
      if (!drop_rows()) return false;
    }
    ended = outcome.status == SRM_DIVERGED;
    return fine(outcome);
  }

  /// All of the instance as bytes: parameters, inputs, time, and the state of the unit once
  /// started.
  bool save(Bytes& bytes) {
    bytes.clear();
    put(bytes, started_);
    put(bytes, ended);
    put(bytes, t_start);
    put(bytes, t);
    put(bytes, last_sample_);
    for (const srm_table table : {SRM_PARAMETER, SRM_INPUT}) {
      std::vector<double> row(unit().names(table).size());
      if (!fine(unit().read(table, row.data()))) return false;
      for (const double value : row) put(bytes, value);
    }
    if (!started_) return true;
    const std::size_t head = bytes.size();
    bytes.resize(head + unit().state_size());
    return fine(unit().save(bytes.data() + head));
  }

  bool restore(const Bytes& bytes) {
    const std::size_t parameters = unit().names(SRM_PARAMETER).size();
    const std::size_t inputs = unit().names(SRM_INPUT).size();
    const std::size_t head = 2 * sizeof(bool) + 2 * sizeof(double) + sizeof last_sample_;
    const std::size_t rows = (parameters + inputs) * sizeof(double);
    if (bytes.size() != head + rows && bytes.size() != head + rows + unit().state_size()) {
      return refused("a state of another unit");
    }
    const unsigned char* from = bytes.data();
    bool started = false;
    take(from, started);
    if (started != (bytes.size() > head + rows)) return refused("a damaged state");
    take(from, ended);
    take(from, t_start);
    take(from, t);
    take(from, last_sample_);
    std::vector<double> row(parameters + inputs);
    std::memcpy(row.data(), from, rows);
    unit().reset();
    started_ = false;
    if (!fine(unit().write(SRM_PARAMETER, 0, row.data(), parameters))) return false;
    if (!fine(unit().write(SRM_INPUT, 0, row.data() + parameters, inputs))) return false;
    if (!started) return true;
    return start() && fine(unit().restore(from + rows));
  }

  bool refused(const std::string& text) {
    why = text;
    return false;
  }

 private:
  c_api::Unit& unit() { return *made_.unit; }

  bool fine(const c_api::Outcome& outcome) {
    if (outcome.status >= 0) return true;
    why = c_api::text_of(outcome.status);
    if (!outcome.what.empty()) why += ": " + outcome.what;
    return false;
  }

  bool is_known(const Entry& e) {
    if (e.table <= SRM_STATES && e.index < unit().names(e.table).size()) return true;
    return refused("no variable has this reference");
  }

  static bool needs_start(const Reference* references, std::size_t n) {
    for (std::size_t j = 0; j < n; ++j) {
      if (references[j] > 0 && entry(references[j]).table > SRM_INPUT) return true;
    }
    return false;
  }

  /// Samples at the first instant that is at or past the next multiple of the control period. Where
  /// that is refused, the next step tries again.
  bool sample_due(double now) {
    const auto n = static_cast<long long>(now / drive::T_s + 1e-6);
    if (n <= last_sample_) return true;
    if (!fine(unit().sample())) return false;
    last_sample_ = n;
    return true;
  }

  /// Takes every sample before `to`, of the measurement that the importer has last written.
  bool control(double to) {
    while (static_cast<double>(last_sample_ + 1) * drive::T_s < to - 1e-6 * drive::T_s) {
      if (!fine(unit().sample())) return false;
      ++last_sample_;
    }
    t = to;
    return true;
  }

  /// Rows of waveforms and periods are for other users of the unit.
  bool drop_rows() {
    std::size_t count = 0;
    for (const srm_table table : {SRM_WAVEFORM, SRM_PERIOD}) {
      rows_.resize((table == SRM_WAVEFORM ? 1 : 1000) * unit().names(table).size());
      const std::size_t capacity = rows_.size() / unit().names(table).size();
      if (!fine(unit().take(table, rows_.data(), capacity, count))) return false;
    }
    return true;
  }

  template <class V>
  static void put(Bytes& bytes, const V& value) {
    const auto* from = reinterpret_cast<const unsigned char*>(&value);
    bytes.insert(bytes.end(), from, from + sizeof value);
  }
  template <class V>
  static void take(const unsigned char*& from, V& value) {
    std::memcpy(&value, from, sizeof value);
    from += sizeof value;
  }

  c_api::Made made_;
  bool started_ = false;
  long long last_sample_ = -1;
  std::vector<double> row_, rows_;
};

/// Runs f, and makes false of whatever it throws.
template <class F>
bool guarded(Instance& instance, const F& f) {
  try {
    return f();
  } catch (...) {
    return instance.refused("not enough memory");
  }
}

}  // namespace srm::fmi
