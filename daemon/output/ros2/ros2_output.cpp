#include "daemon/output/ros2/ros2_output.hpp"

#include <utility>

#include <spdlog/spdlog.h>

namespace posed::output {

Result<std::unique_ptr<Output>> Ros2Output::open(const config::OutputConfig& config,
                                                 std::unique_ptr<system::EventFd> wake) {
  auto domain = TRY(DdsDomain::join(
      {.domain = config.domain, .interface = config.interface, .peers = config.peers}));
  if (config.interface != "lo") {
    spdlog::warn(
        "output {}: DDS on {} has neither keys nor rights: this computer and peers may read and"
        " send on every topic, and who reaches the network may forge their addresses",
        config.name, config.interface);
  }
  return std::make_unique<Ros2Output>(config, std::move(wake), std::move(domain));
}

Ros2Output::Ros2Output(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
                       std::shared_ptr<DdsDomain> domain)
    : Output(config, std::move(wake)),
      config_(config),
      domain_(std::move(domain)),
      streams_(config.people()) {}

Result<> Ros2Output::set_stream(std::size_t place, const LiveStream* stream) {
  auto& there = streams_[place];
  there.reset();
  if (stream == nullptr) return {};
  if (stream->skeleton == nullptr) return fail("cannot be sent: it has values, but no joints");
  there.emplace(config_, domain_, *stream);
  return {};
}

bool Ros2Output::take(std::size_t place, const Frame& frame, std::int64_t /*now_ns*/) {
  auto& stream = streams_[place];
  if (!stream) return false;
  const auto taken = stream->take(frame);
  if (taken) return *taken;
  notify("stream " + config_.bodies[place] + " " + taken.error().message);
  stream.reset();  // it is told once
  return false;
}

void Ros2Output::send(std::int64_t /*now_ns*/) {
  for (auto& stream : streams_) {
    if (stream) count(stream->send());
  }
}

std::int64_t Ros2Output::end_turn(std::int64_t now_ns) {
  if (look_ns_ != kNoTime_ns && now_ns < look_ns_) return look_ns_;
  std::size_t readers = 0;
  for (const auto& stream : streams_) readers += stream ? stream->readers() : 0;
  set_receivers(readers);
  look_ns_ = now_ns + kNanosPerSecond;
  return look_ns_;
}

}  // namespace posed::output
