// Emulates Motive with a person who walks in a circle and a wand that turns. It answers on the
// host's command socket (0) and streams to its data socket (1), as over multicast to all.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "drivers/natnet/decoder.hpp"
#include "drivers/natnet/encode.hpp"
#include "drivers/natnet/layout.hpp"

namespace posed::drivers::natnet {

class NatNetEmulator final : public Emulator {
 public:
  // An unknown version is 3.1, automatic coordinates are global.
  explicit NatNetEmulator(const Settings& settings);

  // Body 0 is the person, 1 the wand, then come those that were added, who stand until they are
  // posed. A posed body no longer moves by itself.
  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override;
  bool add_person() override;
  void pose(std::size_t body, const Frame& frame) override;
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override { return frames_.due_ns(); }
  [[nodiscard]] std::uint8_t next_socket() const override { return described_ ? 1 : 0; }
  [[nodiscard]] std::vector<std::uint16_t> ports() const override { return {kCommandPort, 0}; }
  // First the bodies, as if asked for them, then frames at their rate.
  void emit(std::int64_t now_ns, Bytes& out) override;

  // The wand leaves the description and the frames, or comes back; the next frame says that the
  // bodies have changed.
  void set_wand(bool present);

 private:
  struct Pose {
    Vec3f root_m{};
    std::vector<Quatf> rotation_xyzw{};  // [joint], parent-relative
    std::vector<bool> valid{};
    bool posed = false;  // by pose()
  };

  // All bodies, in posed's axes.
  [[nodiscard]] ModelDef bodies() const;
  // Those that are there, in Motive's.
  [[nodiscard]] ModelDef model() const;
  void learn_bodies();
  void move(double time_s);
  [[nodiscard]] SkeletonPacket person(std::size_t body) const;
  void add_wand(FramePacket& packet) const;

  Settings settings_;
  std::unique_ptr<const SourceLayout> layout_;
  std::vector<Pose> poses_;  // [body]
  emulate::Pace frames_;
  bool described_ = false;
  bool wand_ = true;
  bool changed_ = false;  // the bodies, since the last frame
  std::uint32_t number_ = 0;
};

}  // namespace posed::drivers::natnet
