#include "daemon/control/trigger.hpp"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/pipeline/take.hpp"
#include "proto/text/clean.hpp"

namespace posed::control {
namespace {

// A cut or escaped name is better than no take.
std::string printable_name(const std::string& name) {
  constexpr std::size_t kMark = 3;  // "..." where it was cut
  return clean(name, pipeline::kMaxTakeName - kMark);
}

// What the sender says beside name and time.
std::string remark_of(const TriggerMessage& message, const std::string& sender) {
  std::string remark = "triggered by " + sender;
  const auto add = [&](const char* what, const std::string& value) {
    if (!value.empty()) remark += std::string(", ") + what + " " + in_quotes(value);
  };
  add("session", message.session);
  add("description", message.description);
  add("notes", message.notes);
  if (!message.start && message.result != "SUCCESS") add("result", message.result);
  if (!message.delay.empty() && message.delay != "0") {
    remark += ", its delay " + in_quotes(message.delay) + " (ms) is not waited for";
  }
  return remark;
}

}  // namespace

bool Trigger::is_repeated(const TriggerMessage& message, const std::string& sender) {
  if (message.packet_id.empty()) return false;
  std::string command = sender + (message.start ? " start " : " stop ") + message.packet_id;
  const bool again = command == last_;
  last_ = std::move(command);
  return again;
}

bool Trigger::comes_too_fast() {
  const std::int64_t now_ns = clock_();
  if (allowed_ns_ == kNoTime_ns) allowed_ns_ = now_ns;
  allowed_ns_ = std::max(allowed_ns_, now_ns);
  if (allowed_ns_ - now_ns > (kAtOnce - 1) * kStartEvery_ns) return true;
  allowed_ns_ += kStartEvery_ns;
  return false;
}

void Trigger::handle(std::string_view datagram, const std::string& sender) {
  const auto message = parse_trigger(datagram);
  if (!message) {
    ++refused_;
    spdlog::warn("trigger: a datagram from {} is refused: {} ({} so far)", sender,
                 message.error().text(), refused_);
    return;
  }
  if (is_repeated(*message, sender)) {
    ++repeated_;
    return;
  }
  if (message->start && comes_too_fast()) {
    ++refused_;
    spdlog::warn(
        "trigger: a take of {} is refused: takes begin too fast; name the capture system in"
        " [trigger] peers ({} so far)",
        sender, refused_);
    return;
  }
  pipeline::TakeMark mark{.start = message->start,
                          .time_ns = clock_(),
                          .timecode = message->timecode,
                          .remark = remark_of(*message, sender)};
  if (mark.start) mark.name = printable_name(message->name);
  if (auto marked = daemon_control_.mark_take(mark); !marked) {
    ++refused_;
    spdlog::warn("trigger: what {} asked for cannot be done: {} ({} so far)", sender,
                 marked.error().text(), refused_);
    return;
  }
  ++marked_;
}

}  // namespace posed::control
