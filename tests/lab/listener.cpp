#include "tests/lab/listener.hpp"

#include <algorithm>
#include <cmath>

#include "posed/v1/posed.pb.h"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/lab/gadget.hpp"

namespace posed::lab {
namespace {

constexpr int kLookAround_ms = 50;
constexpr std::string_view kSamples = "sensor/", kEvents = "event/";
constexpr int kMinSensors =
    4;  // fewest sensors of a line whose beginning was cut off when the port was opened

// The common value of all valid raw sensors; empty when they differ or are too few.
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
  if (!common || sensors < kMinSensors) return {};
  return static_cast<std::uint32_t>(std::lround(*common));
}

Moment moment(std::int64_t monotonic_ns) { return Moment(std::chrono::nanoseconds(monotonic_ns)); }

}  // namespace

Listener::Listener(const std::string& endpoint)
    : thread_([this, endpoint](const std::stop_token& stop) { listen(stop, endpoint); }) {}

const Received& Listener::of(const std::string& stream) const {
  static const Received nothing;
  const auto at = received_.find(stream);
  return at == received_.end() ? nothing : at->second;
}

Received Listener::received(const std::string& stream) const {
  const std::lock_guard lock(mutex_);
  return of(stream);
}

std::size_t Listener::samples_since(const std::string& stream, Moment begin) const {
  const std::lock_guard lock(mutex_);
  const auto& samples = of(stream).samples;
  const auto first = std::ranges::lower_bound(samples, begin, {}, &ReceivedSample::arrived);
  return static_cast<std::size_t>(samples.end() - first);
}

bool Listener::lost_since(const std::string& stream, Moment begin) const {
  const std::lock_guard lock(mutex_);
  const auto& lost = of(stream).lost;
  return !lost.empty() && lost.back() >= begin;
}

void Listener::listen(const std::stop_token& stop, const std::string& endpoint) {
  const auto context = net::open_context();
  if (!context) give_up(context.error().message);
  const auto socket = net::open_socket(context->get(), ZMQ_SUB);
  if (!socket) give_up(socket.error().message);
  void* const from = socket->get();
  if (!net::set_option(from, ZMQ_SUBSCRIBE, kSamples) ||
      !net::set_option(from, ZMQ_SUBSCRIBE, kEvents) ||
      !net::set_option(from, ZMQ_RCVTIMEO, kLookAround_ms) ||
      !net::connect_socket(from, endpoint)) {
    give_up("cannot listen to the daemon");
  }
  while (!stop.stop_requested()) {
    net::Message topic, body;
    if (!topic.receive(from, 0) || !topic.more() || !body.receive(from, 0)) continue;
    topic.text().starts_with(kSamples) ? take_sample(body.text()) : take_event(body.text());
  }
}

void Listener::take_sample(std::string_view bytes) {
  v1::Sample sample;
  if (!sample.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    give_up("a sample that is no message");
  }
  const std::lock_guard lock(mutex_);
  auto& samples = received_[sample.stream()].samples;
  // A sample that is published again while its stream is stale is not a new one.
  if (!samples.empty() && samples.back().sequence == sample.sequence()) return;
  samples.push_back({.sequence = sample.sequence(),
                     .arrived = moment(sample.arrival_ns()),
                     .received = std::chrono::steady_clock::now(),
                     .value = common_value(sample)});
}

void Listener::take_event(std::string_view bytes) {
  v1::Event event;
  if (!event.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    give_up("an event that is no message");
  }
  const std::lock_guard lock(mutex_);
  Received& received = received_[event.stream()];
  if (event.kind() == v1::Event::KIND_FOUND) received.found.push_back(moment(event.time_ns()));
  if (event.kind() == v1::Event::KIND_LOST) received.lost.push_back(moment(event.time_ns()));
}

}  // namespace posed::lab
