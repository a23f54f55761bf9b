// AxisOutput: sends people as Axis Neuron does, to every program that connects over TCP or to
// addresses over UDP: in binary, as the programs that are built on the vendor's SDK read it, or in
// text, in which each line is a frame of a BVH.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/output/axis_figure.hpp"
#include "daemon/output/line_clients.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/udp_receivers.hpp"

namespace posed::output {

class AxisOutput final : public Output {
 public:
  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  AxisOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
             std::optional<LineClients> clients, std::optional<UdpReceivers> receivers);

  // Only of one over TCP.
  [[nodiscard]] const std::string& endpoint() const noexcept { return clients_->endpoint(); }

 private:
  struct Person {
    std::unique_ptr<AxisFigure> figure;  // null without a stream, or if its skeleton is no person
    Frame frame{};
    bool waits = false;  // the frame, to be sent
  };
  [[nodiscard]] Result<> set_stream(std::size_t place, const LiveStream* stream) override;
  void begin_turn(std::int64_t now_ns) override;
  [[nodiscard]] bool take(std::size_t place, const Frame& frame, std::int64_t now_ns) override;
  void send(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t end_turn(std::int64_t now_ns) override;

  bool header_, binary_;
  std::optional<LineClients> clients_;     // over TCP
  std::optional<UdpReceivers> receivers_;  // over UDP
  std::vector<Person> people_;             // [place]
  std::vector<std::string> names_;         // [place]
  std::int64_t look_ns_ = kNoTime_ns;      // when to look for clients and news next
};

}  // namespace posed::output
