#include "daemon/devices/pose_calibration.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "daemon/devices/possible_angles.hpp"
#include "daemon/devices/thumb_contacts.hpp"
#include "drivers/glove/crosstalk.hpp"

namespace posed::devices {

drivers::glove::CalibrationFile blank_calibration(const drivers::glove::Model& model,
                                                  const std::string& identity, Side hand,
                                                  std::string user) {
  return {.driver = model.driver,
          .glove = identity.starts_with('/') ? std::string() : identity,
          .user = std::move(user),
          .hand = hand,
          .parameters = {},
          .sensors = {}};
}

Result<PoseCalibration> calibrate_by_poses(const drivers::glove::Model& model,
                                           const drivers::glove::Recorded& recorded,
                                           drivers::glove::CalibrationFile blank) {
  auto fitted = TRY(drivers::glove::fit_poses(model, recorded));
  blank.sensors = std::move(fitted.sensors);
  const auto said = TRY(drivers::glove::fit_fist(model, recorded, blank.hand, blank));
  auto made = TRY(calibrate_by_contacts(model, recorded, std::move(blank)));
  made.said.insert(made.said.begin(), said.begin(), said.end());
  made.warnings.insert(made.warnings.begin(), fitted.warnings.begin(), fitted.warnings.end());
  return made;
}

Result<PoseCalibration> calibrate_by_contacts(const drivers::glove::Model& model,
                                              const drivers::glove::Recorded& recorded,
                                              drivers::glove::CalibrationFile file) {
  PoseCalibration made{.file = std::move(file), .said = {}, .warnings = {}};
  const Side hand = made.file.hand;
  made.said = TRY(fit_contacts(model, recorded, hand, made.file));
  auto odd = TRY(keep_possible(model, recorded, hand, made.file));
  std::ranges::move(odd, std::back_inserter(made.warnings));
  return made;
}

}  // namespace posed::devices
