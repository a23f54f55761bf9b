#include "models/natural/figures.hpp"

#include <limits>
#include <span>
#include <string>

#include "models/feet/foot_score.hpp"
#include "proto/frame/degree.hpp"

namespace posed::natural {
namespace {

constexpr double kCentimetres = 100.0;  // of a metre
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::optional<double> in_cm(const std::optional<double>& metres) {
  return metres ? std::optional(kCentimetres * *metres) : std::nullopt;
}

std::optional<double> there(double number) {
  return number == number ? std::optional(number) : std::nullopt;  // not NaN
}

}  // namespace

Result<Figures> figures_of(const motion::Rows& angles_deg, double rate_hz) {
  Figures figures;
  figures.windows = motion::window_sums(angles_deg);
  if (motion::most_dimensions(figures.windows.count) < 1) {
    return fail("is too short: it has " + std::to_string(angles_deg.rows()) +
                " frames at this rate, and 49 are needed");
  }
  figures.jerk = motion::jerk_rms(angles_deg);
  const Eigen::VectorXd speed = motion::speed_of(angles_deg, rate_hz);
  figures.sparc =
      motion::spectral_arc_length(std::span(speed.data(), speed.data() + speed.size()), rate_hz);
  figures.low_deg = angles_deg.colwise().minCoeff().transpose();
  figures.high_deg = angles_deg.colwise().maxCoeff().transpose();
  return figures;
}

Result<Figures> figures_of(const motion::Motion& motion, const motion::PoseSpaceSpec& spec) {
  const auto space = motion::PoseSpace::bind(spec, *motion.skeleton);
  if (!space) return fail("its skeleton lacks joints of the clip");
  const motion::Rows angles_deg =
      motion::pose_vectors(motion, *space, motion::walk_heading_rad(motion)) / kDegree;
  auto figures = TRY(figures_of(angles_deg, motion.rate_hz));
  // The root turns against the world, which no joint limits.
  for (int d = 0; d < space->dims(); ++d) {
    if (space->joint_of_dim(d) == spec.root) figures.low_deg[d] = figures.high_deg[d] = 0.0;
  }
  figures.slide_cm_s = in_cm(feet::slide_m_s(motion, motion));
  figures.sink_cm = in_cm(feet::below_standing_m(motion));
  return figures;
}

void write(const Figures& figures, NumberWriter& numbers) {
  numbers.add(figures.jerk).add(figures.sparc);
  numbers.add(figures.windows.count).add(figures.windows.first).add(figures.windows.second);
  numbers.add(figures.low_deg).add(figures.high_deg);
  numbers.add(figures.slide_cm_s.value_or(kNone)).add(figures.sink_cm.value_or(kNone));
}

Figures figures_from(NumberReader& numbers) {
  Figures figures;
  figures.jerk = numbers.number();
  figures.sparc = numbers.number();
  figures.windows.count = numbers.number();
  figures.windows.first = numbers.vector();
  figures.windows.second = numbers.matrix();
  figures.low_deg = numbers.vector();
  figures.high_deg = numbers.vector();
  figures.slide_cm_s = there(numbers.number());
  figures.sink_cm = there(numbers.number());
  return figures;
}

}  // namespace posed::natural
