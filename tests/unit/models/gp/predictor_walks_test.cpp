// The predictor on real poses: trained on five people's walks, evaluated on a sixth's. Needs the
// recordings (tests/README.md).
#include <cmath>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/gp/predictor.hpp"
#include "models/gp/regression.hpp"
#include "models/motion/motion.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/shared.hpp"

using namespace posed;

namespace {

Eigen::MatrixXd poses(const std::filesystem::path& path) {
  const auto clip = clip::read_clip(path);
  REQUIRE(clip);
  const auto motion = motion::resample(motion::motion_of(*clip).value(), 60.0);
  const auto spec = motion::describe_space(motion::Space::kCmu43, *motion.skeleton).value();
  const auto space = motion::PoseSpace::bind(spec, *motion.skeleton).value();
  return motion::pose_vectors(motion, space, motion::walk_heading_rad(motion));
}

Eigen::MatrixXd stacked(const std::vector<Eigen::MatrixXd>& blocks) {
  Eigen::MatrixXd all(0, blocks[0].cols());
  for (const auto& block : blocks) {
    all.conservativeResize(all.rows() + block.rows(), Eigen::NoChange);
    all.bottomRows(block.rows()) = block;
  }
  return all;
}

}  // namespace

TEST_CASE("on six real walks the mean is within 1e-3 degree", "[gp][predictor]") {
  std::vector<Eigen::MatrixXd> walks;
  for (const auto* name : {"02_02", "07_01", "08_01", "16_15", "35_01", "39_01"}) {
    const auto path = test::shared(std::string("data/cmu/") + name + ".amc");
    if (!path) SKIP_WITHOUT_SHARED();
    walks.push_back(poses(*path));
  }
  for (const std::size_t asked : {0U, 3U}) {
    std::vector<Eigen::MatrixXd> others = walks;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(asked));
    const Eigen::MatrixXd X = stacked(others);
    REQUIRE(X.rows() > 800);
    // A function like a style: smooth in the pose, up to 20 degrees.
    const Eigen::MatrixXd Y =
        20.0 * kDegree *
        (X * Eigen::MatrixXd::Constant(43, 43, 1.0).triangularView<Eigen::Upper>())
            .array()
            .sin()
            .matrix();
    const double signal = 0.01;
    for (const double length_deg : {75.0, 85.0, 100.0}) {
      const gp::Hyper hyper{std::log(signal), -2.0 * std::log(length_deg * kDegree),
                            -std::numeric_limits<double>::infinity(), std::log(0.1 * signal)};
      const auto process = gp::fit(X, Y, Y.colwise().mean(), hyper).value();
      const auto predictor = gp::Predictor::build(process).value();
      Eigen::MatrixXd queries(walks[asked].rows() + X.rows(), 43);
      queries << walks[asked], X;
      const Eigen::MatrixXd exact = gp::posterior_mean(process, queries);
      double mean_rad = 0.0;
      for (Eigen::Index i = 0; i < queries.rows(); ++i) {
        const Eigen::VectorXf q = queries.row(i).cast<float>();
        std::vector<float> out(43);
        predictor.mean({q.data(), 43}, {}, out);
        for (int o = 0; o < 43; ++o) {
          mean_rad = std::max(mean_rad, std::abs(out[static_cast<std::size_t>(o)] - exact(i, o)));
        }
      }
      INFO("length " << length_deg << " degrees, " << X.rows() << " poses");
      CHECK(mean_rad / kDegree < 1e-3);
    }
  }
}
