// Recorder: the thread that writes the device log. It wakes by its own timer, so the hot threads
// only ever touch the rings behind record_sink(). Cold.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "daemon/devices/open_stream.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/record/log_writer_loop.hpp"
#include "daemon/record/record_rings.hpp"
#include "daemon/record/stream_settings.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"
#include "proto/log/rows.hpp"

namespace posed::record {

// One stream as it stands before its first chunk: a source of the log with one body.
struct RecordedStream {
  log::SourceRow source;             // its id is filled in here: its place
  StreamSettings settings{};         // the hashes of its models are filled in here, too
  std::vector<std::byte> style{};    // the bytes of the style model's file it begins with
  std::vector<std::byte> gesture{};  // the same of the gesture model
};
// An opened stream, as a recorder needs it.
[[nodiscard]] RecordedStream recorded_stream(const devices::OpenStream& stream);

struct RecorderOptions {
  std::filesystem::path file;
  bool overwrite = false;
  bool frames = false;           // keep what is published, too
  std::string config_text;       // the daemon's whole config, for people
  std::string publish_endpoint;  // where it published; replay does, too
  Clock clock = nullptr;         // CLOCK_MONOTONIC
  // Called from the recorder thread.
  std::function<void(const RecorderEvent&)> report = [](const RecorderEvent&) {};
};

// Makes the log and writes what stands in it before the first chunk, committed.
[[nodiscard]] Result<log::Writer> begin_log(const RecorderOptions& options,
                                            std::vector<RecordedStream>& streams);

class Recorder {
 public:
  // Makes the log and starts the thread. Stream ids are places in `streams`.
  [[nodiscard]] static Result<std::unique_ptr<Recorder>> open(RecorderOptions options,
                                                              std::vector<RecordedStream> streams);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  [[nodiscard]] pipeline::RecordSink& record_sink() noexcept { return rings_; }

  // Stops the thread, writes the rest and leaves one file. Call once, after every thread that uses
  // record_sink() has ended.
  [[nodiscard]] Result<> finish();

  // Any thread.
  [[nodiscard]] std::uint64_t lost_chunks() const noexcept { return log_writer_.lost_chunks(); }
  [[nodiscard]] std::uint64_t errors() const noexcept { return log_writer_.errors(); }
  [[nodiscard]] const std::filesystem::path& file() const noexcept { return options_.file; }

 private:
  Recorder(RecorderOptions options, const std::vector<RecordedStream>& streams, log::Writer writer);
  void run(const std::stop_token& stop);

  RecorderOptions options_;
  RecordRings rings_;
  LogWriterLoop log_writer_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;  // last: uses all the others
};

}  // namespace posed::record
