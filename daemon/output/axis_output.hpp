// AxisOutput: sends people as Axis Neuron does, to every program that connects over TCP or to
// addresses over UDP: in binary, as the programs that are built on the vendor's SDK read it, or in
// text, in which each line is a frame of a BVH.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/output/fit.hpp"
#include "daemon/output/line_clients.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/udp_receivers.hpp"
#include "drivers/axis/bones.hpp"
#include "drivers/axis/pose_message.hpp"
#include "drivers/axis/protocol.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::output {

// Poses of any person in the forms in which Axis Neuron sends them (binary, or text: the line of a
// BVH; drivers/axis/protocol.hpp), and the BVH header that describes the figure. One thread.
class AxisFigure {
 public:
  // Makes the figure of a person (Fit::make) whose avatar has this number and name. Cold.
  static Result<AxisFigure> make(const std::shared_ptr<const Skeleton>& skeleton,
                                 std::uint8_t number, std::string_view name);

  // Returns a frame of the skeleton as "0 ann 0.000000 92.1... ||\n", valid until the next call. A
  // joint that was not measured keeps its rotation of the T-pose relative to its parent.
  [[nodiscard]] std::string_view line(const Frame& frame) noexcept;

  // Returns it as the bytes of a binary message, in the same way.
  [[nodiscard]] std::string_view message(const Frame& frame) noexcept;

  // Returns the HIERARCHY of a BVH whose channels are the values of a line.
  [[nodiscard]] std::string hierarchy() const;

 private:
  void fill(const Frame& frame) noexcept;
  AxisFigure(Fit fit, const drivers::axis::Proportions& offset_cm)
      : fit_(std::move(fit)), offset_cm_(offset_cm) {}

  Fit fit_;
  drivers::axis::Proportions offset_cm_;
  drivers::axis::LastPose last_{};
  drivers::axis::Message message_;
  std::vector<drivers::axis::ShortText> known_;  // what the last line said
  std::array<char, drivers::axis::kMaxText + 1> text_{};
};

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
  Datagrams datagrams_;                    // to receivers_ at the end of this turn
  std::vector<Person> people_;             // [place]
  std::vector<std::string> names_;         // [place]
  std::int64_t look_ns_ = kNoTime_ns;      // when to look for clients and news next
};

}  // namespace posed::output
