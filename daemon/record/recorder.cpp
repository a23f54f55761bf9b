#include "daemon/record/recorder.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <map>
#include <utility>

#include <unistd.h>

#include "models/gp/isa.hpp"
#include "proto/log/writer.hpp"

namespace posed::record {
namespace {

constexpr auto kWakeEvery = std::chrono::milliseconds(50);
constexpr double kRing_s = 5.0;                       // what the rings hold at the nominal rates
constexpr std::size_t kLeast = 8 * 1024 * 1024;       // bytes; for sources faster than they say
constexpr double kBytesPerFrame = 4096.0;             // a text clip's line of 96 joints is shorter
constexpr double kUnknownBytesPerSecond = 1'000'000;  // more than any glove sends
constexpr double kUnknownFramesPerSecond = 1000.0;
constexpr double kDecisionsPerSecond = 200.0;  // a stream's ticks, sheds and control together

RingSizes ring_sizes(const std::vector<RecordedStream>& streams, bool frames) {
  double chunk_bytes = 0.0, frame_bytes = 0.0;
  for (const RecordedStream& stream : streams) {
    const bool known = stream.rate_hz > 0.0;
    chunk_bytes += known ? stream.rate_hz * kBytesPerFrame : kUnknownBytesPerSecond;
    // Raw and styled.
    frame_bytes += 2.0 * kBytesPerFrame * (known ? stream.rate_hz : kUnknownFramesPerSecond);
  }
  const auto held = [](double per_second) {
    return static_cast<std::size_t>(kRing_s * per_second);
  };
  return {.chunk_bytes = std::max(held(chunk_bytes), kLeast),
          .frame_bytes = frames ? std::max(held(frame_bytes), kLeast) : 0,
          .decisions = held(kDecisionsPerSecond * static_cast<double>(streams.size()))};
}

std::string utc_text(std::time_t seconds) {
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text.data();
}

std::map<std::string, std::string> meta_of(const RecorderOptions& options) {
  const auto utc_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                          std::chrono::system_clock::now().time_since_epoch())
                          .count();
  const std::int64_t monotonic_ns = options.clock();
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  return {{"posed_version", POSED_VERSION},
          {"isa", std::string(gp::isa_name())},
          {"host", host.data()},
          {"created_utc", utc_text(utc_ns / kNanosPerSecond)},
          {"created_monotonic_ns", std::to_string(monotonic_ns)},
          {"monotonic_to_utc_ns", std::to_string(utc_ns - monotonic_ns)},
          {"publish_endpoint", options.publish_endpoint},
          {"config", options.config_text}};
}

// What stands in the log before the first chunk, committed.
Result<log::Writer> make_log(const RecorderOptions& options, std::vector<RecordedStream>& streams) {
  auto writer = log::Writer::create(options.file, meta_of(options), options.overwrite);
  if (!writer) return writer;
  for (std::uint32_t id = 0; id < streams.size(); ++id) {
    RecordedStream& stream = streams[id];
    stream.row.id = id;
    if (!stream.model.empty()) {
      auto hash = writer->add_blob(stream.model);
      if (!hash) return std::unexpected(hash.error());
      stream.row.model = *hash;
    }
    if (!stream.gesture.empty()) {
      if (auto hash = writer->add_blob(stream.gesture); !hash) {
        return std::unexpected(hash.error());
      }
    }
    if (auto done = writer->add(stream.row); !done) return std::unexpected(done.error());
  }
  if (auto done = writer->commit(); !done) return std::unexpected(done.error());
  return writer;
}

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::open(RecorderOptions options,
                                                 std::vector<RecordedStream> streams) {
  auto writer = make_log(options, streams);
  if (!writer) return std::unexpected(writer.error());
  return std::unique_ptr<Recorder>(new Recorder(std::move(options), streams, std::move(*writer)));
}

Recorder::Recorder(RecorderOptions options, const std::vector<RecordedStream>& streams,
                   log::Writer writer)
    : options_(std::move(options)),
      rings_(streams.size(), ring_sizes(streams, options_.frames)),
      scribe_(rings_, std::move(writer), options_.file, options_.tell),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Recorder::~Recorder() = default;

void Recorder::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    scribe_.turn(options_.clock());
    wake_.wait_for(lock, stop, kWakeEvery, [] { return false; });
  }
}

Result<> Recorder::finish() {
  thread_.request_stop();
  thread_.join();
  return scribe_.finish(options_.clock());
}

}  // namespace posed::record
