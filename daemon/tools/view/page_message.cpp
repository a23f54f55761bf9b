#include "daemon/tools/view/page_message.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "proto/text/json_text.hpp"

namespace posed::view {
namespace {

using nlohmann::json;

Parcel word(const json& value) {
  return {.bytes = std::make_shared<const std::string>(json_text(value)), .text = true};
}

// A page shows and changes streams; the daemon belongs to whoever started it.
std::string refusal_of(const v1::ControlRequest& request) {
  switch (request.request_case()) {
    case v1::ControlRequest::kStatus:
    case v1::ControlRequest::kSetParameter:
    case v1::ControlRequest::kStageCommand:
    case v1::ControlRequest::kModelPart:
    case v1::ControlRequest::kCalibrate:
    case v1::ControlRequest::kTake:
    case v1::ControlRequest::kListModels:
    case v1::ControlRequest::kUseModel:
      return {};
    case v1::ControlRequest::kStop:
      return "a page may not end the daemon: use `posed ctl stop`";
    default:
      return "a page may not ask for this: use `posed ctl`";
  }
}

}  // namespace

PageWord read_word(std::string_view text) {
  if (text.size() > kMaxWord) return UnknownWord{};
  const json value = json::parse(text, nullptr, false);
  if (!value.is_object()) return UnknownWord{};
  const auto type = value.find("type");
  if (type == value.end()) return UnknownWord{};
  if (*type == "ready") return ReadyWord{};
  const auto t0 = value.find("t0");
  if (*type == "clock" && t0 != value.end() && t0->is_number()) {
    return ClockWord{.t0 = t0->get<double>()};
  }
  return UnknownWord{};
}

Result<PageRequest> read_request(std::string_view bytes) {
  constexpr std::size_t kNumberBytes = 4;
  if (bytes.size() < kNumberBytes) return fail("a request begins with its number, 4 bytes");
  PageRequest asked;
  for (std::size_t i = 0; i < kNumberBytes; ++i) {
    asked.number |= std::uint32_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
  }
  bytes.remove_prefix(kNumberBytes);
  const auto size = static_cast<int>(std::min(bytes.size(), kMaxPageMessage));
  if (!asked.request.ParseFromArray(bytes.data(), size)) {
    asked.refusal = "this is not a posed.v1.ControlRequest";
    return asked;
  }
  // Only what was checked may pass: a newer daemon may know fields that this program does not.
  asked.request.DiscardUnknownFields();
  asked.refusal = refusal_of(asked.request);
  return asked;
}

Bytes with_topic(std::string_view topic, std::string_view body) {
  constexpr std::size_t kLongestTopic = 255;
  topic = topic.substr(0, kLongestTopic);
  std::string bytes;
  bytes.reserve(1 + topic.size() + body.size());
  bytes += static_cast<char>(topic.size());
  bytes += topic;
  bytes += body;
  return std::make_shared<const std::string>(std::move(bytes));
}

std::string reply_topic(std::uint32_t number) { return "reply/" + std::to_string(number); }

Parcel refusal_reply(std::uint32_t number, const std::string& sentence) {
  v1::ControlReply reply;
  reply.set_error(sentence);
  return {.bytes = with_topic(reply_topic(number), reply.SerializeAsString())};
}

Parcel hello_word(const Greeting& greeting, const ControlRight& right) {
  return word({{"type", "hello"},
               {"version", greeting.version},
               {"connect", greeting.connect},
               {"same_machine", greeting.same_machine},
               {"may_control", right.may},
               {"read_only_reason", right.reason}});
}

Parcel control_word(const ControlRight& right) {
  return word(
      {{"type", "control"}, {"may_control", right.may}, {"read_only_reason", right.reason}});
}

Parcel daemon_word(const DaemonState& state) {
  return word({{"type", "daemon"}, {"alive", state.alive}, {"sentence", state.sentence}});
}

Parcel clock_word(double t0, std::int64_t monotonic_ns) {
  return word({{"type", "clock"}, {"t0", t0}, {"monotonic_ns", std::to_string(monotonic_ns)}});
}

Parcel no_reply_word(std::uint32_t number, const std::string& sentence) {
  return word({{"type", "no_reply"}, {"request", number}, {"error", sentence}});
}

}  // namespace posed::view
