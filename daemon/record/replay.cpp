#include "daemon/record/replay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/record/tape.hpp"
#include "models/style/style_model.hpp"

namespace posed::record {
namespace {

using Decision = pipeline::Decision;
using Model = std::unique_ptr<const style::BoundModel>;
// By SHA-256. Two of each: live, a model that replaces itself is another object, too.
using Models = std::map<std::string, std::array<Model, 2>>;

constexpr double kMostAlpha = 2.0;
constexpr std::uint64_t kEnd = std::numeric_limits<std::uint64_t>::max();

Result<> load_model(const log::Reader& reader, const std::string& hash,
                    const Replay::Stream& stream, Models& models) {
  if (models.contains(hash)) return {};
  const auto bytes = reader.blob(hash);
  if (!bytes) return std::unexpected(bytes.error());
  const std::string name = "the log's model " + hash.substr(0, 12);
  const auto model = style::parse_model(*bytes, name);
  if (!model) return std::unexpected(model.error());
  for (Model& copy : models[hash]) {
    auto bound =
        style::bind_model(*model, *stream.description.skeleton, *stream.settings.style, name);
    if (!bound) return std::unexpected(bound.error());
    copy = std::move(*bound);
  }
  return {};
}

// A decision as the pipeline made it; one that no pipeline could have made is damage.
Result<> check_decision(const log::DecisionRow& row, const std::string& file) {
  const bool known = row.kind >= static_cast<std::uint8_t>(Decision::Kind::kAlpha) &&
                     row.kind <= static_cast<std::uint8_t>(Decision::Kind::kTick);
  if (known && std::abs(row.alpha) <= kMostAlpha && row.count <= kEnd - row.sequence) return {};
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

  void feed(const log::ChunkRow& chunk, const Out& out) {
    notice_gap(chunk.id);
    if (chunk.direction != static_cast<std::uint8_t>(Direction::kFromDevice)) return;
    out_ = &out;
    arrival_ns_ = chunk.arrival_ns;
    frames_ = chunk.next_sequence - 1;
    decoder_->feed(chunk.bytes, chunk.arrival_ns, *this);
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

  void frame(Frame& frame) noexcept override {
    frame.header.stream = id_;
    frame.header.sequence = ++frames_;
    frame.header.arrival_ns = arrival_ns_;
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
  void notice_gap(std::int64_t chunk) {
    if (gap_after_ && !broken_at_ && chunk > *gap_after_) broken_at_ = frames_ + 1;
  }

  Stream stream_;
  std::uint32_t id_ = 0;
  std::unique_ptr<drivers::Decoder> decoder_;
  Models models_;
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
    return fail("stream '" + row.name + "' comes from driver '" + row.driver +
                    "', which this posed does not have",
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
  lane->stream_.description = std::move(*description);
  auto decoder = driver->make_decoder(lane->stream_.description);
  if (!decoder) return std::unexpected(decoder.error());
  lane->decoder_ = std::move(*decoder);
  if (lane->stream_.settings.style && !lane->stream_.description.skeleton) {
    return fail("stream '" + row.name + "' has a style but no skeleton", file);
  }
  if (auto done = lane->load_decisions(reader, row.id, file); !done) {
    return std::unexpected(done.error());
  }
  pipeline::EngineOptions options;
  options.stream = row.id;
  options.stale_after_ns = nanoseconds(lane->stream_.settings.stale_after_s);
  options.publish_raw = lane->stream_.settings.publish_raw;
  options.style = lane->stream_.settings.style;
  if (options.style && !row.model.empty()) {
    if (auto done = load_model(reader, row.model, lane->stream_, lane->models_); !done) {
      return std::unexpected(done.error());
    }
    options.model = lane->models_[row.model].front().get();
  }
  lane->engine_.emplace(options);
  return lane;
}

// Loads every model that a decision names, so that nothing can fail on the way.
Result<> Replay::Lane::load_decisions(const log::Reader& reader, std::uint32_t id,
                                      const std::string& file) {
  auto decisions = reader.decisions(id);
  if (!decisions) return std::unexpected(decisions.error());
  decisions_ = std::move(*decisions);
  for (const log::DecisionRow& row : decisions_) {
    if (auto sound = check_decision(row, file); !sound) return sound;
    const bool swap = row.kind == static_cast<std::uint8_t>(Decision::Kind::kModel);
    if (!swap || !stream_.settings.style) continue;
    if (auto done = load_model(reader, row.model_hash, stream_, models_); !done) return done;
  }
  return {};
}

void Replay::Lane::apply_decisions(std::uint64_t sequence) noexcept {
  for (; next_decision_ < decisions_.size(); ++next_decision_) {
    const log::DecisionRow& row = decisions_[next_decision_];
    if (row.sequence > sequence) return;
    switch (static_cast<Decision::Kind>(row.kind)) {
      case Decision::Kind::kAlpha:
        static_cast<void>(engine_->apply({.kind = pipeline::Command::Kind::kAlpha,
                                          .stream = id_,
                                          .alpha = static_cast<float>(row.alpha)},
                                         *this));
        break;
      case Decision::Kind::kModel: {
        const auto found = models_.find(row.model_hash);
        if (found == models_.end()) break;  // a stream without a style ignored it live, too
        const auto& [one, other] = found->second;
        const Model& model = engine_->model() == one.get() ? other : one;
        static_cast<void>(engine_->apply(
            {.kind = pipeline::Command::Kind::kModel, .stream = id_, .model = model.get()}, *this));
        break;
      }
      case Decision::Kind::kShed:
        shed_until_ = row.sequence + row.count;
        break;
      case Decision::Kind::kTick:
        engine_->tick_now(row.now_ns, *this);
        break;
    }
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
    lanes_[(*chunk)->stream]->feed(**chunk, out);
  }
  for (const auto& lane : lanes_) lane->finish(out);
  return {};
}

}  // namespace posed::record
