// ReplaySource: one source of a log. It decodes the source's chunks again, with the same decoder
// and intake as the live run, and hands the items to the streams of its bodies. What its bodies are
// is said by the rows of the log, not by what the decoder finds in the chunks. Cold.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/devices/calibration.hpp"
#include "daemon/pipeline/intake.hpp"
#include "daemon/tools/replay/replay_stream_context.hpp"
#include "drivers/driver.hpp"
#include "drivers/mapping.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

class ReplaySource final : private pipeline::IntakeOut {
 public:
  // `streams` are those of the source, by their ids in the log; at least one. They, the row and the
  // host outlive the object.
  static Result<std::unique_ptr<ReplaySource>> open(const log::SourceRow& source,
                                                    std::vector<ReplayStreamContext*> streams,
                                                    ReplayHost& host, const std::string& file);
  ReplaySource(const drivers::Driver& driver, const log::SourceRow& source,
               std::vector<ReplayStreamContext*> streams, ReplayHost& host, std::string file);

  // Before the first chunk, for each description of the source in the log's order: checks it, and
  // describes the streams that it is the first to name.
  Result<> expect(const log::ChunkRow& row);
  // The log lacks chunks, and perhaps descriptions, after this chunk.
  void set_gap(std::int64_t after_chunk);

  Result<> feed(const log::ChunkRow& chunk);

  // The number that the next sample of the stream with this index will get; 0 if it has none now.
  [[nodiscard]] std::uint64_t next_sample(std::uint32_t stream) const noexcept;

 private:
  struct Bodies {
    std::shared_ptr<const drivers::SourceLayout> layout{};  // null: of a device with one body
    std::vector<ReplayStreamContext*> streams{};            // [body], null: nobody wanted it
  };

  Result<> open_device();
  Result<> open_mapping();
  Result<Bodies> bodies_of(const log::ChunkRow& row);
  Result<std::shared_ptr<const drivers::SourceLayout>> layout_of(
      std::span<const std::byte> description);
  Result<> use_bodies(const log::ChunkRow& row);
  Result<> find_place(const log::ChunkRow& chunk);
  Result<> use_device(const std::string& info);
  Result<> calibrate(const std::string& toml);
  void use_calibration();
  void arrived(const log::ChunkRow& chunk, std::span<const pipeline::StreamPosition> positions);
  // Null if the source does not have the stream.
  [[nodiscard]] ReplayStreamContext* find(std::uint32_t log_id) const;
  [[nodiscard]] pipeline::StreamPosition position(const ReplayStreamContext& stream,
                                                  const log::StreamPosition& place) const;
  [[nodiscard]] std::span<const drivers::Body> bodies_in(
      const std::shared_ptr<const drivers::SourceLayout>& layout) const {
    return layout ? std::span(layout->bodies) : std::span(&only_, 1);
  }
  [[nodiscard]] bool has_several() const noexcept { return driver_.make_layout != nullptr; }
  [[nodiscard]] std::unexpected<Error> impossible(const log::ChunkRow& chunk) const;

  // IntakeOut
  bool item(std::size_t place, pipeline::Item& item) noexcept override;
  void outcome(Outcome) noexcept override {}

  const drivers::Driver& driver_;
  const log::SourceRow& source_;
  std::vector<ReplayStreamContext*> streams_;  // by id in the log
  ReplayHost& host_;
  std::string file_;
  drivers::Description device_;  // from its latest device info
  std::unique_ptr<drivers::Decoder> decoder_;
  std::optional<drivers::Mapping> mapping_;  // the user's word about the joints of its bodies
  std::unique_ptr<const devices::OwnedCalibration> calibration_;  // null: use the device's default
  drivers::Body only_;  // of a device that does not describe its bodies
  // Cache of recent layouts, keyed by the SHA-256 of their description; a recording has few
  // distinct ones.
  std::map<std::string, std::shared_ptr<const drivers::SourceLayout>> layouts_;
  std::shared_ptr<const drivers::SourceLayout> layout_;  // in use
  pipeline::Intake intake_;
  std::vector<ReplayStreamContext*> places_;         // as in intake_.next().streams
  std::vector<pipeline::StreamPosition> positions_;  // scratch
  std::int64_t arrival_ns_ = 0;
  std::optional<std::int64_t> gap_after_;
  bool described_ = false;  // expect() was called
};

}  // namespace posed::replay
