// The figures of mean cycles in a report: poses at eight phases, paths in the plane of the largest
// variances, and what is left of the distance joint by joint; shared by `train style` and
// `eval style`. Cold.
#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>

#include "daemon/tools/picture/figure.hpp"
#include "daemon/tools/report/page.hpp"
#include "models/motion/pose_space.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// Phases of a cycle in the figures; a multiple of eight.
inline constexpr int kReportPhases = 56;

// Mean cycles of one motion at the same phases [kReportPhases x dims], rad. `target` is what the
// source should become.
struct StyleCycles {
  std::string motion{}, source_name, target_name;  // `motion` may be empty
  Eigen::MatrixXd source, styled, target;

  [[nodiscard]] std::string what() const;
};

// The points of a cycle, given by its harmonic coefficients.
[[nodiscard]] Eigen::MatrixXd cycle_points(const Eigen::MatrixXd& coefficients);

class CycleFigures {
 public:
  // `clip`: whose bones are drawn. It has frames.
  [[nodiscard]] static Result<CycleFigures> make(const clip::Clip& clip,
                                                 const motion::PoseSpaceSpec& spec);

  [[nodiscard]] report::Figure poses(const StyleCycles& cycles) const;
  [[nodiscard]] report::Figure paths(const StyleCycles& cycles) const;
  [[nodiscard]] report::Figure residuals(const StyleCycles& cycles) const;

 private:
  CycleFigures(motion::PoseSpaceSpec spec, motion::PoseSpace space, const Frame& base,
               std::shared_ptr<const Skeleton> skeleton);
  [[nodiscard]] picture::Figure pose(const Eigen::VectorXd& q) const;

  motion::PoseSpaceSpec spec_;
  motion::PoseSpace space_;
  Frame base_;  // the joints that the style does not change, and the height of the root
  picture::FigureShape shape_;
};

// The two directions of the largest variance of `rows` about their mean, and the shares of all
// variance that they have, 0 where there is none.
struct Plane {
  Eigen::RowVectorXd middle;
  Eigen::MatrixXd directions;  // [columns x 2]
  double first_share = 0.0, second_share = 0.0;

  [[nodiscard]] Eigen::MatrixXd of(const Eigen::MatrixXd& rows) const {
    return (rows.rowwise() - middle) * directions;
  }
};
[[nodiscard]] Plane plane_of(const Eigen::MatrixXd& rows);

}  // namespace posed::tools
