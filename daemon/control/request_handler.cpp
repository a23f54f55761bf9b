#include "daemon/control/request_handler.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "daemon/control/stage_requests.hpp"
#include "daemon/devices/about_stream.hpp"
#include "models/stage_type.hpp"
#include "posed/v1/control.pb.h"
#include "proto/log/digest.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::control {
namespace {

using devices::of_stream;
using pipeline::Command;
using pipeline::StageChange;

Reply make_reply(Requester to, const v1::ControlReply& reply) {
  return {.to = std::move(to), .bytes = reply.SerializeAsString(), .refused = !reply.ok()};
}

Reply refusal(Requester to, const std::string& sentence) {
  v1::ControlReply reply;
  reply.set_error(sentence);
  return make_reply(std::move(to), reply);
}

// Texts that the new model does not take, such as weights of the styles that the one before had,
// stand for their defaults.
void forget_texts(const StageModel& model, pipeline::StageSettings& settings) {
  for (const StageCommandType& command : settings.type->commands) {
    if (!is_live_text(*settings.type, command.name)) continue;
    auto& text = settings.parameters.at(std::string(command.name));
    const std::vector<std::string> words{std::get<std::string>(text)};
    if (!command.encode(&model, words, {})) text = std::string();
  }
}

}  // namespace

RequestHandler::RequestHandler(std::vector<ControlledStream> streams, DaemonControl& daemon_control,
                               ModelFolder models, Clock clock)
    : daemon_control_(daemon_control), models_(std::move(models)), clock_(clock) {
  for (std::uint32_t i = 0; i < streams.size(); ++i) {
    streams[i].stream = i;
    streams_.emplace(i, std::move(streams[i]));
  }
}

RequestHandler::~RequestHandler() = default;

std::optional<Reply> RequestHandler::handle(Requester requester, std::span<const std::byte> bytes) {
  v1::ControlRequest request;
  if (bytes.size() > kMaxRequest) {
    return refusal(std::move(requester), "the request is too large: it has at most 64 KB");
  }
  if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return refusal(std::move(requester), "this is not a valid posed.v1.ControlRequest");
  }
  Result<> done;
  v1::ControlReply reply;
  reply.set_ok(true);
  if (request.has_status() || request.has_stop()) {  // without the lock: these need no stream
    if (request.has_stop()) daemon_control_.stop();
    if (request.has_status()) daemon_control_.fill(*reply.mutable_status());
    return make_reply(std::move(requester), reply);
  }
  if (request.has_take()) return mark_take(request, std::move(requester));
  if (request.has_list_models()) return list_models(std::move(requester));
  std::string model;  // read without the lock: a disk may be slow
  if (request.has_use_model()) {
    auto read = models_.read(request.use_model().name());
    if (!read) return refusal(std::move(requester), read.error().text());
    model = std::move(*read);
  }
  const std::scoped_lock lock(mutex_);
  switch (request.request_case()) {
    case v1::ControlRequest::kSetParameter:
      done = set_parameter(request, requester);
      break;
    case v1::ControlRequest::kStageCommand:
      done = stage_command(request, requester);
      break;
    case v1::ControlRequest::kModelPart: {
      const auto taken = take_model_part(request, requester);
      if (!taken) return refusal(std::move(requester), taken.error().text());
      if (*taken) return make_reply(std::move(requester), reply);
      break;
    }
    case v1::ControlRequest::kUseModel:
      done = set_model(request.use_model().stream(), std::as_bytes(std::span(std::as_const(model))),
                       request.use_model().name(), requester);
      break;
    case v1::ControlRequest::kCalibrate:
      done = calibrate(request, requester);
      break;
    case v1::ControlRequest::kHaptics:
      done = send_haptics(request);
      if (done) return make_reply(std::move(requester), reply);  // devices send no acknowledgement
      break;
    default:
      return refusal(std::move(requester),
                     "the request is empty, or from another version of posed");
  }
  if (!done) return refusal(std::move(requester), done.error().text());
  return std::nullopt;  // acknowledge() makes the reply
}

Reply RequestHandler::mark_take(const v1::ControlRequest& request, Requester requester) {
  const auto& wanted = request.take();
  if (!wanted.start() && !wanted.name().empty()) {
    return refusal(std::move(requester), "a take gets its name when it begins; leave it out here");
  }
  if (auto fine = pipeline::check_take_name(wanted.name()); !fine) {
    return refusal(std::move(requester), fine.error().text());
  }
  const auto take = daemon_control_.mark_take(
      {.start = wanted.start(), .time_ns = clock_(), .name = wanted.name()});
  if (!take) return refusal(std::move(requester), take.error().text());
  v1::ControlReply reply;
  reply.set_ok(true);
  *reply.mutable_take() = pipeline::stats_of(*take);
  reply.set_recorder_trouble(take->trouble);
  return make_reply(std::move(requester), reply);
}

Reply RequestHandler::list_models(Requester requester) const {
  const auto known = models_.list();
  if (!known) return refusal(std::move(requester), known.error().text());
  v1::ControlReply reply;
  reply.set_ok(true);
  for (const FolderModel& model : *known) {
    v1::KnownModel& entry = *reply.add_model();
    entry.set_name(model.name);
    entry.set_kind(std::string(model.kind));
  }
  return make_reply(std::move(requester), reply);
}

bool RequestHandler::is_earlier(Streams::iterator stream) const {
  const auto next = std::next(stream);
  return next != streams_.end() &&
         pipeline::slot_of(next->first) == pipeline::slot_of(stream->first);
}

Result<ControlledStream*> RequestHandler::find_stream(const std::string& name) {
  std::string names;
  for (auto it = streams_.begin(); it != streams_.end(); ++it) {
    if (is_earlier(it)) continue;
    ControlledStream& stream = it->second;
    if (stream.name == name) return &stream;
    if (stream.publishes_raw && raw_name(stream.name) == name) {
      return fail(
          fmt::format("{} is the input of {} before its stages and cannot be changed; name"
                      " {}",
                      name, stream.name, stream.name));
    }
    names += (names.empty() ? "" : ", ") + stream.name;
  }
  return fail(fmt::format("there is no stream {}; there is: {}", in_quotes(name),
                          names.empty() ? "none" : names));
}

Result<> RequestHandler::set_parameter(const v1::ControlRequest& request,
                                       const Requester& requester) {
  const auto& wanted = request.set_parameter();
  const auto stream = find_stream(wanted.stream());
  if (!stream) return std::unexpected(stream.error());
  const auto text = text_change((*stream)->settings, wanted);
  if (!text) return of_stream(wanted.stream(), text.error());
  if (*text) return stage_command(**text, requester);
  const auto change = parameter_change((*stream)->settings, wanted);
  if (!change) return of_stream(wanted.stream(), change.error());
  return send(**stream, {.change = *change}, {.requester = requester});
}

Result<> RequestHandler::stage_command(const v1::ControlRequest& request,
                                       const Requester& requester) {
  const auto& wanted = request.stage_command();
  const auto stream = find_stream(wanted.stream());
  if (!stream) return std::unexpected(stream.error());
  const auto found = find_command((*stream)->settings, wanted.name());
  if (!found) return of_stream(wanted.stream(), found.error());
  const StageCommandType& type = found->change.type->commands[found->change.index];
  const std::string_view why = type.refusal.empty() ? "the stage refused this" : type.refusal;
  const auto command = encode_command(type, coming_model(**stream, found->stage), wanted);
  if (!command) return of_stream(wanted.stream(), command.error());
  std::optional<LiveText> text;
  if (is_live_text(*found->change.type, type.name)) {
    text = {.parameter = std::string(type.name), .value = joined_words(wanted)};
  }
  return send(
      **stream, {.change = found->change, .command = *command},
      {.requester = requester, .stage = found->stage, .refusal = why, .text = std::move(text)});
}

Result<bool> RequestHandler::take_model_part(const v1::ControlRequest& request,
                                             const Requester& requester) {
  const auto& part = request.model_part();
  if (auto stream = find_stream(part.stream()); !stream) return std::unexpected(stream.error());
  auto whole = uploads_.take(requester.empty() ? std::string() : requester.front(),
                             {.stream = part.stream(),
                              .sha256 = part.sha256(),
                              .total = part.total(),
                              .offset = part.offset(),
                              .bytes = part.bytes()},
                             clock_());
  if (!whole) return std::unexpected(whole.error());
  if (!*whole) return true;
  const std::string name = part.name().empty() ? "unnamed model" : clean_name(part.name());
  const auto bytes = std::as_bytes(std::span(std::as_const(**whole)));
  if (auto done = set_model(part.stream(), bytes, name, requester); !done) {
    return std::unexpected(done.error());
  }
  return false;
}

// The file itself says for which stage it is.
Result<> RequestHandler::set_model(const std::string& stream_name, std::span<const std::byte> bytes,
                                   const std::string& name, const Requester& requester) {
  const auto found = find_stream(stream_name);
  if (!found) return std::unexpected(found.error());
  const ControlledStream& stream = **found;
  const auto stage = stage_for_model(stream.settings, bytes, name);
  if (!stage) return of_stream(stream.name, stage.error());
  if (stream.skeleton == nullptr) return fail(stream.name + " has no skeleton to bind a model to");
  const StageType& type = *stream.settings.stages[*stage].type;
  const auto context = pipeline::stage_context(stream.settings, *stage, stream.skeleton);
  if (!context) return std::unexpected(context.error());
  auto bound = type.bind_model(bytes, *context, name);
  if (!bound) return std::unexpected(bound.error());
  Command command{.change = {.kind = StageChange::Kind::kModel, .type = &type},
                  .model = bound->get()};
  const std::string hash = log::sha256_hex(bytes);
  std::copy_n(hash.begin(), std::min(hash.size(), command.model_hash.size() - 1),
              command.model_hash.begin());
  daemon_control_.keep_model(bytes);
  return send(stream, command,
              {.requester = requester, .stage = *stage, .model = std::move(*bound)});
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

Result<> RequestHandler::send(const ControlledStream& stream, Command command, UnderWay under_way) {
  command.stream = stream.stream;
  command.ticket = last_ticket_ + 1;
  if (under_way_.size() >= kMaxUnderWay || !daemon_control_.send(command)) {
    return fail("too many changes are under way; wait for their answers and try again");
  }
  under_way.stream = stream.stream;
  under_way.name = stream.name;
  under_way_.emplace(++last_ticket_, std::move(under_way));
  return {};
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
    return refusal(std::move(done.requester), devices::about_stream(done.name, why));
  }
  if (!gone) apply(stream->second, done);
  v1::ControlReply reply;
  reply.set_ok(true);
  reply.set_stream(done.name);
  reply.set_sequence(ack.sequence);
  return make_reply(std::move(done.requester), reply);
}

void RequestHandler::apply(ControlledStream& stream, UnderWay& done) {
  if (done.model) {
    auto& settings = stream.settings.stages[done.stage];
    settings.model_name = done.model->name;
    settings.model_words = done.model->words;
    forget_texts(*done.model, settings);
    stream.models[done.stage] = std::move(done.model);  // frees the model that it replaces
    daemon_control_.stages_changed(stream.stream, stream.settings);
  }
  if (done.text) {
    stream.settings.stages[done.stage].parameters[done.text->parameter] = done.text->value;
    daemon_control_.stages_changed(stream.stream, stream.settings);
  }
  if (done.calibration) {
    stream.calibration = std::move(done.calibration);
    stream.device->calibrated(
        {.toml = stream.calibration->text, .file = "the calibration sent last"});
  }
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

void RequestHandler::remove_stream(std::uint32_t stream) {
  const std::scoped_lock lock(mutex_);
  streams_.erase(stream);
}

}  // namespace posed::control
