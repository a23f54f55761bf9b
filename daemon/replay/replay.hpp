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
#include "daemon/replay/replay_models.hpp"
#include "daemon/replay/replay_stream_context.hpp"
#include "daemon/replay/schedule.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"

namespace posed::replay {

// Streams are numbered by their place in Reader::streams(), whatever their ids in the log are.
class Replay final : private ReplayHost {
 public:
  // Builds decoders, models and engines of all streams. The reader outlives the replay.
  [[nodiscard]] static Result<std::unique_ptr<Replay>> open(log::Reader& reader);
  ~Replay() override = default;

  [[nodiscard]] std::uint32_t streams() const {
    return static_cast<std::uint32_t>(contexts_.size());
  }
  [[nodiscard]] const ReplayStream& stream(std::uint32_t stream) const;

  // Where the slew of the stream's style is, while run() lasts and afterwards; 0 without a style.
  [[nodiscard]] float alpha(std::uint32_t stream) const;

  // Items in pipeline order.
  using Out = std::function<void(const pipeline::Item&)>;
  // Called before each chunk; false ends the replay there.
  using Pace = std::function<bool(const log::ChunkRow&)>;
  [[nodiscard]] Result<> run(const Out& out, const Pace& pace);

  // While run() lasts and afterwards: the first frame number of a stream from which on the log is
  // known to lack chunks or decisions; what comes later cannot be compared.
  [[nodiscard]] std::optional<std::uint64_t> broken_at(std::uint32_t stream) const;

 private:
  explicit Replay(log::Reader& reader);
  [[nodiscard]] Result<> open_contexts();
  [[nodiscard]] Result<> load_decisions();
  [[nodiscard]] Result<> load_gaps();
  void apply(const Schedule::Entry& entry) noexcept;

  // ReplayHost
  void before(const pipeline::Item& item, std::uint32_t index) noexcept override;
  void publish(const pipeline::Item& item) noexcept override { (*out_)(item); }

  log::Reader& reader_;
  ReplayModels models_;
  std::vector<std::unique_ptr<ReplayStreamContext>> contexts_;
  Schedule schedule_;
  const Out* out_ = nullptr;  // of the run in progress
};

}  // namespace posed::replay
