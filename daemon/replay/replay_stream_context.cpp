#include "daemon/replay/replay_stream_context.hpp"

#include <algorithm>
#include <utility>

#include "daemon/pipeline/record_sink.hpp"
#include "drivers/glove/calibrated_decoder.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"

namespace posed::replay {
namespace {

using Kind = pipeline::Decision::Kind;

// No clock that counts from the start of a machine reaches this; sums of two such times fit 64
// bits.
constexpr std::int64_t kLastTime_ns = std::int64_t{1} << 61;

bool possible(std::int64_t time_ns) { return time_ns >= 0 && time_ns <= kLastTime_ns; }

std::string text_of(const log::ChunkRow& chunk) {
  return {reinterpret_cast<const char*>(chunk.bytes.data()), chunk.bytes.size()};
}

}  // namespace

ReplayStreamContext::ReplayStreamContext(std::uint32_t index, std::uint32_t stream_id,
                                         ReplayModels& models, ReplayHost& host, std::string file)
    : index_(index),
      stream_id_(stream_id),
      models_(models),
      host_(host),
      file_(std::move(file)),
      intake_(index, host.next_item, *this) {}

Result<std::unique_ptr<ReplayStreamContext>> ReplayStreamContext::open(
    std::uint32_t index, const log::SourceRow& source, const log::StreamRow& stream,
    ReplayModels& models, ReplayHost& host, const std::string& file) {
  auto self = std::make_unique<ReplayStreamContext>(index, stream.id, models, host, file);
  self->stream_.name = stream.name;
  auto settings = record::settings_from_json(stream.stages_json, file);
  if (!settings) return std::unexpected(settings.error());
  self->stream_.settings = std::move(*settings);
  if (auto done = self->open_decoder(source); !done) return std::unexpected(done.error());
  if (auto done = self->open_engine(); !done) return std::unexpected(done.error());
  return self;
}

Result<> ReplayStreamContext::open_decoder(const log::SourceRow& source) {
  const drivers::Driver* driver = drivers::find_driver(source.driver);
  if (driver == nullptr) {
    return fail("stream " + in_quotes(stream_.name) + " comes from driver " +
                    in_quotes(source.driver) + ", which this posed does not have",
                file_);
  }
  auto description = driver->describe(source.text, source.identity);
  if (!description) return std::unexpected(description.error());
  stream_.description = *description;
  device_ = std::move(*description);
  auto decoder = driver->make_decoder(device_);
  if (!decoder) return std::unexpected(decoder.error());
  decoder_ = std::move(*decoder);
  return {};
}

Result<> ReplayStreamContext::open_engine() {
  record::StreamSettings& settings = stream_.settings;
  const auto& skeleton = stream_.description.skeleton;
  if (!settings.stages.empty() && !skeleton) {
    return fail("stream " + in_quotes(stream_.name) + " has stages but no skeleton", file_);
  }
  settings.rate_hz = stream_.description.rate_hz;  // the models are bound to this rate
  models_in_use_.resize(settings.stages.size());
  std::vector<const StageModel*> borrowed;
  for (std::size_t i = 0; i < settings.stages.size(); ++i) {
    if (!settings.stages[i].model_sha256.empty()) {
      auto bound = bind(i, settings.stages[i].model_sha256);
      if (!bound) return std::unexpected(bound.error());
      models_in_use_[i] = std::move(*bound);
    }
    borrowed.push_back(models_in_use_[i].get());
  }
  auto options = pipeline::engine_options(index_, settings, skeleton, borrowed);
  if (!options) {
    Error error = options.error();
    error.file = file_;
    return std::unexpected(std::move(error));
  }
  engine_.emplace(std::move(*options));
  return {};
}

Result<std::unique_ptr<const StageModel>> ReplayStreamContext::bind(std::size_t stage,
                                                                    const std::string& hash) {
  const record::StreamSettings& settings = stream_.settings;
  const StageType& type = *settings.stages[stage].type;
  if (!type.has_model()) return fail("stage " + std::string(type.name) + " has no model", file_);
  return models_.bind(hash, type,
                      pipeline::stage_context(settings, stage, stream_.description.skeleton));
}

// Index of the stage; empty if the stream does not have it: then the live run ignored the change,
// too.
std::optional<std::size_t> ReplayStreamContext::stage_of(
    const pipeline::StageChange& change) const {
  const auto& stages = stream_.settings.stages;
  const auto found = std::ranges::find(stages, change.type, &pipeline::StageSettings::type);
  if (found == stages.end()) return std::nullopt;
  return static_cast<std::size_t>(found - stages.begin());
}

Result<> ReplayStreamContext::expect(const pipeline::Decision& decision) {
  switch (decision.kind) {
    case Kind::kShed:
      shed_frames_.add(decision.sequence, decision.count);
      return {};
    case Kind::kShedSamples:
      shed_samples_.add(decision.sequence, decision.count);
      return {};
    case Kind::kChange: {
      const std::string hash = decision.model_hash.data();
      const auto stage = stage_of(decision.change);
      if (decision.change.kind != pipeline::StageChange::Kind::kModel || !stage) return {};
      if (!tried_.emplace(*stage, hash).second) return {};
      const auto bound = bind(*stage, hash);
      if (!bound) return std::unexpected(bound.error());
      return {};
    }
    default:
      if (possible(decision.now_ns)) return {};
      return fail("the log is damaged (a decision of stream " + in_quotes(stream_.name) +
                      " was made at an impossible time); use another copy of it",
                  file_);
  }
}

void ReplayStreamContext::set_gap(std::int64_t after_chunk) {
  gap_after_ = std::min(gap_after_.value_or(after_chunk), after_chunk);
}

// Frames that a stage still holds back depend on data after the gap, and the last published frame
// may be repeated, so they are not reliable either.
void ReplayStreamContext::apply_gap(std::int64_t chunk) {
  if (gap_after_ && !broken_at_ && chunk > *gap_after_) broken_at_ = last_out_;
}

// Formats 1 and 2 number only frames; the other numbers continue by counting.
Result<> ReplayStreamContext::find_place(const log::ChunkRow& chunk) {
  const auto place = std::ranges::find(chunk.places, stream_id_, &log::StreamPosition::stream);
  if (place == chunk.places.end() || place->next_frame == 0 || !possible(chunk.arrival_ns)) {
    return log::damaged_row(file_, "chunk", chunk.id, "has an impossible time or place");
  }
  pipeline::Position next = intake_.next();
  next.frame = place->next_frame;
  if (place->next_sample != 0) next.sample = place->next_sample;
  if (chunk.first_item != 0) next.item = chunk.first_item;
  intake_.go_to(next);
  arrival_ns_ = chunk.arrival_ns;
  intake_.arrived(arrival_ns_);
  return {};
}

Result<> ReplayStreamContext::feed(const log::ChunkRow& chunk) {
  if (auto found = find_place(chunk); !found) return found;
  switch (static_cast<pipeline::Direction>(chunk.direction)) {
    case pipeline::Direction::kFromDevice:
      decoder_->feed_socket(static_cast<std::uint8_t>(chunk.socket), chunk.bytes, arrival_ns_,
                            intake_);
      return outcome_so_far();
    case pipeline::Direction::kToDevice:
      return {};
    case pipeline::Direction::kDeviceInfo:
      return use_device(text_of(chunk));
    case pipeline::Direction::kCalibration:
      return calibrate(text_of(chunk));
    default:
      return log::damaged_row(file_, "chunk", chunk.id,
                              "has an unknown kind, or comes from a newer posed");
  }
}

// The device came back, perhaps with other properties; what the pipeline was bound to stays.
Result<> ReplayStreamContext::use_device(const std::string& info) {
  const drivers::Driver* driver = drivers::find_driver(stream_.description.driver);
  auto description = driver->describe(info, stream_.description.identity);
  if (!description) return std::unexpected(description.error());
  auto decoder = driver->make_decoder(*description);
  if (!decoder) return std::unexpected(decoder.error());
  decoder_ = std::move(*decoder);
  device_ = std::move(*description);
  intake_.new_link();
  if (calibration_) use_calibration();
  return {};
}

Result<> ReplayStreamContext::calibrate(const std::string& toml) {
  drivers::Description device = device_;
  device.identity.clear();  // the live run has checked to which device it belongs
  auto compiled = devices::compile_calibration(device, toml, "the log's calibration");
  if (!compiled) return std::unexpected(compiled.error());
  calibration_ = std::move(*compiled);
  use_calibration();
  return {};
}

void ReplayStreamContext::use_calibration() {
  auto* const glove = drivers::glove::calibrated_decoder(*decoder_);
  if (glove != nullptr) glove->calibrate(*calibration_->calibration);
}

bool ReplayStreamContext::item(pipeline::Item& item) noexcept {
  host_.before(item, index_);
  switch (item.kind) {
    case pipeline::Item::Kind::kSample:
      if (shed_samples_.contains(item.sample.header.sequence)) break;
      engine_->on_sample(item.sample, *this);
      break;
    case pipeline::Item::Kind::kEvent:
      host_.publish(item);
      break;
    default:
      if (shed_frames_.contains(item.frame.header.sequence)) break;
      engine_->on_frame(item.frame, *this);
  }
  return true;
}

void ReplayStreamContext::apply(const pipeline::Decision& decision) noexcept {
  switch (decision.kind) {
    case Kind::kShed:
    case Kind::kShedSamples:
      return;  // the engine decides this again when it meets the gap
    case Kind::kTick:
      return engine_->tick_now(decision.now_ns, *this);
    case Kind::kEnd:
      close_gaps();
      return engine_->end(decision.now_ns, *this);
    case Kind::kChange:
      return change(decision);
  }
}

// The model that is replaced is freed once it is no longer read.
void ReplayStreamContext::change(const pipeline::Decision& decision) noexcept {
  const auto stage = stage_of(decision.change);
  if (!stage) return;
  pipeline::Command command{
      .change = decision.change, .model_hash = decision.model_hash, .command = decision.command};
  std::unique_ptr<const StageModel> model;
  if (decision.change.kind == pipeline::StageChange::Kind::kModel) {
    auto bound = bind(*stage, decision.model_hash.data());
    if (!bound) {
      error_ = std::move(bound.error());
      return;
    }
    model = std::move(*bound);
    command.model = model.get();
  }
  const bool refused = engine_->apply(command, *this).refused;
  if (model && !refused) models_in_use_[*stage] = std::move(model);
}

// Nothing more comes: what was decoded last but never came was shed.
void ReplayStreamContext::close_gaps() noexcept {
  const pipeline::Position next = intake_.next();
  engine_->close_gaps(next.frame - 1, next.sample - 1, *this);
}

Result<> ReplayStreamContext::finish(bool ends) {
  close_gaps();
  if (ends) {
    engine_->end(arrival_ns_, *this);
  } else {
    engine_->flush(*this);
  }
  return outcome_so_far();
}

Result<> ReplayStreamContext::outcome_so_far() {
  if (error_) return std::unexpected(*error_);
  return {};
}

}  // namespace posed::replay
