// StreamHost: what the builder of streams needs from the rest of the daemon.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_stages.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/reader.hpp"

namespace posed::devices {

// A device with several bodies.
struct BodySource {
  config::SourceConfig config;
  std::uint32_t number = 0;            // of the source, in the reader and in the log
  std::unique_ptr<OpenSource> source;  // never null
  std::unique_ptr<pipeline::BodyExchange> exchange;
};

// The rate of its bodies as the config or the device says, or else the usual one of mocap systems.
[[nodiscard]] double nominal_rate_hz(const BodySource& source);

// A body on its way to becoming a stream.
struct NewStream {
  std::uint32_t id = 0;
  const BodySource& source;
  const drivers::Body& body;
  config::StreamConfig config;  // with its name; without driver and options
  double rate_hz = 0.0;
  LoadedStages stages{};
  BoundStages bound{};
  // Empty for a body that a stage cannot serve; `refusal` says why.
  std::optional<pipeline::EngineOptions> engine{};
  std::string refusal{};
};

// All calls come from the builder's thread.
class StreamHost {
 public:
  StreamHost() = default;
  StreamHost(const StreamHost&) = delete;
  StreamHost& operator=(const StreamHost&) = delete;
  virtual ~StreamHost() = default;

  // Of the slot of this stream; they outlive the host.
  virtual pipeline::StreamCounters& counters(std::uint32_t stream) = 0;
  // How many slots of the ring to the pipeline a stream may fill.
  [[nodiscard]] virtual std::size_t decoded_slots() const = 0;
  // Makes the stream known to publisher, control, log and worker, so that its first item may come.
  virtual void add(NewStream stream) = 0;
  // A stream that the worker has ended and does not use any more, each once; empty: none now.
  virtual std::optional<std::uint32_t> take_gone() = 0;
  // Removes what add() made. Returns when nothing uses it any more.
  virtual void remove(std::uint32_t stream) = 0;
  // The reader has an update to take.
  virtual void call_reader() = 0;
  // Tells people of a problem with a source.
  virtual void warn(const BodySource& source, const std::string& sentence) = 0;
};

}  // namespace posed::devices
