// A round of a synthetic walker: he walks, turns about, stops, stands, starts and walks on, twice,
// so that he is back where he began and can go round for ever. His steps are always in time; where
// he stands they have no length. Cold.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace posed::motion {

// From 0 to 1 while x goes from 0 to 1, without a jump of the slope.
[[nodiscard]] double smooth_step(double x);

// Everything goes by strides, counted from the begin of the walk, and repeats after strides().
class Round {
 public:
  // A walker stands over a foot at `over`, a share of a stride, and half a stride later over the
  // other: there he begins and ends to stand. `strides` is whole and at least kMinStrides.
  Round(double stride_m, double strides, double over);
  static constexpr double kMinStrides = 12.0;

  [[nodiscard]] double strides() const { return 2.0 * half_; }
  [[nodiscard]] Eigen::Vector3d at_m(double stride) const;  // on the floor
  [[nodiscard]] double heading_rad(double stride) const;    // about +Y, does not jump at a round
  [[nodiscard]] double pace(double stride) const;           // of the path: 0 stands, 1 walks
  [[nodiscard]] double swing(double stride) const;          // of the body: 0 still, 1 as it walks
  [[nodiscard]] double turn_rad_per_stride(double stride) const;  // to the left

 private:
  [[nodiscard]] double in_half(double stride) const;
  [[nodiscard]] double from_rest(double stride) const;  // from the middle of standing

  struct Place {
    double x_m = 0.0, z_m = 0.0, heading_rad = 0.0;
  };
  [[nodiscard]] Place place(double in_half) const;

  double half_, rest_;         // strides of half a round, and the middle of standing in it
  std::vector<Place> places_;  // of the first half, equally far apart in time
};

}  // namespace posed::motion
