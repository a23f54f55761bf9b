// Bases for the `Type` of DriverOf for devices with several bodies (drivers/driver_of.hpp).
// SourceType has what they all share, RateSource what those over UDP share that say nothing about
// themselves: their device info, "vmc rate=60", repeats the options. NetworkRateSource is the same
// for those over UDP or TCP. Cold.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/driver_of.hpp"
#include "drivers/transport/network_options.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {

inline constexpr double kMinRate_hz = 0.001;
inline constexpr double kMaxRate_hz = 1000.0;

// The option rate_hz with its range.
[[nodiscard]] OptionSpec rate_option(double default_hz, std::string_view help);

// Writes and reads a device info that ends in a rate, such as "vmc rate=60". `prefix` is the text
// before the number; a rate out of range is none.
[[nodiscard]] std::string rate_text(std::string_view prefix, double rate_hz);
[[nodiscard]] std::optional<double> parse_rate(std::string_view text, std::string_view prefix);
// Says that a device info is not of `what`, for example "Xsens MVN", and shows how one looks.
[[nodiscard]] std::unexpected<Error> another_device(std::string_view what,
                                                    const std::string& example,
                                                    const std::string& identity);

// `Self` adds connect(options, ports) -> Result<std::unique_ptr<Transport>>, and kPoll_ns or poll()
// if the device is asked.
template <typename Self>
struct SourceType {
  // Such a device has no skeleton and no samples of its own: its bodies have.
  static Result<Description> describe(const auto& settings) {
    return Description{.driver = {},
                       .text = {},
                       .identity = {},
                       .skeleton = nullptr,
                       .samples = {},
                       .rate_hz = static_cast<double>(settings.rate_hz)};
  }
  static Poll poll() { return {}; }
  // A network socket opens whether or not the device is there.
  static Result<Opened> open(const Options& options, auto& settings, TransportFactory& ports) {
    auto identity = TRY(Self::check(options, settings));
    auto transport = TRY(Self::connect(options, ports));
    // With port 0 the kernel chooses one, which the senders must know.
    const auto* udp = dynamic_cast<const UdpTransport*>(transport.get());
    const bool listens =
        udp != nullptr && identity == "udp " + option<std::string>(options, "listen");
    if (listens && identity.ends_with(":0")) identity = "udp " + udp->endpoint(0);
    return Opened{
        .identity = std::move(identity), .transport = std::move(transport), .poll = Self::poll()};
  }
};

struct RateSettings {
  double rate_hz = 0.0;
};

// `Self` has kListen, kRate_hz (their defaults), kRateHelp, kWhat ("a mocopi"), make_layout and
// emulator, and a DecoderType; more_options() if it has further ones.
template <typename Self>
struct RateSource : SourceType<Self> {
  using Settings = RateSettings;

  static std::vector<OptionSpec> more_options() { return {}; }
  static std::vector<OptionSpec> option_specs() {
    auto specs = udp_options(Self::kListen);
    specs.push_back(rate_option(Self::kRate_hz, Self::kRateHelp));
    for (OptionSpec& spec : Self::more_options()) specs.push_back(std::move(spec));
    return specs;
  }
  static Result<Settings> settings(const Options& options) {
    return Settings{.rate_hz = option<double>(options, "rate_hz")};
  }
  static Result<std::string> check(const Options& options, const Settings& /*settings*/) {
    TRY(check_udp(udp_settings(options)));
    return "udp " + option<std::string>(options, "listen");
  }
  static std::string prefix() { return std::string(Self::kName) + " rate="; }
  static std::string device_info(const Settings& settings) {
    return rate_text(prefix(), settings.rate_hz);
  }
  static Result<Settings> parse_device_info(const std::string& text, const std::string& identity) {
    if (const auto rate_hz = parse_rate(text, prefix())) return Settings{.rate_hz = *rate_hz};
    return another_device(Self::kWhat, rate_text(prefix(), Self::kRate_hz), identity);
  }
  static Result<std::unique_ptr<Decoder>> decoder(const Settings& /*settings*/,
                                                  const Description& /*description*/) {
    return std::make_unique<typename Self::DecoderType>();
  }
  static Result<std::unique_ptr<Transport>> connect(const Options& options,
                                                    TransportFactory& ports) {
    return ports.udp(udp_settings(options));
  }
};

// `Self` has kWhat, kExample (a device info), link_prefix(stream) (what is before its rate),
// option_specs, settings, make_layout and emulator, Settings with `stream` (over TCP) and
// `rate_hz`, and a DecoderType that is made with `stream`.
template <typename Self>
struct NetworkRateSource : SourceType<Self> {
  static constexpr auto connect = open_network;

  static Result<std::string> check(const Options& options, const auto& /*settings*/) {
    TRY(check_network(options));
    return network_identity(options);
  }
  static std::string device_info(const auto& settings) {
    return rate_text(Self::link_prefix(settings.stream), settings.rate_hz);
  }
  static auto parse_device_info(const std::string& text, const std::string& identity) {
    using Parsed = Result<typename Self::Settings>;
    for (const bool stream : {false, true}) {
      const auto rate_hz = parse_rate(text, Self::link_prefix(stream));
      if (rate_hz) return Parsed({.stream = stream, .rate_hz = *rate_hz});
    }
    return Parsed(another_device(Self::kWhat, std::string(Self::kExample), identity));
  }
  static Result<std::unique_ptr<Decoder>> decoder(const auto& settings,
                                                  const Description& /*description*/) {
    return std::make_unique<typename Self::DecoderType>(settings.stream);
  }
};

}  // namespace posed::drivers
