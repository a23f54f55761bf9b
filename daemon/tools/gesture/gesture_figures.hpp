// The figures of a gesture model in a report: what it performs, how it got there, and how it
// compares with recordings; shared by `train gesture` and `eval gesture`. Cold.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/tools/gesture/lag_curve.hpp"
#include "daemon/tools/picture/figure.hpp"
#include "daemon/tools/report/gesture_sections.hpp"
#include "daemon/tools/report/page.hpp"
#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"
#include "models/perform/body_performance.hpp"
#include "models/perform/perform.hpp"
#include "proto/clip/clip.hpp"

namespace posed::tools {

class GestureFigures {
 public:
  // `labels`: what is performed, indices into the model's; at least one. `body`: who performs a
  // model of bodies; empty for one of hands.
  GestureFigures(std::shared_ptr<const gesture::GestureModel> model, std::vector<int> labels,
                 std::optional<perform::BodyFigure> body);

  // The performance as a strip, two poses a label.
  [[nodiscard]] report::Figure strip() const;
  // The performance's angles with their band.
  [[nodiscard]] report::Figure trajectories() const;
  // The same labels as the beginning of a recording, over what was recorded; empty for a recording
  // without labels of the model.
  [[nodiscard]] std::optional<report::Figure> over(const gesture::Recording& recording) const;
  // Each label of the model that was not recorded, in its hold, beside the nearest of these poses
  // [frame][channel], rad; empty where all were recorded.
  [[nodiscard]] std::optional<report::Figure> unseen(const gesture::FeatureMatrix& poses,
                                                     const std::string& from) const;
  [[nodiscard]] report::Figure durations() const;
  // One tree to begin with, then all of them, folded away.
  [[nodiscard]] std::vector<report::Figure> trees() const;
  [[nodiscard]] report::Figure lag(std::span<const LagPoint> curve) const;
  // The curve of the labels, where nobody has computed it yet.
  [[nodiscard]] std::vector<LagPoint> curve() const { return lag_curve(information_, labels_); }

  [[nodiscard]] std::string label_text() const;  // "g 1 c"

 private:
  [[nodiscard]] perform::Performance perform(std::span<const int> labels) const;
  [[nodiscard]] picture::Figure pose(const perform::Pose& angles_rad) const;
  [[nodiscard]] report::Figure strip_of(const std::string& title, const std::string& sentence,
                                        const std::vector<picture::StripRow>& rows) const;
  [[nodiscard]] report::Figure trajectories_of(const std::string& title,
                                               const std::string& sentence,
                                               const std::vector<report::AngleTrajectory>& angles,
                                               const std::vector<report::LabelSpan>& spans) const;
  [[nodiscard]] const std::string& name(int label) const;

  std::shared_ptr<const gesture::GestureModel> model_;
  std::vector<int> labels_;
  trajectory::StateInformation information_;
  std::optional<perform::BodyFigure> body_;
  std::shared_ptr<const Skeleton> skeleton_;
  picture::FigureShape shape_;
};

// Which label the live stage recognises where another was given; empty for a model that it cannot
// use, with more labels than it follows.
[[nodiscard]] std::optional<report::Figure> confusion_of(
    const gesture::GestureModel& model, const clip::Clip& body,
    const std::vector<gesture::Recording>& recordings, const std::string& measured_on);

// The paper's string where the model has its labels, else every label once.
[[nodiscard]] std::vector<int> labels_to_show(const gesture::GestureModel& model);

}  // namespace posed::tools
