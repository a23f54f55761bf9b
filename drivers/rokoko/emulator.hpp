// Emulates Rokoko Studio with two actors and a prop: Anna wears gloves and her face is captured,
// Ben has only a suit. They move by themselves until they are posed.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "drivers/rokoko/description.hpp"
#include "drivers/rokoko/encode.hpp"

namespace posed::drivers::rokoko {

enum class StudioVersion : std::uint8_t { k2, k25, k3 };

struct StudioEmulatorSettings {
  double rate_hz = 60.0;
  StudioVersion version = StudioVersion::k3;
  bool lz4 = true;
};

class StudioEmulator final : public Emulator {
 public:
  explicit StudioEmulator(const StudioEmulatorSettings& settings);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override;
  // Body 0 is Anna, 1 Ben, 2 the prop. A joint that is not valid is sent as all zero.
  void pose(std::size_t body, const Frame& frame) override;
  [[nodiscard]] std::int64_t next_due_ns() const override { return pace_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override;

  // Leaves this body out from now on.
  void set_present(std::size_t body, bool present) { bodies_[body].present = present; }
  // Stops capturing Anna's body, but not her hands, from now on (version 3).
  void set_gloves_only(bool gloves_only) { gloves_only_ = gloves_only; }
  // The timestamps begin again, as those of a recording that plays in a loop.
  void restart() { began_ns_ = pace_.due_ns(); }

 private:
  struct EmulatedBody {
    DescribedBody described;
    std::shared_ptr<const Skeleton> skeleton;
    Frame frame;  // of that skeleton
    bool present = true, posed = false;
  };
  void move(double time_s);
  void turn(std::size_t body, Bone bone, const Eigen::Quaterniond& canonical);
  [[nodiscard]] std::string frame_json(double time_s) const;
  [[nodiscard]] std::string actor_json(const EmulatedBody& body) const;
  [[nodiscard]] std::string joints_json(const EmulatedBody& body) const;
  [[nodiscard]] std::string face_json() const;

  StudioEmulatorSettings settings_;
  emulate::Pace pace_;
  std::array<EmulatedBody, 3> bodies_;
  std::int64_t began_ns_ = 0;
  double jaw_ = 0.0;  // how far Anna's is open, 0 to 100
  bool gloves_only_ = false;
  Lz4Writer lz4_writer_;
};

}  // namespace posed::drivers::rokoko
