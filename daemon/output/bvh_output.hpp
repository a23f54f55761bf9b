// BvhOutput: sends one person over TCP to every program that connects, as the text stream of Axis
// Neuron, in which each line is a frame of a BVH.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/output/axis_figure.hpp"
#include "daemon/output/line_clients.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/rate_limit.hpp"

namespace posed::output {

class BvhOutput final : public Output {
 public:
  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  BvhOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
            LineClients clients);

  [[nodiscard]] std::int64_t turn(std::int64_t now_ns) override;
  [[nodiscard]] const std::string& endpoint() const noexcept { return clients_.endpoint(); }

 private:
  void update_stream(const std::shared_ptr<const PartStream>& stream);
  void send(const Frame& frame, std::int64_t now_ns);

  bool header_;
  RateLimit limit_;
  LineClients clients_;
  std::shared_ptr<const PartStream> known_;
  std::unique_ptr<AxisFigure> figure_;  // null without a stream, or if its skeleton is no person
  std::int64_t look_ns_ = kNoTime_ns;   // when to look for clients next
};

}  // namespace posed::output
