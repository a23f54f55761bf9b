#include "daemon/output/output.hpp"

#include <spdlog/spdlog.h>

#include "daemon/output/axis_output.hpp"
#include "daemon/output/vmc_output.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::output {

Output::Output(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake)
    : name_(config.name),
      kind_(config::kind_name(config.kind)),
      wake_(std::move(wake)),
      inbox_({config.body, config.left_hand, config.right_hand}, *wake_) {}

void Output::fill(v1::OutputStats& stats) const {
  stats.set_name(name_);
  stats.set_kind(kind_);
  stats.set_receivers(receivers_now_.load());
  stats.set_frames(inbox_.frames());
  stats.set_sent(sent_.load());
  stats.set_dropped(inbox_.dropped() + dropped_.load());
  stats.set_failures(failures_.load());
}

const Delivery& Output::receive() {
  inbox_.drain(delivery_);
  return delivery_;
}

void Output::count(const SendOutcome& outcome) noexcept {
  sent_ += outcome.sent;
  dropped_ += outcome.dropped;
  failures_ += outcome.failed;
}

void Output::notify(const std::string& text) const {
  std::optional<std::uint32_t> concerned;
  for (const auto& stream : streams()) {
    if (stream != nullptr && !concerned) concerned = stream->id;
  }
  const std::string sentence = "output " + name_ + ": " + text;
  if (notify_) return notify_(concerned, sentence);
  spdlog::warn("{}", sentence);
}

Result<std::unique_ptr<Output>> open_output(const config::OutputConfig& config) {
  auto wake = TRY(system::EventFd::open());
  auto opened = config.kind == config::OutputKind::kVmc ? VmcOutput::open(config, std::move(wake))
                                                        : AxisOutput::open(config, std::move(wake));
  if (!opened) return fail("output " + config.name + ": " + opened.error().message);
  return opened;
}

}  // namespace posed::output
