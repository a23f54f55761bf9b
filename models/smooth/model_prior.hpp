// ModelPrior: the terms of position and motion that a gesture model adds to the live window
// (models/smooth/README.md, "Model prior"). Measured channels get a robust pull towards the poses
// that the model considers probable; its weight vanishes for a pose that is far from them. In gaps,
// but for the newest frame, the gestures' own motion takes the place of the adaptive one, the more
// the better the window's measured frames fit the model. RT-safe except for construction; one
// thread.
#pragma once

#include <array>

#include "models/smooth/adaptive_window.hpp"
#include "models/smooth/hmm_forward_filter.hpp"

namespace posed::smooth {

class ModelPrior final : public InformationSource {
 public:
  // For models of at most `max_channels` channels; channel c of the model is column c of the
  // window. `filter` outlives this, and has a model and has swept the window when add() is called.
  ModelPrior(const HmmForwardFilter& filter, int max_channels);

  void add(AdaptiveWindow& window) noexcept override;

 private:
  // The model's Gaussian for one frame, at the stream's rate, and the distance of each group (a
  // finger, an arm) from it: the mean of the normalised squared distances.
  struct Belief {
    LiveRows mean, variance;
    std::array<double, gesture::kMaxGroups> distance2{};
  };

  [[nodiscard]] bool believe(int back, bool moving) noexcept;
  void measure_distance(const AdaptiveWindow& window, int back) noexcept;
  void measure_fit(const AdaptiveWindow& window) noexcept;
  void pull(AdaptiveWindow& window, int back) noexcept;
  void bridge(AdaptiveWindow& window, int back, std::size_t c) noexcept;

  const HmmForwardFilter& filter_;
  double some_ = 1.0;  // the probability that the frame shows one of the model's gestures
  Belief belief_;
  // How well each group fits over the window's measured frames, from 0 (unlike the model) to 1.
  std::array<double, gesture::kMaxGroups> fit_{};
};

}  // namespace posed::smooth
