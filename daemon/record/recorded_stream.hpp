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
struct BodySource;
struct NewStream;
struct OpenStream;
}  // namespace posed::devices

namespace posed::record {

struct RecordedSource {
  log::SourceRow row{};      // its id is the source's number
  double rate_hz = 0.0;      // nominal, of its frames; 0: unknown
  std::size_t bodies = 1;    // the most that it can have at once
  bool bodies_come = false;  // its bodies become streams as they come, also if there is only one
};

struct RecordedStream {
  std::uint32_t id = 0;
  std::uint32_t source = 0;  // its number
  std::string body{};        // the device's name for it; empty if the source has only one body
  std::string name{};
  StreamSettings settings{};                       // without the hashes of its models
  std::vector<devices::ModelBytes> model_files{};  // one for each stage, null without a model
};

// What the log begins with.
struct RecordedSetup {
  std::vector<RecordedSource> sources{};  // by number
  std::vector<RecordedStream> streams{};  // those that are there from the start, by id
  // How many more streams there may be at once, each in a slot of its own after those of `streams`;
  // and the highest nominal rate of one of them.
  std::size_t slots_to_come = 0;
  double rate_to_come_hz = 0.0;

  // Adds a device with one body: a source and a stream, both with the next number.
  void add_device(log::SourceRow row, StreamSettings settings,
                  std::vector<devices::ModelBytes> model_files);
  // Adds a device whose bodies come later, with the next number. `bodies` is how many at most.
  void add_bodies(log::SourceRow row, double rate_hz, std::size_t bodies);
};

// Of the daemon's devices, those with one body first.
[[nodiscard]] RecordedSetup recorded_setup(
    std::span<const std::unique_ptr<devices::OpenStream>> streams,
    std::span<const std::unique_ptr<devices::BodySource>> sources, std::size_t slots_to_come);

// For a body that has become a stream.
[[nodiscard]] RecordedStream recorded_stream(const devices::NewStream& stream);

// Adds the stream's models and then its row. A row that is there already is replaced.
[[nodiscard]] Result<> add_stream_row(log::Writer& writer, const RecordedStream& stream,
                                      std::uint64_t first_item);

}  // namespace posed::record
