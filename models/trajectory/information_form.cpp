#include "models/trajectory/information_form.hpp"

#include <algorithm>

namespace posed::trajectory {

InformationForm::InformationForm(int channels, int frames)
    : channels_(channels),
      frames_(frames),
      stride_(padded(channels)),
      data_(hwy::AllocateAligned<double>(static_cast<std::size_t>(frames) * kRows *
                                         static_cast<std::size_t>(stride_))) {
  for (int f = 0; f < frames; ++f) clear(f);
}

RT_SAFE void InformationForm::clear(int frame) noexcept {
  double* rows = row(frame, kPosition);
  std::fill_n(rows, kRows * stride_, 0.0);
  std::fill(rows + channels_, rows + stride_, 1.0);
}

}  // namespace posed::trajectory
