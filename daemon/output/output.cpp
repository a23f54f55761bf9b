#include "daemon/output/output.hpp"

#include <algorithm>

#include <spdlog/fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "daemon/output/axis_output.hpp"
#include "daemon/output/datagram_output.hpp"
#include "daemon/output/natnet_output.hpp"
#include "daemon/output/ros2/ros2_output.hpp"
#include "daemon/output/vmc_output.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/text/clean.hpp"

namespace posed::output {
namespace {

std::vector<std::string> streams_of(const config::OutputConfig& config) {
  if (!config.bodies.empty()) return config.bodies;
  return {config.body, config.left_hand, config.right_hand};
}

std::string address_of(const config::OutputConfig& config) {
  if (config.kind == config::OutputKind::kRos2) {
    return fmt::format("domain {} on {}", config.domain, config.interface);
  }
  if (!config.to.empty()) return fmt::format("{}", fmt::join(config.to, ", "));
  return config.group.empty() ? config.listen : fmt::format("{}, {}", config.listen, config.group);
}

Result<std::unique_ptr<Output>> open_kind(const config::OutputConfig& config,
                                          std::unique_ptr<system::EventFd> wake) {
  switch (config.kind) {
    case config::OutputKind::kVmc:
      return VmcOutput::open(config, std::move(wake));
    case config::OutputKind::kBvh:
    case config::OutputKind::kAxis:
      return AxisOutput::open(config, std::move(wake));
    case config::OutputKind::kNatNet:
      return NatNetOutput::open(config, std::move(wake));
    case config::OutputKind::kRos2:
      return Ros2Output::open(config, std::move(wake));
    default:
      return DatagramOutput::open(config, std::move(wake));
  }
}

}  // namespace

Output::Output(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
               bool together)
    : name_(config.name),
      kind_(config::kind_name(config.kind)),
      address_(address_of(config)),
      wake_(std::move(wake)),
      inbox_(streams_of(config), *wake_),
      delivery_(streams_of(config).size()),
      limit_(config.rate_hz) {
  if (together) gathering_.emplace(config.people());
}

std::int64_t Output::turn(std::int64_t now_ns) {
  inbox_.drain(delivery_);
  update_streams();
  begin_turn(now_ns);
  pass_frames(now_ns);
  const std::int64_t due_ns = end_turn(now_ns);
  if (!gathering_ || gathering_->due_ns() == kNoTime_ns) return due_ns;
  return std::min(due_ns, gathering_->due_ns());
}

void Output::update_streams() {
  known_.resize(delivery_.streams.size());
  for (std::size_t place = 0; place < known_.size(); ++place) {
    const auto& stream = delivery_.streams[place];
    if (known_[place] == stream) continue;
    known_[place] = stream;
    if (gathering_) gathering_->leaves(place);
    const auto set = set_stream(place, stream.get());
    if (!set) notify({.text = "stream " + in_quotes(stream->name) + " " + set.error().message});
  }
}

// Without a limit every frame is sent; with one the newest of those that have come together.
void Output::pass_frames(std::int64_t now_ns) {
  bool newer = false;
  delivery_.for_each([&](std::size_t place, const Frame& frame) {
    if (!take(place, frame, now_ns)) return;
    if (gathering_ && !gathering_->comes(place, now_ns)) return;
    newer = true;
    if (!limit_.limits()) send(now_ns);
  });
  const bool late = gathering_ && gathering_->is_late(now_ns);
  if (late) gathering_->sent();
  if ((late || (limit_.limits() && newer)) && limit_.admit(now_ns)) send(now_ns);
}

void Output::fill(v1::OutputStats& stats) const {
  stats.set_name(name_);
  stats.set_kind(kind_);
  stats.set_address(address_);
  stats.set_receivers(receivers_now_.load());
  stats.set_frames(inbox_.frames());
  stats.set_sent(sent_.load());
  stats.set_dropped(inbox_.dropped() + dropped_.load());
  stats.set_failures(failures_.load());
}

void Output::count(const SendOutcome& outcome) noexcept {
  sent_ += outcome.sent;
  dropped_ += outcome.dropped;
  failures_ += outcome.failed;
}

void Output::notify(const News& news) const {
  std::optional<std::uint32_t> concerned;
  for (const auto& stream : delivery_.streams) {
    if (stream != nullptr && !concerned) concerned = stream->id;
  }
  const News told{.text = "output " + name_ + ": " + news.text, .good = news.good};
  if (notify_) return notify_(concerned, told);
  spdlog::warn("{}", told.text);
}

Result<std::unique_ptr<Output>> open_output(const config::OutputConfig& config) {
  auto wake = TRY(system::EventFd::open());
  auto opened = open_kind(config, std::move(wake));
  if (!opened) return fail("output " + config.name + ": " + opened.error().text());
  return opened;
}

}  // namespace posed::output
