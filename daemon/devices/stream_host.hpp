// StreamHost: what SourceBuilder needs from the rest of the daemon. Cold.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_stages.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/reader.hpp"

namespace posed::devices {

// A body on its way to becoming a stream.
struct NewStream {
  std::uint32_t id = 0;
  const OpenSource& source;     // outlives the stream
  const drivers::Body& body;    // valid during add() only
  config::StreamConfig config;  // with its name
  double rate_hz = 0.0;         // expected; never 0
  LoadedStages stages{};
  BoundStages bound{};
  // Empty for a body that a stage cannot serve; `refusal` says why.
  std::optional<pipeline::EngineOptions> engine{};
  std::string refusal{};
  ExitCode exit_code = ExitCode::kFailed;  // posed's, if a refusal ends its start
};

// All calls come from the builder's thread or, before that runs, from the thread that opens the
// sources.
class StreamHost {
 public:
  StreamHost() = default;
  StreamHost(const StreamHost&) = delete;
  StreamHost& operator=(const StreamHost&) = delete;
  virtual ~StreamHost() = default;

  // A sign of life for the watchdog: called before each stream that the builder makes, because many
  // with large models need seconds together.
  virtual void is_alive() noexcept = 0;
  // The counters of this stream's slot; they live as long as the host.
  virtual pipeline::StreamCounters& counters(std::uint32_t stream) = 0;
  // Makes the stream known to publisher, control, log and worker, so that its first item may come;
  // a refused stream, which has no engine, to publisher and control only.
  virtual void add(NewStream stream) = 0;
  // Returns a stream that the worker has ended and no longer uses, each once; empty: none now.
  virtual std::optional<std::uint32_t> next_gone() = 0;
  // Removes what add() made. Returns when nothing uses it any more.
  virtual void remove(std::uint32_t stream) = 0;
  // Wakes the reader, for which an update waits.
  virtual void call_reader() = 0;
  // Reports a problem with a source.
  virtual void warn(const OpenSource& source, const std::string& sentence) = 0;
};

}  // namespace posed::devices
