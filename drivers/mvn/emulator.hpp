// Emulates MVN with two characters: one walks and has gloves, the other waves and has none.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "drivers/mvn/layout.hpp"
#include "drivers/mvn/protocol.hpp"

namespace posed::drivers::mvn {

class MvnEmulator final : public Emulator {
 public:
  struct Settings {
    double rate_hz = 60.0;
    std::vector<Type> types;     // of each sample, in this order; at least one pose
    std::size_t characters = 2;  // 1 or 2
    std::size_t longest = 1472;  // bytes; a longer sample is split
  };
  explicit MvnEmulator(Settings settings);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override;
  // Body 0 walks, 1 waves. A posed body no longer moves by itself.
  void pose(std::size_t body, const Frame& frame) override;
  // MVN takes nothing from its host.
  [[nodiscard]] std::int64_t next_due_ns() const override;
  // The next datagram. Types 12 and 13 come at the start and every second.
  void emit(std::int64_t now_ns, Bytes& out) override;

  // A character enters or leaves.
  void set_present(std::size_t body, bool present) { people_.at(body).present = present; }

 private:
  struct Person {
    Character character;
    std::shared_ptr<const Skeleton> skeleton;
    Vec3f root_m{};
    std::array<Quatf, kSegments> rotation_xyzw{};  // [segment], from the parent; zero: not seen
    bool present = true;
    bool posed = false;  // by pose()
  };
  void fill_queue(std::int64_t now_ns);
  void move(std::size_t body, double time_s);
  void add_sample(const Person& person, Type type, std::int64_t time_ns);

  Settings settings_;
  std::vector<Person> people_;
  emulate::Pace samples_;
  std::int64_t reported_ns_ = kNoTime_ns;  // when types 12 and 13 were last sent
  std::int64_t queued_ns_ = 0;             // when the datagrams that wait were due
  std::deque<Bytes> queue_;
  std::uint32_t sample_ = 0;
};

// The two people as they stand in T-pose. Cold.
[[nodiscard]] Character emulated_walker();
[[nodiscard]] Character emulated_waver();

}  // namespace posed::drivers::mvn
