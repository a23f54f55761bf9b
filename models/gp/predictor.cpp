#include "models/gp/predictor.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include <hwy/aligned_allocator.h>

#include "models/gp/kernel.hpp"

namespace posed::gp {
namespace {

using kernel::kMaxDims;
using kernel::kTile;
using kernel::padded;

constexpr Eigen::Index kMaxPoints = 100'000;

Result<> validate(const Trained& t) {
  const Eigen::Index points = t.inputs.rows();
  if (points < 1 || points > kMaxPoints) return fail("the model's process has no training poses");
  if (t.inputs.cols() < 1 || t.inputs.cols() > kMaxDims || t.weights.cols() < 1 ||
      t.weights.cols() > kMaxDims) {
    return fail("the model's process has no dimension or more than " + std::to_string(kMaxDims));
  }
  if (t.weights.rows() != points || t.offset.size() != t.weights.cols()) {
    return fail("the model's inputs, weights and offset differ in shape");
  }
  const bool scales =
      t.scale.size() == 0 || (t.scale.size() == t.inputs.cols() && (t.scale.array() > 0.0).all() &&
                              (t.scale.array() <= 1.0).all());
  if (!scales) return fail("the model's kernel counts a dimension less than nothing or above 1");
  const bool finite = t.inputs.allFinite() && t.weights.allFinite() && t.offset.allFinite();
  if (!finite || !std::isfinite(t.lambda) || !std::isfinite(t.b) || !std::isfinite(t.noise)) {
    return fail("the model's process holds a value that is not a number");
  }
  if (!(t.mu > 0.0) || !std::isfinite(t.mu) || t.b < 0.0 || t.noise < 0.0) {
    return fail("the model's kernel values are out of range: mu > 0, b >= 0, noise >= 0");
  }
  const double largest = std::exp(t.lambda) * t.weights.cwiseAbs().maxCoeff();
  if (!(largest < 1e30) || !(t.inputs.cwiseAbs().maxCoeff() < 1e15)) {
    return fail("the model's weights are too large for single precision");
  }
  return {};
}

Result<> validate_more(const Trained& t, std::span<const Function> more) {
  if (more.size() >= kMaxFunctions) {
    return fail("the model has more than " + std::to_string(kMaxFunctions) + " functions");
  }
  for (const Function& one : more) {
    const Trained other{t.inputs, one.weights, one.offset, t.lambda, t.mu, t.b, t.noise};
    if (one.weights.cols() != t.weights.cols()) {
      return fail("the model's functions differ in their number of outputs");
    }
    TRY(validate(other));
  }
  return {};
}

// Writes one row a point of the tile that begins at `first`: its weights.
float* lay_out_weights(const Eigen::MatrixXd& weights, double signal, int first, int width,
                       int outputs_padded, float* out) {
  const auto outputs = static_cast<int>(weights.cols());
  const auto real = static_cast<int>(weights.rows());
  for (int i = 0; i < width; ++i) {
    for (int o = 0; o < outputs_padded; ++o) {
      const bool is_weight = first + i < real && o < outputs;
      *out++ = is_weight ? static_cast<float>(signal * weights(first + i, o)) : 0.0F;
    }
  }
  return out;
}

// Writes the tiles of kernel.hpp.
void lay_out(const Trained& t, int points, int outputs_padded, float* out) {
  const auto dims = static_cast<int>(t.inputs.cols());
  const auto real = static_cast<int>(t.inputs.rows());
  const double signal = std::exp(t.lambda);
  for (int first = 0; first < points; first += kTile) {
    const int width = std::min(kTile, points - first);
    for (int d = 0; d < dims; ++d) {
      for (int i = 0; i < width; ++i) {
        const bool is_point = first + i < real;
        const double scale = t.scale.size() == 0 ? 1.0 : t.scale[d];
        *out++ = is_point ? static_cast<float>(scale * t.inputs(first + i, d)) : 0.0F;
      }
    }
    out = lay_out_weights(t.weights, signal, first, width, outputs_padded, out);
  }
}

// Writes the blocks of kernel.hpp.
void lay_out_blocks(const Trained& t, std::span<const Function> more, int points,
                    int outputs_padded, float* out) {
  const double signal = std::exp(t.lambda);
  for (int first = 0; first < points; first += kTile) {
    const int width = std::min(kTile, points - first);
    out = lay_out_weights(t.weights, signal, first, width, outputs_padded, out);
    for (const Function& one : more) {
      out = lay_out_weights(one.weights, signal, first, width, outputs_padded, out);
    }
  }
}

// k = e^lambda exp(.) + b: e^lambda is multiplied into the weights, b sum w is a constant.
std::array<float, kMaxDims> constant_of(const Eigen::MatrixXd& weights,
                                        const Eigen::VectorXd& offset, double b) {
  std::array<float, kMaxDims> constant{};
  const Eigen::VectorXd sum = offset + b * weights.colwise().sum().transpose();
  for (Eigen::Index o = 0; o < sum.size(); ++o) {
    constant[o] = static_cast<float>(sum[o]);
  }
  return constant;
}

}  // namespace

struct Predictor::Parts {
  int dims = 0;
  int outputs = 0;
  int points = 0;  // padded
  float exponent = 0.0F;
  std::vector<float> scale;  // of the query's dimensions; empty: all 1
  std::array<float, kMaxDims> constant{};
  hwy::AlignedFreeUniquePtr<float[]> data;  // the tiles
  // With several functions: the weights of each, and the constants. The tiles and `constant` hold
  // those of the mixture, as soon as all points have its weights.
  hwy::AlignedFreeUniquePtr<float[]> blocks;
  std::vector<std::array<float, kMaxDims>> constants;
  std::array<float, kMaxFunctions> mixture{1.0F};
  int mixed_points = 0;

  void mix_weights(int point) noexcept;
  void mixed_constant(std::span<const float> shares, std::span<float> out) const noexcept;
};

Predictor::Predictor(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Predictor::Predictor(Predictor&&) noexcept = default;
Predictor& Predictor::operator=(Predictor&&) noexcept = default;
Predictor::~Predictor() = default;

Result<Predictor> Predictor::build(const Trained& trained, std::span<const Function> more) {
  TRY(validate(trained));
  TRY(validate_more(trained, more));
  auto parts = std::make_unique<Parts>();
  parts->dims = static_cast<int>(trained.inputs.cols());
  parts->outputs = static_cast<int>(trained.weights.cols());
  parts->points = padded(static_cast<int>(trained.inputs.rows()));
  const Eigen::VectorXf scale = trained.scale.cast<float>();
  parts->scale.assign(scale.begin(), scale.end());
  parts->exponent = static_cast<float>(-0.5 * trained.mu * std::numbers::log2e);
  const int outputs_padded = padded(parts->outputs);
  const auto tile_floats = static_cast<std::size_t>(parts->points) *
                           static_cast<std::size_t>(parts->dims + outputs_padded);
  parts->data = hwy::AllocateAligned<float>(tile_floats);
  lay_out(trained, parts->points, outputs_padded, parts->data.get());
  parts->constant = constant_of(trained.weights, trained.offset, trained.b);
  if (!more.empty()) {
    const auto block_floats = static_cast<std::size_t>(parts->points) *
                              static_cast<std::size_t>(outputs_padded) * (1 + more.size());
    parts->blocks = hwy::AllocateAligned<float>(block_floats);
    parts->mixed_points = parts->points;
    lay_out_blocks(trained, more, parts->points, outputs_padded, parts->blocks.get());
    parts->constants.push_back(parts->constant);
    for (const Function& one : more) {
      parts->constants.push_back(constant_of(one.weights, one.offset, trained.b));
    }
  }
  static_cast<void>(
      kernel::target());  // Highway detects the CPU here and not in the first hot call
  return Predictor(std::move(parts));
}

int Predictor::inputs() const noexcept { return parts_->dims; }
int Predictor::outputs() const noexcept { return parts_->outputs; }
int Predictor::functions() const noexcept {
  return std::max(1, static_cast<int>(parts_->constants.size()));
}
std::span<const float> Predictor::constant() const noexcept {
  return {parts_->constant.data(), static_cast<std::size_t>(parts_->outputs)};
}

RT_SAFE void Predictor::Parts::mixed_constant(std::span<const float> shares,
                                              std::span<float> out) const noexcept {
  const bool mixed = shares.empty() || constants.empty();  // `constant` is the mixture's
  for (int o = 0; o < outputs; ++o) {
    out[o] = mixed ? constant[o] : 0.0F;
    for (std::size_t s = 0; !mixed && s < constants.size(); ++s) {
      out[o] += shares[s] * constants[s][o];
    }
  }
}

RT_SAFE void Predictor::constant(std::span<const float> shares,
                                 std::span<float> out) const noexcept {
  parts_->mixed_constant(shares, out);
}

RT_SAFE void Predictor::Parts::mix_weights(int point) noexcept {
  const int row = padded(outputs);
  const auto functions = static_cast<int>(constants.size());
  const int first = point / kTile * kTile;  // of its tile
  const int width = std::min(kTile, points - first);
  float* const mixed = data.get() + static_cast<std::ptrdiff_t>(first) * (dims + row) +
                       dims * width + (point - first) * row;
  const float* one =
      blocks.get() + static_cast<std::ptrdiff_t>(first) * row * functions + (point - first) * row;
  std::fill_n(mixed, row, 0.0F);
  for (int s = 0; s < functions; ++s, one += width * row) {
    const float share = mixture[s];
    if (share == 0.0F) continue;
    for (int o = 0; o < row; ++o) mixed[o] += share * one[o];
  }
}

RT_SAFE bool Predictor::settle(std::span<const float> shares) noexcept {
  Parts& p = *parts_;
  if (p.constants.empty()) return true;
  if (!std::ranges::equal(shares, std::span(p.mixture).first(shares.size()))) {
    std::ranges::copy(shares, p.mixture.begin());
    p.mixed_points = 0;
  }
  if (p.mixed_points == p.points) return true;
  const int end = std::min(p.points, p.mixed_points + (p.points + kSettleCalls - 1) / kSettleCalls);
  while (p.mixed_points < end) p.mix_weights(p.mixed_points++);
  if (end < p.points) return false;
  p.mixed_constant(p.mixture, {p.constant.data(), static_cast<std::size_t>(p.outputs)});
  return true;
}

RT_SAFE void Predictor::mean(std::span<const float> q, std::span<const std::uint8_t> available,
                             std::span<float> out, std::span<const float> shares) const noexcept {
  const Parts& p = *parts_;
  assert(q.size() >= static_cast<std::size_t>(p.dims));
  std::array<std::uint16_t, kMaxDims> present;
  kernel::Query query{q.data(), nullptr, p.dims, p.exponent};
  alignas(64) std::array<float, kMaxDims> scaled;
  if (!p.scale.empty()) {
    for (int d = 0; d < p.dims; ++d) scaled[d] = p.scale[d] * q[d];
    query.q = scaled.data();
  }
  if (!available.empty()) {
    int count = 0;
    for (int d = 0; d < p.dims; ++d) {
      present[count] = static_cast<std::uint16_t>(d);
      count += available[d] != 0 ? 1 : 0;
    }
    if (count == 0) return p.mixed_constant(shares, out);
    if (count < p.dims) {
      query.present = present.data();
      query.present_count = count;
      query.exponent = p.exponent * static_cast<float>(p.dims) / static_cast<float>(count);
    }
  }
  alignas(64) std::array<float, kMaxDims> raw;
  const kernel::Tiles tiles{p.data.get(), p.points, p.dims, padded(p.outputs)};
  if (shares.empty() || p.constants.empty()) {
    kernel::weighted_sum(tiles, query, raw.data());
  } else {
    const auto functions = static_cast<int>(p.constants.size());
    kernel::blended_sum(tiles, {p.blocks.get(), shares.data(), functions}, query, raw.data());
  }
  p.mixed_constant(shares, out);
  for (int o = 0; o < p.outputs; ++o) out[o] += raw[o];
}

}  // namespace posed::gp
