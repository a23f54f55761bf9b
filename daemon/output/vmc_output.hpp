// VmcOutput: sends one avatar to programs of the VMC protocol, as OSC over UDP. Each frame has
// root, bones, blend shapes, status and time, in bundles that fit a network packet.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "daemon/output/avatar.hpp"
#include "daemon/output/blend_shapes.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/udp_receivers.hpp"
#include "drivers/vmc/messages.hpp"

namespace posed::output {

class VmcOutput final : public Output {
 public:
  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  VmcOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
            std::shared_ptr<const Skeleton> figure, UdpReceivers receivers);

 private:
  [[nodiscard]] Result<> set_stream(std::size_t place, const LiveStream* stream) override;
  void begin_turn(std::int64_t now_ns) override;
  [[nodiscard]] bool take(std::size_t place, const Frame& frame, std::int64_t now_ns) override;
  void send(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t end_turn(std::int64_t now_ns) override;
  // Whether frames of this part trigger sending. Those of the body do; while it has none, those of
  // the left hand do, then those of the right hand.
  [[nodiscard]] bool leads(Part part, std::int64_t now_ns) const noexcept;

  bool assistant_;
  Avatar avatar_;
  BlendShapes shapes_;
  UdpReceivers receivers_;
  std::unique_ptr<drivers::vmc::DatagramWriter> writer_;
  std::array<std::int64_t, kParts> measured_ns_;  // [part] when its last measured frame came
  Quality quality_ = Quality::kMeasured;          // of the frame that makes it send
  std::int64_t begin_ns_ = kNoTime_ns;            // the zero of the time that is sent
};

}  // namespace posed::output
