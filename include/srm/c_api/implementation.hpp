// The functions of reluctance.h: handles, checks of arguments, no exception across the border.
//
// Include it in one source file of a program or library; kinds.hpp says what it will hold.
#pragma once

#include <array>
#include <atomic>
#include <string_view>

#include "srm/c_api/kinds.hpp"
#include "srm/c_api/reluctance.h"

namespace srm::c_api {

/// Handles: a place in a table and a count of its uses, so that a freed one is told apart. The
/// place is the handle modulo the size.
class Handles {
 public:
  static constexpr std::uint32_t size = 4096;

  srm_unit add(std::unique_ptr<Unit> unit) {
    for (std::uint32_t n = 0; n < size; ++n) {
      const std::uint32_t j = next_.fetch_add(1) % size;
      Place& place = places_[j];
      bool free = false;
      if (!place.taken.compare_exchange_strong(free, true)) continue;
      const std::uint32_t use = place.use.load() % (0xffffffffu / size) + 1;
      place.use.store(use);
      place.unit.store(unit.release());
      return use * size + j;
    }
    return 0;
  }

  Unit* find(srm_unit handle) {
    Place& place = places_[handle % size];
    return place.use.load() == handle / size ? place.unit.load() : nullptr;
  }

  /// The unit, whose handle names nothing from now on; null where it did not before.
  std::unique_ptr<Unit> remove(srm_unit handle) {
    Place& place = places_[handle % size];
    if (place.use.load() != handle / size) return nullptr;
    std::unique_ptr<Unit> unit(place.unit.exchange(nullptr));
    if (unit) place.taken.store(false);
    return unit;
  }

 private:
  struct Place {
    std::atomic<bool> taken{false};
    std::atomic<std::uint32_t> use{0};
    std::atomic<Unit*> unit{nullptr};
  };
  std::array<Place, size> places_{};
  std::atomic<std::uint32_t> next_{0};
};

inline Handles& handles() {
  static Handles table;
  return table;
}

inline const char* text_of(srm_status status) {
  switch (status) {
    case SRM_OK:
      return "no error";
    case SRM_MORE:
      return "stopped early: take the rows that wait, and call again";
    case SRM_NULL_POINTER:
      return "a pointer is null";
    case SRM_NO_UNIT:
      return "the handle names no unit: it was never made, or was freed";
    case SRM_TOO_MANY_UNITS:
      return "too many units: free one first";
    case SRM_WRONG_SIZE:
      return "a buffer has the wrong size";
    case SRM_NOT_A_BLOB:
      return "not a blob of `reluctance export blob`, or one that is cut off";
    case SRM_WRONG_VERSION:
      return "the blob is of another version of reluctance: export it again";
    case SRM_WRONG_CHECKSUM:
      return "the checksum is wrong: the bytes are damaged";
    case SRM_NOT_BUILT:
      return "this library was compiled without this kind of drive";
    case SRM_BAD_PARAMETER:
      return "a number cannot be what it is meant for";
    case SRM_WRONG_ORDER:
      return "wrong order of calls: srm_start comes first, srm_reset goes back";
    case SRM_WRONG_PART:
      return "this part of a drive has no such function or table";
    case SRM_NO_SUCH_NAME:
      return "no entry has this name or index";
    case SRM_NOT_WRITABLE:
      return "this table can only be read";
    case SRM_NOT_FINITE:
      return "a number is not finite";
    case SRM_DIVERGED:
      return "the state has no meaningful numbers any more: reset the unit";
    case SRM_WRONG_STATE:
      return "the state is of another drive or part";
    case SRM_OUT_OF_MEMORY:
      return "not enough memory";
    case SRM_INTERNAL:
      return "a fault of the library";
    default:
      return "unknown status";
  }
}

inline thread_local std::array<char, 256> last_error{};

inline srm_status told(srm_status status, const std::string& what = {}) {
  if (status < 0) {
    std::size_t n = 0;  // not printf: it would be a fifth of a module for the browser
    const auto append = [&n](std::string_view text) {
      for (const char c : text) {
        if (n + 1 < last_error.size()) last_error[n++] = c;
      }
    };
    append(text_of(status));
    if (!what.empty()) append(": ");
    append(what);
    last_error[n] = '\0';
  }
  return status;
}
inline srm_status told(const Outcome& outcome) { return told(outcome.status, outcome.what); }

/// Runs f, and makes a status of whatever it throws.
template <class F>
srm_status guarded(F&& f) {
#ifdef __cpp_exceptions
  try {
    return f();
  } catch (const std::bad_alloc&) {
    return told(SRM_OUT_OF_MEMORY);
  } catch (...) {
    return told(SRM_INTERNAL);
  }
#else
  return f();
#endif
}

/// Runs f(unit) on the unit of a handle.
template <class F>
srm_status with_unit(srm_unit handle, F&& f) {
  return guarded([&] {
    Unit* unit = handles().find(handle);
    return unit ? f(*unit) : told(SRM_NO_UNIT);
  });
}

/// The same with the names of a table.
template <class F>
srm_status with_table(srm_unit handle, srm_table table, F&& f) {
  return with_unit(handle, [&](Unit& unit) {
    if (table < SRM_PARAMETER || table > SRM_STATES) return told(SRM_NO_SUCH_NAME, "table");
    const auto& names = unit.names(table);
    const bool may_be_empty = table == SRM_INPUT;
    return names.empty() && !may_be_empty ? told(SRM_WRONG_PART) : f(unit, names);
  });
}

/// The same with an index that names an entry.
template <class F>
srm_status with_entry(srm_unit handle, srm_table table, int32_t index, F&& f) {
  return with_table(handle, table, [&](Unit& unit, const std::vector<std::string>& names) {
    const bool known = index >= 0 && std::size_t(index) < names.size();
    return known ? f(unit, names) : told(SRM_NO_SUCH_NAME);
  });
}

}  // namespace srm::c_api

extern "C" {

SRM_API int32_t srm_version(void) { return SRM_VERSION; }

SRM_API const char* srm_text(srm_status status) { return srm::c_api::text_of(status); }

SRM_API const char* srm_mode_text(int32_t mode) {
  return srm::describe(static_cast<srm::Mode>(mode));
}

SRM_API const char* srm_fault_text(int32_t status) {
  const bool known = status == static_cast<std::int8_t>(status);
  return srm::describe(static_cast<srm::Status>(known ? status : -1));
}

SRM_API const char* srm_last_error(void) { return srm::c_api::last_error.data(); }

SRM_API srm_status srm_create(const void* blob, size_t size, srm_part part, srm_unit* unit) {
  using namespace srm::c_api;
  return guarded([&] {
    if (!blob || !unit) return told(SRM_NULL_POINTER);
    *unit = 0;
    if (part < SRM_DRIVE || part > SRM_CONTROLLER) return told(SRM_WRONG_PART);
    Made found = made(static_cast<const unsigned char*>(blob), size, part);
    if (found.outcome.status != SRM_OK) return told(found.outcome);
    *unit = handles().add(std::move(found.unit));
    return *unit == 0 ? told(SRM_TOO_MANY_UNITS) : SRM_OK;
  });
}

SRM_API srm_status srm_free(srm_unit unit) {
  using namespace srm::c_api;
  return guarded([&] { return handles().remove(unit) ? SRM_OK : told(SRM_NO_UNIT); });
}

SRM_API srm_status srm_start(srm_unit unit) {
  using namespace srm::c_api;
  return with_unit(unit, [](Unit& u) { return told(u.start()); });
}

SRM_API srm_status srm_reset(srm_unit unit) {
  using namespace srm::c_api;
  return with_unit(unit, [](Unit& u) {
    u.reset();
    return SRM_OK;
  });
}

SRM_API srm_status srm_count(srm_unit unit, srm_table table, int32_t* count) {
  using namespace srm::c_api;
  return with_table(unit, table, [&](Unit&, const auto& names) {
    if (!count) return told(SRM_NULL_POINTER);
    *count = static_cast<int32_t>(names.size());
    return srm_status(SRM_OK);
  });
}

SRM_API srm_status srm_name(srm_unit unit, srm_table table, int32_t index, const char** name) {
  using namespace srm::c_api;
  return with_entry(unit, table, index, [&](Unit&, const auto& names) {
    if (!name) return told(SRM_NULL_POINTER);
    *name = names[std::size_t(index)].c_str();
    return srm_status(SRM_OK);
  });
}

SRM_API srm_status srm_find(srm_unit unit, srm_table table, const char* name, int32_t* index) {
  using namespace srm::c_api;
  return with_table(unit, table, [&](Unit&, const auto& names) {
    if (!name || !index) return told(SRM_NULL_POINTER);
    for (std::size_t j = 0; j < names.size(); ++j) {
      if (names[j] != name) continue;
      *index = static_cast<int32_t>(j);
      return srm_status(SRM_OK);
    }
    return told(SRM_NO_SUCH_NAME, std::string(name).substr(0, 100));
  });
}

SRM_API srm_status srm_get(srm_unit unit, srm_table table, int32_t index, double* value) {
  using namespace srm::c_api;
  return with_entry(unit, table, index, [&](Unit& u, const auto& names) {
    if (!value) return told(SRM_NULL_POINTER);
    std::vector<double> row(names.size());
    const Outcome outcome = u.read(table, row.data());
    if (outcome.status == SRM_OK) *value = row[std::size_t(index)];
    return told(outcome);
  });
}

SRM_API srm_status srm_set(srm_unit unit, srm_table table, int32_t index, double value) {
  using namespace srm::c_api;
  return with_entry(unit, table, index, [&](Unit& u, const auto&) {
    return told(u.write(table, std::size_t(index), &value, 1));
  });
}

SRM_API srm_status srm_read(srm_unit unit, srm_table table, double* values, size_t count) {
  using namespace srm::c_api;
  return with_table(unit, table, [&](Unit& u, const auto& names) {
    if (!values) return told(SRM_NULL_POINTER);
    return count == names.size() ? told(u.read(table, values)) : told(SRM_WRONG_SIZE);
  });
}

SRM_API srm_status srm_write(srm_unit unit, srm_table table, const double* values, size_t count) {
  using namespace srm::c_api;
  return with_table(unit, table, [&](Unit& u, const auto& names) {
    if (!values) return told(SRM_NULL_POINTER);
    return count == names.size() ? told(u.write(table, 0, values, count)) : told(SRM_WRONG_SIZE);
  });
}

SRM_API srm_status srm_advance(srm_unit unit, double t_stop, double* reached) {
  using namespace srm::c_api;
  return with_unit(unit, [&](Unit& u) {
    double t = 0;
    const Outcome outcome = u.advance(t_stop, t);
    if (reached && outcome.status >= 0) *reached = t;
    return told(outcome);
  });
}

SRM_API srm_status srm_sample(srm_unit unit) {
  using namespace srm::c_api;
  return with_unit(unit, [](Unit& u) { return told(u.sample()); });
}

SRM_API srm_status srm_take(srm_unit unit, srm_table table, double* rows, size_t capacity,
                            size_t* count) {
  using namespace srm::c_api;
  return with_table(unit, table, [&](Unit& u, const auto&) {
    if (!count || (!rows && capacity > 0)) return told(SRM_NULL_POINTER);
    *count = 0;
    return told(u.take(table, rows, capacity, *count));
  });
}

SRM_API srm_status srm_state_size(srm_unit unit, size_t* size) {
  using namespace srm::c_api;
  return with_unit(unit, [&](Unit& u) {
    if (!size) return told(SRM_NULL_POINTER);
    *size = u.state_size();
    return srm_status(SRM_OK);
  });
}

SRM_API srm_status srm_save(srm_unit unit, void* bytes, size_t size) {
  using namespace srm::c_api;
  return with_unit(unit, [&](Unit& u) {
    if (!bytes) return told(SRM_NULL_POINTER);
    if (size != u.state_size()) return told(SRM_WRONG_SIZE);
    return told(u.save(static_cast<unsigned char*>(bytes)));
  });
}

SRM_API srm_status srm_restore(srm_unit unit, const void* bytes, size_t size) {
  using namespace srm::c_api;
  return with_unit(unit, [&](Unit& u) {
    if (!bytes) return told(SRM_NULL_POINTER);
    if (size != u.state_size()) return told(SRM_WRONG_SIZE);
    return told(u.restore(static_cast<const unsigned char*>(bytes)));
  });
}

}  // extern "C"
