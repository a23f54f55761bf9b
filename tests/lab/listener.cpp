#include "tests/lab/listener.hpp"

#include <cmath>
#include <cstdio>
#include <optional>

#include "daemon/control/zmq_handle.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/lab/gadget.hpp"

namespace posed::lab {
namespace {

constexpr int kLookAround_ms = 50;
constexpr int kFewestSensors = 4;  // of a line whose beginning was cut off by opening the port

// The value that all valid raw sensors share; nothing when they differ or are too few.
std::optional<std::uint32_t> common_value(const v1::Sample& sample) {
  std::optional<float> common;
  int sensors = 0;
  for (int i = 0; i < sample.value_size(); ++i) {
    const bool valid = sample.validity().at(static_cast<std::size_t>(i)) != 0;
    if (!valid || !sample.name(i).starts_with("raw_")) continue;
    if (common && *common != sample.value(i)) return {};
    common = sample.value(i);
    ++sensors;
  }
  if (!common || sensors < kFewestSensors) return {};
  return static_cast<std::uint32_t>(std::lround(*common));
}

}  // namespace

Listener::Listener(const std::string& endpoint, std::map<std::string, std::uint32_t> modulus) {
  for (const auto& [stream, n] : modulus) states_[stream].modulus = n;
  thread_ = std::jthread([this, endpoint](const std::stop_token& stop) { listen(stop, endpoint); });
}

Heard Listener::heard(const std::string& stream) const {
  const std::lock_guard lock(mutex_);
  return states_.at(stream).heard;
}

void Listener::new_session(const std::string& stream) {
  const std::lock_guard lock(mutex_);
  states_.at(stream).follows = false;
}

void Listener::listen(const std::stop_token& stop, const std::string& endpoint) {
  const auto context = control::open_context();
  if (!context) give_up(context.error().message);
  const auto socket = control::open_socket(context->get(), ZMQ_SUB);
  if (!socket) give_up(socket.error().message);
  void* const from = socket->get();
  if (!control::set_option(from, ZMQ_SUBSCRIBE, "sensor/") ||
      !control::set_option(from, ZMQ_RCVTIMEO, kLookAround_ms) ||
      !control::connect_socket(from, endpoint)) {
    give_up("cannot listen to the daemon");
  }
  while (!stop.stop_requested()) {
    control::Message topic, body;
    if (!topic.receive(from, 0) || !topic.more() || !body.receive(from, 0)) continue;
    take(body.text());
  }
}

void Listener::take(std::string_view bytes) {
  v1::Sample sample;
  if (!sample.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    give_up("a sample that is no message");
  }
  const std::lock_guard lock(mutex_);
  State& state = states_.at(sample.stream());
  if (state.sequence != 0 && sample.sequence() > state.sequence + 1) ++state.heard.gaps;
  if (sample.sequence() == state.sequence) return;  // told once more while it is stale
  state.sequence = sample.sequence();
  ++state.heard.samples;
  state.heard.last_ns = sample.arrival_ns();
  const auto value = common_value(sample);
  if (!value) {
    ++state.heard.mixed;
    return;
  }
  if (state.follows && *value != (state.value + 1) % state.modulus) {
    ++state.heard.skipped;
    std::printf("     %s: after report %u came %u, sample %llu\n", sample.stream().c_str(),
                state.value, *value, static_cast<unsigned long long>(sample.sequence()));
  }
  state.value = *value;
  state.follows = true;
}

}  // namespace posed::lab
