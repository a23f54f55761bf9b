// Emulates the template mocap system with two people: one walks, the other waves. Each describes
// itself by its own joints.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "drivers/template_mocap/protocol.hpp"

namespace posed::drivers::mocap {

class MocapEmulator final : public Emulator {
 public:
  explicit MocapEmulator(double rate_hz);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override;
  // Body 0 is the walker, 1 the waver. A posed body no longer moves by itself.
  void pose(std::size_t body, const Frame& frame) override;
  // Takes a request: the description is due at once.
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override;
  // A description at the start, every second and after a change; frames at their rate.
  void emit(std::int64_t now_ns, Bytes& out) override;

  // A person enters or leaves the room; from then on the description is without it.
  void set_present(std::size_t body, bool present);

 private:
  struct Person {
    BodyEntry entry;
    std::shared_ptr<const Skeleton> skeleton;
    BodyPose pose;
    bool present = true;
    bool posed = false;  // by pose()
  };
  void describe(Bytes& out) const;
  void move(double time_s);

  std::vector<Person> people_;
  emulate::Pace frames_, descriptions_;
  bool changed_ = false;  // since the last description, or one was asked for
  std::uint32_t number_ = 0;
};

}  // namespace posed::drivers::mocap
