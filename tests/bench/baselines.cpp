#include "tests/bench/baselines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <Eigen/QR>

namespace posed::bench {
namespace {

using clip::ChannelMatrix;

constexpr Eigen::Index kStart = 40;  // frames for filters to settle, not counted
constexpr Eigen::Index kEnd = 8;

template <typename... Values>
std::string text(const char* format, Values... values) {
  std::array<char, 96> line{};
  std::snprintf(line.data(), line.size(), format, values...);
  return line.data();
}

// Shifts estimates that were made `lag` frames late to the frames that they describe.
ChannelMatrix moved_back(const ChannelMatrix& made, const ChannelMatrix& measured, int lag) {
  ChannelMatrix moved = measured;
  moved.topRows(made.rows() - lag) = made.bottomRows(made.rows() - lag);
  return moved;
}

// Stores the best setting of one baseline.
class Best {
 public:
  Best(const std::string& name, std::span<const Trial> trials) : trials_(trials) {
    best_.name = name;
  }

  template <typename Filter>
  void consider(const std::string& setting, const Filter& filter) {
    double sum = 0.0;
    for (const Trial& trial : trials_) {
      const double rms = rms_deg(filter(trial), trial.truth);
      sum += rms * rms;
    }
    const double rms = std::sqrt(sum / static_cast<double>(trials_.size()));
    if (!best_.setting.empty() && rms >= best_.rms_deg) return;
    best_.setting = setting;
    best_.rms_deg = rms;
  }
  [[nodiscard]] const Tuned& best() const { return best_; }

 private:
  Tuned best_;
  std::span<const Trial> trials_;
};

Tuned best_polynomial(std::span<const Trial> trials, int lag, const std::string& name,
                      int max_order) {
  Best best(name, trials);
  for (const int window : {1, 2, 3, 4, 5, 6, 7, 9, 11, 13, 15, 19, 23, 29}) {
    for (int order = 0; order <= std::min(max_order, window - 1); ++order) {
      if (window <= lag) continue;
      best.consider(text("%d frames, order %d", window, order), [&](const Trial& trial) {
        return local_polynomial(trial.measured, lag, window, order);
      });
    }
  }
  return best.best();
}

Tuned best_one_euro(std::span<const Trial> trials, int lag) {
  Best best("One-Euro", trials);
  for (const double cutoff : {0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0}) {
    for (const double beta : {0.0, 0.003, 0.01, 0.02, 0.04, 0.06, 0.08, 0.11, 0.15, 0.25}) {
      for (const double speed_cutoff : {1.0, 3.0}) {
        if (beta == 0.0 && speed_cutoff > 1.0) continue;
        const OneEuro setting{cutoff, beta, speed_cutoff};
        best.consider(text("%.1f Hz, beta %.3f, %.0f Hz", cutoff, beta, speed_cutoff),
                      [&](const Trial& trial) {
                        return moved_back(one_euro(trial.measured, trial.rate_hz, setting),
                                          trial.measured, lag);
                      });
      }
    }
  }
  return best.best();
}

Tuned best_kalman(std::span<const Trial> trials, int lag, double noise_deg) {
  Best best("Kalman, constant velocity", trials);
  for (int step = -20; step <= 16; ++step) {
    const double q = std::pow(10.0, 0.25 * step);
    best.consider(text("q %.2g deg^2", q), [&](const Trial& trial) {
      return kalman_velocity(trial.measured, lag, q, noise_deg);
    });
  }
  return best.best();
}

}  // namespace

double rms_deg(const ChannelMatrix& estimate, const ChannelMatrix& truth) {
  const Eigen::Index frames = truth.rows() - kStart - kEnd;
  const ChannelMatrix error =
      estimate.middleRows(kStart, frames) - truth.middleRows(kStart, frames);
  return std::sqrt(error.array().square().mean());
}

ChannelMatrix local_polynomial(const ChannelMatrix& measured, int lag, int window, int order) {
  // Row i of the basis is frame i of the window, time is 0 at the frame to estimate.
  Eigen::MatrixXd basis(window, order + 1);
  for (int i = 0; i < window; ++i) {
    const double t = static_cast<double>(i - (window - 1 - lag)) / window;
    for (int k = 0; k <= order; ++k) basis(i, k) = std::pow(t, k);
  }
  const Eigen::VectorXd first = Eigen::VectorXd::Unit(order + 1, 0);
  const Eigen::VectorXd weights =
      basis * (basis.transpose() * basis).colPivHouseholderQr().solve(first);
  ChannelMatrix made = measured;
  for (Eigen::Index t = window - 1; t < measured.rows(); ++t) {
    made.row(t) = weights.transpose() * measured.middleRows(t - window + 1, window);
  }
  return moved_back(made, measured, lag);
}

// Casiez, Roussel and Vogel 2012; the derivative is taken against the last filtered value, as in
// their code.
ChannelMatrix one_euro(const ChannelMatrix& measured, double rate_hz, const OneEuro& setting) {
  const auto gain = [rate_hz](double cutoff_hz) {
    return 1.0 / (1.0 + rate_hz / (2.0 * std::numbers::pi * cutoff_hz));
  };
  const double speed_gain = gain(setting.speed_cutoff_hz);
  ChannelMatrix made = measured;
  Eigen::RowVectorXd speed = Eigen::RowVectorXd::Zero(measured.cols());
  for (Eigen::Index t = 1; t < measured.rows(); ++t) {
    for (Eigen::Index c = 0; c < measured.cols(); ++c) {
      const double step = measured(t, c) - made(t - 1, c);
      speed[c] += speed_gain * (step * rate_hz - speed[c]);
      made(t, c) =
          made(t - 1, c) + gain(setting.cutoff_hz + setting.beta * std::abs(speed[c])) * step;
    }
  }
  return made;
}

ChannelMatrix kalman_velocity(const ChannelMatrix& measured, int lag, double q, double noise_deg) {
  // State: position, velocity [deg/frame], and the positions of the last `lag` frames.
  const int size = 2 + lag;
  Eigen::MatrixXd F = Eigen::MatrixXd::Zero(size, size);
  F(0, 0) = F(0, 1) = F(1, 1) = 1.0;
  for (int i = 2; i < size; ++i) F(i, i == 2 ? 0 : i - 1) = 1.0;
  Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
  g[0] = 0.5;
  g[1] = 1.0;
  const double R = noise_deg * noise_deg;
  const Eigen::MatrixXd Q = q * g * g.transpose();
  Eigen::MatrixXd P = R * Eigen::MatrixXd::Identity(size, size);
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(size, measured.cols());
  for (int i = 0; i < size; ++i) {
    if (i != 1) x.row(i) = measured.row(0);
  }
  ChannelMatrix made = measured;
  for (Eigen::Index t = 1; t < measured.rows(); ++t) {
    x = F * x;
    P = F * P * F.transpose() + Q;
    const Eigen::VectorXd gain = P.col(0) / (P(0, 0) + R);
    const Eigen::RowVectorXd innovation = measured.row(t) - x.row(0);
    x += gain * innovation;
    P -= gain * P.row(0).eval();
    made.row(t) = x.row(lag == 0 ? 0 : 1 + lag);
  }
  return moved_back(made, measured, lag);
}

std::vector<Tuned> tuned_baselines(std::span<const Trial> trials, int lag, double noise_deg) {
  return {best_polynomial(trials, lag, "moving average", 0),
          best_polynomial(trials, lag, "local polynomial", 3), best_one_euro(trials, lag),
          best_kalman(trials, lag, noise_deg)};
}

}  // namespace posed::bench
