// DatagramOutput: sends people to addresses, as a program does that only sends: MVN,
// mocopi, Rokoko Studio.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/output/datagram_encoder.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/udp_receivers.hpp"

namespace posed::output {

class DatagramOutput final : public Output {
 public:
  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  DatagramOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
                 std::unique_ptr<DatagramEncoder> encoder, UdpReceivers receivers);

 private:
  [[nodiscard]] Result<> set_stream(std::size_t place, const LiveStream* stream) override;
  void begin_turn(std::int64_t now_ns) override;
  [[nodiscard]] bool take(std::size_t place, const Frame& frame, std::int64_t now_ns) override;
  void send(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t end_turn(std::int64_t now_ns) override;

  std::size_t places_;
  std::unique_ptr<DatagramEncoder> encoder_;
  UdpReceivers receivers_;
  Datagrams datagrams_;  // of this turn
  std::int64_t described_ns_ = kNoTime_ns;
};

}  // namespace posed::output
