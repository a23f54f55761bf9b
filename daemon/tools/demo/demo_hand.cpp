#include "daemon/tools/demo/demo_hand.hpp"

#include <array>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <zmq.h>

#include "posed/v1/control.pb.h"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr std::array kLabels{"g", "1", "c", "3", "4", "p"};
// a performance takes about 12 s; the rest shows the live hand
constexpr double kAgainAfter_s = 25.0;

std::string joined(const auto& labels) {
  std::string text;
  for (const auto& label : labels) text += (text.empty() ? "" : " ") + std::string(label);
  return text;
}

bool is_performed(const v1::Frame& frame) {
  return frame.source() == v1::SOURCE_LABELS && !frame.label().empty();
}

}  // namespace

Result<DemoHand> DemoHand::open(const std::string& control) {
  ClientOptions client;
  client.endpoint = control;
  auto connection = Connection::open(client, ZMQ_DEALER);
  if (!connection) return std::unexpected(connection.error());
  return DemoHand(std::move(*connection));
}

void DemoHand::take(const v1::Frame& frame) {
  ++frames_;
  if (is_performed(frame)) {
    if (!is_performed(last_)) performed_.clear();
    if (performed_.empty() || performed_.back() != frame.label()) {
      performed_.push_back(frame.label());
    }
    ++performed_frames_;
  }
  last_ = frame;
}

Result<> DemoHand::tend(double seconds) {
  if (frames_ > 0 && seconds >= next_play_s_) {
    next_play_s_ += kAgainAfter_s;
    v1::ControlRequest request;
    auto& wanted = *request.mutable_stage_command();
    wanted.set_stream(kDemoHandStream);
    wanted.set_name("play");
    for (const char* label : kLabels) wanted.add_word(label);
    if (!net::send_part(connection_.socket(), request.SerializeAsString(), false)) {
      return fail("the demo's own play command cannot be sent");
    }
  }
  net::Message message;
  if (!message.receive(connection_.socket())) return {};
  v1::ControlReply reply;
  const auto bytes = message.bytes();
  if (!reply.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) || !reply.ok()) {
    return fail("the demo's own play command was refused: " + reply.error());
  }
  return {};
}

std::string DemoHand::note() const {
  if (frames_ == 0) return "hand: waiting";
  if (last_.source() == v1::SOURCE_LABELS) {
    return fmt::format("hand: performs {} (1, 3 and 4 are not in its training data): {}",
                       joined(kLabels), clean_name(last_.label()));
  }
  const std::string label = last_.label().empty()
                                ? "no gesture that it knows"
                                : fmt::format("{} ({:.0f} %)", clean_name(last_.label()),
                                              100.0F * last_.label_probability());
  return fmt::format("hand: a live signer's, smoothed {} frame behind: {}", last_.lag_frames(),
                     label);
}

std::string DemoHand::summary() const {
  if (frames_ == 0) return {};
  return fmt::format("received {} hand frames, {} of them performed from labels: {}", frames_,
                     performed_frames_, performed_.empty() ? "none" : joined(performed_));
}

}  // namespace posed::tools
