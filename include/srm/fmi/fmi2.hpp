// The functions of FMI 2.0 for co-simulation. https://fmi-standard.org, version 2.0.4.
#pragma once

#include "srm/fmi/instance.hpp"

#define FMI2_API extern "C" __attribute__((visibility("default")))

namespace srm::fmi {

enum Status2 { ok2, warning2, discard2, error2, fatal2, pending2 };
using Logger2 = void (*)(void*, const char*, int, const char*, const char*, ...);

struct Callbacks2 {
  Logger2 logger;
  void* (*allocate)(std::size_t, std::size_t);
  void (*release)(void*);
  void (*step_finished)(void*, int);
  void* environment;
};

struct Component2 {
  Instance instance;
  std::string name;
  Logger2 logger = nullptr;
  void* environment = nullptr;

  int told(bool good) {
    if (good) return ok2;
    if (logger) {
      logger(environment, name.c_str(), error2, "logStatusError", "%s", instance.why.c_str());
    }
    return error2;
  }
  template <class F>
  int run(const F& f) {
    return told(guarded(instance, [&] { return f(instance); }));
  }
};

template <class F>
int with2(void* c, const F& f) {
  return c ? static_cast<Component2*>(c)->run(f) : int(error2);
}

}  // namespace srm::fmi

FMI2_API const char* fmi2GetTypesPlatform() { return "default"; }
FMI2_API const char* fmi2GetVersion() { return "2.0"; }
FMI2_API int fmi2SetDebugLogging(void*, int, std::size_t, const char* const*) { return 0; }

FMI2_API void* fmi2Instantiate(const char* name, int type, const char* token, const char*,
                               const srm::fmi::Callbacks2* callbacks, int, int) {
  using namespace srm::fmi;
  try {
    auto component = std::make_unique<Component2>();
    component->name = name ? name : "";
    if (callbacks) {
      component->logger = callbacks->logger;
      component->environment = callbacks->environment;
    }
    Instance& instance = component->instance;
    if (type != 1) instance.refused("only co-simulation");
    if (!token || std::strcmp(token, drive::token) != 0) instance.refused("another GUID");
    if (!instance.is_made()) instance.refused("the parameters of the unit are damaged");
    if (!component->instance.why.empty()) {
      component->told(false);
      return nullptr;
    }
    return component.release();
  } catch (...) {
    return nullptr;
  }
}
FMI2_API void fmi2FreeInstance(void* c) { delete static_cast<srm::fmi::Component2*>(c); }

FMI2_API int fmi2SetupExperiment(void* c, int, double, double t_start, int, double) {
  return srm::fmi::with2(c, [&](auto& x) {
    x.t_start = t_start;
    return srm::is_finite(t_start) || x.refused("the start time is not finite");
  });
}
FMI2_API int fmi2EnterInitializationMode(void* c) {
  return srm::fmi::with2(c, [](auto&) { return true; });
}
FMI2_API int fmi2ExitInitializationMode(void* c) {
  return srm::fmi::with2(c, [](auto& x) { return x.start(); });
}
FMI2_API int fmi2Terminate(void* c) {
  return srm::fmi::with2(c, [](auto&) { return true; });
}
FMI2_API int fmi2Reset(void* c) {
  return srm::fmi::with2(c, [](auto& x) {
    x.reset();
    return x.is_made();
  });
}

FMI2_API int fmi2GetReal(void* c, const unsigned* r, std::size_t n, double* v) {
  return srm::fmi::with2(c, [&](auto& x) { return x.get(r, n, v); });
}
FMI2_API int fmi2SetReal(void* c, const unsigned* r, std::size_t n, const double* v) {
  return srm::fmi::with2(c, [&](auto& x) { return x.set(r, n, v); });
}
FMI2_API int fmi2GetInteger(void* c, const unsigned* r, std::size_t n, int* v) {
  return srm::fmi::with2(c, [&](auto& x) { return x.get(r, n, v); });
}
FMI2_API int fmi2SetInteger(void* c, const unsigned* r, std::size_t n, const int* v) {
  return srm::fmi::with2(c, [&](auto& x) { return x.set(r, n, v); });
}

FMI2_API int fmi2DoStep(void* c, double t, double h, int) {
  const int status = srm::fmi::with2(c, [&](auto& x) { return x.step(t, h); });
  const bool ended = c && static_cast<srm::fmi::Component2*>(c)->instance.ended;
  return status != 0 && ended ? int(srm::fmi::discard2) : status;
}
FMI2_API int fmi2CancelStep(void*) { return srm::fmi::error2; }
FMI2_API int fmi2GetBooleanStatus(void* c, int kind, int* value) {
  return srm::fmi::with2(c, [&](auto& x) {
    *value = x.ended;
    return kind == 3;  // fmi2Terminated
  });
}
FMI2_API int fmi2GetRealStatus(void* c, int kind, double* value) {
  return srm::fmi::with2(c, [&](auto& x) {
    *value = x.t_start + x.t;
    return kind == 2;  // fmi2LastSuccessfulTime
  });
}

FMI2_API int fmi2GetFMUstate(void* c, void** state) {
  return srm::fmi::with2(c, [&](auto& x) {
    if (!*state) *state = new srm::fmi::Bytes;
    return x.save(*static_cast<srm::fmi::Bytes*>(*state));
  });
}
FMI2_API int fmi2SetFMUstate(void* c, void* state) {
  return srm::fmi::with2(c, [&](auto& x) {
    return state ? x.restore(*static_cast<srm::fmi::Bytes*>(state)) : x.refused("no state");
  });
}
FMI2_API int fmi2FreeFMUstate(void*, void** state) {
  if (state) {
    delete static_cast<srm::fmi::Bytes*>(*state);
    *state = nullptr;
  }
  return 0;
}
FMI2_API int fmi2SerializedFMUstateSize(void*, void* state, std::size_t* size) {
  *size = static_cast<srm::fmi::Bytes*>(state)->size();
  return 0;
}
FMI2_API int fmi2SerializeFMUstate(void* c, void* state, char* bytes, std::size_t size) {
  return srm::fmi::with2(c, [&](auto& x) {
    const auto& from = *static_cast<srm::fmi::Bytes*>(state);
    if (size < from.size()) return x.refused("too little room for a state");
    std::memcpy(bytes, from.data(), from.size());
    return true;
  });
}
FMI2_API int fmi2DeSerializeFMUstate(void* c, const char* bytes, std::size_t size, void** state) {
  return srm::fmi::with2(c, [&](auto&) {
    *state = new srm::fmi::Bytes(bytes, bytes + size);
    return true;
  });
}

// What this unit does not have.
#define FMI2_NONE(name, ...) \
  FMI2_API int name(void*, __VA_ARGS__) { return srm::fmi::error2; }
FMI2_NONE(fmi2GetBoolean, const unsigned*, std::size_t, int*)
FMI2_NONE(fmi2SetBoolean, const unsigned*, std::size_t, const int*)
FMI2_NONE(fmi2GetString, const unsigned*, std::size_t, const char**)
FMI2_NONE(fmi2SetString, const unsigned*, std::size_t, const char* const*)
FMI2_NONE(fmi2SetRealInputDerivatives, const unsigned*, std::size_t, const int*, const double*)
FMI2_NONE(fmi2GetRealOutputDerivatives, const unsigned*, std::size_t, const int*, double*)
FMI2_NONE(fmi2GetDirectionalDerivative, const unsigned*, std::size_t, const unsigned*, std::size_t,
          const double*, double*)
FMI2_NONE(fmi2GetStatus, int, int*)
FMI2_NONE(fmi2GetIntegerStatus, int, int*)
FMI2_NONE(fmi2GetStringStatus, int, const char**)
