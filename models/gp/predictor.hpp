// Predictor: the trained Gaussian process in a form for the hot path: float32, precomputed weights,
// tiles that fit the caches, SIMD chosen at run time (AVX2 and AVX-512 give the same bits). Const
// and shareable between threads after build(), but for settle().
//
//   f(q) = offset + sum_i k(q, x_i) w_i,   k(q, x) = exp(lambda - mu |q - x|^2 / 2) + b
//   (models/gp/README.md, "Kernel")
//
// Several functions f_s that share inputs and kernel are evaluated in one pass over the kernel, as
// their mixture sum_s share_s f_s (models/gp/README.md, "Mixtures"): for any shares, which costs
// one sum a function, or for those that settle() has put together, at the cost of one function.
//
// Missing dimensions are left out: the distance runs over the available ones and is scaled by D /
// D_avail (models/gp/README.md, "Missing dimensions").
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "models/gp/trained.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::gp {

inline constexpr std::size_t kMaxFunctions = 16;  // of one predictor

class Predictor {
 public:
  // Checks shapes and values; precomputes the tiles. Cold.
  // `more`: further functions, in the shapes of `trained`, at most kMaxFunctions in all. At first
  // the mixture is the function of `trained` alone.
  static Result<Predictor> build(const Trained& trained, std::span<const Function> more = {});
  Predictor(Predictor&&) noexcept;
  Predictor& operator=(Predictor&&) noexcept;
  ~Predictor();

  [[nodiscard]] int inputs() const noexcept;     // D
  [[nodiscard]] int outputs() const noexcept;    // D_out
  [[nodiscard]] int functions() const noexcept;  // 1 without `more`

  // The limit of f far from all training poses: offset + b sum w [D_out].
  RT_SAFE [[nodiscard]] std::span<const float> constant() const noexcept;
  // Writes that limit for other shares [functions] into out [D_out].
  RT_SAFE void constant(std::span<const float> shares, std::span<float> out) const noexcept;

  // Works towards the mixture of these shares [functions] and returns whether mean() without shares
  // gives it. A call puts the weights of one part in kSettleCalls together; until all are, ask with
  // shares. Not for a predictor that another thread uses.
  RT_SAFE [[nodiscard]] bool settle(std::span<const float> shares) noexcept;
  static constexpr int kSettleCalls = 64;

  // f(q) into out [D_out]; constant() where nothing is available. q must be finite; its missing
  // values are not read. `available` is empty (all) or D flags. `shares` is empty (those of the
  // mixture) or [functions].
  RT_SAFE void mean(std::span<const float> q, std::span<const std::uint8_t> available,
                    std::span<float> out, std::span<const float> shares = {}) const noexcept;

 private:
  struct Parts;
  explicit Predictor(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace posed::gp
