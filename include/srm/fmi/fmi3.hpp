// The functions of FMI 3.0 for co-simulation. https://fmi-standard.org, version 3.0.
#pragma once

#include "srm/fmi/instance.hpp"

#define FMI3_API extern "C" __attribute__((visibility("default")))

namespace srm::fmi {

enum Status3 { ok3, warning3, discard3, error3, fatal3 };
using Logger3 = void (*)(void*, int, const char*, const char*);

struct Component3 {
  Instance instance;
  Logger3 logger = nullptr;
  void* environment = nullptr;

  int told(bool good) {
    if (good) return ok3;
    if (logger) logger(environment, error3, "logStatusError", instance.why.c_str());
    return error3;
  }
  template <class F>
  int run(const F& f) {
    return told(guarded(instance, [&] { return f(instance); }));
  }
};

template <class F>
int with3(void* c, const F& f) {
  return c ? static_cast<Component3*>(c)->run(f) : int(error3);
}

using References = const std::uint32_t*;

}  // namespace srm::fmi

FMI3_API const char* fmi3GetVersion() { return "3.0"; }
FMI3_API int fmi3SetDebugLogging(void*, bool, std::size_t, const char* const*) { return 0; }

FMI3_API void* fmi3InstantiateCoSimulation(const char*, const char* token, const char*, bool, bool,
                                           bool, bool, srm::fmi::References, std::size_t,
                                           void* environment, srm::fmi::Logger3 logger, void*) {
  using namespace srm::fmi;
  try {
    auto component = std::make_unique<Component3>();
    component->logger = logger;
    component->environment = environment;
    Instance& instance = component->instance;
    if (!token || std::strcmp(token, drive::token) != 0) instance.refused("another token");
    if (!instance.is_made()) instance.refused("the parameters of the unit are damaged");
    if (!instance.why.empty()) {
      component->told(false);
      return nullptr;
    }
    return component.release();
  } catch (...) {
    return nullptr;
  }
}
FMI3_API void* fmi3InstantiateModelExchange(const char*, const char*, const char*, bool, bool,
                                            void*, srm::fmi::Logger3) {
  return nullptr;
}
FMI3_API void* fmi3InstantiateScheduledExecution(const char*, const char*, const char*, bool, bool,
                                                 void*, srm::fmi::Logger3, void*, void*, void*) {
  return nullptr;
}
FMI3_API void fmi3FreeInstance(void* c) { delete static_cast<srm::fmi::Component3*>(c); }

FMI3_API int fmi3EnterInitializationMode(void* c, bool, double, double t_start, bool, double) {
  return srm::fmi::with3(c, [&](auto& x) {
    x.t_start = t_start;
    return srm::is_finite(t_start) || x.refused("the start time is not finite");
  });
}
FMI3_API int fmi3ExitInitializationMode(void* c) {
  return srm::fmi::with3(c, [](auto& x) { return x.start(); });
}
FMI3_API int fmi3Terminate(void* c) {
  return srm::fmi::with3(c, [](auto&) { return true; });
}
FMI3_API int fmi3Reset(void* c) {
  return srm::fmi::with3(c, [](auto& x) {
    x.reset();
    return x.is_made();
  });
}

FMI3_API int fmi3GetFloat64(void* c, srm::fmi::References r, std::size_t n, double* v,
                            std::size_t m) {
  return srm::fmi::with3(c, [&](auto& x) { return m == n && x.get(r, n, v); });
}
FMI3_API int fmi3SetFloat64(void* c, srm::fmi::References r, std::size_t n, const double* v,
                            std::size_t m) {
  return srm::fmi::with3(c, [&](auto& x) { return m == n && x.set(r, n, v); });
}
FMI3_API int fmi3GetInt32(void* c, srm::fmi::References r, std::size_t n, std::int32_t* v,
                          std::size_t m) {
  return srm::fmi::with3(c, [&](auto& x) { return m == n && x.get(r, n, v); });
}
FMI3_API int fmi3SetInt32(void* c, srm::fmi::References r, std::size_t n, const std::int32_t* v,
                          std::size_t m) {
  return srm::fmi::with3(c, [&](auto& x) { return m == n && x.set(r, n, v); });
}

/// A diverged unit asks for the end of the simulation.
FMI3_API int fmi3DoStep(void* c, double t, double h, bool, bool* event, bool* terminate,
                        bool* early, double* last) {
  const int status = srm::fmi::with3(c, [&](auto& x) { return x.step(t, h); });
  const auto* x = c ? &static_cast<srm::fmi::Component3*>(c)->instance : nullptr;
  const bool ended = x && x->ended;
  if (event) *event = false;
  if (terminate) *terminate = ended;
  if (early) *early = ended;
  if (last && x) *last = x->t_start + x->t;
  return status != 0 && ended ? int(srm::fmi::discard3) : status;
}

FMI3_API int fmi3GetFMUState(void* c, void** state) {
  return srm::fmi::with3(c, [&](auto& x) {
    if (!*state) *state = new srm::fmi::Bytes;
    return x.save(*static_cast<srm::fmi::Bytes*>(*state));
  });
}
FMI3_API int fmi3SetFMUState(void* c, void* state) {
  return srm::fmi::with3(c, [&](auto& x) {
    return state ? x.restore(*static_cast<srm::fmi::Bytes*>(state)) : x.refused("no state");
  });
}
FMI3_API int fmi3FreeFMUState(void*, void** state) {
  if (state) {
    delete static_cast<srm::fmi::Bytes*>(*state);
    *state = nullptr;
  }
  return 0;
}
FMI3_API int fmi3SerializedFMUStateSize(void*, void* state, std::size_t* size) {
  *size = static_cast<srm::fmi::Bytes*>(state)->size();
  return 0;
}
FMI3_API int fmi3SerializeFMUState(void* c, void* state, std::uint8_t* bytes, std::size_t size) {
  return srm::fmi::with3(c, [&](auto& x) {
    const auto& from = *static_cast<srm::fmi::Bytes*>(state);
    if (size < from.size()) return x.refused("too little room for a state");
    std::memcpy(bytes, from.data(), from.size());
    return true;
  });
}
FMI3_API int fmi3DeserializeFMUState(void* c, const std::uint8_t* bytes, std::size_t size,
                                     void** state) {
  return srm::fmi::with3(c, [&](auto&) {
    *state = new srm::fmi::Bytes(bytes, bytes + size);
    return true;
  });
}

// What this unit does not have. Importers may look for every function of the standard.
#define FMI3_NONE(name, ...) \
  FMI3_API int name(void*, __VA_ARGS__) { return srm::fmi::error3; }
#define FMI3_NO_TYPE(name, type)                                                  \
  FMI3_NONE(fmi3Get##name, srm::fmi::References, std::size_t, type*, std::size_t) \
  FMI3_NONE(fmi3Set##name, srm::fmi::References, std::size_t, type const*, std::size_t)
FMI3_NO_TYPE(Float32, float)
FMI3_NO_TYPE(Int8, std::int8_t)
FMI3_NO_TYPE(UInt8, std::uint8_t)
FMI3_NO_TYPE(Int16, std::int16_t)
FMI3_NO_TYPE(UInt16, std::uint16_t)
FMI3_NO_TYPE(UInt32, std::uint32_t)
FMI3_NO_TYPE(Int64, std::int64_t)
FMI3_NO_TYPE(UInt64, std::uint64_t)
FMI3_NO_TYPE(Boolean, bool)
FMI3_NO_TYPE(String, const char*)
FMI3_NONE(fmi3GetBinary, srm::fmi::References, std::size_t, std::size_t*, const std::uint8_t**,
          std::size_t)
FMI3_NONE(fmi3SetBinary, srm::fmi::References, std::size_t, const std::size_t*,
          const std::uint8_t* const*, std::size_t)
FMI3_NONE(fmi3GetClock, srm::fmi::References, std::size_t, bool*)
FMI3_NONE(fmi3SetClock, srm::fmi::References, std::size_t, const bool*)
FMI3_NONE(fmi3GetNumberOfVariableDependencies, std::uint32_t, std::size_t*)
FMI3_NONE(fmi3GetVariableDependencies, std::uint32_t, std::size_t*, std::uint32_t*, std::size_t*,
          int*, std::size_t)
FMI3_NONE(fmi3GetDirectionalDerivative, srm::fmi::References, std::size_t, srm::fmi::References,
          std::size_t, const double*, std::size_t, double*, std::size_t)
FMI3_NONE(fmi3GetAdjointDerivative, srm::fmi::References, std::size_t, srm::fmi::References,
          std::size_t, const double*, std::size_t, double*, std::size_t)
FMI3_NONE(fmi3GetIntervalDecimal, srm::fmi::References, std::size_t, double*, int*)
FMI3_NONE(fmi3GetIntervalFraction, srm::fmi::References, std::size_t, std::uint64_t*,
          std::uint64_t*, int*)
FMI3_NONE(fmi3GetShiftDecimal, srm::fmi::References, std::size_t, double*)
FMI3_NONE(fmi3GetShiftFraction, srm::fmi::References, std::size_t, std::uint64_t*, std::uint64_t*)
FMI3_NONE(fmi3SetIntervalDecimal, srm::fmi::References, std::size_t, const double*)
FMI3_NONE(fmi3SetIntervalFraction, srm::fmi::References, std::size_t, const std::uint64_t*,
          const std::uint64_t*)
FMI3_NONE(fmi3SetShiftDecimal, srm::fmi::References, std::size_t, const double*)
FMI3_NONE(fmi3SetShiftFraction, srm::fmi::References, std::size_t, const std::uint64_t*,
          const std::uint64_t*)
FMI3_NONE(fmi3SetContinuousStates, const double*, std::size_t)
FMI3_NONE(fmi3GetContinuousStates, double*, std::size_t)
FMI3_NONE(fmi3GetContinuousStateDerivatives, double*, std::size_t)
FMI3_NONE(fmi3GetNominalsOfContinuousStates, double*, std::size_t)
FMI3_NONE(fmi3GetEventIndicators, double*, std::size_t)
FMI3_NONE(fmi3GetNumberOfEventIndicators, std::size_t*)
FMI3_NONE(fmi3GetNumberOfContinuousStates, std::size_t*)
FMI3_NONE(fmi3CompletedIntegratorStep, bool, bool*, bool*)
FMI3_NONE(fmi3GetOutputDerivatives, srm::fmi::References, std::size_t, const std::int32_t*, double*,
          std::size_t)
FMI3_NONE(fmi3ActivateModelPartition, std::uint32_t, double)
FMI3_NONE(fmi3SetTime, double)
FMI3_NONE(fmi3UpdateDiscreteStates, bool*, bool*, bool*, bool*, bool*, double*)
#define FMI3_NO_MODE(name) \
  FMI3_API int name(void*) { return srm::fmi::error3; }
FMI3_NO_MODE(fmi3EnterEventMode)
FMI3_NO_MODE(fmi3EnterStepMode)
FMI3_NO_MODE(fmi3EnterConfigurationMode)
FMI3_NO_MODE(fmi3ExitConfigurationMode)
FMI3_NO_MODE(fmi3EnterContinuousTimeMode)
FMI3_NO_MODE(fmi3EvaluateDiscreteStates)
