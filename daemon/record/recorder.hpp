// Recorder: the thread that writes the device log. It wakes by its own timer; the hot threads only
// use the rings behind record_sink(). Cold.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "daemon/pipeline/record_sink.hpp"
#include "daemon/record/log_writer_loop.hpp"
#include "daemon/record/record_rings.hpp"
#include "daemon/record/recorded_stream.hpp"
#include "daemon/system/pulse.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"
#include "proto/log/writer.hpp"

namespace posed::record {

struct RecorderOptions {
  std::filesystem::path file;
  bool reserved = false;         // log::reserve() has made it; else there must be none
  bool may_begin_later = false;  // a log that cannot be begun is tried again, as after an error
  bool frames = false;           // record the published frames, too
  std::string config_text;       // the daemon's whole config, for human readers
  std::string publish_endpoint;  // where the daemon published; replay publishes there, too
  Clock clock = nullptr;         // CLOCK_MONOTONIC
  // Called from the recorder thread.
  std::function<void(const RecorderEvent&)> report = [](const RecorderEvent&) {};
};

// The writer of the log, not open yet.
log::Writer log_writer(const RecorderOptions& options, const RecordedSetup& setup);

class Recorder {
 public:
  static constexpr const char* kThreadName = "posed-record";

  // Begins the log and starts the thread.
  static Result<std::unique_ptr<Recorder>> open(RecorderOptions options,
                                                const RecordedSetup& setup);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  [[nodiscard]] pipeline::RecordSink& record_sink() noexcept { return rings_; }

  // A stream comes. Call it before the first record of the stream is made; its row comes into the
  // log with that record, or at once if it is there from the start. Any thread.
  void add_stream(RecordedStream stream) { rings_.add_stream(std::move(stream)); }

  // Stops the thread, writes the rest and leaves a single file. Call once, after every thread that
  // uses record_sink() has ended.
  Result<> finish();

  // Any thread.
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return pulse_; }
  [[nodiscard]] std::optional<pipeline::Take> running_take() const { return rings_.running_take(); }
  // Why the log cannot be written at present; empty: it can.
  [[nodiscard]] std::string trouble() const { return rings_.state().trouble; }
  [[nodiscard]] std::uint64_t lost_chunks() const noexcept { return log_writer_.lost_chunks(); }
  [[nodiscard]] std::uint64_t lost_frames() const noexcept { return log_writer_.lost_frames(); }
  [[nodiscard]] std::uint64_t errors() const noexcept { return log_writer_.errors(); }
  [[nodiscard]] std::int64_t error_ns() const noexcept { return log_writer_.error_ns(); }
  [[nodiscard]] const std::filesystem::path& file() const noexcept { return options_.file; }

 private:
  Recorder(RecorderOptions options, const RingSizes& sizes, log::Writer writer);
  void run(const std::stop_token& stop);

  RecorderOptions options_;
  RecordRings rings_;
  LogWriterLoop log_writer_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  system::Pulse pulse_;
  std::jthread thread_;  // last, because it uses all the others
};

}  // namespace posed::record
