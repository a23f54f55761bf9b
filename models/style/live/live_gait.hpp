// LiveGait: whether legs that stride walk or run at this moment. A walking body is an inverted
// pendulum, highest where the legs pass each other; a running one is a spring, lowest there (G. A.
// Cavagna, N. C. Heglund, C. R. Taylor, "Mechanical work in terrestrial locomotion", American
// Journal of Physiology 233, 1977). So the correlation of the pelvis' height with how far the legs
// are apart tells one from the other, whatever the cadence, the scale and the style (README.md,
// "Gate"). RT-safe.
#pragma once

namespace posed::style {

class LiveGait {
 public:
  // The height of the pelvis and the leg signal (motion::LegSignal), `dt_s` after the last ones.
  void update(double height_m, double leg_rad, double dt_s) noexcept;

  // Of the last 0.3 s or so: towards -1 in a walk, towards 1 in a run. NaN until 0.4 s are known,
  // and where the pelvis keeps its height or the legs do not move.
  [[nodiscard]] double correlation() const noexcept;

  // The gait is that of what comes from now on.
  void forget() noexcept { seen_s_ = 0.0; }

 private:
  double seen_s_ = 0.0;
  double height_m_ = 0.0, apart_rad_ = 0.0;                           // means
  double height_m2_ = 0.0, apart_rad2_ = 0.0, together_m_rad_ = 0.0;  // variances, covariance
};

}  // namespace posed::style
