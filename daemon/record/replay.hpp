// Replay: recomputes what a device log's run published, from its chunks and decisions alone, with
// the decoders and engines of the live run. No thread, no clock: whoever drives it paces it. Cold.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/messages.hpp"
#include "daemon/record/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"

namespace posed::record {

class Replay {
 public:
  // Builds decoders, models and engines of all streams. The reader outlives the replay.
  [[nodiscard]] static Result<std::unique_ptr<Replay>> open(log::Reader& reader,
                                                            const std::string& file);
  ~Replay();
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  struct Stream {
    std::string name;
    drivers::Description description;
    StreamSettings settings;
  };
  [[nodiscard]] const Stream& stream(std::uint32_t id) const;

  // Items in pipeline order.
  using Out = std::function<void(const pipeline::Item&)>;
  // Called before each chunk with its arrival time; false ends the replay there.
  using Pace = std::function<bool(std::int64_t arrival_ns)>;
  [[nodiscard]] Result<> run(const Out& out, const Pace& pace);

  // While run() lasts and afterwards: the first frame number of a stream from which on the log is
  // known to lack chunks or decisions; what comes later cannot be compared.
  [[nodiscard]] std::optional<std::uint64_t> broken_at(std::uint32_t stream) const;

 private:
  class Lane;
  explicit Replay(log::Reader& reader);

  log::Reader& reader_;
  std::vector<std::unique_ptr<Lane>> lanes_;
};

}  // namespace posed::record
