// Emulates a daemon that publishes one person, who waves until somebody poses them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "drivers/chain/protocol.hpp"
#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "proto/message/frame_message.hpp"

namespace posed::drivers::chain {

class UpstreamEmulator final : public Emulator {
 public:
  explicit UpstreamEmulator(const UpstreamInfo& info);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override {
    return body == 0 ? &skeleton_ : nullptr;
  }
  void pose(std::size_t body, const Frame& frame) override;
  [[nodiscard]] std::int64_t next_due_ns() const override {
    return std::min(frames_.due_ns(), skeletons_.due_ns());
  }
  // The skeleton at the start and every second; frames at their rate.
  void emit(std::int64_t now_ns, Bytes& out) override;

 private:
  UpstreamInfo info_;
  Skeleton skeleton_;
  Frame pose_;
  message::FrameEncoder encoder_;
  emulate::Pace frames_, skeletons_;
  bool posed_ = false;
};

}  // namespace posed::drivers::chain
