// Emulates the mocopi app with one person who waves until somebody poses them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "drivers/mocopi/decoder.hpp"

namespace posed::drivers::mocopi {

class MocopiEmulator final : public Emulator {
 public:
  explicit MocopiEmulator(double rate_hz);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override;
  // A joint that is not valid is sent as all zero.
  void pose(std::size_t body, const Frame& frame) override;
  [[nodiscard]] std::int64_t next_due_ns() const override {
    return std::min(frames_.due_ns(), skeletons_.due_ns());
  }
  // The skeleton at the start and every two seconds; frames at their rate.
  void emit(std::int64_t now_ns, Bytes& out) override;

 private:
  std::vector<BoneEntry> bones_;  // in T-pose
  std::vector<BoneEntry> pose_;
  std::unique_ptr<const SourceLayout> layout_;
  emulate::Pace frames_, skeletons_;
  std::uint32_t number_ = 0;
  bool posed_ = false;
};

}  // namespace posed::drivers::mocopi
