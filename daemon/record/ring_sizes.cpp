#include "daemon/record/ring_sizes.hpp"

#include <algorithm>
#include <cassert>

#include "daemon/pipeline/messages.hpp"
#include "daemon/record/record_rings.hpp"

namespace posed::record {
namespace {

constexpr double kRing_s = 5.0;  // the rings hold this long at the nominal rates
// bytes of all sources or slots; for devices that send faster than stated
constexpr std::size_t kMinRings = 8 * 1024 * 1024;
constexpr double kBytesPerFrame = 4096.0;             // longer than a text clip's line of 96 joints
constexpr double kUnknownBytesPerSecond = 1'000'000;  // more than any glove sends
constexpr double kUnknownFramesPerSecond = 1000.0;
constexpr double kDecisionsPerSecond = 200.0;  // of a stream, for ticks, sheds and control together

// A source of several bodies is taken to send a full Ethernet datagram for every four of them in
// each frame (a body of 60 joints as quaternions of 16-bit numbers has 500 bytes); each is a chunk,
// which also keeps the position of every body.
constexpr std::size_t kBodiesPerDatagram = 4;
constexpr std::size_t kDatagramBytes = 1472;
constexpr std::size_t kMinManyBodies = 2 * 1024 * 1024;  // several descriptions of up to 256 KiB
// Bytes of all streams to come. Where they are many their frames have less than kRing_s, because
// the memory is set aside from the start: 27 streams at 120 Hz have all of it.
constexpr std::size_t kMaxFramesToCome = 128 * 1024 * 1024;

constexpr auto kDecisions = static_cast<std::size_t>(kRing_s * kDecisionsPerSecond);
// There may be many of them, and a decision is large.
constexpr std::size_t kDecisionsToCome = kDecisions / 4;

std::size_t held(double bytes_per_s, std::size_t least) {
  return std::max(static_cast<std::size_t>(kRing_s * bytes_per_s), least);
}

std::size_t bytes_of_source(const RecordedSource& source, std::size_t least) {
  const bool known = source.rate_hz > 0.0;
  if (source.bodies == 0) {
    return held(known ? source.rate_hz * kBytesPerFrame : kUnknownBytesPerSecond, least);
  }
  const std::size_t datagrams = (source.bodies + kBodiesPerDatagram - 1) / kBodiesPerDatagram;
  const std::size_t chunk =
      sizeof(ChunkHeader) + source.bodies * sizeof(pipeline::StreamPosition) + kDatagramBytes;
  return held(
      known ? source.rate_hz * static_cast<double>(datagrams * chunk) : kUnknownBytesPerSecond,
      std::max(least, kMinManyBodies));
}

std::size_t bytes_of_frames(double rate_hz, std::size_t least) {
  const double frames_per_s = 2.0 * (rate_hz > 0.0 ? rate_hz : kUnknownFramesPerSecond);
  return held(frames_per_s * kBytesPerFrame, least);  // raw and styled
}

}  // namespace

bool bodies_come(const RecordedSetup& setup) {
  return std::ranges::any_of(setup.sources,
                             [](const RecordedSource& source) { return source.bodies > 0; });
}

RingSizes ring_sizes(const RecordedSetup& setup, bool frames) {
  RingSizes sizes;
  const auto to_come =
      std::ranges::find_if(setup.sources, [](const auto& source) { return source.bodies > 0; });
  const std::size_t at_start = to_come - setup.sources.begin();
  const std::size_t per_source = kMinRings / std::max<std::size_t>(setup.sources.size(), 1);
  const std::size_t per_stream = kMinRings / std::max<std::size_t>(at_start, 1);
  double rate_to_come_hz = 0.0;  // the highest
  for (std::size_t i = 0; i < setup.sources.size(); ++i) {
    const RecordedSource& source = setup.sources[i];
    sizes.chunk_bytes.push_back(bytes_of_source(source, per_source));
    if (i >= at_start) rate_to_come_hz = std::max(rate_to_come_hz, source.rate_hz);
    if (i >= at_start) continue;
    sizes.slots.push_back({.frame_bytes = frames ? bytes_of_frames(source.rate_hz, per_stream) : 0,
                           .decisions = kDecisions});
  }
  assert(setup.slots >= at_start);
  const std::size_t most = kMaxFramesToCome / std::max<std::size_t>(setup.slots - at_start, 1);
  const std::size_t frames_to_come =
      frames ? std::min(bytes_of_frames(rate_to_come_hz, 0), most) : 0;
  sizes.slots.resize(setup.slots, {.frame_bytes = frames_to_come, .decisions = kDecisionsToCome});
  return sizes;
}

std::size_t total_bytes(const RingSizes& sizes) {
  std::size_t bytes = 0;
  for (const std::size_t of_source : sizes.chunk_bytes) bytes += of_source;
  for (const SlotSizes& slot : sizes.slots) {
    bytes += slot.frame_bytes + slot.decisions * sizeof(DecisionRecord);
  }
  return bytes;
}

}  // namespace posed::record
