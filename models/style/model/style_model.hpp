// StyleModel: the result of `posed train style`, used by `run`, `apply` and `replay`. Its file is
// described in proto/README.md: 24 bytes of header, then posed.v1.ModelFile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "models/gp/predictor.hpp"
#include "models/motion/pose_space.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

inline constexpr std::size_t kMaxStyles = gp::kMaxFunctions;  // of one model

// A style after a model's first one: another function of the same inputs.
struct MoreStyle {
  std::string name;  // of its group
  gp::Function function;
  Eigen::VectorXd limit_rad;
};

// Data by which the gate and the warm-up recognise a motion that the model knows
// (models/style/README.md, "Gate" and "Warm-up").
struct GateData {
  Eigen::VectorXd
      neutral{};  // mean pose of the neutral walk in training [dims]; empty: no gate data
  // The smallest mean swing of the legs (LiveStride) of any training clip, and the stride period of
  // the fastest clip. Both are 0 if the training shows no strides.
  double swing_rad = 0.0;
  double fastest_stride_s = 0.0;
  // The highest mean that LiveGait has over a training clip; NaN: unknown.
  double gait_correlation = std::numeric_limits<double>::quiet_NaN();
  // The mean cycle of each person and day in the neutral walk, as harmonic coefficients
  // [kCycleRows x dims]; at phase 0 the right thigh is farthest in front. Empty without strides and
  // in models of older versions of posed.
  std::vector<Eigen::MatrixXd> usual{};
  // rig_id() of the figures of training; empty in models of older versions of posed.
  std::vector<std::uint32_t> rigs{};
  // [joint of a humanoid space] Where it is along the trunk of the training figure, from the hips
  // (0) to the head (1) (trunk_places()); -1: beside the trunk. Empty in models of older versions
  // of posed.
  std::vector<double> places{};

  [[nodiscard]] bool present() const { return neutral.size() > 0; }
  [[nodiscard]] bool strides() const { return swing_rad > 0.0; }
};

// How much of the style a mean pose shows, direction . q + offset: 0 none, 1 all
// (models/style/README.md, "Auto-alpha").
struct StyleAxis {
  Eigen::VectorXd direction{};  // [dims]; empty: not known
  double offset = 0.0;

  [[nodiscard]] bool present() const { return direction.size() > 0; }
};

// What a style does to the pelvis, a function with the inputs and kernel of the process: its height
// [leg lengths], its speed forward and to the left [leg lengths per mean stride of the source].
struct RootFunction {
  static constexpr int kDims = 3;
  gp::Function function;  // weights [N x 3], offset [3]
  Eigen::Vector3d limit = Eigen::Vector3d::Zero();
};

struct StyleModel {
  motion::PoseSpaceSpec space;
  gp::Trained process;        // q -> difference of q at alpha = 1
  Eigen::VectorXd limit_rad;  // clamp of |difference| per dimension (1.5 x the largest in training)
  double rate_hz = 30.0;      // of training; the filter has no memory and is correct at any rate
  std::string from, to;       // group names, for people
  std::string report_json;    // what `train --json` printed
  GateData gate{};
  StyleAxis axis{};
  std::vector<RootFunction> roots{};  // of each style; empty in models of older versions of posed
  std::vector<MoreStyle> more{};      // `process`, `limit_rad` and `to` are the first style's

  [[nodiscard]] std::size_t styles() const { return 1 + more.size(); }
  [[nodiscard]] std::vector<std::string> names() const;  // of its styles, in order
};

// Returns a hash of the joints' names and parents: figures that differ in size have the same. Cold.
[[nodiscard]] std::uint32_t rig_id(const Skeleton& skeleton);

// Returns a model whose only style is the sum of the styles of `model`, each times its share.
// `shares` has styles() numbers. Cold.
[[nodiscard]] StyleModel mixture_of(const StyleModel& model, std::span<const double> shares);

// Reads a file that save_model() wrote. Errors name the file and what is wrong with it.
Result<StyleModel> load_model(const std::filesystem::path& path);
// Reads a model as load_model() does, from bytes (control message, device log). `name` is only for
// error messages. Any bytes give a model or an Error, never a crash.
Result<StyleModel> parse_model(std::span<const std::byte> bytes, const std::string& name);
[[nodiscard]] std::string serialize_model(const StyleModel& model);
Result<> save_model(const StyleModel& model, const std::filesystem::path& path);

}  // namespace posed::style
