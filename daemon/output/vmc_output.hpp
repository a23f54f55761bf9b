// VmcOutput: sends one avatar to programs of the VMC protocol, as OSC over UDP. Each frame has
// root, bones, blend shapes, status and time, in bundles that fit a network packet.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "daemon/output/avatar.hpp"
#include "daemon/output/blend_shapes.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/rate_limit.hpp"
#include "daemon/output/udp_receivers.hpp"
#include "drivers/vmc/messages.hpp"

namespace posed::output {

class VmcOutput final : public Output {
 public:
  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  VmcOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
            std::shared_ptr<const Skeleton> figure, UdpReceivers receivers);

  [[nodiscard]] std::int64_t turn(std::int64_t now_ns) override;

 private:
  void update_streams(const PartStreams& streams);
  // Puts the frame into the avatar. Returns whether the avatar is to be sent now.
  [[nodiscard]] bool accept(Part part, const Frame& frame, std::int64_t now_ns);
  // Whether frames of this part trigger sending. Those of the body do; while it has none, those of
  // the left hand do, then those of the right hand.
  [[nodiscard]] bool leads(Part part, std::int64_t now_ns) const noexcept;
  void send(const Frame& frame, std::int64_t now_ns);

  bool assistant_;
  Avatar avatar_;
  BlendShapes shapes_;
  RateLimit limit_;
  UdpReceivers receivers_;
  std::unique_ptr<drivers::vmc::DatagramWriter> writer_;
  PartStreams known_;                             // the streams that the avatar has
  std::array<std::int64_t, kParts> measured_ns_;  // [part] when its last measured frame came
  std::int64_t begin_ns_ = kNoTime_ns;            // the zero of the time that is sent
};

}  // namespace posed::output
