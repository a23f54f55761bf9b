#include "daemon/tools/replay/replay_stream_context.hpp"

#include <algorithm>
#include <utility>

#include "proto/text/clean.hpp"

namespace posed::replay {
namespace {

using Kind = pipeline::Decision::Kind;

}  // namespace

ReplayStreamContext::ReplayStreamContext(std::uint32_t index, std::uint32_t log_id,
                                         ReplayModels& models, ReplayHost& host, std::string file)
    : index_(index), log_id_(log_id), models_(models), host_(host), file_(std::move(file)) {}

Result<std::unique_ptr<ReplayStreamContext>> ReplayStreamContext::open(
    std::uint32_t index, const log::SourceRow& source, const log::StreamRow& stream,
    ReplayModels& models, ReplayHost& host, const std::string& file) {
  auto self = std::make_unique<ReplayStreamContext>(index, stream.id, models, host, file);
  self->stream_.name = stream.name;
  self->stream_.body = stream.body;
  if (!stream.body.empty()) self->stream_.source = source.name;
  self->stream_.first_item = stream.first_item;
  self->stream_.is_there_from_start =
      stream.body.empty() && pipeline::generation_of(stream.id) == 0;
  auto settings = TRY(record::settings_from_json(stream.stages_json, file));
  self->stream_.settings = std::move(settings);
  return self;
}

std::unexpected<Error> ReplayStreamContext::about(Error error) const {
  error.message = "stream " + in_quotes(stream_.name) + ": " + error.message;
  error.file = file_;
  return std::unexpected(std::move(error));
}

Result<> ReplayStreamContext::describe(drivers::Description description, bool waits) {
  if (!stream_.settings.stages.empty() && !description.skeleton) {
    return fail("stream " + in_quotes(stream_.name) + " has stages but no skeleton", file_);
  }
  stream_.settings.rate_hz = description.rate_hz;  // the models are bound to this rate
  stream_.description = std::move(description);
  stream_.described = true;
  waits_ = waits;
  return {};
}

bool ReplayStreamContext::has_partner(const ReplayStreamContext& other) const {
  for (const pipeline::StageSettings& stage : stream_.settings.stages) {
    const auto names = pipeline::partner_names(*stage.type, stage.parameters);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] != other.stream_.name) continue;
      if (stage.partners.empty() || stage.partners[i].stream == other.log_id_) return true;
    }
  }
  return false;
}

Result<> ReplayStreamContext::build(std::span<const ReplayStreamContext* const> partners) {
  record::StreamSettings& settings = stream_.settings;
  pipeline::PartnerStreams known;
  for (const ReplayStreamContext* const partner : partners) {
    known[partner->stream_.name] = {.stream = partner->index_,
                                    .about = {.skeleton = partner->stream_.published,
                                              .rate_hz = partner->stream_.settings.rate_hz}};
  }
  if (auto found = pipeline::find_partners(settings, known); !found) return about(found.error());
  auto published = TRY(pipeline::published_skeleton(settings, stream_.description.skeleton));
  stream_.published = std::move(published);
  TRY(make_engine());
  if (waits_) set_aside();
  return {};
}

void ReplayStreamContext::set_aside() {
  if (engine_) host_.routes.remove(*engine_);
  engine_.reset();
  models_in_use_.clear();
}

Result<> ReplayStreamContext::make_engine() {
  const record::StreamSettings& settings = stream_.settings;
  models_in_use_.resize(settings.stages.size());
  std::vector<const StageModel*> borrowed;
  for (std::size_t i = 0; i < settings.stages.size(); ++i) {
    if (!settings.stages[i].model_sha256.empty()) {
      auto bound = TRY(bind(i, settings.stages[i].model_sha256));
      models_in_use_[i] = std::move(bound);
    }
    borrowed.push_back(models_in_use_[i].get());
  }
  auto options = pipeline::engine_options(index_, settings, stream_.description.skeleton, borrowed);
  if (!options) {
    Error error = options.error();
    error.file = file_;
    return std::unexpected(std::move(error));
  }
  engine_ = std::make_unique<pipeline::StreamEngine>(std::move(*options));
  engine_->start_at(last_frame_ + 1, last_sample_ + 1);
  host_.routes.add(*engine_, *this);
  return {};
}

bool ReplayStreamContext::needs(std::uint32_t partner) const noexcept {
  for (const pipeline::StageSettings& stage : stream_.settings.stages) {
    for (const pipeline::PartnerStream& named : stage.partners) {
      if (named.stream == partner) return true;
    }
  }
  return false;
}

// A decision may be the first that comes: the live engine waits for its body's first frame, too.
pipeline::StreamEngine* ReplayStreamContext::needed_engine() noexcept {
  if (!engine_ && stream_.described && !gone_) {
    if (auto made = make_engine(); !made) {
      gone_ = true;
      host_.failed(std::move(made.error()));
    }
  }
  return engine_.get();
}

Result<std::unique_ptr<const StageModel>> ReplayStreamContext::bind(std::size_t stage,
                                                                    const std::string& hash) {
  const record::StreamSettings& settings = stream_.settings;
  const StageType& type = *settings.stages[stage].type;
  if (!type.has_model()) return fail("stage " + std::string(type.name) + " has no model", file_);
  const auto context = TRY(pipeline::stage_context(settings, stage, stream_.description.skeleton));
  return models_.bind(hash, type, context);
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
      const bool is_model = decision.change.kind == pipeline::StageChange::Kind::kModel;
      if (!is_model || hash.empty() || !stage || !stream_.described) return {};
      if (!tried_.emplace(*stage, hash).second) return {};
      TRY(bind(*stage, hash));
      return {};
    }
    default:
      if (is_possible_time(decision.now_ns)) return {};
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
bool ReplayStreamContext::apply_gap(std::int64_t chunk) {
  if (gap_after_ && !broken_at_ && chunk > *gap_after_) broken_at_ = last_out_;
  return !gap_after_ || broken_at_;
}

void ReplayStreamContext::begin(const pipeline::StreamPosition& first) noexcept {
  last_frame_ = first.frame - 1;
  last_sample_ = first.sample - 1;
  if (engine_) engine_->start_at(first.frame, first.sample);
}

// What was decoded after the end never came: the reader gave the stream no more space in the ring.
void ReplayStreamContext::handle(pipeline::Item& item) noexcept {
  host_.before(item, index_);
  pipeline::StreamEngine* const engine = needed_engine();
  if (engine == nullptr || ended_) return;
  switch (item.kind) {
    case pipeline::Item::Kind::kSample:
      last_sample_ = item.sample.header.sequence;
      if (!shed_samples_.contains(last_sample_)) engine->on_sample(item.sample, *this);
      break;
    case pipeline::Item::Kind::kEvent:
      host_.publish(item);
      break;
    default:
      last_frame_ = item.frame.header.sequence;
      if (!shed_frames_.contains(last_frame_)) engine->on_frame(item.frame, *this);
  }
}

void ReplayStreamContext::apply(const pipeline::Decision& decision) noexcept {
  // The engine decides again what was shed when it meets the gap.
  if (decision.kind == Kind::kShed || decision.kind == Kind::kShedSamples) return;
  pipeline::StreamEngine* const engine = needed_engine();
  if (engine == nullptr) return;
  if (decision.kind == Kind::kTick) return engine->tick_now(decision.now_ns, *this);
  if (decision.kind == Kind::kEnd) return end(decision.now_ns);
  change(decision);
}

// The model that is replaced is freed once it is no longer read.
void ReplayStreamContext::change(const pipeline::Decision& decision) noexcept {
  const auto stage = stage_of(decision.change);
  if (!stage) return;
  pipeline::Command command{
      .change = decision.change, .model_hash = decision.model_hash, .command = decision.command};
  std::unique_ptr<const StageModel> model;
  const bool is_model = decision.change.kind == pipeline::StageChange::Kind::kModel;
  if (const std::string hash = decision.model_hash.data(); is_model && !hash.empty()) {
    auto bound = bind(*stage, hash);
    if (!bound) return host_.failed(std::move(bound.error()));
    model = std::move(*bound);
    command.model = model.get();
  }
  const bool refused = engine_->apply(command, *this).refused;
  if (is_model && !refused) models_in_use_[*stage] = std::move(model);
}

// Nothing more comes: what was decoded last but never came was shed.
void ReplayStreamContext::end(std::int64_t now_ns) noexcept {
  engine_->close_gaps(last_frame_, last_sample_, *this);
  engine_->end(now_ns, false, *this);
  ended_ = true;
}

// The reader reports the end before the bodies change, so only a log that lacks the decision has
// not ended the stream by now.
void ReplayStreamContext::leave(std::int64_t now_ns) noexcept {
  if (engine_ && !ended_) end(now_ns);
  gone_ = true;
  set_aside();
}

void ReplayStreamContext::finish() noexcept {
  if (!engine_ || ended_) return;
  engine_->close_gaps(last_frame_, last_sample_, *this);
  engine_->flush(*this);
}

}  // namespace posed::replay
