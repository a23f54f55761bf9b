// Predictor: the trained Gaussian process in a form for the hot path: float32, precomputed weights,
// tiles that fit the caches, SIMD chosen at run time (AVX2 and AVX-512 give the same bits). Const
// and shareable between threads after build().
//
//   f(q) = offset + sum_i k(q, x_i) w_i,   k(q, x) = exp(lambda - mu |q - x|^2 / 2) + b (README.md,
//   "Kernel")
//
// Missing dimensions are left out: the distance runs over the available ones and is scaled by D /
// D_avail (README.md, "Missing dimensions").
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "models/gp/trained.hpp"
#include "proto/frame/result.hpp"

namespace posed::gp {

class Predictor {
 public:
  // Checks shapes and values; precomputes tiles and, with `gate`, the confidence's matrices. Cold.
  [[nodiscard]] static Result<Predictor> build(const Trained& trained, bool gate);
  Predictor(Predictor&&) noexcept;
  Predictor& operator=(Predictor&&) noexcept;
  ~Predictor();

  [[nodiscard]] int inputs() const noexcept;           // D
  [[nodiscard]] int outputs() const noexcept;          // D_out
  [[nodiscard]] bool has_confidence() const noexcept;  // built with `gate`

  // The limit of f far from all training poses: offset + b sum w [D_out]. RT-safe.
  [[nodiscard]] std::span<const float> constant() const noexcept;

  // f(q) into out [D_out]; constant() where nothing is available. q must be finite; its missing
  // values are not read. `available` is empty (all) or D flags. RT-safe.
  void mean(std::span<const float> q, std::span<const std::uint8_t> available,
            std::span<float> out) const noexcept;

  // The same, and returns the confidence g = 1 - v_E(q) / e^lambda in 0..1 (README.md,
  // "Confidence"). RT-safe. Needs build(..., gate = true).
  [[nodiscard]] float mean_and_confidence(std::span<const float> q,
                                          std::span<const std::uint8_t> available,
                                          std::span<float> out) const noexcept;

 private:
  struct Parts;
  explicit Predictor(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace posed::gp
