#include "daemon/record/replay.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "daemon/devices/calibration.hpp"
#include "daemon/pipeline/device_clock.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/record/replay_models.hpp"
#include "daemon/record/tape.hpp"
#include "models/gesture/play_order.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::record {
namespace {

using Decision = pipeline::Decision;
constexpr double kMostAlpha = 2.0;
constexpr std::uint64_t kEnd = std::numeric_limits<std::uint64_t>::max();

// What a play's row says; nothing when no pipeline could have written it.
std::optional<gesture::PlayOrder> play_order(const log::DecisionRow& row) {
  gesture::PlayOrder order{
      .tempo = static_cast<float>(row.alpha), .loop = row.count != 0, .size = 0, .label = {}};
  for (const std::string& word : gesture::split_labels(row.labels)) {
    unsigned label = 0;
    const char* const end = word.data() + word.size();
    if (order.size == order.label.size() || std::from_chars(word.data(), end, label).ptr != end ||
        label > std::numeric_limits<std::uint16_t>::max()) {
      return std::nullopt;
    }
    order.label[order.size++] = static_cast<std::uint16_t>(label);
  }
  if (order.size == 0 || !(order.tempo > 0.0F)) return std::nullopt;
  return order;
}

// A decision as the pipeline made it; one that no pipeline could have made is damage.
Result<> check_decision(const log::DecisionRow& row, const std::string& file) {
  const bool known = row.kind >= static_cast<std::uint8_t>(Decision::Kind::kAlpha) &&
                     row.kind <= static_cast<std::uint8_t>(Decision::Kind::kShedSamples);
  const bool plays = row.kind == static_cast<std::uint8_t>(Decision::Kind::kPlay);
  if (known && std::abs(row.alpha) <= kMostAlpha && row.count <= kEnd - row.sequence &&
      (!plays || play_order(row).has_value())) {
    return {};
  }
  return fail("the log is damaged (a decision before frame " + std::to_string(row.sequence) +
                  " of stream " + std::to_string(row.stream) + " makes no sense)",
              file);
}

}  // namespace

// One stream: its decoder, the sink that numbers frames as the live reader does, and its engine.
class Replay::Lane final : public Sink, private pipeline::EngineOut {
 public:
  static Result<std::unique_ptr<Lane>> open(const log::Reader& reader, const log::StreamRow& row,
                                            const std::string& file);

  Result<> feed(const log::ChunkRow& chunk, const Out& out) {
    notice_gap(chunk.id);
    out_ = &out;
    arrival_ns_ = chunk.arrival_ns;
    frames_ = chunk.next_sequence - 1;
    switch (static_cast<Direction>(chunk.direction)) {
      case Direction::kFromDevice:
        decoder_->feed(chunk.bytes, chunk.arrival_ns, *this);
        return {};
      case Direction::kGreeting:
        return greet(text_of(chunk));
      case Direction::kCalibration:
        return calibrate(text_of(chunk));
      case Direction::kToDevice:
        return {};
    }
    return fail("the log is damaged (chunk " + std::to_string(chunk.id) + " has no direction)");
  }

  // After the last chunk: what was decided when no frame came any more.
  void finish(const Out& out) {
    out_ = &out;
    notice_gap(std::numeric_limits<std::int64_t>::max());
    apply_decisions(kEnd);
    engine_->end(arrival_ns_, *this);
  }

  void set_gap(std::int64_t after_chunk) {
    gap_after_ = std::min(gap_after_.value_or(after_chunk), after_chunk);
  }
  [[nodiscard]] const Stream& stream() const { return stream_; }
  [[nodiscard]] std::optional<std::uint64_t> broken_at() const { return broken_at_; }

 private:
  Result<> load_decisions(const log::Reader& reader, std::uint32_t id, const std::string& file);
  Result<> open_engine(const log::Reader& reader, const log::StreamRow& row);
  Result<> greet(const std::string& text);
  Result<> calibrate(const std::string& toml);
  static std::string text_of(const log::ChunkRow& chunk) {
    return {reinterpret_cast<const char*>(chunk.bytes.data()), chunk.bytes.size()};
  }

  void frame(Frame& frame) noexcept override {
    frame.header.stream = id_;
    frame.header.sequence = ++frames_;
    frame.header.arrival_ns = arrival_ns_;
    clock_.stamp(frame);
    apply_decisions(frames_);
    if (frames_ >= shed_until_) engine_->on_frame(frame, *this);
  }

  void sample(Sample& sample) noexcept override {
    sample.header.stream = id_;
    sample.header.sequence = ++samples_;
    sample.header.arrival_ns = arrival_ns_;
    engine_->on_sample(sample, *this);
  }

  void outcome(Outcome) noexcept override {}

  void item(const pipeline::Item& item) noexcept override { (*out_)(item); }
  // The engine decides again what the log made it decide.
  void decision(const Decision&) noexcept override {}

  void apply_decisions(std::uint64_t sequence) noexcept;
  std::optional<pipeline::Command> command_of(const log::DecisionRow& row) const;
  void notice_gap(std::int64_t chunk) {
    if (gap_after_ && !broken_at_ && chunk > *gap_after_) broken_at_ = frames_ + 1;
  }

  Stream stream_;
  std::uint32_t id_ = 0;
  std::unique_ptr<drivers::Decoder> decoder_;
  drivers::Description device_;                                   // as it greeted last
  std::unique_ptr<const devices::OwnedCalibration> calibration_;  // null: the device's default
  pipeline::DeviceClock clock_;
  ReplayModels models_;
  std::optional<pipeline::StreamEngine> engine_;
  std::vector<log::DecisionRow> decisions_;
  std::size_t next_decision_ = 0;
  std::uint64_t shed_until_ = 0;  // first frame that is not shed
  std::uint64_t frames_ = 0;      // number of the last frame decoded
  std::uint64_t samples_ = 0;
  std::int64_t arrival_ns_ = 0;
  std::optional<std::int64_t> gap_after_;
  std::optional<std::uint64_t> broken_at_;
  const Out* out_ = nullptr;
};

Result<std::unique_ptr<Replay::Lane>> Replay::Lane::open(const log::Reader& reader,
                                                         const log::StreamRow& row,
                                                         const std::string& file) {
  const drivers::Driver* driver = drivers::find_driver(row.driver);
  if (driver == nullptr) {
    return fail("stream " + in_quotes(row.name) + " comes from driver " + in_quotes(row.driver) +
                    ", which this posed does not have",
                file);
  }
  auto lane = std::make_unique<Lane>();
  lane->id_ = row.id;
  lane->stream_.name = row.name;
  auto settings = settings_from_json(row.config, file);
  if (!settings) return std::unexpected(settings.error());
  lane->stream_.settings = std::move(*settings);
  auto description = driver->describe(row.text, row.identity);
  if (!description) return std::unexpected(description.error());
  lane->stream_.description = *description;
  lane->device_ = std::move(*description);
  auto decoder = driver->make_decoder(lane->device_);
  if (!decoder) return std::unexpected(decoder.error());
  lane->decoder_ = std::move(*decoder);
  const StreamSettings& stages = lane->stream_.settings;
  if ((stages.style || stages.generate) && !lane->stream_.description.skeleton) {
    return fail("stream " + in_quotes(row.name) + " has stages but no skeleton", file);
  }
  if (auto done = lane->load_decisions(reader, row.id, file); !done) {
    return std::unexpected(done.error());
  }
  if (auto done = lane->open_engine(reader, row); !done) return std::unexpected(done.error());
  return lane;
}

// The device came back, perhaps as another make of it; what the pipeline was bound to stays.
Result<> Replay::Lane::greet(const std::string& text) {
  const drivers::Driver* driver = drivers::find_driver(stream_.description.driver);
  auto description = driver->describe(text, stream_.description.identity);
  if (!description) return std::unexpected(description.error());
  auto decoder = driver->make_decoder(*description);
  if (!decoder) return std::unexpected(decoder.error());
  decoder_ = std::move(*decoder);
  device_ = std::move(*description);
  clock_.restart();
  if (calibration_) decoder_->calibrate(*calibration_->calibration);
  return {};
}

Result<> Replay::Lane::calibrate(const std::string& toml) {
  drivers::Description device = device_;
  device.identity.clear();  // whose it was, the live run has checked
  auto compiled = devices::compile_calibration(device, toml, "the log's calibration");
  if (!compiled) return std::unexpected(compiled.error());
  decoder_->calibrate(*(*compiled)->calibration);
  calibration_ = std::move(*compiled);
  return {};
}

Result<> Replay::Lane::open_engine(const log::Reader& reader, const log::StreamRow& row) {
  const StreamSettings& settings = stream_.settings;
  pipeline::EngineOptions options;
  options.stream = row.id;
  options.stale_after_ns = nanoseconds(settings.stale_after_s);
  options.publish_raw = settings.publish_raw;
  options.style = settings.style;
  options.generate = settings.generate;
  options.skeleton = stream_.description.skeleton;
  options.constrain =
      settings.constrain && options.skeleton && hand_side(*options.skeleton).has_value();
  options.rate_hz = stream_.description.rate_hz;
  if (options.style && !row.model.empty()) {
    auto done = models_.load_style(reader, row.model, stream_.description, *options.style);
    if (!done) return done;
    options.model = models_.style(row.model, nullptr);
  }
  if (options.generate && !settings.gesture_model.empty()) {
    auto done = models_.load_gesture(reader, settings.gesture_model, stream_.description);
    if (!done) return done;
    options.gesture = models_.gesture(settings.gesture_model);
  }
  engine_.emplace(options);
  return {};
}

// Loads every model that a decision names, so that nothing can fail on the way.
Result<> Replay::Lane::load_decisions(const log::Reader& reader, std::uint32_t id,
                                      const std::string& file) {
  auto decisions = reader.decisions(id);
  if (!decisions) return std::unexpected(decisions.error());
  decisions_ = std::move(*decisions);
  // Their place is not among the frames.
  std::erase_if(decisions_, [](const log::DecisionRow& row) {
    return row.kind == static_cast<std::uint8_t>(Decision::Kind::kShedSamples);
  });
  for (const log::DecisionRow& row : decisions_) {
    if (auto sound = check_decision(row, file); !sound) return sound;
    const auto kind = static_cast<Decision::Kind>(row.kind);
    const StreamSettings& settings = stream_.settings;
    Result<> done;
    if (kind == Decision::Kind::kModel && settings.style) {
      done = models_.load_style(reader, row.model_hash, stream_.description, *settings.style);
    } else if (kind == Decision::Kind::kGesture && settings.generate) {
      done = models_.load_gesture(reader, row.model_hash, stream_.description);
    }
    if (!done) return done;
  }
  return {};
}

void Replay::Lane::apply_decisions(std::uint64_t sequence) noexcept {
  for (; next_decision_ < decisions_.size(); ++next_decision_) {
    const log::DecisionRow& row = decisions_[next_decision_];
    if (row.sequence > sequence) return;
    switch (static_cast<Decision::Kind>(row.kind)) {
      case Decision::Kind::kShed:
        shed_until_ = row.sequence + row.count;
        break;
      case Decision::Kind::kTick:
        engine_->tick_now(row.now_ns, *this);
        break;
      default:
        if (const auto command = command_of(row)) {
          static_cast<void>(engine_->apply(*command, *this));
        }
    }
  }
}

// The command behind a decision; nothing where the stage it is for is missing: live, it was
// ignored, too.
std::optional<pipeline::Command> Replay::Lane::command_of(const log::DecisionRow& row) const {
  pipeline::Command command{.stream = id_};
  switch (static_cast<Decision::Kind>(row.kind)) {
    case Decision::Kind::kAlpha:
      command.alpha = static_cast<float>(row.alpha);
      return command;
    case Decision::Kind::kModel:
      command.kind = pipeline::Command::Kind::kModel;
      command.model = models_.style(row.model_hash, engine_->model());
      if (command.model == nullptr) return std::nullopt;
      return command;
    case Decision::Kind::kGesture:
      command.kind = pipeline::Command::Kind::kGesture;
      command.gesture = models_.gesture(row.model_hash);
      if (command.gesture == nullptr) return std::nullopt;
      return command;
    case Decision::Kind::kPlay:
      command.kind = pipeline::Command::Kind::kPlay;
      command.play = play_order(row).value_or(gesture::PlayOrder{});
      return command;
    case Decision::Kind::kStopPlaying:
      command.kind = pipeline::Command::Kind::kStopPlaying;
      return command;
    default:
      return std::nullopt;
  }
}

Replay::Replay(log::Reader& reader) : reader_(reader) {}
Replay::~Replay() = default;

Result<std::unique_ptr<Replay>> Replay::open(log::Reader& reader, const std::string& file) {
  std::unique_ptr<Replay> replay(new Replay(reader));
  for (const log::StreamRow& row : reader.streams()) {
    auto lane = Lane::open(reader, row, file);
    if (!lane) return std::unexpected(lane.error());
    replay->lanes_.push_back(std::move(*lane));
  }
  const auto gaps = reader.gaps();
  if (!gaps) return std::unexpected(gaps.error());
  for (const log::GapRow& gap : *gaps) {
    if (gap.kind != log::GapRow::Kind::kFrames)
      replay->lanes_[gap.stream]->set_gap(gap.after_chunk);
  }
  return replay;
}

const Replay::Stream& Replay::stream(std::uint32_t id) const { return lanes_[id]->stream(); }

std::optional<std::uint64_t> Replay::broken_at(std::uint32_t stream) const {
  return lanes_[stream]->broken_at();
}

Result<> Replay::run(const Out& out, const Pace& pace) {
  for (;;) {
    const auto chunk = reader_.next_chunk();
    if (!chunk) return std::unexpected(chunk.error());
    if (!chunk->has_value()) break;
    if (!pace((*chunk)->arrival_ns)) return {};
    if (auto fed = lanes_[(*chunk)->stream]->feed(**chunk, out); !fed) return fed;
  }
  for (const auto& lane : lanes_) lane->finish(out);
  return {};
}

}  // namespace posed::record
