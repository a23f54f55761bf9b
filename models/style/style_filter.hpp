// StyleFilter: the style stage of one stream, y = q + a f(q) (paper, eq. 5), with the same code
// live, offline (`apply`) and in replay. Memoryless but for what makes it safe to touch while it
// runs: the heading low-pass, the alpha slew, the gate's smoothing and the blend after a model
// swap.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "models/style/style_model.hpp"
#include "proto/frame/sink.hpp"

namespace posed::style {

// A model bound to one skeleton and ready for hot use. Built cold, then const; the hot side gets a
// plain pointer and hands the old one back to be freed.
struct BoundModel {
  motion::PoseSpace space;
  gp::Predictor predictor;
  Eigen::VectorXf limit_rad, input_mean, input_sd;
  std::string name;
};
struct FilterOptions {
  double alpha = 1.0;  // -2..2
  double alpha_slew_per_s = 2.0;
  bool gate = false;           // fade towards fallback * offset where the process knows nothing
  double gate_fallback = 1.0;  // kappa_c of algorithms 2.4
  bool calibrate = false;      // remove the walker's own mean offset from the kernel's input
};
[[nodiscard]] Result<std::unique_ptr<const BoundModel>> bind_model(const StyleModel& model,
                                                                   const Skeleton& skeleton,
                                                                   const FilterOptions& options,
                                                                   std::string name);

class StyleFilter final : public Stage {
 public:
  StyleFilter(const BoundModel* model,
              const FilterOptions& options) noexcept;  // model may be null: pass through

  void step(const Frame* in, std::int64_t now_ns, Emit& emit) noexcept override;

  // Both take effect at the next frame; RT-safe. set_model returns the old pointer.
  void set_alpha(float alpha) noexcept;
  [[nodiscard]] const BoundModel* set_model(const BoundModel* model) noexcept;
  // Starts from the settled state that this frame would lead to (offline use): full alpha, heading
  // found.
  void settle(const Frame& frame, double heading_rad) noexcept;

  [[nodiscard]] float alpha() const noexcept;  // where the slew is now
};

}  // namespace posed::style
