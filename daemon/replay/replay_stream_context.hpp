// ReplayStreamContext: one stream of a log. It computes the stream again with the same decoder,
// intake and engine as the live run. Cold.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/devices/calibration.hpp"
#include "daemon/pipeline/intake.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/record/stream_settings.hpp"
#include "daemon/replay/replay_models.hpp"
#include "daemon/replay/shed_ranges.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

// A stream as the users of a replay see it.
struct ReplayStream {
  std::string name;
  drivers::Description description;
  record::StreamSettings settings;
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
  // Receives the items that a stream publishes.
  virtual void publish(const pipeline::Item& item) noexcept = 0;

  std::uint64_t next_item = 1;  // the next Item::number
};

class ReplayStreamContext final : private pipeline::IntakeOut, private pipeline::EngineOut {
 public:
  // Published items have `index` as their stream. Host and models outlive the object.
  [[nodiscard]] static Result<std::unique_ptr<ReplayStreamContext>> open(
      std::uint32_t index, const log::SourceRow& source, const log::StreamRow& stream,
      ReplayModels& models, ReplayHost& host, const std::string& file);
  ReplayStreamContext(std::uint32_t index, std::uint32_t stream_id, ReplayModels& models,
                      ReplayHost& host, std::string file);

  // Before the first chunk, for each decision of the stream in the log's order: loads what the
  // decision needs, so that nothing can fail later, and remembers which frames never reached the
  // engine.
  [[nodiscard]] Result<> expect(const pipeline::Decision& decision);
  // The log lacks chunks or decisions after this chunk.
  void set_gap(std::int64_t after_chunk);
  // Call after the last expect() and set_gap().
  void ready() {
    shed_frames_.finish();
    shed_samples_.finish();
  }

  // Call before the chunk with this id is fed to any stream: if it lies behind this stream's gap,
  // frames from here on cannot be compared. It may be a chunk of another stream, because decisions
  // of this stream can come with it.
  void apply_gap(std::int64_t chunk);

  [[nodiscard]] Result<> feed(const log::ChunkRow& chunk);
  void apply(const pipeline::Decision& decision) noexcept;
  // Call after the last chunk and decision. `ends`: the log has an old format that does not record
  // whether the stream ended.
  [[nodiscard]] Result<> finish(bool ends);

  [[nodiscard]] const ReplayStream& stream() const noexcept { return stream_; }
  [[nodiscard]] std::optional<std::uint64_t> broken_at() const noexcept { return broken_at_; }
  [[nodiscard]] const pipeline::StreamEngine& engine() const noexcept { return *engine_; }

 private:
  [[nodiscard]] Result<> open_decoder(const log::SourceRow& source);
  [[nodiscard]] Result<> open_engine();
  [[nodiscard]] Result<> find_place(const log::ChunkRow& chunk);
  [[nodiscard]] Result<> use_device(const std::string& info);
  [[nodiscard]] Result<> calibrate(const std::string& toml);
  void use_calibration();
  [[nodiscard]] std::optional<std::size_t> stage_of(const pipeline::StageChange& change) const;
  [[nodiscard]] Result<std::unique_ptr<const StageModel>> bind(std::size_t stage,
                                                               const std::string& hash);
  void change(const pipeline::Decision& decision) noexcept;
  void close_gaps() noexcept;
  [[nodiscard]] Result<> outcome_so_far();

  // IntakeOut
  bool item(pipeline::Item& item) noexcept override;
  void outcome(Outcome) noexcept override {}
  // EngineOut. The engine repeats the decisions that the log contains, so they are ignored here.
  void item(const pipeline::Item& item) noexcept override {
    if (item.kind == pipeline::Item::Kind::kFrame) last_out_ = item.frame.header.sequence;
    host_.publish(item);
  }
  void decision(const pipeline::Decision&) noexcept override {}

  std::uint32_t index_;
  std::uint32_t stream_id_;  // in the log
  ReplayModels& models_;
  ReplayHost& host_;
  std::string file_;
  ReplayStream stream_;
  drivers::Description device_;  // from its latest device info
  std::unique_ptr<drivers::Decoder> decoder_;
  std::unique_ptr<const devices::OwnedCalibration> calibration_;  // null: use the device's default
  std::vector<std::unique_ptr<const StageModel>> models_in_use_;  // one for each stage, or null
  std::set<std::pair<std::size_t, std::string>> tried_;           // stage and hash
  pipeline::Intake intake_;
  std::optional<pipeline::StreamEngine> engine_;
  ShedRanges shed_frames_, shed_samples_;
  std::int64_t arrival_ns_ = 0;
  std::uint64_t last_out_ = 0;  // sequence of the last frame that left the engine
  std::optional<std::int64_t> gap_after_;
  std::optional<std::uint64_t> broken_at_;
  std::optional<Error> error_;  // the first error that could not be returned at once
};

}  // namespace posed::replay
