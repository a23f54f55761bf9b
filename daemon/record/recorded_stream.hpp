// What the recorder is told about a source and about a stream before their first chunk: the log's
// rows, and what sizes its rings.
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
  // The most bodies it can have at once: every recorded chunk has one position for each of them. 0:
  // a source with exactly one body.
  std::size_t bodies = 0;
};

struct RecordedStream {
  std::uint32_t id = 0;
  std::uint32_t source = 0;  // its number
  std::string body{};        // the device's name for it; empty if the source has only one body
  bool from_start = false;   // it is there before the first item
  std::string name{};
  StreamSettings settings{};  // without the hashes of its models
  // [stage] as in `settings`; null without a model
  std::vector<devices::ModelBytes> model_files{};
};

// What is known when the log begins.
struct RecordedSetup {
  std::vector<RecordedSource> sources{};  // in the order of `sources`
  // How many streams there may be at once. Those of sources with one body have the first slots.
  std::size_t slots = 0;
};

// `sources`: by number, those with one body first. `slots`: how many streams there may be at once.
[[nodiscard]] RecordedSetup recorded_setup(
    std::span<const std::unique_ptr<devices::OpenSource>> sources, std::size_t slots);

// For a body that has become a stream.
[[nodiscard]] RecordedStream recorded_stream(const devices::NewStream& stream);

// Adds the stream's models and then its row; replaces a row that is there already. `first_item`:
// the number of the stream's first item, 0 if it is not known.
Result<> add_stream_row(log::Writer& writer, const RecordedStream& stream,
                        std::uint64_t first_item);

}  // namespace posed::record
