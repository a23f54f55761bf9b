// GloveType: the base for the `Type` of DriverOf for gloves (drivers/driver_of.hpp). `Self` adds
//
//   kName, kSummary, option_specs(), settings(), device_info(), parse_device_info(), open(),
//   emulator() Settings, with a member `hand` model(settings) -> Result<Model>             the
//   sensors, before calibration make_decoder(settings, skeleton, calibration) ->
//   std::unique_ptr<Decoder>
//
// and, if it has them, extra_names(), layout(), rate_hz(), kUsb, kUndetected and encode_haptics().
// Cold.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/driver_of.hpp"
#include "drivers/glove/angle_map.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/connect.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/glove/glove_decoder.hpp"
#include "drivers/glove/traits.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers::glove {

template <typename Self>
struct GloveType {
  static constexpr std::span<const KnownUsb> kUsb{};
  static constexpr double kUndetected = 0.0;

  static Result<std::string> check(const Options& options, const auto& /*settings*/) {
    TRY(check_connection(options));
    return option<std::string>(options, "id");
  }

  static std::vector<std::string> extra_names() { return {}; }
  static SampleLayout layout(const Model& model, const auto& /*settings*/) {
    return sample_layout(model, Self::extra_names());
  }
  static double rate_hz(const auto& /*settings*/) { return 0.0; }

  static Result<Description> describe(const auto& settings) {
    const auto model = TRY(Self::model(settings));
    return Description{.driver = {},
                       .text = {},
                       .identity = {},
                       .skeleton = std::make_shared<const Skeleton>(hand_skeleton(settings.hand)),
                       .samples = Self::layout(model, settings),
                       .rate_hz = Self::rate_hz(settings)};
  }

  static Result<std::unique_ptr<Decoder>> decoder(auto settings, const Description& description) {
    const auto model = TRY(Self::model(settings));
    auto calibration = TRY(default_calibration(model));
    return Self::make_decoder(std::move(settings), description.skeleton, std::move(calibration));
  }

  static const GloveTraits& traits() {
    static const GloveTraits traits = [] {
      GloveTraits made{
          .glove_model = glove_model, .usb = Self::kUsb, .undetected = Self::kUndetected};
      if constexpr (requires { &Self::encode_haptics; }) made.encode_haptics = haptics;
      return made;
    }();
    return traits;
  }

 private:
  static Result<Model> glove_model(const Description& description) {
    const auto settings = TRY(Self::parse_device_info(description.text, description.identity));
    return Self::model(settings);
  }
  static Result<std::vector<std::byte>> haptics(const Options& given, const Haptics& haptics) {
    const auto chosen = TRY(DriverOf<Self>::choose(given));
    return Self::encode_haptics(chosen.options, chosen.settings, haptics);
  }
};

}  // namespace posed::drivers::glove
