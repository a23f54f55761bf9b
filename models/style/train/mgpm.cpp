#include "models/style/train/mgpm.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Cholesky>

#include "models/gp/lbfgs.hpp"
#include "models/motion/symmetric_eigen.hpp"
#include "models/style/model/harmonics.hpp"
#include "models/task_numbers.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLogGammaSd = 1.5;
constexpr double kLogNoiseMean = -4.0;
constexpr double kLogNoiseSd = 3.0;

// phi(theta) = [a_0, a_n cos n theta, a_n sin n theta] and its derivatives, a row per frame.
struct Basis {
  MatrixXd value, d_theta, d_gamma;
};

Basis basis_at(const VectorXd& theta, const CircularKernel& kernel) {
  const auto harmonics = static_cast<int>(kernel.a.size()) - 1;
  Basis basis;
  for (MatrixXd* m : {&basis.value, &basis.d_theta, &basis.d_gamma}) {
    m->resize(theta.size(), 2 * harmonics + 1);
  }
  basis.value.col(0).setConstant(kernel.a[0]);
  basis.d_theta.col(0).setZero();
  basis.d_gamma.col(0).setConstant(kernel.da[0]);
  for (int n = 1; n <= harmonics; ++n) {
    const Eigen::ArrayXd c = (n * theta.array()).cos();
    const Eigen::ArrayXd s = (n * theta.array()).sin();
    basis.value.col(n) = kernel.a[n] * c;
    basis.value.col(harmonics + n) = kernel.a[n] * s;
    basis.d_theta.col(n) = -n * kernel.a[n] * s;
    basis.d_theta.col(harmonics + n) = n * kernel.a[n] * c;
    basis.d_gamma.col(n) = kernel.da[n] * c;
    basis.d_gamma.col(harmonics + n) = kernel.da[n] * s;
  }
  return basis;
}

// One clip's part of the sums. The style point is constant within a clip, so all products with Phi
// = xi (x) phi reduce to products with the clip's phi alone: 2H+1 columns instead of q (2H+1).
struct ClipBlock {
  int first = 0, frames = 0, subject = 0;
  VectorXd time;  // 0, 1, 2, ...
  Basis basis;
  MatrixXd gram;     // phi' phi
  MatrixXd moments;  // phi' y
};

std::vector<ClipBlock> clip_blocks(const MgpmData& data, const MgpmParams& p,
                                   const CircularKernel& kernel) {
  std::vector<ClipBlock> blocks(data.clip_frames.size());
  int first = 0;
  for (int m = 0; m < data.clips(); ++m) {
    ClipBlock& b = blocks[m];
    b.first = first;
    b.frames = data.clip_frames[m];
    b.subject = data.clip_subject[m];
    b.time = VectorXd::LinSpaced(b.frames, 0.0, b.frames - 1.0);
    b.basis = basis_at((p.theta0[m] + p.dtheta[m] * b.time.array()).matrix(), kernel);
    b.gram.noalias() = b.basis.value.transpose() * b.basis.value;
    b.moments.noalias() = b.basis.value.transpose() * data.y.middleRows(first, b.frames);
    first += b.frames;
  }
  return blocks;
}

// A = Phi' Phi + noise I and Phi' Y, factorised and solved.
struct Solved {
  Eigen::LLT<MatrixXd> llt;
  MatrixXd weights;  // M = A^-1 Phi' Y  [P x D]
};

Solved solve(const std::vector<ClipBlock>& blocks, const MgpmParams& p, int width, int channels) {
  const auto q = static_cast<int>(p.xi.cols());
  MatrixXd a = MatrixXd::Zero(q * width, q * width);
  MatrixXd rhs = MatrixXd::Zero(q * width, channels);
  for (const ClipBlock& b : blocks) {
    for (int k = 0; k < q; ++k) {
      const double xi_k = p.xi(b.subject, k);
      rhs.middleRows(k * width, width) += xi_k * b.moments;
      for (int l = 0; l <= k; ++l) {
        a.block(k * width, l * width, width, width) += xi_k * p.xi(b.subject, l) * b.gram;
      }
    }
  }
  a.diagonal().array() += std::exp(p.log_noise);
  Solved solved{Eigen::LLT<MatrixXd>(a), {}};  // reads the lower triangle only
  solved.weights = solved.llt.solve(rhs);
  return solved;
}

// sum_k xi_k M_k: the clip's own regression weights [width x D].
MatrixXd clip_weights(const MatrixXd& weights, const MgpmParams& p, int subject, int width) {
  MatrixXd sum = MatrixXd::Zero(width, weights.cols());
  for (int k = 0; k < p.xi.cols(); ++k) {
    sum += p.xi(subject, k) * weights.middleRows(k * width, width);
  }
  return sum;
}

MgpmParams zero_like(const MgpmParams& p) {
  MgpmParams zero;
  zero.xi = MatrixXd::Zero(p.xi.rows(), p.xi.cols());
  zero.theta0 = VectorXd::Zero(p.theta0.size());
  zero.dtheta = VectorXd::Zero(p.dtheta.size());
  return zero;
}

// d nlp / d Phi = D Phi A^-1 - beta E W^2 M' (models/style/train/README.md, "Cost of one
// likelihood"), chained to xi, theta and gamma.
void add_clip_gradient(const ClipBlock& b, int m, const MatrixXd& residual, const Solved& solved,
                       const MatrixXd& a_inverse, const VectorXd& w_squared, const MgpmParams& p,
                       MgpmParams& gradient) {
  const auto width = static_cast<int>(b.gram.rows());
  const auto q = static_cast<int>(p.xi.cols());
  const double channels = static_cast<double>(residual.cols());
  const double beta = std::exp(-p.log_noise);
  // phi' E W^2 and, per style dimension k, sum_l xi_l A^-1_kl.
  const MatrixXd weighted = residual * w_squared.asDiagonal();
  const MatrixXd phi_residual = b.basis.value.transpose() * weighted;
  MatrixXd spread = MatrixXd::Zero(width, width);  // sum_kl xi_k xi_l A^-1_kl
  for (int k = 0; k < q; ++k) {
    MatrixXd row = MatrixXd::Zero(width, width);
    for (int l = 0; l < q; ++l) {
      row += p.xi(b.subject, l) * a_inverse.block(k * width, l * width, width, width);
    }
    spread += p.xi(b.subject, k) * row;
    const double through_a = channels * row.cwiseProduct(b.gram).sum();
    const double through_fit =
        beta * phi_residual.cwiseProduct(solved.weights.middleRows(k * width, width)).sum();
    gradient.xi(b.subject, k) += through_a - through_fit;
  }
  MatrixXd d_phi = channels * (b.basis.value * spread);
  d_phi.noalias() -=
      beta * weighted * clip_weights(solved.weights, p, b.subject, width).transpose();
  const VectorXd d_theta = d_phi.cwiseProduct(b.basis.d_theta).rowwise().sum();
  gradient.theta0[m] += d_theta.sum();
  gradient.dtheta[m] += d_theta.dot(b.time);
  gradient.log_gamma += std::exp(p.log_gamma) * d_phi.cwiseProduct(b.basis.d_gamma).sum();
}

double square(double x) { return x * x; }

void add_prior(const MgpmPrior& prior, const MgpmParams& p, MgpmValue& value) {
  value.nlp += mgpm_prior_nlp(prior, p);
  value.gradient.xi += p.xi;
  if (prior.dtheta_mean.size() > 0) {
    const Eigen::ArrayXd sd = prior.dtheta_relative_sd * prior.dtheta_mean.array();
    value.gradient.dtheta.array() += (p.dtheta - prior.dtheta_mean).array() / sd.square();
  }
  value.gradient.log_gamma += p.log_gamma / square(kLogGammaSd);
  value.gradient.log_noise += (p.log_noise - kLogNoiseMean) / square(kLogNoiseSd);
}

}  // namespace

int MgpmData::subjects() const {
  return clip_subject.empty() ? 0 : 1 + *std::max_element(clip_subject.begin(), clip_subject.end());
}

CircularKernel circular_kernel(double gamma, int harmonics) {
  // e^-g I_n(g) by Miller's downward recurrence I_{n-1} = I_{n+1} + (2n/g) I_n, normalised with e^g
  // = I_0 + 2 sum I_n. The recursion starts well above both the order and g, so its start value
  // does not matter.
  const int start = harmonics + 20 + static_cast<int>(2.0 * gamma);
  VectorXd bessel = VectorXd::Zero(start + 2);
  bessel[start] = 1e-300;
  double sum = 0.0;
  for (int n = start; n >= 1; --n) {
    bessel[n - 1] = bessel[n + 1] + 2.0 * n / gamma * bessel[n];
    sum += 2.0 * bessel[n];
    if (bessel[n - 1] > 1e200) {  // before it overflows
      bessel.tail(start + 2 - (n - 1)) *= 1e-200;
      sum *= 1e-200;
    }
  }
  bessel /= sum + bessel[0];
  CircularKernel kernel{VectorXd(harmonics + 1), VectorXd(harmonics + 1)};
  for (int n = 0; n <= harmonics; ++n) {
    const double c = n == 0 ? bessel[0] : 2.0 * bessel[n];
    const double dc =
        n == 0 ? bessel[1] - bessel[0] : bessel[n - 1] + bessel[n + 1] - 2.0 * bessel[n];
    kernel.a[n] = std::sqrt(std::max(c, 1e-300));
    kernel.da[n] = 0.5 * dc / kernel.a[n];
  }
  return kernel;
}

double mgpm_prior_nlp(const MgpmPrior& prior, const MgpmParams& p) {
  double nlp = 0.5 * p.xi.squaredNorm();
  if (prior.dtheta_mean.size() > 0) {
    nlp += 0.5 * ((p.dtheta - prior.dtheta_mean).array() /
                  (prior.dtheta_relative_sd * prior.dtheta_mean.array()))
                     .square()
                     .sum();
  }
  return nlp + 0.5 * square(p.log_gamma / kLogGammaSd) +
         0.5 * square((p.log_noise - kLogNoiseMean) / kLogNoiseSd);
}

MgpmValue mgpm_evaluate(const MgpmData& data, const MgpmParams& p, const MgpmPrior* prior,
                        const VectorXd* scale, int harmonics) {
  const auto frames = static_cast<double>(data.y.rows());
  const auto channels = static_cast<int>(data.y.cols());
  const int width = 2 * harmonics + 1;
  const double rank = static_cast<double>(p.xi.cols()) * width;
  const double noise = std::exp(p.log_noise);
  const std::vector<ClipBlock> blocks =
      clip_blocks(data, p, circular_kernel(std::exp(p.log_gamma), harmonics));
  const Solved solved = solve(blocks, p, width, channels);

  MatrixXd residual = data.y;  // E = Y - Phi M; K^-1 Y = E / noise
  for (const ClipBlock& b : blocks) {
    residual.middleRows(b.first, b.frames).noalias() -=
        b.basis.value * clip_weights(solved.weights, p, b.subject, width);
  }
  const VectorXd quadratic = data.y.cwiseProduct(residual).colwise().sum() / noise;
  MgpmValue value;
  value.scale = scale != nullptr ? *scale : (frames / quadratic.array()).sqrt().matrix();
  const VectorXd w_squared = value.scale.array().square();
  const double log_det =
      (frames - rank) * p.log_noise + 2.0 * solved.llt.matrixLLT().diagonal().array().log().sum();
  value.nlp = 0.5 * frames * channels * std::log(2.0 * std::numbers::pi) +
              0.5 * channels * log_det - frames * value.scale.array().log().sum() +
              0.5 * w_squared.dot(quadratic);

  value.gradient = zero_like(p);
  const MatrixXd a_inverse =
      solved.llt.solve(MatrixXd::Identity(solved.weights.rows(), solved.weights.rows()));
  for (int m = 0; m < data.clips(); ++m) {
    add_clip_gradient(blocks[m], m, residual.middleRows(blocks[m].first, blocks[m].frames), solved,
                      a_inverse, w_squared, p, value.gradient);
  }
  // tr K^-1 = (N - P) / noise + tr A^-1.
  const double trace = (frames - rank) / noise + a_inverse.trace();
  const double fit = w_squared.dot(residual.colwise().squaredNorm().transpose()) / square(noise);
  value.gradient.log_noise += 0.5 * noise * (channels * trace - fit);
  if (prior != nullptr) add_prior(*prior, p, value);
  return value;
}

MatrixXd mgpm_cycle(const MgpmData& data, const MgpmParams& p, const VectorXd& xi,
                    const VectorXd& theta, int harmonics) {
  const int width = 2 * harmonics + 1;
  const CircularKernel kernel = circular_kernel(std::exp(p.log_gamma), harmonics);
  const Solved solved =
      solve(clip_blocks(data, p, kernel), p, width, static_cast<int>(data.y.cols()));
  MatrixXd weights = MatrixXd::Zero(width, data.y.cols());
  for (int k = 0; k < xi.size(); ++k) {
    weights += xi[k] * solved.weights.middleRows(k * width, width);
  }
  return basis_at(theta, kernel).value * weights;
}

namespace {

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

void read_fit(const TaskResult& numbers, MgpmFit& fit) {
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
    read_fit((*found)[k], fit);
    fit.scale = mgpm_evaluate(data, fit.params, &fit.prior, nullptr, fit.harmonics).scale;
  }
  std::stable_sort(fits.begin(), fits.end(),
                   [](const MgpmFit& a, const MgpmFit& b) { return a.nlp < b.nlp; });
  return fits;
}

}  // namespace posed::style
