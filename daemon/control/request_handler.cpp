#include "daemon/control/request_handler.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/words.hpp"
#include "models/style/style_model.hpp"
#include "posed/v1/control.pb.h"
#include "proto/log/digest.hpp"

namespace posed::control {
namespace {

using pipeline::Command;

constexpr float kMostAlpha = 2.0F;

Answer answer(Asker to, const v1::ControlReply& reply) {
  return {std::move(to), reply.SerializeAsString()};
}

Answer refusal(Asker to, const std::string& sentence) {
  v1::ControlReply reply;
  reply.set_error(sentence);
  return answer(std::move(to), reply);
}

}  // namespace

RequestHandler::RequestHandler(std::vector<ControlledStream> streams, Helm& helm)
    : streams_(std::move(streams)), helm_(helm) {}

RequestHandler::~RequestHandler() = default;

std::optional<Answer> RequestHandler::handle(Asker asker, std::span<const std::byte> bytes) {
  v1::ControlRequest request;
  if (bytes.size() > kLargestModel + kLargestRequest ||
      !request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return refusal(std::move(asker), "this is no posed.v1.ControlRequest");
  }
  const std::size_t model_size = request.has_set_model() ? request.set_model().model().size() : 0;
  if (model_size > kLargestModel || bytes.size() - model_size > kLargestRequest) {
    return refusal(std::move(asker),
                   "the request is too large: a model file has at most 64 MB,"
                   " everything else at most 64 KB");
  }
  Result<> done;
  v1::ControlReply reply;
  reply.set_ok(true);
  switch (request.request_case()) {
    case v1::ControlRequest::kSetAlpha:
      done = set_alpha(request, asker);
      break;
    case v1::ControlRequest::kSetModel:
      done = set_model(request, asker);
      break;
    case v1::ControlRequest::kStatus:
      helm_.fill(*reply.mutable_status());
      return answer(std::move(asker), reply);
    case v1::ControlRequest::kStop:
      helm_.stop();
      return answer(std::move(asker), reply);
    case v1::ControlRequest::REQUEST_NOT_SET:
      return refusal(std::move(asker), "the request is empty, or from a newer posed");
  }
  if (!done) return refusal(std::move(asker), done.error().text());
  return std::nullopt;  // acknowledge() answers
}

Result<std::uint32_t> RequestHandler::styled_stream(const std::string& name) const {
  std::string names;
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const ControlledStream& stream = streams_[i];
    if (stream.name == name) {
      if (stream.style) return static_cast<std::uint32_t>(i);
      return fail(
          fmt::format("stream {} has no style; give it a [stream.style] table in the"
                      " config and start again",
                      name));
    }
    if (stream.publishes_raw && stream.name + "-raw" == name) {
      return fail(
          fmt::format("{} is the input of {} before the style and cannot be changed; name"
                      " {}",
                      name, stream.name, stream.name));
    }
    names += (names.empty() ? "" : ", ") + stream.name;
  }
  return fail(fmt::format("there is no stream '{}'; there is: {}", config::printable(name), names));
}

Result<> RequestHandler::set_alpha(const v1::ControlRequest& request, const Asker& asker) {
  const auto& wanted = request.set_alpha();
  const auto stream = styled_stream(wanted.stream());
  if (!stream) return std::unexpected(stream.error());
  if (!(std::abs(wanted.alpha()) <= kMostAlpha)) {
    return fail(fmt::format("alpha {} is out of range; it goes from -2 to 2", wanted.alpha()));
  }
  Command command{.kind = Command::Kind::kAlpha, .stream = *stream, .alpha = wanted.alpha()};
  return send(command, {asker, nullptr});
}

Result<> RequestHandler::set_model(const v1::ControlRequest& request, const Asker& asker) {
  const auto& wanted = request.set_model();
  const auto index = styled_stream(wanted.stream());
  if (!index) return std::unexpected(index.error());
  const ControlledStream& stream = streams_[*index];
  const std::string name =
      wanted.name().empty() ? "unnamed model" : config::printable(wanted.name());
  const auto bytes = std::as_bytes(std::span(wanted.model()));
  const auto model = style::parse_model(bytes, name);
  if (!model) return std::unexpected(model.error());
  if (stream.skeleton == nullptr) return fail(stream.name + " has no skeleton to bind a model to");
  auto bound = style::bind_model(*model, *stream.skeleton, *stream.style, name);
  if (!bound) return std::unexpected(bound.error());
  Command command{.kind = Command::Kind::kModel, .stream = *index, .model = bound->get()};
  const std::string hash = log::sha256_hex(bytes);
  std::copy_n(hash.begin(), std::min(hash.size(), command.model_hash.size() - 1),
              command.model_hash.begin());
  helm_.keep_model(bytes);
  return send(command, {asker, std::move(*bound)});
}

Result<> RequestHandler::send(Command command, UnderWay under_way) {
  command.ticket = last_ticket_ + 1;
  if (under_way_.size() >= kMostUnderWay || !helm_.send(command)) {
    return fail("too many changes are under way; wait for their answers and try again");
  }
  under_way_.emplace(++last_ticket_, std::move(under_way));
  return {};
}

std::optional<Answer> RequestHandler::acknowledge(const pipeline::Ack& ack) {
  const auto found = under_way_.find(ack.ticket);
  if (found == under_way_.end()) return std::nullopt;
  UnderWay done = std::move(found->second);
  under_way_.erase(found);
  ControlledStream& stream = streams_[ack.stream];
  if (done.model) {
    stream.model = std::move(done.model);  // the one it replaces is free now
    helm_.model_in_use(ack.stream, stream.model->name);
  }
  v1::ControlReply reply;
  reply.set_ok(true);
  reply.set_stream(stream.name);
  reply.set_sequence(ack.sequence);
  return answer(std::move(done.asker), reply);
}

}  // namespace posed::control
