// ModelPrior: what a gesture model adds to the live window, and where it must keep silent. A
// robust pull towards the poses that it believes in, with so little weight that a hand which is
// elsewhere feels nothing; and, where the sensors are silent, how its gestures move, as far as the
// hand fitted them before the gap (models/smooth/README.md, "Model prior"). RT-safe but for
// construction.
#pragma once

#include <array>

#include "models/smooth/adaptive_window.hpp"
#include "models/smooth/hmm_forward_filter.hpp"

namespace posed::smooth {

class ModelPrior final : public WindowEvidence {
 public:
  explicit ModelPrior(const HmmForwardFilter& filter) : filter_(filter) {}

  void add(AdaptiveWindow& window) noexcept override;

 private:
  // Believed of one frame, at the stream's rate, and how far each finger is from it: the mean of
  // its normalised square distances.
  struct Belief {
    HandRows mean{}, variance{};
    std::array<double, kFingers> distance2{};
  };

  void believe(int back) noexcept;
  void measure_distance(const AdaptiveWindow& window, int back) noexcept;
  void measure_fit(const AdaptiveWindow& window) noexcept;
  void pull(AdaptiveWindow& window, int back, int channel) noexcept;
  void bridge(AdaptiveWindow& window, int back, int channel) noexcept;

  const HmmForwardFilter& filter_;
  Belief belief_;
  std::array<double, kFingers> fit_{};  // over the window's measured frames: 0 a stranger's, to 1
};

}  // namespace posed::smooth
