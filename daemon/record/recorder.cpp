#include "daemon/record/recorder.hpp"

#include <array>
#include <chrono>
#include <ctime>
#include <map>
#include <utility>

#include <unistd.h>

#include <spdlog/spdlog.h>

#include "daemon/record/ring_sizes.hpp"
#include "daemon/system/realtime.hpp"
#include "models/gp/isa.hpp"

namespace posed::record {
namespace {

constexpr auto kWakeEvery = std::chrono::milliseconds(50);

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

}  // namespace

log::Writer log_writer(const RecorderOptions& options, const RecordedSetup& setup) {
  log::Beginning beginning{.meta = meta_of(options)};
  for (const RecordedSource& source : setup.sources) beginning.sources.push_back(source.row);
  return {options.file, std::move(beginning), options.reserved};
}

Result<std::unique_ptr<Recorder>> Recorder::open(RecorderOptions options,
                                                 const RecordedSetup& setup) {
  log::Writer writer = log_writer(options, setup);
  // Otherwise the thread tries again, and says why it fails.
  if (auto begun = writer.resume(); !begun && !options.may_begin_later) {
    return std::unexpected(begun.error());
  }
  const RingSizes sizes = ring_sizes(setup, options.frames);
  // Where no bodies come it is little.
  if (bodies_come(setup)) {
    spdlog::info("{}: {:.0f} MB of memory are set aside for what is on its way into the log",
                 options.file.string(), static_cast<double>(total_bytes(sizes)) / 1e6);
  }
  return std::unique_ptr<Recorder>(new Recorder(std::move(options), sizes, std::move(writer)));
}

Recorder::Recorder(RecorderOptions options, const RingSizes& sizes, log::Writer writer)
    : options_(std::move(options)),
      rings_(sizes),
      log_writer_(rings_, std::move(writer), options_.file, options_.report),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Recorder::~Recorder() = default;

void Recorder::run(const std::stop_token& stop) {
  system::name_thread(kThreadName);
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    pulse_.beat();
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
