// The recorder: a ring of segments in the caller's memory, and its dump.
//
// A segment in memory and in a dump, in 32-bit words, little-endian:
//
//   number of its first sample, count of samples
//   state of the controller before that sample
//   samples: measurement, request, command, outputs, status
//
// A dump: header, segments from the oldest to the newest, CRC-32 of all words before.
#include <bit>
#include <cstddef>

#include "_standard.hpp"
#include "reluctance_recorder.h"
#include "srm/base/crc32.hpp"
#include "state.hpp"

namespace {

using reluctance::state_of;

constexpr uint32_t magic = 0x444C4552;  // the bytes "RELD"
constexpr uint32_t dump_version = 1;
constexpr uint32_t no_sample = 0xFFFFFFFF;
constexpr uint32_t state_words = (sizeof(reluctance::State) + 3) / 4;
constexpr uint32_t head_words = 2 + state_words;  // of a segment

struct Record {
  reluctance_measurement measurement;
  reluctance_request request;
  reluctance_command command;
  reluctance_outputs outputs;
  reluctance_status status;
};
static_assert(sizeof(Record) == 4 * RELUCTANCE_RECORD_WORDS);

uint32_t segment_words(const reluctance_recorder& r) {
  return head_words + r.samples * RELUCTANCE_RECORD_WORDS;
}

uint32_t* segment(const reluctance_recorder& r, uint32_t index) {
  return r.memory + index * segment_words(r);
}

/// The next segment of the ring, with the state as it is; the oldest one goes.
void begin_segment(reluctance_recorder& r, const reluctance_controller* controller) {
  if (r.used > 0) r.newest = r.newest + 1 == r.segments ? 0 : r.newest + 1;
  if (r.used < r.segments) ++r.used;
  uint32_t* head = segment(r, r.newest);
  head[0] = r.next;
  head[1] = 0;
  __builtin_memcpy(head + 2, controller, sizeof(reluctance::State));
}

/// Parameters that a thread has set since the segment began. Its count of changes may still be the
/// old one, where this interrupts it.
bool tuned(const reluctance_recorder& r, const reluctance_controller* controller) {
  const auto& now = state_of(controller).control.parameter;
  const auto bytes = [](const auto* p) { return reinterpret_cast<const unsigned char*>(p); };
  auto then = now;
  __builtin_memcpy(&then, bytes(segment(r, r.newest) + 2) + (bytes(&now) - bytes(controller)),
                   sizeof then);
  for (std::size_t n = 0; n < then.size(); ++n) {
    if (std::bit_cast<uint32_t>(then[n]) != std::bit_cast<uint32_t>(now[n])) return true;
  }
  return false;
}

struct Sink {
  void (*put)(void* context, const uint32_t* words, uint32_t count);
  void* context;
  uint32_t crc, count;
};

void write(Sink& to, const uint32_t* words, uint32_t count) {
  to.crc = srm::crc32(words, static_cast<int>(count), to.crc);
  to.count += count;
  to.put(to.context, words, count);
}

}  // namespace

uint32_t reluctance_state_words(void) { return state_words; }

void reluctance_restore(reluctance_controller* controller, const uint32_t* state) {
  reluctance_init(controller);
  __builtin_memcpy(static_cast<void*>(controller), state, sizeof(reluctance::State));
}

uint32_t reluctance_recorder_start(reluctance_recorder* recorder, uint32_t* memory, uint32_t words,
                                   uint32_t samples, uint32_t after) {
  reluctance_recorder& r = *recorder;
  r = {};
  r.samples = samples;
  r.memory = memory;
  r.after = after;
  const uint32_t room = words > head_words ? words - head_words : 0;
  const bool fits = samples > 0 && samples <= room / RELUCTANCE_RECORD_WORDS;  // no product wraps
  r.segments = fits ? words / segment_words(r) : 0;
  const uint32_t held = r.segments < 2 ? 0 : (r.segments - 1) * samples;
  if (held <= after) r.segments = 0;
  reluctance_recorder_resume(recorder);
  return r.segments > 0 ? held : 0;
}

void reluctance_recorder_resume(reluctance_recorder* recorder) {
  recorder->used = 0;
  recorder->newest = 0;
  recorder->trigger = no_sample;
  recorder->left = 0;
  recorder->cause = {};
  recorder->mode = -1;
  recorder->state = recorder->segments > 0 ? RELUCTANCE_RECORDER_RUNS : RELUCTANCE_RECORDER_FROZEN;
}

void reluctance_recorder_trigger(reluctance_recorder* recorder) {
  reluctance_recorder& r = *recorder;
  if (r.state != RELUCTANCE_RECORDER_RUNS || r.used == 0) return;
  r.trigger = r.next - 1;
  r.left = r.after;
  r.state = r.after > 0 ? RELUCTANCE_RECORDER_TRIGGERED : RELUCTANCE_RECORDER_FROZEN;
}

reluctance_mode reluctance_run_recorded(reluctance_recorder* recorder,
                                        reluctance_controller* controller,
                                        const reluctance_measurement* measurement,
                                        const reluctance_request* request,
                                        reluctance_command* command, reluctance_outputs* outputs) {
  reluctance_recorder& r = *recorder;
  if (r.state == RELUCTANCE_RECORDER_FROZEN) {
    return reluctance_run(controller, measurement, request, command, outputs);
  }
  const bool changed = state_of(controller).changes != r.changes;
  if (r.used == 0 || changed || tuned(r, controller) || segment(r, r.newest)[1] == r.samples) {
    begin_segment(r, controller);
  }
  const reluctance_mode mode = reluctance_run(controller, measurement, request, command, outputs);
  r.changes = state_of(controller).changes;
  uint32_t* head = segment(r, r.newest);
  const Record record{*measurement, *request, *command, *outputs,
                      reluctance_get_status(controller)};
  __builtin_memcpy(head + head_words + head[1] * RELUCTANCE_RECORD_WORDS, &record, sizeof record);
  ++head[1];
  ++r.next;
  if (r.state == RELUCTANCE_RECORDER_TRIGGERED && --r.left == 0) {
    r.state = RELUCTANCE_RECORDER_FROZEN;
  }
  if (mode == RELUCTANCE_MODE_FAULT && r.mode >= 0 && r.mode != RELUCTANCE_MODE_FAULT &&
      r.state == RELUCTANCE_RECORDER_RUNS) {
    r.cause = reluctance_get_fault(controller);
    reluctance_recorder_trigger(recorder);
  }
  r.mode = mode;
  return mode;
}

uint32_t reluctance_recorder_dump(const reluctance_recorder* recorder,
                                  void (*put)(void* context, const uint32_t* words, uint32_t count),
                                  void* context) {
  const reluctance_recorder& r = *recorder;
  if (r.used == 0) return 0;
  Sink to{put, context, 0, 0};
  const uint32_t header[] = {magic,
                             dump_version,
                             RELUCTANCE_API,
                             reluctance_fingerprint(),
                             RELUCTANCE_PHASES,
                             state_words,
                             RELUCTANCE_RECORD_WORDS,
                             r.used,
                             r.trigger,
                             static_cast<uint32_t>(r.cause.status),
                             static_cast<uint32_t>(r.cause.phase),
                             std::bit_cast<uint32_t>(r.cause.value),
                             std::bit_cast<uint32_t>(r.cause.limit),
                             std::bit_cast<uint32_t>(RELUCTANCE_CONTROL_PERIOD_S)};
  write(to, header, sizeof header / sizeof header[0]);
  for (uint32_t n = 0; n < r.used; ++n) {
    const uint32_t* head = segment(r, (r.newest + r.segments - (r.used - 1) + n) % r.segments);
    write(to, head, head_words + head[1] * RELUCTANCE_RECORD_WORDS);
  }
  const uint32_t crc = to.crc;
  write(to, &crc, 1);
  return to.count;
}
