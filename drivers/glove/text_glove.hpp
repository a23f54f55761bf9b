// TextGlove: a whole driver for a glove that writes one line of text a measurement over a serial
// port. drivers/template is one. `Self` says only what is particular to it:
//
//   kName, kSummary, kUsb (the ids of its serial chip), kBaud
//   kSensors, kExtras                      std::array of names; a value is 0 (open) to kRawMax
//   kRate_hz                               lines a second of the emulator
//   parse(text, reading) -> Outcome        reads a line without its line end. noexcept, RT-safe
//   write(reading) -> std::string          the line that the glove would send, with its line end
//
// The joints that the sensors move are in config/devices/<kName>.toml. The decoder is RT-safe,
// everything else cold.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "drivers/emulate/pace.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/glove/glove_type.hpp"
#include "drivers/glove/line_reader.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::glove {

inline constexpr std::size_t kMaxTextLine = 256;  // bytes; a longer line is not from a glove

// The measurement of one line.
template <typename Self>
struct TextReading {
  std::array<float, Self::kSensors.size()> raw{};  // [sensor]
  std::bitset<kMaxSensors> valid;                  // sensors that the line has
  std::array<float, Self::kExtras.size()> extra{};
};

struct TextSettings {
  Side hand = Side::kRight;
};

template <typename Self>
class TextDecoder final : public GloveDecoder {
 public:
  TextDecoder(std::shared_ptr<const Skeleton> skeleton,
              std::shared_ptr<const Calibration> default_calibration)
      : GloveDecoder(std::move(skeleton), std::move(default_calibration)) {}

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                    Sink& sink) noexcept override {
    lines_.feed(
        bytes,
        [&](std::string_view text) {
          typename Self::Reading reading;
          const Outcome outcome = Self::parse(text, reading);
          sink.outcome(outcome);
          if (outcome != Outcome::kOk) return;
          emit({.raw = reading.raw, .valid = reading.valid, .extra = reading.extra}, sink);
        },
        [&] { sink.outcome(Outcome::kForeign); });
  }

 private:
  LineReader<kMaxTextLine> lines_;
};

// Streams from power-on and ignores what it receives.
template <typename Self>
class TextEmulator final : public GloveEmulator {
 public:
  explicit TextEmulator(std::shared_ptr<const Calibration> calibration)
      : calibration_(std::move(calibration)), pace_(nanoseconds(1.0 / Self::kRate_hz)) {
    reading_.valid.set();
    pace_.start(0);
    pose_hand({});
  }
  void pose_hand(const HandAngles& angles) override {
    for (std::size_t s = 0; s < reading_.raw.size(); ++s) {
      const double raw = raw_of_pose(*calibration_, s, angles).value_or(0.0);
      reading_.raw[s] = static_cast<float>(std::round(std::clamp(raw, 0.0, Self::kRawMax)));
    }
  }
  [[nodiscard]] std::int64_t next_due_ns() const override { return pace_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override {
    pace_.step(now_ns);
    add_text(Self::write(reading_), out);
  }

 private:
  std::shared_ptr<const Calibration> calibration_;
  emulate::Pace pace_;
  typename Self::Reading reading_;
};

template <typename Self>
struct TextGlove : GloveType<Self> {
  using Settings = TextSettings;

  static std::vector<OptionSpec> option_specs() { return serial_options(Self::kBaud); }
  static Result<Settings> settings(const Options& options) {
    const auto hand = TRY(hand_option(options));
    return Settings{.hand = hand};
  }
  static std::string device_info(const Settings& settings) {
    return hand_info(Self::kName, settings.hand);
  }
  static Result<Settings> parse_device_info(const std::string& text, const std::string& identity) {
    DeviceInfoReader reader(text, Self::kName, identity);
    const Settings settings{.hand = reader.side()};
    TRY(reader.finish());
    return settings;
  }
  static std::vector<std::string> extra_names() {
    return {Self::kExtras.begin(), Self::kExtras.end()};
  }
  static Result<Model> model(const Settings& /*settings*/) {
    Model model{.driver = std::string(Self::kName), .sensors = {}};
    for (const std::string_view name : Self::kSensors) {
      model.sensors.push_back({.name = std::string(name),
                               .raw_max = Self::kRawMax,
                               .curve = Curve::line(0.0, 0.0, Self::kRawMax, 1.0),
                               .unit = "1"});
    }
    return with_device_table(std::move(model), Self::kName);
  }
  static std::unique_ptr<Decoder> make_decoder(const Settings& /*settings*/,
                                               std::shared_ptr<const Skeleton> skeleton,
                                               std::shared_ptr<const Calibration> calibration) {
    return std::make_unique<TextDecoder<Self>>(std::move(skeleton), std::move(calibration));
  }
  static Result<Opened> open(const Options& options, const Settings& /*settings*/,
                             TransportFactory& ports) {
    auto link = TRY(connect(options, ports, Self::kUsb));
    const auto is_line = [](std::string_view text) {
      typename Self::Reading reading;
      return Self::parse(text, reading) == Outcome::kOk;
    };
    TRY(await_line(link, is_line));
    return opened(std::move(link), kLineSilence_s);
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    const auto model = TRY(Self::model(settings));
    auto calibration = TRY(default_calibration(model));
    return std::make_unique<TextEmulator<Self>>(std::move(calibration));
  }
};

}  // namespace posed::drivers::glove
