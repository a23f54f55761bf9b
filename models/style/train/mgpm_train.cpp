#include "models/style/train/mgpm_train.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include <Eigen/Cholesky>

#include "models/gp/lbfgs.hpp"
#include "models/motion/symmetric_eigen.hpp"
#include "models/style/train/harmonics.hpp"
#include "models/task_numbers.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kStageOneRounds = 2;
constexpr int kStageOneIterations = 60;
constexpr int kStageTwoRounds = 12;
constexpr int kStageTwoIterations = 50;
constexpr double kSettled = 1e-6;       // relative change between rounds
constexpr double kMaxLogKernel = 12.0;  // a trial step beyond it is refused

int harmonics_for(double log_gamma) { return std::exp(log_gamma) > 4.0 ? 12 : 10; }

// Standard normal numbers that are the same on every platform.
class Normal {
 public:
  explicit Normal(std::uint64_t seed) : bits_(seed) {}
  double operator()() {  // Box and Muller
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  double uniform() { return (static_cast<double>(bits_() >> 11U) + 0.5) * 0x1p-53; }
  std::mt19937_64 bits_;
};

// The scaling (xi, noise, w) -> (c xi, c^2 noise, c w) changes only the prior. This sets c to the
// prior's minimum, since the optimiser would approach it very slowly. The prior is convex in log c,
// so Newton steps of limited size converge.
void regauge(MgpmParams& p) {
  const MgpmParams start = p;
  double log_c = 0.0;
  for (int i = 0; i < 50; ++i) {
    const double xi2 = start.xi.squaredNorm() * std::exp(2.0 * log_c);
    const double z = (start.log_noise + 2.0 * log_c + 4.0) / 9.0;  // noise prior N(-4, 3^2)
    const double step = std::clamp(-(xi2 + 2.0 * z) / (2.0 * xi2 + 4.0 / 9.0), -1.0, 1.0);
    log_c += step;
    if (std::abs(step) < 1e-12) break;
  }
  p.xi = start.xi * std::exp(log_c);
  p.log_noise = start.log_noise + 2.0 * log_c;
}

// The optimiser's variables, all of order one. A clip's phase is taken at its centre and its rate
// is scaled by the clip's time spread, so that the two are uncorrelated.
class Variables {
 public:
  Variables(const MgpmData& data, const MgpmParams& start, bool phases_free)
      : start_(start), phases_free_(phases_free) {
    const int clips = data.clips();
    centre_.resize(clips);
    spread_.resize(clips);
    for (int m = 0; m < clips; ++m) {
      const double frames = data.clip_frames[m];
      centre_[m] = 0.5 * (frames - 1.0);
      spread_[m] = std::sqrt(std::max(1.0, (frames * frames - 1.0) / 12.0));
    }
    xi_unit_ =
        std::max(1e-6, std::sqrt(start.xi.squaredNorm() / static_cast<double>(start.xi.size())));
  }

  // The variables are xi, then theta0 (without that of the first clip, which fixes the common turn)
  // and the rates, then the two kernel parameters.
  [[nodiscard]] int size() const {
    return static_cast<int>(start_.xi.size()) + (phases_free_ ? 2 * clips() - 1 : 0) + 2;
  }

  [[nodiscard]] MgpmParams params(const VectorXd& z) const {
    MgpmParams p = start_;
    const auto styles = static_cast<int>(p.xi.size());
    p.xi.reshaped() += xi_unit_ * z.head(styles);
    if (phases_free_) {
      const VectorXd rate = z.segment(styles + clips() - 1, clips()).cwiseQuotient(spread_);
      p.dtheta += rate;
      p.theta0 -= rate.cwiseProduct(centre_);
      p.theta0.tail(clips() - 1) += z.segment(styles, clips() - 1);
    }
    p.log_gamma += z[z.size() - 2];
    p.log_noise += z[z.size() - 1];
    return p;
  }

  void gradient(const MgpmParams& of_params, VectorXd& z) const {
    const auto styles = static_cast<int>(of_params.xi.size());
    z.head(styles) = xi_unit_ * of_params.xi.reshaped();
    if (phases_free_) {
      z.segment(styles, clips() - 1) = of_params.theta0.tail(clips() - 1);
      z.segment(styles + clips() - 1, clips()) =
          (of_params.dtheta - centre_.cwiseProduct(of_params.theta0)).cwiseQuotient(spread_);
    }
    z[z.size() - 2] = of_params.log_gamma;
    z[z.size() - 1] = of_params.log_noise;
  }

 private:
  [[nodiscard]] int clips() const { return static_cast<int>(start_.theta0.size()); }

  MgpmParams start_;
  bool phases_free_;
  VectorXd centre_, spread_;
  double xi_unit_ = 1.0;
};

using Stop = std::function<bool()>;

void optimise(const MgpmData& data, bool phases_free, int iterations, const Stop& stop,
              MgpmFit& fit) {
  fit.harmonics = harmonics_for(fit.params.log_gamma);
  const Variables variables(data, fit.params, phases_free);
  const gp::Objective objective = [&](const VectorXd& z, VectorXd& gradient) {
    const MgpmParams p = variables.params(z);
    gradient.setZero();
    if (!(std::abs(p.log_gamma) < kMaxLogKernel) || !(std::abs(p.log_noise) < 2 * kMaxLogKernel)) {
      return std::numeric_limits<double>::infinity();
    }
    const MgpmValue value = mgpm_evaluate(data, p, &fit.prior, nullptr, fit.harmonics);
    variables.gradient(value.gradient, gradient);
    return value.nlp;
  };
  const gp::LbfgsResult found = gp::lbfgs_minimise(objective, VectorXd::Zero(variables.size()),
                                                   {.max_iterations = iterations, .stop = stop});
  fit.params = variables.params(found.x);
  fit.nlp = found.value;
  fit.evaluations += found.evaluations;
}

// Style points from the leading left singular vectors of the subjects' Fourier coefficients.
MatrixXd svd_styles(const MgpmData& data, const VectorXd& theta0, const VectorXd& dtheta, int q) {
  constexpr int kHarmonics = 4;
  constexpr double kRidge = 1e-2;
  const int width = 2 * kHarmonics + 1;
  const auto channels = static_cast<int>(data.y.cols());
  const VectorXd sd =
      (data.y.colwise().squaredNorm() / static_cast<double>(data.y.rows())).cwiseSqrt();
  MatrixXd gram = MatrixXd::Zero(width * data.subjects(), width);
  MatrixXd moments = MatrixXd::Zero(width * data.subjects(), channels);
  int first = 0;
  for (int m = 0; m < data.clips(); ++m) {
    const int frames = data.clip_frames[m];
    const MatrixXd z = harmonic_basis(clip_phase(theta0[m], dtheta[m], frames), kHarmonics);
    gram.middleRows(width * data.clip_subject[m], width) += z.transpose() * z;
    moments.middleRows(width * data.clip_subject[m], width) +=
        z.transpose() * data.y.middleRows(first, frames);
    first += frames;
  }
  MatrixXd stacked(data.subjects(), width * channels);
  for (int s = 0; s < data.subjects(); ++s) {
    MatrixXd a = gram.middleRows(s * width, width);
    a.diagonal().array() += kRidge;
    const MatrixXd c = (a.llt().solve(moments.middleRows(s * width, width)).array().rowwise() /
                        sd.transpose().array())
                           .matrix();
    stacked.row(s) = c.reshaped().transpose();
  }
  // The left singular vectors by their singular values, from the small matrix of inner products.
  const motion::SymmetricEigen eigen = motion::symmetric_eigen(stacked * stacked.transpose());
  const VectorXd singular_values = eigen.values.tail(q).cwiseMax(0.0).cwiseSqrt();
  const MatrixXd xi =
      (eigen.vectors.rightCols(q) * singular_values.asDiagonal()).rowwise().reverse();
  return xi / std::max(1e-9, std::sqrt(xi.squaredNorm() / static_cast<double>(xi.size())));
}

MatrixXd random_styles(int subjects, int q, std::uint64_t seed) {
  Normal normal(seed);
  MatrixXd xi(subjects, q);
  for (double& value : xi.reshaped()) value = normal();
  return xi;
}

// Optimises from one start, until `stop` says that nobody wants it any more.
void run_start(const MgpmData& data, const Stop& stop, MgpmFit& fit) {
  for (int round = 0; round < kStageOneRounds; ++round) {
    regauge(fit.params);
    optimise(data, false, kStageOneIterations, stop, fit);
  }
  double previous = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kStageTwoRounds; ++round) {
    regauge(fit.params);
    optimise(data, true, kStageTwoIterations, stop, fit);
    if (stop()) return;
    if (previous - fit.nlp < kSettled * std::abs(fit.nlp)) break;
    previous = fit.nlp;
  }
}

// What a start ends with, as a task's numbers and back.
TaskResult numbers_of(const MgpmFit& fit) {
  const MgpmParams& params = fit.params;
  return NumberWriter()
      .add(fit.nlp)
      .add(fit.harmonics)
      .add(fit.evaluations)
      .add(params.log_gamma)
      .add(params.log_noise)
      .add(params.theta0)
      .add(params.dtheta)
      .add(params.xi)
      .take();
}

void take_numbers(const TaskResult& numbers, MgpmFit& fit) {
  NumberReader reader(numbers);
  fit.nlp = reader.number();
  fit.harmonics = static_cast<int>(reader.index());
  fit.evaluations = static_cast<int>(reader.index());
  fit.params.log_gamma = reader.number();
  fit.params.log_noise = reader.number();
  fit.params.theta0 = reader.vector();
  fit.params.dtheta = reader.vector();
  fit.params.xi = reader.matrix();
}

}  // namespace

Result<std::vector<MgpmFit>> mgpm_train(const MgpmData& data, const VectorXd& theta0,
                                        const VectorXd& dtheta, const MgpmOptions& options) {
  const int q = std::min(options.style_dims, data.subjects());
  std::vector<MgpmFit> fits;
  for (std::size_t k = 0; k < options.starts.size(); ++k) {
    MgpmFit& fit = fits.emplace_back();
    fit.prior.dtheta_mean = dtheta;
    fit.params.theta0 = theta0;
    fit.params.dtheta = dtheta;
    fit.params.log_noise = std::log(0.05);
    fit.params.xi = options.starts[k] == MgpmStart::kSvd
                        ? svd_styles(data, theta0, dtheta, q)
                        : random_styles(data.subjects(), q, options.seed * 1'000'003 + k);
  }
  SerialTasks serial;
  TaskRunner& tasks = options.tasks != nullptr ? *options.tasks : serial;
  const Task task = [&](std::size_t k) {
    MgpmFit fit = fits[k];
    run_start(data, [&tasks] { return tasks.stopping(); }, fit);
    return numbers_of(fit);
  };
  const TaskProgress progress = [&](std::size_t done) {
    const double fraction = static_cast<double>(done) / static_cast<double>(fits.size());
    return !options.progress || options.progress(fraction);
  };
  const auto found = tasks.run(fits.size(), task, progress);
  if (!found) return training_stopped();
  for (std::size_t k = 0; k < fits.size(); ++k) {
    MgpmFit& fit = fits[k];
    take_numbers((*found)[k], fit);
    fit.scale = mgpm_evaluate(data, fit.params, &fit.prior, nullptr, fit.harmonics).scale;
  }
  std::stable_sort(fits.begin(), fits.end(),
                   [](const MgpmFit& a, const MgpmFit& b) { return a.nlp < b.nlp; });
  return fits;
}

}  // namespace posed::style
