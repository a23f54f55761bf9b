// What the device log says about a source and about a stream, before their first chunk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/devices/model_files.hpp"
#include "daemon/record/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"
#include "proto/log/writer.hpp"

namespace posed::devices {
struct NewStream;
struct OpenSource;
}  // namespace posed::devices

namespace posed::record {

struct RecordedSource {
  log::SourceRow row{};  // its id is the source's number
  double rate_hz = 0.0;  // nominal, of its frames; 0: unknown
  // The most that it can have at once, each with a chunk's position; 0: one, from the start on.
  std::size_t bodies = 0;
};

struct RecordedStream {
  std::uint32_t id = 0;
  std::uint32_t source = 0;  // its number
  std::string body{};        // the device's name for it; empty if the source has only one body
  bool from_start = false;   // it is there before the first item
  std::string name{};
  StreamSettings settings{};                       // without the hashes of its models
  std::vector<devices::ModelBytes> model_files{};  // one for each stage, null without a model
};

// What the log begins with.
struct RecordedSetup {
  std::vector<RecordedSource> sources{};  // by number; those with one body first
  // How many streams there may be at once. Those of sources with one body have the first slots.
  std::size_t slots = 0;
};

// `slots`: how many streams there may be at once.
[[nodiscard]] RecordedSetup recorded_setup(
    std::span<const std::unique_ptr<devices::OpenSource>> sources, std::size_t slots);

// For a body that has become a stream.
[[nodiscard]] RecordedStream recorded_stream(const devices::NewStream& stream);

// Adds the stream's models and then its row. A row that is there already is replaced.
Result<> add_stream_row(log::Writer& writer, const RecordedStream& stream,
                        std::uint64_t first_item);

}  // namespace posed::record
