// One stream of the running virtual daemon, with everything that its parts borrow.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include <catch2/catch.hpp>

#include "daemon/devices/calibration.hpp"
#include "tests/support/scripted_device.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {

struct VirtualStreamContext {
  explicit VirtualStreamContext(VirtualStream script)
      : stream(std::move(script)),
        device(stream.description, std::move(stream.links), stream.repeat_s) {
    stream.settings.rate_hz = stream.description.rate_hz;
    for (std::size_t i = 0; i < stream.model_files.size(); ++i) {
      if (!stream.model_files[i].empty()) static_cast<void>(bind(i, stream.model_files[i]));
    }
  }

  // The file, bound to stage number `stage`; once, however often it is used.
  const StageModel* bind(std::size_t stage, const std::string& bytes) {
    std::unique_ptr<const StageModel>& model = models[{stage, bytes}];
    if (model) return model.get();
    const StageType& type = *stream.settings.stages[stage].type;
    const auto context =
        pipeline::stage_context(stream.settings, stage, stream.description.skeleton);
    REQUIRE(context);
    auto bound = type.bind_model(bytes_of(bytes), *context, "virtual");
    REQUIRE(bound);
    model = std::move(*bound);
    return model.get();
  }
  [[nodiscard]] const StageModel* any_model() const { return models.begin()->second.get(); }
  const drivers::glove::OwnedCalibration* compile(const std::string& toml) {
    std::unique_ptr<const drivers::glove::OwnedCalibration>& calibration = calibrations[toml];
    if (calibration) return calibration.get();
    auto compiled = devices::compile_calibration(stream.description, toml, "virtual.toml");
    REQUIRE(compiled);
    calibration = std::move(*compiled);
    return calibration.get();
  }

  VirtualStream stream;
  ScriptedDevice device;
  std::map<std::pair<std::size_t, std::string>, std::unique_ptr<const StageModel>> models;
  std::map<std::string, std::unique_ptr<const drivers::glove::OwnedCalibration>> calibrations;
};

}  // namespace posed::test
