// The part of `posed calibrate` that records pose after pose, with its screen as lines of text and
// the hand that results. Cold.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "daemon/tools/devices/glove_source.hpp"
#include "drivers/glove/calibration.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"

namespace posed::tools {

// The screen of `posed calibrate` as lines of text: which pose to take, what to do now, and a bar
// for each sensor. Pure, so that it can be tested without a terminal.
struct SensorView {
  std::string name;
  double least = 0.0, most = 255.0;  // the range that the device can send
  double least_span = 10.0;          // a smaller range is only noise
  bool there = false;                // has been measured
  double value = 0.0;                // the current value
  double low = 0.0, high = 0.0;      // the range seen since the first pose was held

  // Has not moved, or not enough to be fitted.
  [[nodiscard]] bool still() const { return high - low < least_span; }
};

enum class PosePhase { kAsked, kSettling, kHeld };

struct CalibrateView {
  std::string title;
  std::vector<drivers::glove::Pose> poses;  // in their order
  std::size_t pose = 0;                     // index of the current one
  PosePhase phase = PosePhase::kAsked;
  double left_s = 0.0;    // remaining time of a phase that ends by itself; 0: the user ends it
  double share = 0.0;     // elapsed share of such a phase
  bool may_skip = false;  // contacts and repeats are left
  bool silent = false;    // nothing came for a while
  // a pose was recorded; from then on it is known which sensors have not moved
  bool any_held = false;
  std::string note{};  // about the previous pose; may be empty
  std::vector<SensorView> sensors{};
  int width = 80, height = 24;  // of the terminal; at least 40 columns are used
  bool colour = false;
};

// At most `height` lines of at most `width` columns. Sensors are shown in as many columns as
// necessary; those that were never measured are left out.
[[nodiscard]] std::vector<std::string> calibrate_view(const CalibrateView& view);

// "#" up to the value, "-" elsewhere in the range seen so far, blanks outside it: `width`
// characters.
[[nodiscard]] std::string sensor_bar(const SensorView& sensor, int width);

// The part of `posed calibrate` that records pose after pose. A PoseGuide leads the user through
// it: a screen (pose_screen.hpp), lines of text for scripts, or a test.
struct PosePlan {
  // How long each pose is recorded [s]; 0: skip it. The flat hand is never skipped.
  std::array<double, drivers::glove::kPoses> seconds{2.0, 2.0, 2.0, 2.0, 1.0, 1.0,
                                                     1.0, 1.0, 1.0, 1.0, 1.0};
  // How long the user has to take a pose that starts by itself [s]; empty: the guide starts it.
  std::optional<double> ready_s{};
  double settle_s = 0.5;  // not recorded, so that the hand and the glove's filter come to rest

  [[nodiscard]] std::vector<drivers::glove::Pose> poses() const;
  // Leaves out contacts and repeats: a verdict is doubtful then.
  void shorten();
};

class PoseGuide {
 public:
  PoseGuide() = default;
  PoseGuide(const PoseGuide&) = delete;
  PoseGuide& operator=(const PoseGuide&) = delete;
  virtual ~PoseGuide() = default;

  virtual void want(drivers::glove::Pose pose) = 0;

  // The user's reply while a pose is asked for. The call must not wait; it is made at least ten
  // times a second.
  enum class Word { kNothing, kGo, kBack, kStop, kEnough };  // kEnough: leave out the rest
  [[nodiscard]] virtual Word receive() = 0;

  // One measurement. `left_s` of `whole_s` remain: of the time to get ready, or of the time to hold
  // still, settling included. Both are 0 if the user ends the phase.
  virtual void show(const GloveSource::Raw& raw, const GloveSource::Valid& valid, PosePhase phase,
                    double left_s, double whole_s) = 0;

  // The hand moved while the pose was held; `sensor` shows it.
  virtual void restless(drivers::glove::Pose pose, const std::string& sensor) = 0;
};

// An error if the user gives up, the glove is unplugged, or it sends nothing.
Result<drivers::glove::Recorded> record_poses(GloveSource& source, const PosePlan& plan,
                                              PoseGuide& guide);

// The recorded poses, but for repeats, beside each other with their names below, at one scale:
// strips of `rows` lines of UTF-8 of at most `columns` characters. A joint that no sensor measures
// is straight.
[[nodiscard]] std::vector<std::string> calibrated_hand(
    const drivers::glove::Model& model, const drivers::glove::Calibration& calibration, Side hand,
    const drivers::glove::Recorded& recorded, int columns, int rows);

}  // namespace posed::tools
