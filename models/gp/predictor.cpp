#include "models/gp/predictor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include <hwy/aligned_allocator.h>

#include "models/gp/confidence.hpp"
#include "models/gp/kernel.hpp"

namespace posed::gp {
namespace {

using kernel::kLanes;
using kernel::kMaxDims;
using kernel::kMaxGate;
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

// Writes the tiles of kernel.hpp with the points in `order`.
void lay_out(const Trained& t, const std::vector<int>& order, int points, int outputs_padded,
             float* out) {
  const auto dims = static_cast<int>(t.inputs.cols());
  const auto outputs = static_cast<int>(t.weights.cols());
  const auto real = static_cast<int>(order.size());
  const double signal = std::exp(t.lambda);
  for (int first = 0; first < points; first += kTile) {
    const int width = std::min(kTile, points - first);
    for (int d = 0; d < dims; ++d) {
      for (int i = 0; i < width; ++i) {
        const bool is_point = first + i < real;
        *out++ = is_point ? static_cast<float>(t.inputs(order[first + i], d)) : 0.0F;
      }
    }
    for (int i = 0; i < width; ++i) {
      for (int o = 0; o < outputs_padded; ++o) {
        const bool is_weight = first + i < real && o < outputs;
        *out++ = is_weight ? static_cast<float>(signal * t.weights(order[first + i], o)) : 0.0F;
      }
    }
  }
}

}  // namespace

struct Predictor::Parts {
  int dims = 0;
  int outputs = 0;
  int points = 0;  // padded
  float exponent = 0.0F;
  int gate_rows = 0;
  std::array<float, kMaxDims> constant{};
  const float* triangle = nullptr;
  hwy::AlignedFreeUniquePtr<float[]> data;  // the tiles, then the triangle, in reading order

  // k is written only where the confidence needs it. Returns false when no dimension is available.
  bool sum(std::span<const float> q, std::span<const std::uint8_t> available, int keep, float* k,
           std::span<float> out) const noexcept;
};

Predictor::Predictor(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Predictor::Predictor(Predictor&&) noexcept = default;
Predictor& Predictor::operator=(Predictor&&) noexcept = default;
Predictor::~Predictor() = default;

Result<Predictor> Predictor::build(const Trained& trained, bool gate) {
  if (auto valid = validate(trained); !valid) return std::unexpected(valid.error());
  auto parts = std::make_unique<Parts>();
  parts->dims = static_cast<int>(trained.inputs.cols());
  parts->outputs = static_cast<int>(trained.weights.cols());
  const auto points = static_cast<int>(trained.inputs.rows());
  parts->points = padded(points);
  parts->exponent = static_cast<float>(-0.5 * trained.mu * std::numbers::log2e);
  std::vector<int> order(static_cast<std::size_t>(points));
  std::iota(order.begin(), order.end(), 0);
  std::vector<float> triangle;
  if (gate) {
    Confidence confidence = confidence_of(trained, kMaxGate);
    order = std::move(confidence.order);
    triangle = std::move(confidence.triangle);
    parts->gate_rows = confidence.rows;
  }
  const int outputs_padded = padded(parts->outputs);
  const auto tile_floats = static_cast<std::size_t>(parts->points) *
                           static_cast<std::size_t>(parts->dims + outputs_padded);
  parts->data = hwy::AllocateAligned<float>(tile_floats + triangle.size());
  lay_out(trained, order, parts->points, outputs_padded, parts->data.get());
  std::ranges::copy(triangle, parts->data.get() + tile_floats);
  parts->triangle = parts->data.get() + tile_floats;
  // k = e^lambda exp(.) + b: e^lambda is multiplied into the weights, b sum w is a constant.
  const Eigen::VectorXd constant =
      trained.offset + trained.b * trained.weights.colwise().sum().transpose();
  for (int o = 0; o < parts->outputs; ++o) parts->constant[o] = static_cast<float>(constant[o]);
  static_cast<void>(
      kernel::target());  // Highway detects the CPU here and not in the first hot call
  return Predictor(std::move(parts));
}

int Predictor::inputs() const noexcept { return parts_->dims; }
int Predictor::outputs() const noexcept { return parts_->outputs; }
bool Predictor::has_confidence() const noexcept { return parts_->gate_rows > 0; }
std::span<const float> Predictor::constant() const noexcept {
  return {parts_->constant.data(), static_cast<std::size_t>(parts_->outputs)};
}

// RT-safe.
bool Predictor::Parts::sum(std::span<const float> q, std::span<const std::uint8_t> available,
                           int keep, float* k, std::span<float> out) const noexcept {
  std::array<std::uint16_t, kMaxDims> present;
  kernel::Query query{q.data(), nullptr, dims, exponent};
  if (!available.empty()) {
    int count = 0;
    for (int d = 0; d < dims; ++d) {
      present[count] = static_cast<std::uint16_t>(d);
      count += available[d] != 0 ? 1 : 0;
    }
    if (count == 0) return false;
    if (count < dims) {
      query.present = present.data();
      query.present_count = count;
      query.exponent = exponent * static_cast<float>(dims) / static_cast<float>(count);
    }
  }
  alignas(64) std::array<float, kMaxDims> raw;
  kernel::weighted_sum({data.get(), points, dims, padded(outputs)}, query, keep, k, raw.data());
  for (int o = 0; o < outputs; ++o) out[o] = constant[o] + raw[o];
  return true;
}

// RT-safe.
void Predictor::mean(std::span<const float> q, std::span<const std::uint8_t> available,
                     std::span<float> out) const noexcept {
  if (!parts_->sum(q, available, 0, nullptr, out)) std::ranges::copy(constant(), out.begin());
}

// RT-safe.
float Predictor::mean_and_confidence(std::span<const float> q,
                                     std::span<const std::uint8_t> available,
                                     std::span<float> out) const noexcept {
  alignas(64) std::array<float, kMaxGate> k;
  if (!parts_->sum(q, available, parts_->gate_rows, k.data(), out)) {
    std::ranges::copy(constant(), out.begin());
    return 0.0F;
  }
  const float g = kernel::triangle_norm2(parts_->triangle, parts_->gate_rows, k.data());
  return std::clamp(g, 0.0F, 1.0F);
}

}  // namespace posed::gp
