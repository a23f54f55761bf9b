// ReplayStreamContext: one stream of a log, from its items to what was published. It computes the
// stream again with the same engine as the live run. Cold.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/partner_routes.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/record/stream_settings.hpp"
#include "daemon/tools/replay/replay_models.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

// No clock that counts from the start of a machine reaches this; sums of two such times fit 64
// bits.
[[nodiscard]] constexpr bool is_possible_time(std::int64_t time_ns) {
  return time_ns >= 0 && time_ns <= std::int64_t{1} << 61;
}

// A stream as the users of a replay see it.
struct ReplayStream {
  std::string name;
  std::string source, body;      // of a device with several bodies, else empty
  std::uint64_t first_item = 0;  // with which it begins
  bool is_there_from_start = false;
  // False if the log lacks the description of its body: then nothing is replayed of it.
  bool described = false;
  drivers::Description description{};
  std::shared_ptr<const Skeleton> published{};  // of the frames that leave the last stage
  record::StreamSettings settings{};
};

// What all streams of a replay share.
class ReplayHost {
 public:
  ReplayHost() = default;
  ReplayHost(const ReplayHost&) = delete;
  ReplayHost& operator=(const ReplayHost&) = delete;
  virtual ~ReplayHost() = default;

  // Called before an item enters the engine of stream `index`.
  virtual void before(const pipeline::Item& item, std::uint32_t index) noexcept = 0;
  // Called where the streams of a source change: what was decided up to the item with this number
  // takes effect now.
  virtual void reach(std::uint64_t item) noexcept = 0;
  // Receives the items that a stream publishes.
  virtual void publish(const pipeline::Item& item) noexcept = 0;
  // An error that could not be returned at once; it ends the replay.
  virtual void failed(Error error) noexcept = 0;

  std::uint64_t next_item = 1;       // the next Item::number
  pipeline::PartnerRoutes routes{};  // to the engines that there are
};

// The frames (or samples) of a stream that were decoded in the live run but never reached its
// engine. Cold.
class ShedRanges {
 public:
  // first + count must not overflow.
  void add(std::uint64_t first, std::uint64_t count) { ranges_.push_back({first, first + count}); }

  // Call after the last add(): joins overlapping ranges, so that contains() can use a binary
  // search.
  void finish() {
    std::ranges::sort(ranges_, {}, &Range::first);
    std::vector<Range> joined;
    for (const Range& range : ranges_) {
      if (joined.empty() || joined.back().end < range.first) {
        joined.push_back(range);
      } else {
        joined.back().end = std::max(joined.back().end, range.end);
      }
    }
    ranges_ = std::move(joined);
  }

  [[nodiscard]] bool contains(std::uint64_t sequence) const {
    const auto after = std::ranges::upper_bound(ranges_, sequence, {}, &Range::first);
    return after != ranges_.begin() && sequence < (after - 1)->end;
  }

 private:
  struct Range {
    std::uint64_t first = 0;
    std::uint64_t end = 0;  // the first that is not shed
  };
  std::vector<Range> ranges_;  // after finish() sorted and without overlap
};

class ReplayStreamContext final : private pipeline::EngineOut {
 public:
  // Published items have `index` as their stream. Host and models outlive the object.
  static Result<std::unique_ptr<ReplayStreamContext>> open(std::uint32_t index,
                                                           const log::SourceRow& source,
                                                           const log::StreamRow& stream,
                                                           ReplayModels& models, ReplayHost& host,
                                                           const std::string& file);
  ReplayStreamContext(std::uint32_t index, std::uint32_t log_id, ReplayModels& models,
                      ReplayHost& host, std::string file);

  // Before build(): gives raw frames, also where the live run published none.
  void give_raw() noexcept { stream_.settings.publish_raw = true; }
  // What the device says of the stream's body. `waits`: it comes late, so that its engine is freed
  // until then.
  Result<> describe(drivers::Description description, bool waits);
  // The streams that its stages have as partners, by their ids in the log or, in an older log, by
  // their names.
  [[nodiscard]] bool has_partner(const ReplayStreamContext& other) const;
  // After describe(), and after build() of its partners: makes the models and the engine, so that
  // nothing can fail later.
  Result<> build(std::span<const ReplayStreamContext* const> partners);

  // Before the first chunk, after describe(), for each decision of the stream in the log's order:
  // loads what the decision needs, so that nothing can fail later, and remembers which frames never
  // reached the engine.
  Result<> expect(const pipeline::Decision& decision);
  // The log lacks chunks or decisions after this chunk.
  void set_gap(std::int64_t after_chunk);
  // Call after the last expect() and set_gap().
  void ready() {
    shed_frames_.finish();
    shed_samples_.finish();
  }

  // Call before the chunk with this id is fed to any source: if it lies behind this stream's gap,
  // frames from here on cannot be compared. It may be a chunk of another source, because decisions
  // of this stream can come with it. Returns whether nothing is left to wait for.
  [[nodiscard]] bool apply_gap(std::int64_t chunk);

  // Its body comes: these are the numbers of its first frame and sample, because earlier ones
  // belong to the streams of its name before it.
  void begin(const pipeline::StreamPosition& first) noexcept;
  // From the intake.
  void handle(pipeline::Item& item) noexcept;
  void apply(const pipeline::Decision& decision) noexcept;
  // Its body is no longer among those of the source, at this time: frees the engine for good.
  void leave(std::int64_t now_ns) noexcept;
  // Call after the last chunk and decision.
  void finish() noexcept;

  // Whether its stages name this stream as a partner.
  [[nodiscard]] bool needs(std::uint32_t partner) const noexcept;
  [[nodiscard]] std::uint32_t index() const noexcept { return index_; }
  [[nodiscard]] std::uint32_t log_id() const noexcept { return log_id_; }
  [[nodiscard]] const ReplayStream& stream() const noexcept { return stream_; }
  // 0 if nothing is replayed of it.
  [[nodiscard]] std::optional<std::uint64_t> broken_at() const noexcept {
    return stream_.described ? broken_at_ : 0;
  }
  // Null while there is none.
  [[nodiscard]] const pipeline::StreamEngine* engine() const noexcept { return engine_.get(); }

 private:
  Result<> make_engine();
  void set_aside();
  [[nodiscard]] std::unexpected<Error> about(Error error) const;
  // Makes it when it is first needed; null if there is none.
  [[nodiscard]] pipeline::StreamEngine* needed_engine() noexcept;
  [[nodiscard]] std::optional<std::size_t> stage_of(const pipeline::StageChange& change) const;
  Result<std::unique_ptr<const StageModel>> bind(std::size_t stage, const std::string& hash);
  void change(const pipeline::Decision& decision) noexcept;
  void end(std::int64_t now_ns) noexcept;

  // EngineOut. The engine repeats the decisions that the log contains, so they are ignored here.
  void item(const pipeline::Item& item) noexcept override {
    if (item.kind == pipeline::Item::Kind::kFrame) last_out_ = item.frame.header.sequence;
    host_.publish(item);
    host_.routes.published(item);
  }
  void decision(const pipeline::Decision&) noexcept override {}

  std::uint32_t index_;
  std::uint32_t log_id_;
  ReplayModels& models_;
  ReplayHost& host_;
  std::string file_;
  ReplayStream stream_;
  bool waits_ = false;
  std::vector<std::unique_ptr<const StageModel>> models_in_use_;  // one for each stage, or null
  std::set<std::pair<std::size_t, std::string>> tried_;           // stage and hash
  std::unique_ptr<pipeline::StreamEngine> engine_;
  ShedRanges shed_frames_, shed_samples_;
  std::uint64_t last_frame_ = 0, last_sample_ = 0;  // sequences of those decoded last
  std::uint64_t last_out_ = 0;  // sequence of the last frame that left the engine
  bool ended_ = false, gone_ = false;
  std::optional<std::int64_t> gap_after_;
  std::optional<std::uint64_t> broken_at_;
};

}  // namespace posed::replay
