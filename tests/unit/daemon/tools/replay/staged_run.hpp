// A reproducible live run without threads and clocks: two streams through the real decoders,
// engines and recorder, with every kind of decision that a pipeline can make: an alpha change, a
// model swap, a shed, ticks.
#pragma once

#include <array>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/pipeline/intake.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/record/recorder.hpp"
#include "daemon/record/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/log/digest.hpp"
#include "proto/message/frame_message.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {

// One stream of the run, from chunk to published frame.
class StagedStream final : private pipeline::IntakeOut, private pipeline::EngineOut {
 public:
  // `next_item` is shared by all streams of the run.
  StagedStream(std::uint32_t id, std::string name, drivers::Device device, std::string model_bytes,
               std::uint64_t& next_item)
      : id_(id),
        name_(std::move(name)),
        device_(std::move(device)),
        model_bytes_(std::move(model_bytes)),
        styled_(name_),
        raw_(name_ + "-raw"),
        next_item_(next_item),
        intake_(next_item, *this) {
    const pipeline::StreamPosition begin{.stream = id};
    intake_.set_streams(std::span(&begin, 1));
    settings_.publish_raw = true;
    settings_.rate_hz = device_.description.rate_hz;
    settings_.stages.push_back(pipeline::stage_settings(style::style_type()));
    model_ = bind(model_bytes_);
    const std::array<const StageModel*, 1> models{model_.get()};
    engine_.emplace(
        pipeline::engine_options(id, settings_, device_.description.skeleton, models).value());
  }

  void add_to(record::RecordedSetup& setup) const {
    const drivers::Description& description = device_.description;
    setup.sources.push_back({.row = {.id = id_,
                                     .name = name_,
                                     .driver = description.driver,
                                     .text = description.text,
                                     .identity = "toy.bvh",
                                     .config = "{}"},
                             .rate_hz = settings_.rate_hz});
    ++setup.slots;
  }
  void add_to(record::Recorder& recorder) const {
    recorder.add_stream({.id = id_,
                         .source = id_,
                         .from_start = true,
                         .name = name_,
                         .settings = settings_,
                         .model_files = {std::make_shared<const std::string>(model_bytes_)}});
  }

  void set_record_sink(pipeline::RecordSink& record_sink) { record_sink_ = &record_sink; }

  // The line of a clip, or a part of it. A shed chunk is decoded, but its frame never reaches the
  // engine.
  void feed(const std::string& line, std::int64_t arrival_ns, bool shed = false) {
    shed_ = shed;
    const auto bytes = std::as_bytes(std::span(line));
    intake_.arrived(arrival_ns);
    record_sink_->chunk(id_, 0, pipeline::Direction::kFromDevice, arrival_ns, intake_.next(),
                        bytes);
    device_.decoder->feed(bytes, arrival_ns, intake_);
  }

  void tick(std::int64_t now_ns) { CHECK(engine_->tick(now_ns, *this)); }

  void set_alpha(float alpha) {
    static_cast<void>(engine_->apply(alpha_command(id_, alpha), *this));
  }

  void set_model(const std::string& bytes) {
    swapped_.push_back(bind(bytes));
    auto command = model_command(id_, style::style_type(), swapped_.back().get());
    const auto view = std::as_bytes(std::span(bytes));
    const std::string hash = log::sha256_hex(view);
    hash.copy(command.model_hash.data(), hash.size());
    record_sink_->keep_model(view);
    static_cast<void>(engine_->apply(command, *this));
  }

 private:
  using Model = std::unique_ptr<const StageModel>;
  [[nodiscard]] Model bind(const std::string& bytes) const {
    const auto context =
        pipeline::stage_context(settings_, 0, device_.description.skeleton).value();
    return style::style_type().bind_model(std::as_bytes(std::span(bytes)), context, "toy").value();
  }

  bool item(std::size_t /*place*/, pipeline::Item& item) noexcept override {
    place_ = item.number;
    if (!shed_) engine_->on_frame(item.frame, *this);
    place_ = 0;
    return !shed_;
  }
  void outcome(Outcome) noexcept override {}

  void item(const pipeline::Item& item) noexcept override {
    const bool raw = item.kind == pipeline::Item::Kind::kRawFrame;
    if (!raw && item.kind != pipeline::Item::Kind::kFrame) return;
    const std::string bytes = (raw ? raw_ : styled_).encode(item.frame).SerializeAsString();
    record_sink_->published(id_, item.frame.header.sequence, raw, std::as_bytes(std::span(bytes)));
  }
  void decision(const pipeline::Decision& decision) noexcept override {
    pipeline::Decision placed = decision;
    placed.item = place_ != 0 ? place_ : next_item_;
    record_sink_->decision(placed);
  }

  std::uint32_t id_;
  std::string name_;
  drivers::Device device_;
  std::string model_bytes_;
  record::StreamSettings settings_;
  message::FrameEncoder styled_, raw_;
  std::uint64_t& next_item_;
  std::uint64_t place_ = 0;  // number of the item in the engine; 0 between items
  pipeline::Intake intake_;
  Model model_;
  std::vector<Model> swapped_;
  std::optional<pipeline::StreamEngine> engine_;
  pipeline::RecordSink* record_sink_ = nullptr;
  bool shed_ = false;
};

// The motion lines of a clip, each with its line end.
inline std::vector<std::string> motion_lines(const std::filesystem::path& bvh) {
  std::ifstream file(bvh);
  std::vector<std::string> lines;
  bool motion = false;
  for (std::string line; std::getline(file, line);) {
    if (motion) lines.push_back(line + "\n");
    motion = motion || line.starts_with("Frame Time");
  }
  return lines;
}

// Writes the log of the staged run: `frames` frames of each stream, 60 Hz.
inline void write_staged_log(const std::filesystem::path& path, std::size_t frames) {
  const TempFolder dir;
  const auto bvh = dir.path() / "toy.bvh";
  REQUIRE(clip::write_bvh(toy_walk(static_cast<int>(frames), 60.0, 0.4), bvh));
  const auto lines = motion_lines(bvh);
  REQUIRE(lines.size() == frames);
  const std::string one = style::serialize_model(toy_model(1));
  const std::string two = style::serialize_model(toy_model(2));
  std::vector<std::unique_ptr<StagedStream>> streams;
  record::RecordedSetup setup;
  drivers::TransportFactory ports;
  std::uint64_t next_item = 1;
  for (std::uint32_t id = 0; id < 2; ++id) {
    auto device = drivers::find_driver("file")->open({{"path", bvh.string()}}, ports);
    REQUIRE(device);
    streams.push_back(std::make_unique<StagedStream>(id, id == 0 ? "a" : "b", std::move(*device),
                                                     one, next_item));
    streams.back()->add_to(setup);
  }
  record::RecorderOptions options;
  options.file = path;
  options.frames = true;
  options.clock = []() noexcept -> std::int64_t { return 1'000'000'000; };
  auto recorder = record::Recorder::open(std::move(options), setup);
  REQUIRE(recorder);
  for (const auto& stream : streams) {
    stream->add_to(**recorder);
    stream->set_record_sink((*recorder)->record_sink());
  }
  std::int64_t now_ns = 5'000'000'000;
  for (std::size_t i = 0; i < frames; ++i) {
    now_ns += 16'666'667;
    if (i == frames / 6) streams[0]->set_alpha(-0.5F);
    if (i == frames / 4) streams[1]->set_model(two);
    if (i == frames / 2) {
      streams[0]->set_model(one);  // replaced by itself
      now_ns += 700'000'000;
      for (const auto& stream : streams) stream->tick(now_ns);
      now_ns += 1'100'000'000;
      streams[1]->tick(now_ns);
    }
    const bool shed = i > 2 * frames / 3 && i < 2 * frames / 3 + 6;
    streams[0]->feed(lines[i], now_ns, shed);
    // The other stream's lines come in two parts, with foreign bytes between them.
    const std::size_t half = lines[i].size() / 2;
    streams[1]->feed(lines[i].substr(0, half), now_ns);
    streams[1]->feed(lines[i].substr(half), now_ns + 1000);
    if (i % 10 == 3) streams[1]->feed("not a number\n", now_ns + 2000);
  }
  streams[0]->tick(now_ns + 600'000'000);
  REQUIRE((*recorder)->finish());
}

}  // namespace posed::test
