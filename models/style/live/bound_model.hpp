// BoundModel: a style model bound to one skeleton, ready for the hot path. Built cold, then const;
// the hot side holds a plain pointer and returns the old one to be freed by the cold side.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/gp/predictor.hpp"
#include "models/motion/pose_space.hpp"
#include "models/stage.hpp"
#include "models/style/live/alpha_reach.hpp"
#include "models/style/live/body_mask.hpp"
#include "models/style/live/bone_turns.hpp"
#include "models/style/live/hinges.hpp"
#include "models/style/live/leg_map.hpp"
#include "models/style/live/trained_motion.hpp"
#include "models/style/model/style_model.hpp"

namespace posed::style {

struct BoundModel final : StageModel {
  BoundModel(const StyleModel& model, motion::PoseSpace bound_space, gp::Predictor bound_predictor,
             std::string file);

  // Their names; the limits and the axis below are the first one's.
  [[nodiscard]] const std::vector<std::string>& styles() const noexcept { return words; }

  motion::PoseSpace space;
  Hinges hinges;  // of the skeleton
  // Mutable, because it keeps the mixture of styles ready that the filter asks for. With several
  // styles a model therefore serves one filter at a time at its full speed.
  mutable gp::Predictor predictor;
  Eigen::VectorXf limit_rad;           // [dims]
  Eigen::VectorXf neutral;             // [dims]; empty: a model without gate data
  std::optional<TrainedMotion> known;  // the same
  Eigen::VectorXf axis;                // [dims]; empty: a model without a style axis
  double axis_offset = 0.0;
  std::vector<Eigen::VectorXf> more_limits_rad;  // of the others
  std::vector<BodyPart> parts;                   // [dims]
  std::vector<std::uint8_t> served;              // [dims], 0 where the skeleton lacks the joint
  // With roots the predictor has RootFunction::kDims outputs after those of the pose.
  bool has_root = false;
  double leg_m = 0.0;                        // of the skeleton
  std::vector<Eigen::Vector3f> root_limits;  // of each style
  std::vector<std::uint16_t> leg_dims;       // those of the hips and the legs
  std::vector<LoosePart> loose_parts;        // [dims]

  // A neutral walk of training: its cycle, and what it does at the legs' instant.
  struct Usual {
    PoseCycle cycle;
    LegMap does;
  };
  std::vector<Usual> usual;        // by person and day; empty: a model without them
  std::optional<Usual> anyone;     // their mean, for a walker who is not known
  std::vector<AlphaReach> reach;   // of each style
  std::optional<BoneTurns> turns;  // for a figure that is none of training
};

// Returns an error for a skeleton that cannot serve the model's pose space
// (PoseSpace::bind_person), which names what is missing, and for a model whose parts do not fit
// each other.
Result<std::unique_ptr<const BoundModel>> bind_model(const StyleModel& model,
                                                     const Skeleton& skeleton, std::string name);

}  // namespace posed::style
