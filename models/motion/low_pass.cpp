#include "models/motion/low_pass.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace posed::motion {
namespace {

constexpr int kOrder = 4;
constexpr int kPadding = 3 * (kOrder + 1);  // frames, scipy's default for five coefficients

// One second-order section, transposed direct form II, gain 1 at frequency 0.
struct Section {
  double b0, b1, b2, a1, a2;

  void run(Eigen::Ref<Eigen::VectorXd> x) const {
    // The initial state for which a constant input of x[0] gives a constant output.
    double z1 = (1.0 - b0) * x[0];
    double z2 = (b2 - a2) * x[0];
    for (double& value : x) {
      const double y = b0 * value + z1;
      z1 = b1 * value - a1 * y + z2;
      z2 = b2 * value - a2 * y;
      value = y;
    }
  }
};

// The bilinear transform of the analogue Butterworth pole pairs, cutoff prewarped.
std::array<Section, kOrder / 2> butterworth(double cutoff) {
  const double w = std::tan(0.5 * std::numbers::pi * cutoff);
  std::array<Section, kOrder / 2> sections{};
  for (int k = 0; k < kOrder / 2; ++k) {
    const double damping = 2.0 * std::sin(std::numbers::pi * (2 * k + 1) / (2.0 * kOrder));
    const double a0 = 1.0 + damping * w + w * w;
    sections[k] = {w * w / a0, 2.0 * w * w / a0, w * w / a0, 2.0 * (w * w - 1.0) / a0,
                   (1.0 - damping * w + w * w) / a0};
  }
  return sections;
}

}  // namespace

Eigen::MatrixXd low_pass_zero_phase(const Eigen::MatrixXd& signal, double cutoff) {
  const auto frames = static_cast<int>(signal.rows());
  if (frames < 2) return signal;
  const auto sections = butterworth(cutoff);
  const int pad = std::min(kPadding, frames - 1);
  Eigen::MatrixXd filtered(frames, signal.cols());
  Eigen::VectorXd x(frames + 2 * pad);
  for (int c = 0; c < signal.cols(); ++c) {
    const auto column = signal.col(c);
    x.head(pad) = 2.0 * column[0] - column.segment(1, pad).reverse().array();
    x.segment(pad, frames) = column;
    x.tail(pad) =
        2.0 * column[frames - 1] - column.segment(frames - 1 - pad, pad).reverse().array();
    for (int pass = 0; pass < 2; ++pass) {
      for (const Section& section : sections) section.run(x);
      x.reverseInPlace();
    }
    filtered.col(c) = x.segment(pad, frames);
  }
  return filtered;
}

}  // namespace posed::motion
