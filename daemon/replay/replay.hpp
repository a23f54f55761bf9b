// Replay computes again what a device log's run published, from the log's chunks and decisions
// alone, with the decoders and engines of the live run. It has no thread and no clock; the caller
// decides its speed. Cold.
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

// Streams are numbered by their index in Reader::streams(), whatever their ids in the log are.
class Replay final : private ReplayHost {
 public:
  // Builds decoders, models and engines of all streams. The reader outlives the replay.
  [[nodiscard]] static Result<std::unique_ptr<Replay>> open(log::Reader& reader);
  ~Replay() override = default;

  [[nodiscard]] std::uint32_t streams() const {
    return static_cast<std::uint32_t>(contexts_.size());
  }
  [[nodiscard]] const ReplayStream& stream(std::uint32_t stream) const;

  // During run() and afterwards.
  [[nodiscard]] const pipeline::StreamEngine& engine(std::uint32_t stream) const;

  // Items in pipeline order.
  using Out = std::function<void(const pipeline::Item&)>;
  // Called before each chunk; false ends the replay there.
  using Pace = std::function<bool(const log::ChunkRow&)>;
  [[nodiscard]] Result<> run(const Out& out, const Pace& pace);

  // During run() and afterwards: the first frame of a stream from which the log is known to lack
  // chunks or decisions; frames from there on cannot be compared.
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
  const Out* out_ = nullptr;  // of the current run()
};

}  // namespace posed::replay
