// Replay computes again what a device log's run published, from the log's chunks and decisions
// alone, with the decoders and engines of the live run. It has no thread and no clock; the caller
// decides its speed. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/pipeline/messages.hpp"
#include "daemon/tools/replay/replay_models.hpp"
#include "daemon/tools/replay/replay_source.hpp"
#include "daemon/tools/replay/replay_stream_context.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

// When each decision of a log takes effect, just before an item.
class Schedule {
 public:
  struct Entry {
    std::size_t stream = 0;  // index of the stream in the log
    log::DecisionRow row;
  };

  // Call in the order of the log.
  void add(Entry entry) { waiting_.push_back(std::move(entry)); }

  // The next decision that takes effect before the item with this number; null if none is left that
  // does. The pointer stays valid.
  [[nodiscard]] const Entry* due(std::uint64_t item) {
    if (next_ == waiting_.size() || waiting_[next_].row.item > item) return nullptr;
    return &waiting_[next_++];
  }

  // Call after the last item: the decisions that were made when no more items came; null after the
  // last.
  [[nodiscard]] const Entry* rest() {
    return next_ < waiting_.size() ? &waiting_[next_++] : nullptr;
  }

 private:
  std::vector<Entry> waiting_;
  std::size_t next_ = 0;
};

// Streams are numbered by their index in Reader::streams(), whatever their ids in the log are. A
// body that comes back or changes its skeleton is another stream, of the same name.
class Replay final : private ReplayHost {
 public:
  // Builds decoders, models and engines of all streams. Those of bodies that come later than the
  // first ones of their source are built again when they come, so that few are in memory. The
  // reader outlives the replay. `every_raw`: gives raw frames also of streams that published none.
  static Result<std::unique_ptr<Replay>> open(log::Reader& reader, bool every_raw = false);
  ~Replay() override = default;

  [[nodiscard]] std::uint32_t streams() const {
    return static_cast<std::uint32_t>(contexts_.size());
  }
  [[nodiscard]] const ReplayStream& stream(std::uint32_t stream) const;

  // Null while there is none: the body has left, or does not come soon.
  [[nodiscard]] const pipeline::StreamEngine* engine(std::uint32_t stream) const;

  // Items in pipeline order.
  using Out = std::function<void(const pipeline::Item&)>;
  // Called before each chunk; false ends the replay there.
  using Pace = std::function<bool(const log::ChunkRow&)>;
  Result<> run(const Out& out, const Pace& pace);

  // During run() and afterwards: the number that the next item will get.
  [[nodiscard]] std::uint64_t next_item() const noexcept { return ReplayHost::next_item; }

  // During run() and afterwards: the number of the item that is handled, or of the last one. What
  // the stages emit between two items, such as by a tick, counts to the one before. 0: before the
  // first.
  [[nodiscard]] std::uint64_t position() const noexcept { return position_; }

  // During run() and afterwards: the first frame of a stream from which the log is known to lack
  // chunks or decisions; frames from there on cannot be compared.
  [[nodiscard]] std::optional<std::uint64_t> broken_at(std::uint32_t stream) const;

 private:
  explicit Replay(log::Reader& reader);
  Result<> open_contexts(bool every_raw);
  Result<> open_sources();
  Result<> load_descriptions();
  enum class Built : std::uint8_t { kNo, kUnderWay, kYes };
  Result<> build_streams();
  Result<> build_stream(std::size_t stream, std::vector<Built>& built);
  Result<> load_decisions();
  Result<> load_gaps();
  void set_gap(std::size_t stream, std::int64_t after_chunk);
  void apply_gaps(std::int64_t chunk);
  void apply(const Schedule::Entry& entry) noexcept;
  // Null if nothing is to be replayed of it.
  [[nodiscard]] ReplaySource* source_of(std::uint32_t log_id) const;

  // ReplayHost
  void before(const pipeline::Item& item, std::uint32_t index) noexcept override;
  void reach(std::uint64_t item) noexcept override;
  void publish(const pipeline::Item& item) noexcept override { (*out_)(item); }
  void failed(Error error) noexcept override {
    if (!error_) error_ = std::move(error);
  }

  log::Reader& reader_;
  ReplayModels models_;
  std::vector<std::unique_ptr<ReplayStreamContext>> contexts_;
  std::vector<std::unique_ptr<ReplaySource>> sources_;  // as in Reader::sources(); may be null
  std::vector<ReplayStreamContext*> gapped_;            // whose gap is still to come
  Schedule schedule_;
  const Out* out_ = nullptr;  // of the current run()
  std::uint64_t position_ = 0;
  std::optional<Error> error_;
};

}  // namespace posed::replay
