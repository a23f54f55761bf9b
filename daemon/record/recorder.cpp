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
constexpr double kRing_s = 5.0;  // the rings hold this long at the nominal rates
// bytes of all streams; for sources that send faster than stated
constexpr std::size_t kMinRings = 8 * 1024 * 1024;
constexpr double kBytesPerFrame = 4096.0;             // longer than a text clip's line of 96 joints
constexpr double kUnknownBytesPerSecond = 1'000'000;  // more than any glove sends
constexpr double kUnknownFramesPerSecond = 1000.0;
constexpr double kDecisionsPerSecond = 200.0;  // of a stream, for ticks, sheds and control together

// How much of the recorder's rings each stream may use.
std::vector<RingSizes> ring_shares(const std::vector<RecordedStream>& streams, bool frames) {
  const std::size_t least = kMinRings / std::max<std::size_t>(streams.size(), 1);
  const auto held = [&](double bytes_per_s) {
    return std::max(static_cast<std::size_t>(kRing_s * bytes_per_s), least);
  };
  std::vector<RingSizes> shares;
  for (const RecordedStream& stream : streams) {
    const double rate_hz = stream.settings.rate_hz;
    const bool known = rate_hz > 0.0;
    const double frames_per_s = 2.0 * (known ? rate_hz : kUnknownFramesPerSecond);  // raw, styled
    shares.push_back(
        {.chunk_bytes = held(known ? rate_hz * kBytesPerFrame : kUnknownBytesPerSecond),
         .frame_bytes = frames ? held(frames_per_s * kBytesPerFrame) : 0,
         .decisions = static_cast<std::size_t>(kRing_s * kDecisionsPerSecond)});
  }
  return shares;
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

// Stores a model's file in the log and returns its hash; empty if there is no model.
Result<std::string> keep(log::Writer& writer, const std::string& file) {
  if (file.empty()) return std::string();
  return writer.add_blob(std::as_bytes(std::span(file)));
}

}  // namespace

RecordedStream recorded_stream(const devices::OpenStream& stream) {
  const drivers::Description& description = stream.device.description;
  const config::StreamConfig& config = stream.config;
  return {.source = {.id = 0,
                     .name = config.name,
                     .driver = description.driver,
                     .text = description.text,
                     .identity = description.identity,
                     .config = to_json(config.options)},
          .settings = stream.settings,
          .model_files = stream.model_files};
}

Result<log::Writer> begin_log(const RecorderOptions& options,
                              std::vector<RecordedStream>& streams) {
  auto writer = log::Writer::create(options.file, meta_of(options), options.overwrite);
  if (!writer) return writer;
  for (std::uint32_t id = 0; id < streams.size(); ++id) {
    RecordedStream& stream = streams[id];
    stream.source.id = id;
    for (std::size_t i = 0; i < stream.settings.stages.size(); ++i) {
      auto hash = keep(*writer, stream.model_files[i]);
      if (!hash) return std::unexpected(hash.error());
      stream.settings.stages[i].model_sha256 = std::move(*hash);
    }
    if (auto done = writer->add(stream.source); !done) return std::unexpected(done.error());
    const log::StreamRow row{.id = id,
                             .source = id,
                             .body = {},
                             .name = stream.source.name,
                             .stages_json = to_json(stream.settings),
                             .first_item = 1};
    if (auto done = writer->add(row); !done) return std::unexpected(done.error());
  }
  if (auto done = writer->commit(); !done) return std::unexpected(done.error());
  return writer;
}

Result<std::unique_ptr<Recorder>> Recorder::open(RecorderOptions options,
                                                 std::vector<RecordedStream> streams) {
  auto writer = begin_log(options, streams);
  if (!writer) return std::unexpected(writer.error());
  return std::unique_ptr<Recorder>(new Recorder(std::move(options), streams, std::move(*writer)));
}

Recorder::Recorder(RecorderOptions options, const std::vector<RecordedStream>& streams,
                   log::Writer writer)
    : options_(std::move(options)),
      rings_(ring_shares(streams, options_.frames)),
      log_writer_(rings_, std::move(writer), options_.file, options_.report),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Recorder::~Recorder() = default;

void Recorder::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    log_writer_.turn(options_.clock());
    wake_.wait_for(lock, stop, kWakeEvery, [] { return false; });
  }
}

Result<> Recorder::finish() {
  thread_.request_stop();
  thread_.join();
  return log_writer_.finish(options_.clock());
}

}  // namespace posed::record
