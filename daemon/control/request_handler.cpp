#include "daemon/control/request_handler.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/config.hpp"
#include "daemon/control/glove_fit.hpp"
#include "daemon/control/stage_requests.hpp"
#include "daemon/devices/about_stream.hpp"
#include "daemon/devices/calibration.hpp"
#include "daemon/teach/teacher.hpp"
#include "drivers/glove/traits.hpp"
#include "models/stage_type.hpp"
#include "models/stages/registry.hpp"
#include "posed/v1/control.pb.h"
#include "proto/log/digest.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::control {
namespace {

using devices::in_stream;
constexpr std::size_t kMaxKnownWords = 512;
// A folder of large models takes long to read: other requests come in between.
constexpr std::int64_t kListing_ns = kNanosPerSecond / 20;
constexpr std::size_t kMaxListings = 16;
constexpr std::string_view kNoModel = "none";  // names of models have an ending
using pipeline::Command;
using pipeline::DeviceCommand;
using pipeline::StageChange;

Reply make_reply(Requester to, v1::ControlReply reply) {
  reply.set_ok(true);
  return {.to = std::move(to), .bytes = reply.SerializeAsString()};
}

Reply refusal(Requester to, const std::string& sentence) {
  v1::ControlReply reply;
  reply.set_error(clean(sentence));
  return {.to = std::move(to), .bytes = reply.SerializeAsString(), .refused = true};
}

constexpr float kMaxVibration_hz = 1000.0F;
constexpr float kMaxVibration_s = 60.0F;

bool within(float value, float min, float max) {
  return std::isfinite(value) && value >= min && value <= max;
}

Result<drivers::glove::Haptics> read_haptics(const v1::ControlRequest::Haptics& wanted) {
  drivers::glove::Haptics haptics{.vibration_hz = wanted.vibration_hz(),
                                  .vibration_s = wanted.vibration_s(),
                                  .vibration = wanted.vibration_amplitude()};
  haptics.force.fill(-1.0F);
  if (static_cast<std::size_t>(wanted.force_size()) > haptics.force.size()) {
    return fail("a hand has five fingers: give at most five forces, thumb to little");
  }
  std::ranges::copy(wanted.force(), haptics.force.begin());
  const bool valid =
      std::ranges::all_of(haptics.force, [](float force) { return within(force, -1.0F, 1.0F); }) &&
      within(haptics.vibration_hz, 0.0F, kMaxVibration_hz) &&
      within(haptics.vibration_s, 0.0F, kMaxVibration_s) && within(haptics.vibration, 0.0F, 1.0F);
  if (valid) return haptics;
  return fail(
      "a force is 0 (free) to 1 (blocked), negative to leave it; a vibration has up to 1000 Hz,"
      " 60 s and an amplitude of 0 to 1");
}

// The value that `number` stands for in a live parameter.
ParameterValue value_of(const ParameterSpec& spec, double number) {
  if (std::holds_alternative<bool>(spec.default_value)) return number != 0.0;
  if (std::holds_alternative<double>(spec.default_value)) return number;
  if (std::holds_alternative<std::int64_t>(spec.default_value)) {
    return static_cast<std::int64_t>(number);
  }
  return std::string(spec.words[static_cast<std::size_t>(number)]);
}

}  // namespace

// A list of models that is under way.
struct RequestHandler::Listing {
  Requester to;
  std::vector<FolderModel> models;
  std::size_t next = 0;  // of `models`
  v1::ControlReply reply{};
};

ControlledStream known_stream(const config::StreamConfig& config, const std::string& source) {
  ControlledStream stream;
  stream.stream = pipeline::kNoStream;
  stream.name = config.name;
  stream.publishes_raw = config.publish_raw;
  stream.settings = devices::possible_settings(config);
  stream.source = source;
  stream.models.resize(stream.settings.stages.size());
  return stream;
}

RequestHandler::RequestHandler(DaemonControl& daemon_control, devices::KeptSettings& kept,
                               ModelFolder models, Clock clock, teach::Teacher* teacher,
                               RecordingFolder recordings)
    : daemon_control_(daemon_control),
      kept_(kept),
      models_(std::move(models)),
      recordings_(std::move(recordings)),
      clock_(clock),
      teacher_(teacher) {}

RequestHandler::~RequestHandler() = default;

std::optional<Reply> RequestHandler::handle(Requester requester, std::span<const std::byte> bytes) {
  v1::ControlRequest request;
  if (bytes.size() > kMaxRequest) {
    return refusal(std::move(requester), "the request is too large: it has at most 64 KB");
  }
  if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return refusal(std::move(requester), "this is not a valid posed.v1.ControlRequest");
  }
  auto answer = answer_to(request, requester);
  if (!answer) return refusal(std::move(requester), answer.error().text());
  if (!*answer) return std::nullopt;
  return make_reply(std::move(requester), std::move(**answer));
}

RequestHandler::Answer RequestHandler::answer_to(const v1::ControlRequest& request,
                                                 const Requester& requester) {
  v1::ControlReply reply;
  if (request.has_status() || request.has_stop()) {  // without the lock: these need no stream
    if (request.has_stop()) daemon_control_.stop();
    if (request.has_status()) daemon_control_.fill(*reply.mutable_status());
    return reply;
  }
  if (request.has_take()) return mark_take(request);
  if (request.has_list_models()) return list_models(requester);
  if (request.has_teach()) return teach(request);
  if (request.has_fit_glove()) return fit_glove(request, requester);
  if (request.has_rename_model() || request.has_delete_model()) return change_models(request);
  if (request.has_list_recordings()) return list_recordings();
  if (request.has_fetch_recording()) {
    auto piece = TRY(piece_of(request));
    reply.set_piece(std::move(piece));
    return reply;
  }
  std::string model;  // read without the lock: a disk may be slow
  const bool use = request.has_use_model() && request.use_model().name() != kNoModel;
  if (use) model = TRY(models_.read(request.use_model().name()));
  const std::scoped_lock lock(mutex_);
  const auto done = TRY(apply(request, std::as_bytes(std::span(std::as_const(model))), requester));
  if (done.under_way) return std::nullopt;
  if (!done.stream.empty()) reply.set_stream(done.stream);
  return reply;
}

Result<RequestHandler::Done> RequestHandler::apply(const v1::ControlRequest& request,
                                                   std::span<const std::byte> model,
                                                   const Requester& requester) {
  switch (request.request_case()) {
    case v1::ControlRequest::kSetParameter:
      return set_parameter(request, requester);
    case v1::ControlRequest::kStageCommand:
      return stage_command(request, requester);
    case v1::ControlRequest::kModelPart:
      return add_model_part(request, requester);
    case v1::ControlRequest::kUseModel:
      if (request.use_model().name() == kNoModel) return take_model_away(request, requester);
      return set_model(request.use_model().stream(), model, request.use_model().name(),
                       {.requester = requester});
    case v1::ControlRequest::kCalibrate:
      return calibrate(request.calibrate().stream(), request.calibrate().toml(),
                       request.calibrate().name(), {.requester = requester});
    case v1::ControlRequest::kHaptics:
      return send_haptics(request);
    default:
      return fail("the request is empty, or from another version of posed");
  }
}

RequestHandler::Answer RequestHandler::mark_take(const v1::ControlRequest& request) {
  const auto& wanted = request.take();
  if (!wanted.start() && !wanted.name().empty()) {
    return fail("a take gets its name when it begins; leave it out here");
  }
  TRY(pipeline::check_take_name(wanted.name()));
  const auto take = TRY(daemon_control_.mark_take(
      {.start = wanted.start(), .time_ns = clock_(), .name = wanted.name()}));
  v1::ControlReply reply;
  *reply.mutable_take() = pipeline::stats_of(take);
  reply.set_recorder_trouble(clean(take.trouble));
  return reply;
}

RequestHandler::Answer RequestHandler::list_models(const Requester& requester) {
  std::size_t before = 0;
  {
    const std::scoped_lock lock(listings_mutex_);
    before = listings_.size();
  }
  if (before >= kMaxListings) {
    return fail("other clients ask for the models just now; ask again in a moment");
  }
  auto models = TRY(models_.list());
  Listing listing{.to = requester, .models = std::move(models)};
  if (before == 0 && add_models(listing)) return std::move(listing.reply);
  const std::scoped_lock lock(listings_mutex_);
  listings_.push_back(std::make_unique<Listing>(std::move(listing)));
  return std::nullopt;
}

// Adds models to the reply for some time, one at least; a large one takes a second. Returns whether
// all are there.
bool RequestHandler::add_models(Listing& listing) {
  const Figures there = figures();
  const std::int64_t end_ns = clock_() + kListing_ns;
  while (listing.next < listing.models.size()) {
    const FolderModel& model = listing.models[listing.next++];
    pulse_.beat();
    if (const auto words = words_of(model, there)) {
      v1::KnownModel& entry = *listing.reply.add_model();
      entry.set_name(model.name);
      entry.set_kind(std::string(model.kind));
      entry.set_learnt(words->learnt);
      entry.set_skeleton(words->skeleton);
      entry.set_verdict(words->verdict);
      entry.set_strip(words->strip);
    }
    if (clock_() > end_ns) break;
  }
  return listing.next == listing.models.size();
}

bool RequestHandler::is_listing() {
  const std::scoped_lock lock(listings_mutex_);
  return !listings_.empty();
}

std::optional<Reply> RequestHandler::list_on() {
  std::unique_ptr<Listing> listing;
  {
    const std::scoped_lock lock(listings_mutex_);
    if (listings_.empty()) return std::nullopt;
    listing = std::move(listings_.front());
    listings_.pop_front();
  }
  if (add_models(*listing)) return make_reply(std::move(listing->to), std::move(listing->reply));
  const std::scoped_lock lock(listings_mutex_);
  listings_.push_back(std::move(listing));
  return std::nullopt;
}

RequestHandler::Figures RequestHandler::figures() {
  const std::scoped_lock lock(mutex_);
  Figures all;
  for (const auto& [id, stream] : streams_) {
    if (stream.skeleton) all.push_back(stream.skeleton);
  }
  return all;
}

// A model is read again only when its file has changed, or another body may show it: a page asks
// often. Null: it has been deleted since the list was begun.
std::optional<ModelWords> RequestHandler::words_of(const FolderModel& model,
                                                   const Figures& figures) {
  const std::scoped_lock lock(words_mutex_);
  std::vector<std::uint32_t> ids;
  for (const auto& figure : figures) ids.push_back(figure->id);
  // Words of models that have gone are kept, too, so they must not grow for ever.
  if (words_.size() > kMaxKnownWords || ids != drawn_on_) words_.clear();
  drawn_on_ = std::move(ids);
  auto& [stamp, words] = words_[model.name];
  if (stamp == model.stamp) return words;
  const auto bytes = models_.read(model.name);
  if (!bytes && !models_.find(model.name)) return std::nullopt;
  words = bytes ? words_of_model(*bytes, model.kind, model.name, figures)
                : ModelWords{.verdict = clean(bytes.error().text())};
  stamp = model.stamp;
  return words;
}

// A stream that uses the model would go on with it, and fail at its next start.
Result<> RequestHandler::check_unused(const std::string& model) {
  const std::scoped_lock lock(mutex_);
  const auto uses = [&](const ControlledStream& stream) {
    return std::ranges::any_of(stream.settings.stages, [&](const pipeline::StageSettings& stage) {
      return stage.model_name == model;
    });
  };
  for (const auto& [id, stream] : streams_) {
    if (uses(stream)) {
      return fail(fmt::format("{} uses it; give {} another model, or none, first",
                              in_quotes(stream.name), in_quotes(stream.name)));
    }
  }
  for (const auto& [name, stream] : known_) {
    if (uses(stream)) return fail(in_quotes(name) + " begins with it; change its config first");
  }
  return {};
}

RequestHandler::Answer RequestHandler::change_models(const v1::ControlRequest& request) {
  const auto& rename = request.rename_model();
  const std::string& name =
      request.has_rename_model() ? rename.name() : request.delete_model().name();
  TRY(check_unused(name));
  if (request.has_rename_model()) {
    TRY(models_.rename(name, rename.to()));
  } else {
    TRY(models_.remove(name));
  }
  return v1::ControlReply();
}

RequestHandler::Answer RequestHandler::list_recordings() const {
  const auto files = TRY(recordings_.list());
  v1::ControlReply reply;
  for (const FolderRecording& file : files) {
    v1::KnownRecording& entry = *reply.add_recording();
    entry.set_name(file.name);
    entry.set_bytes(file.bytes);
    entry.set_changed_unix_s(file.changed_unix_s);
    entry.set_in_use(file.in_use);
  }
  daemon_control_.add_clips(reply);
  return reply;
}

Result<std::string> RequestHandler::piece_of(const v1::ControlRequest& request) {
  const auto& wanted = request.fetch_recording();
  if (wanted.as().empty()) return recordings_.piece(wanted.name(), wanted.offset());
  const RecordingFolder::Part part{
      .name = wanted.name(), .as = wanted.as(), .from_s = wanted.from_s(), .to_s = wanted.to_s()};
  const std::scoped_lock lock(converted_mutex_);
  if (part != part_ || wanted.offset() == 0) {
    part_ = {};
    converted_ = TRY(recordings_.converted(part));
    part_ = part;
  }
  if (wanted.offset() < converted_.size()) {
    return converted_.substr(static_cast<std::size_t>(wanted.offset()), kMaxRecordingPiece);
  }
  part_ = {};  // nobody needs it any more
  converted_ = {};
  return std::string();
}

RequestHandler::Answer RequestHandler::teach(const v1::ControlRequest& request) {
  TRY(models_.check_writable());  // without the lock: a disk may be slow
  const std::scoped_lock lock(mutex_);
  TRY(teach_step(request));
  v1::ControlReply reply;
  *reply.mutable_teaching() = teacher_->state();
  return reply;
}

Result<> RequestHandler::teach_step(const v1::ControlRequest& request) {
  using teach::Walk;
  const auto& wanted = request.teach();
  if (teacher_ == nullptr) return fail("this daemon teaches nothing");
  switch (wanted.step_case()) {
    case v1::ControlRequest::Teach::kMark: {
      const auto pupil = TRY(find_pupil(wanted.stream(), teach::Subject::kStyle));
      const auto& mark = wanted.mark();
      return teacher_->mark(pupil, mark.style() ? Walk::kStyle : Walk::kNeutral, mark.seconds(),
                            mark.more());
    }
    case v1::ControlRequest::Teach::kShow: {
      const auto pupil = TRY(find_pupil(wanted.stream(), teach::Subject::kSigns));
      return teacher_->show(pupil, wanted.show().label(), wanted.show().seconds());
    }
    case v1::ControlRequest::Teach::kForget:
      return teacher_->forget(wanted.stream(), wanted.forget().label());
    case v1::ControlRequest::Teach::kTrain: {
      const auto& train = wanted.train();
      if (config::is_stream_name(train.name())) {
        return teacher_->train(wanted.stream(), train.name(),
                               train.signs() ? teach::Subject::kSigns : teach::Subject::kStyle);
      }
      return fail(in_quotes(train.name()) + " cannot be the name of " +
                  (train.signs() ? "signs" : "a style") +
                  "; it has a-z, digits, '-' and '_', 1 to 32");
    }
    case v1::ControlRequest::Teach::kCancel:
      return teacher_->cancel(wanted.stream());
    default:  // who asks how it stands hears now, not after the walks, that there is no such stream
      if (!wanted.stream().empty()) TRY(find_stream(wanted.stream()));
      return {};
  }
}

// What a stream lacks that cannot be taught is told before somebody has walked.
Result<teach::Pupil> RequestHandler::find_pupil(const std::string& name, teach::Subject subject) {
  const auto found = TRY(find_stream(name));
  const ControlledStream& stream = *found;
  const bool signs = subject == teach::Subject::kSigns;
  const StageType* const taught = find_stage_type(signs ? "generate" : "style");
  const auto& stages = stream.settings.stages;
  if (std::ranges::find(stages, taught, &pipeline::StageSettings::type) == stages.end()) {
    return in_stream(
        name, fail(fmt::format("it has no {0} stage to teach; give it a [stream.{0}] table in"
                               " the config (model = \"\" while there is none) and start again",
                               taught->name))
                  .error());
  }
  if (!stream.publishes_raw) {
    return in_stream(name, fail("teaching needs its frames as they were before the stages; set"
                                " publish_raw = true for it in the config and start again")
                               .error());
  }
  if (!stream.is_there() || stream.skeleton == nullptr) {
    return in_stream(
        name, fail(fmt::format("no {} is there now; wait until it comes", signs ? "hand" : "body"))
                  .error());
  }
  return teach::Pupil{.stream = stream.stream, .name = stream.name, .skeleton = stream.skeleton};
}

void RequestHandler::use_taught() {
  const auto model = teacher_ != nullptr ? teacher_->take_model() : std::nullopt;
  if (!model) return;
  const std::scoped_lock lock(mutex_);
  const auto bytes = std::as_bytes(std::span(model->bytes));
  const auto done = set_model(model->stream, bytes, model->file, {.requester = {}, .taught = true});
  if (!done) return teacher_->not_started(done.error().text());
  if (!done->under_way) teacher_->started(0);  // when the stream comes
}

bool RequestHandler::is_earlier(Streams::iterator stream) const {
  const auto next = std::next(stream);
  return next != streams_.end() &&
         pipeline::slot_of(next->first) == pipeline::slot_of(stream->first);
}

Result<ControlledStream*> RequestHandler::find_stream(const std::string& name) {
  std::vector<ControlledStream*> all;
  for (auto it = streams_.begin(); it != streams_.end(); ++it) {
    if (!is_earlier(it)) all.push_back(&it->second);
  }
  for (auto& [known_name, stream] : known_) {
    if (std::ranges::find(all, known_name, &ControlledStream::name) == all.end()) {
      all.push_back(&stream);
    }
  }
  std::string names;
  for (ControlledStream* const stream : all) {
    if (stream->name == name) return stream;
    if (stream->publishes_raw && raw_name(stream->name) == name) {
      return fail(
          fmt::format("{} is the input of {} before its stages and cannot be changed; name"
                      " {}",
                      name, stream->name, stream->name));
    }
    add_word(names, stream->name);
  }
  return fail(fmt::format("there is no stream {}; there is: {}", in_quotes(name),
                          names.empty() ? "none" : names));
}

Result<RequestHandler::Done> RequestHandler::set_parameter(const v1::ControlRequest& request,
                                                           const Requester& requester) {
  const auto& wanted = request.set_parameter();
  const auto stream = TRY(find_stream(wanted.stream()));
  const auto text = text_change(stream->settings, wanted);
  if (!text) return in_stream(wanted.stream(), text.error());
  if (*text) return stage_command(**text, requester);
  const auto change = parameter_change(stream->settings, wanted);
  if (!change) return in_stream(wanted.stream(), change.error());
  const ParameterSpec& spec = change->type->parameters[change->index];
  const NewValue value{.stage = change->type,
                       .parameter = std::string(spec.name),
                       .value = value_of(spec, change->value)};
  return send(*stream, {.change = *change}, {.requester = requester, .value = value});
}

Result<RequestHandler::Done> RequestHandler::stage_command(const v1::ControlRequest& request,
                                                           const Requester& requester) {
  const auto& wanted = request.stage_command();
  const auto stream = TRY(find_stream(wanted.stream()));
  const auto found = find_command(stream->settings, wanted.name());
  if (!found) return in_stream(wanted.stream(), found.error());
  const StageType& stage = *found->change.type;
  const StageCommandType& type = stage.commands[found->change.index];
  std::optional<NewValue> value;
  if (is_live_text(stage, type.name)) {
    value = {.stage = &stage, .parameter = std::string(type.name), .value = joined_words(wanted)};
  }
  if (!stream->is_there() && !value) {
    return in_stream(wanted.stream(), fail(fmt::format("it is not there now, so there is nothing"
                                                       " that could do {}",
                                                       type.name))
                                          .error());
  }
  UnderWay under_way{.requester = requester, .stage = found->stage, .value = std::move(value)};
  under_way.refusal = type.refusal;
  // What the text means depends on the model, which is bound when the stream comes.
  if (!stream->is_there()) return keep(stream->name, under_way);
  const auto command = encode_command(type, coming_model(*stream, found->stage), wanted);
  if (!command) return in_stream(wanted.stream(), command.error());
  return send(*stream, {.change = found->change, .command = *command}, std::move(under_way));
}

Result<RequestHandler::Done> RequestHandler::add_model_part(const v1::ControlRequest& request,
                                                            const Requester& requester) {
  const auto& part = request.model_part();
  TRY(find_stream(part.stream()));
  auto whole = TRY(uploads_.add(requester.empty() ? std::string() : requester.front(),
                                {.stream = part.stream(),
                                 .sha256 = part.sha256(),
                                 .total = part.total(),
                                 .offset = part.offset(),
                                 .bytes = part.bytes()},
                                clock_()));
  if (!whole) return Done{};
  const std::string name = part.name().empty() ? "unnamed model" : clean_name(part.name());
  return set_model(part.stream(), std::as_bytes(std::span(std::as_const(*whole))), name,
                   {.requester = requester});
}

// The file itself says for which stage it is.
Result<RequestHandler::Done> RequestHandler::set_model(const std::string& stream_name,
                                                       std::span<const std::byte> bytes,
                                                       const std::string& name,
                                                       UnderWay under_way) {
  const auto found = TRY(find_stream(stream_name));
  const ControlledStream& stream = *found;
  const auto stage = stage_for_model(stream.settings, bytes, name);
  if (!stage) return in_stream(stream.name, stage.error());
  const StageType& type = *stream.settings.stages[*stage].type;
  under_way.stage = *stage;
  under_way.file = {.stage = &type, .name = name, .bytes = {bytes.begin(), bytes.end()}};
  if (!stream.is_there()) return keep(stream.name, under_way);
  if (stream.skeleton == nullptr) return fail(stream.name + " has no skeleton to bind a model to");
  const auto context = TRY(pipeline::stage_context(stream.settings, *stage, stream.skeleton));
  under_way.model = TRY(type.bind_model(bytes, context, name));
  Command command{.change = {.kind = StageChange::Kind::kModel, .type = &type},
                  .model = under_way.model.get()};
  const std::string hash = log::sha256_hex(bytes);
  std::copy_n(hash.begin(), std::min(hash.size(), command.model_hash.size() - 1),
              command.model_hash.begin());
  daemon_control_.keep_model(bytes);
  return send(stream, command, std::move(under_way));
}

// Of a stream that is not there it is not known with which model it would come.
Result<RequestHandler::Done> RequestHandler::take_model_away(const v1::ControlRequest& request,
                                                             const Requester& requester) {
  const auto& wanted = request.use_model();
  const auto found = TRY(find_stream(wanted.stream()));
  const ControlledStream& stream = *found;
  const auto& stages = stream.settings.stages;
  std::vector<std::size_t> users;  // stages
  std::string names;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const bool named = wanted.stage().empty() || wanted.stage() == stages[i].type->name;
    const bool uses =
        stream.is_there() ? !stages[i].model_name.empty() : stages[i].type->has_model();
    if (!uses || !named) continue;
    users.push_back(i);
    add_word(names, std::string(stages[i].type->name));
  }
  if (users.empty()) return in_stream(stream.name, fail("it uses no model").error());
  if (users.size() > 1) {
    return in_stream(stream.name,
                     fail("the stages " + names + " use models: say of which stage").error());
  }
  const StageType& type = *stages[users.front()].type;
  if (type.check != nullptr) {
    const auto fault = type.check(stages[users.front()].parameters, false);
    if (fault) return in_stream(stream.name, fail(fault->sentence).error());
  }
  return send(stream, {.change = {.kind = StageChange::Kind::kModel, .type = &type}},
              {.requester = requester,
               .stage = users.front(),
               .file = {.stage = &type},
               .refusal = "it plays labels: stop that first"});
}

const StageModel* RequestHandler::coming_model(const ControlledStream& stream,
                                               std::size_t stage) const {
  for (auto it = under_way_.rbegin(); it != under_way_.rend(); ++it) {
    const UnderWay& change = it->second;
    if (change.stream == stream.stream && change.stage == stage && change.model) {
      return change.model.get();
    }
  }
  return stream.models[stage].get();
}

template <typename AnyCommand>
Result<RequestHandler::Done> RequestHandler::put_under_way(const ControlledStream& stream,
                                                           AnyCommand command, UnderWay under_way) {
  command.ticket = last_ticket_ + 1;
  if (under_way_.size() >= kMaxUnderWay || !daemon_control_.send(command)) {
    return fail("too many changes are under way; wait for their answers and try again");
  }
  under_way.stream = stream.stream;
  under_way.name = stream.name;
  under_way_.emplace(++last_ticket_, std::move(under_way));
  return Done{.under_way = true};
}

Result<RequestHandler::Done> RequestHandler::send(const ControlledStream& stream, Command command,
                                                  UnderWay under_way) {
  if (!stream.is_there()) return keep(stream.name, under_way);
  command.stream = stream.stream;
  return put_under_way(stream, command, std::move(under_way));
}

RequestHandler::Done RequestHandler::keep(const std::string& stream, const UnderWay& change) {
  if (change.value) {
    kept_.set(stream, *change.value->stage, change.value->parameter, change.value->value);
  }
  if (change.file.stage != nullptr) {
    kept_.set_model(stream, *change.file.stage, change.file.bytes, change.file.name);
  }
  return {.stream = stream};
}

std::optional<Reply> RequestHandler::acknowledge(const pipeline::Ack& ack) {
  const std::scoped_lock lock(mutex_);
  const auto found = under_way_.find(ack.ticket);
  if (found == under_way_.end()) return std::nullopt;
  UnderWay done = std::move(found->second);
  under_way_.erase(found);
  const auto stream = streams_.find(done.stream);
  const bool gone = stream == streams_.end();
  if (ack.refused) {  // nothing has changed, so the model in use stays
    std::string_view why = done.refusal.empty() ? "the stage refused this" : done.refusal;
    if (ack.gone) why = "its body changes just now; try again";
    if (gone || is_earlier(stream)) why = "it has left before this took effect";
    const std::string sentence = devices::about_stream(done.name, why);
    if (!done.taught) return refusal(std::move(done.requester), sentence);
    teacher_->not_started(sentence);
    return std::nullopt;
  }
  if (done.calibration) {
    done.device->calibrated({.toml = done.calibration->text, .file = "the calibration sent last"});
    calibrations_[done.source_number] = std::move(done.calibration);  // frees the one before it
  }
  static_cast<void>(keep(done.name, done));
  if (!gone) apply(stream->second, done);
  if (done.taught) {
    teacher_->started(ack.sequence);
    return std::nullopt;
  }
  v1::ControlReply reply;
  reply.set_stream(done.name);
  reply.set_sequence(ack.sequence);
  if (done.fit) *reply.mutable_fit() = *done.fit;
  return make_reply(std::move(done.requester), std::move(reply));
}

void RequestHandler::apply(ControlledStream& stream, UnderWay& done) {
  auto& settings = stream.settings.stages;
  if (done.file.stage != nullptr) {  // another model, or none
    auto& stage = settings[done.stage];
    stage.model_name = done.model ? done.model->name : std::string();
    stage.model_words = done.model ? done.model->words : std::vector<std::string>();
    devices::forget_texts(done.model.get(), stage);
    stream.models[done.stage] = std::move(done.model);  // frees the model that it replaces
    daemon_control_.stages_changed(stream.stream, stream.settings);
  }
  if (!done.value ||
      !text_command(*done.value->stage,
                    *find_parameter(done.value->stage->parameters, done.value->parameter))) {
    return;
  }
  settings[done.stage].parameters[done.value->parameter] = done.value->value;
  daemon_control_.stages_changed(stream.stream, stream.settings);
}

Result<ControlledStream*> RequestHandler::find_device(const std::string& name) {
  auto found = find_stream(name);
  if (found && !(*found)->source.empty()) {
    return fail(
        fmt::format("stream {} is a body of source {}; calibrations and haptics are for gloves",
                    name, (*found)->source));
  }
  if (found && !(*found)->is_there()) {
    return fail(fmt::format("stream {} is not there now, because a stage has refused it", name));
  }
  return found;
}

Result<RequestHandler::Done> RequestHandler::calibrate(const std::string& stream_name,
                                                       const std::string& toml,
                                                       const std::string& name,
                                                       UnderWay under_way) {
  const auto found = TRY(find_device(stream_name));
  const ControlledStream& stream = *found;
  auto compiled = TRY(devices::compile_calibration(*stream.device->description(), toml, name));
  const DeviceCommand command{.kind = DeviceCommand::Kind::kCalibrate,
                              .source = stream.source_number,
                              .calibration = compiled.get(),
                              .size = 0,
                              .bytes = {}};
  under_way.calibration = std::move(compiled);
  under_way.device = stream.device;
  under_way.source_number = stream.source_number;
  return put_under_way(stream, command, std::move(under_way));
}

RequestHandler::Answer RequestHandler::fit_glove(const v1::ControlRequest& request,
                                                 const Requester& requester) {
  const auto fit = TRY(judge_or_use(request, requester));
  if (!fit->file().empty()) return std::nullopt;
  v1::ControlReply reply;
  *reply.mutable_fit() = *fit;
  return reply;
}

// The fit is computed, and the file written, without the lock.
Result<std::shared_ptr<const v1::GloveFit>> RequestHandler::judge_or_use(
    const v1::ControlRequest& request, const Requester& requester) {
  const auto& wanted = request.fit_glove();
  if (!wanted.name().empty() && !config::is_stream_name(wanted.name())) {
    return fail(in_quotes(wanted.name()) +
                " cannot be the name of a calibration; it has a-z, digits, '-' and '_', 1 to 32");
  }
  std::unique_lock lock(mutex_);
  const ControlledStream* const stream = TRY(find_device(wanted.stream()));
  const auto glove = stream->device;
  lock.unlock();
  auto fitted = control::fit_glove(*glove->description(), glove->calibration().toml, wanted);
  if (!fitted) return in_stream(wanted.stream(), fitted.error());
  auto fit = std::make_shared<v1::GloveFit>(std::move(fitted->words));
  if (fitted->toml.empty()) return fit;
  auto file = TRY(models_.add(wanted.name(), kCalibration, fitted->toml));
  fit->set_file(std::move(file));
  lock.lock();
  TRY(calibrate(wanted.stream(), fitted->toml, fit->file(), {.requester = requester, .fit = fit}));
  return fit;
}

Result<RequestHandler::Done> RequestHandler::send_haptics(const v1::ControlRequest& request) {
  const auto found = TRY(find_device(request.haptics().stream()));
  const ControlledStream& stream = *found;
  const std::string driver_name = stream.device->description()->driver;
  const drivers::Driver* driver = drivers::find_driver(driver_name);
  if (driver == nullptr || driver->glove == nullptr || driver->glove->encode_haptics == nullptr) {
    return fail(fmt::format("stream {} has no haptics: driver '{}' only sends data", stream.name,
                            driver_name));
  }
  const auto haptics = TRY(read_haptics(request.haptics()));
  const auto bytes = TRY(driver->glove->encode_haptics(stream.options, haptics));
  if (stream.device->away()) {
    return fail("the glove of stream " + stream.name + " is away: plug it in and try again");
  }
  DeviceCommand command{.kind = DeviceCommand::Kind::kSend, .source = stream.source_number};
  if (bytes.size() > command.bytes.size()) return fail("the device's message is too long");
  command.size = static_cast<std::uint16_t>(bytes.size());
  std::ranges::copy(bytes, command.bytes.begin());
  if (!daemon_control_.send(command))
    return fail("too many messages wait for the device; send fewer");
  return Done{};  // devices send no acknowledgement
}

std::int64_t RequestHandler::forget_old(std::int64_t now_ns) {
  const std::scoped_lock lock(mutex_);
  return uploads_.forget_old(now_ns);
}

void RequestHandler::add_stream(ControlledStream stream) {
  const std::scoped_lock lock(mutex_);
  const std::uint32_t id = stream.stream;
  streams_.insert_or_assign(id, std::move(stream));
}

void RequestHandler::add_known(ControlledStream stream) {
  const std::scoped_lock lock(mutex_);
  known_.insert_or_assign(stream.name, std::move(stream));
}

void RequestHandler::remove_stream(std::uint32_t stream) {
  const std::scoped_lock lock(mutex_);
  streams_.erase(stream);
}

}  // namespace posed::control
