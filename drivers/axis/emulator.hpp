// Emulates Axis Neuron or Axis Studio with two avatars: one walks, the other, who is smaller,
// waves.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/axis/description.hpp"
#include "drivers/axis/pose_message.hpp"
#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"

namespace posed::drivers::axis {

struct EmulatorSettings {
  Form form = Form::kBinary;
  Content content{.displacement = true, .reference = false};
  std::uint8_t order = 0;  // of the rotations, an index of kOrderNames
  double rate_hz = 60.0;
  // 0: a record holds the messages of both avatars, as over TCP. Otherwise a record is a datagram:
  // one message, or a piece of it with at most so many bytes.
  std::size_t split_bytes = 0;
  std::optional<Figure> figure{};  // nullopt: Axis Neuron's
};

class AxisEmulator final : public Emulator {
 public:
  explicit AxisEmulator(const EmulatorSettings& settings);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override;
  // Body 0 walks, 1 waves. A posed body no longer moves by itself.
  void pose(std::size_t body, const Frame& frame) override;
  // The application takes nothing.
  [[nodiscard]] std::int64_t next_due_ns() const override { return frames_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override;

  // An avatar appears in the stream or disappears; its proportions become others.
  void set_present(std::size_t body, bool present) { people_[body].present = present; }
  void set_scale(std::size_t body, float scale);

 private:
  struct Person {
    AvatarEntry entry;
    std::shared_ptr<const Skeleton> skeleton;
    Vec3f root_m{};
    std::array<Quatf, kBones + 1> rotation_xyzw{};  // [joint of the skeleton]
    LastPose last{};
    Message message;
    bool present = true;
    bool posed = false;  // by pose()
  };
  void move(double time_s);
  void encode(const Person& person, Bytes& out) const;

  EmulatorSettings settings_;
  std::vector<Person> people_;
  emulate::Pace frames_;
  Bytes waiting_;                   // the rest of a frame that goes out in pieces
  std::vector<std::size_t> piece_;  // their lengths, the next one last
  std::uint32_t number_ = 0;
};

}  // namespace posed::drivers::axis
