#include "daemon/control/request_handler.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "models/gesture/model_file.hpp"
#include "models/style/style_model.hpp"
#include "posed/v1/control.pb.h"
#include "proto/log/digest.hpp"
#include "proto/model/model_file.hpp"
#include "proto/text/clean.hpp"

namespace posed::control {
namespace {

using pipeline::Command;

constexpr float kMaxAlpha = 2.0F;

Reply make_reply(Requester to, const v1::ControlReply& reply) {
  return {std::move(to), reply.SerializeAsString()};
}

Reply refusal(Requester to, const std::string& sentence) {
  v1::ControlReply reply;
  reply.set_error(sentence);
  return make_reply(std::move(to), reply);
}

}  // namespace

RequestHandler::RequestHandler(std::vector<ControlledStream> streams, DaemonControl& daemon_control,
                               Clock clock)
    : streams_(std::move(streams)), daemon_control_(daemon_control), clock_(clock) {}

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
  switch (request.request_case()) {
    case v1::ControlRequest::kSetAlpha:
      done = set_alpha(request, requester);
      break;
    case v1::ControlRequest::kModelPart: {
      const auto taken = take_model_part(request, requester);
      if (!taken) return refusal(std::move(requester), taken.error().text());
      if (*taken) return make_reply(std::move(requester), reply);
      break;
    }
    case v1::ControlRequest::kPlay:
      done = play(request, requester);
      break;
    case v1::ControlRequest::kStopPlaying:
      done = stop_playing(request, requester);
      break;
    case v1::ControlRequest::kCalibrate:
      done = calibrate(request, requester);
      break;
    case v1::ControlRequest::kHaptics:
      done = send_haptics(request);
      if (done) return make_reply(std::move(requester), reply);  // devices send no acknowledgement
      break;
    case v1::ControlRequest::kStatus:
      daemon_control_.fill(*reply.mutable_status());
      return make_reply(std::move(requester), reply);
    case v1::ControlRequest::kStop:
      daemon_control_.stop();
      return make_reply(std::move(requester), reply);
    case v1::ControlRequest::REQUEST_NOT_SET:
      return refusal(std::move(requester), "the request is empty, or from a newer posed");
  }
  if (!done) return refusal(std::move(requester), done.error().text());
  return std::nullopt;  // acknowledge() makes the reply
}

Result<std::uint32_t> RequestHandler::find_stream(const std::string& name) const {
  std::string names;
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const ControlledStream& stream = streams_[i];
    if (stream.name == name) return static_cast<std::uint32_t>(i);
    if (stream.publishes_raw && stream.name + "-raw" == name) {
      return fail(
          fmt::format("{} is the input of {} before its stages and cannot be changed; name"
                      " {}",
                      name, stream.name, stream.name));
    }
    names += (names.empty() ? "" : ", ") + stream.name;
  }
  return fail(fmt::format("there is no stream {}; there is: {}", in_quotes(name), names));
}

Result<std::uint32_t> RequestHandler::styled_stream(const std::string& name) const {
  const auto stream = find_stream(name);
  if (!stream || streams_[*stream].style) return stream;
  return fail(fmt::format(
      "stream {} has no style; give it a [stream.style] table in the config and start again",
      name));
}

Result<std::uint32_t> RequestHandler::playing_stream(const std::string& name) const {
  const auto stream = find_stream(name);
  if (!stream) return stream;
  if (!streams_[*stream].generates) {
    return fail(fmt::format(
        "stream {} performs no gestures; give it a [stream.generate] table in the config and"
        " start again",
        name));
  }
  if (coming_gesture(*stream) == nullptr) {
    return fail(
        fmt::format("stream {} has no gesture model; send one with `posed ctl model {} H.gesture`",
                    name, name));
  }
  return stream;
}

Result<> RequestHandler::set_alpha(const v1::ControlRequest& request, const Requester& requester) {
  const auto& wanted = request.set_alpha();
  const auto stream = styled_stream(wanted.stream());
  if (!stream) return std::unexpected(stream.error());
  if (!(std::abs(wanted.alpha()) <= kMaxAlpha)) {
    return fail(fmt::format("alpha {} is out of range; it goes from -2 to 2", wanted.alpha()));
  }
  Command command{.kind = Command::Kind::kAlpha, .stream = *stream, .alpha = wanted.alpha()};
  return send(command, {.requester = requester});
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

// The file itself says which kind of model it is.
Result<> RequestHandler::set_model(const std::string& stream, std::span<const std::byte> bytes,
                                   const std::string& name, const Requester& requester) {
  const auto index = find_stream(stream);
  if (!index) return std::unexpected(index.error());
  const auto file = model_file::open(bytes, name);
  if (!file) return std::unexpected(file.error());
  return file->has_gesture() ? set_gesture_model(*index, bytes, name, requester)
                             : set_style_model(*index, bytes, name, requester);
}

Result<> RequestHandler::set_style_model(std::uint32_t index, std::span<const std::byte> bytes,
                                         const std::string& name, const Requester& requester) {
  const ControlledStream& stream = streams_[index];
  if (auto styled = styled_stream(stream.name); !styled) return std::unexpected(styled.error());
  const auto model = style::parse_model(bytes, name);
  if (!model) return std::unexpected(model.error());
  if (stream.skeleton == nullptr) return fail(stream.name + " has no skeleton to bind a model to");
  auto bound = style::bind_model(*model, *stream.skeleton, *stream.style, name);
  if (!bound) return std::unexpected(bound.error());
  Command command{.kind = Command::Kind::kModel, .stream = index, .model = bound->get()};
  keep_model(bytes, command);
  return send(command, {.requester = requester, .model = std::move(*bound)});
}

Result<> RequestHandler::set_gesture_model(std::uint32_t index, std::span<const std::byte> bytes,
                                           const std::string& name, const Requester& requester) {
  const ControlledStream& stream = streams_[index];
  if (!stream.generates) {
    return fail(fmt::format(
        "{} is a gesture model, and stream {} has no use for it; give it a [stream.generate]"
        " table in the config and start again",
        name, stream.name));
  }
  auto model = gesture::parse_model(bytes, name);
  if (!model) return std::unexpected(model.error());
  auto bound = generate::bind_model(std::move(*model), *stream.skeleton, stream.rate_hz, name);
  if (!bound) return std::unexpected(bound.error());
  Command command{.kind = Command::Kind::kGesture, .stream = index, .gesture = bound->get()};
  keep_model(bytes, command);
  return send(command, {.requester = requester, .gesture = std::move(*bound)});
}

void RequestHandler::keep_model(std::span<const std::byte> bytes, Command& command) {
  const std::string hash = log::sha256_hex(bytes);
  std::copy_n(hash.begin(), std::min(hash.size(), command.model_hash.size() - 1),
              command.model_hash.begin());
  daemon_control_.keep_model(bytes);
}

Result<> RequestHandler::play(const v1::ControlRequest& request, const Requester& requester) {
  const auto& wanted = request.play();
  const auto stream = playing_stream(wanted.stream());
  if (!stream) return std::unexpected(stream.error());
  const std::vector<std::string> names(wanted.label().begin(), wanted.label().end());
  const auto order =
      gesture::make_play_order(coming_gesture(*stream)->gesture(), names,
                               wanted.tempo() == 0.0F ? 1.0 : wanted.tempo(), wanted.loop());
  if (!order) return std::unexpected(order.error());
  return send({.kind = Command::Kind::kPlay, .stream = *stream, .play = *order},
              {.requester = requester});
}

Result<> RequestHandler::stop_playing(const v1::ControlRequest& request,
                                      const Requester& requester) {
  const auto stream = playing_stream(request.stop_playing().stream());
  if (!stream) return std::unexpected(stream.error());
  return send({.kind = Command::Kind::kStopPlaying, .stream = *stream}, {.requester = requester});
}

const generate::BoundModel* RequestHandler::coming_gesture(std::uint32_t stream) const {
  for (auto it = under_way_.rbegin(); it != under_way_.rend(); ++it) {
    if (it->second.stream == stream && it->second.gesture) return it->second.gesture.get();
  }
  return streams_[stream].gesture.get();
}

Result<> RequestHandler::send(Command command, UnderWay under_way) {
  command.ticket = last_ticket_ + 1;
  if (under_way_.size() >= kMaxUnderWay || !daemon_control_.send(command)) {
    return fail("too many changes are under way; wait for their answers and try again");
  }
  under_way.stream = command.stream;
  under_way_.emplace(++last_ticket_, std::move(under_way));
  return {};
}

std::optional<Reply> RequestHandler::acknowledge(const pipeline::Ack& ack) {
  const auto found = under_way_.find(ack.ticket);
  if (found == under_way_.end()) return std::nullopt;
  UnderWay done = std::move(found->second);
  under_way_.erase(found);
  ControlledStream& stream = streams_[ack.stream];
  if (done.model) {
    stream.model = std::move(done.model);  // frees the model that it replaces
    daemon_control_.model_in_use(ack.stream, stream.model->name);
  }
  if (done.calibration) {
    stream.calibration = std::move(done.calibration);
    stream.device->calibrated(
        {.toml = stream.calibration->text, .file = "the calibration sent last"});
  }
  if (done.gesture) {
    stream.gesture = std::move(done.gesture);
    if (!stream.style) daemon_control_.model_in_use(ack.stream, stream.gesture->name);
  }
  if (ack.refused) {
    return refusal(std::move(done.requester), "too many labels wait already on " + stream.name +
                                                  "; try again later, or stop them with"
                                                  " `posed ctl stop-playing " +
                                                  stream.name + "`");
  }
  v1::ControlReply reply;
  reply.set_ok(true);
  reply.set_stream(stream.name);
  reply.set_sequence(ack.sequence);
  return make_reply(std::move(done.requester), reply);
}

}  // namespace posed::control
