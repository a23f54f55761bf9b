// DriverOf: makes a registry entry from the parts that differ between devices. The functions of an
// entry begin alike: they complete and read the options, or read the device info that a log has
// kept. A `Type` is a struct of static members; glove/glove_type.hpp and source_type.hpp have bases
// that provide most of them.
//
//   kName, kSummary                              registry name, and a line for users
//   Settings                                     what the options and the device info say
//   option_specs()                               the table of the driver's options
//   settings(Options&) -> Result<Settings>       reads completed options and may add to them
//   check(options, settings)                     checks the connection without opening anything;
//     -> Result<std::string>                     gives the identity of the expected device
//   device_info(settings), parse_device_info(text, identity) -> Result<Settings>
//   describe(settings) -> Result<Description>    without driver, text and identity
//   decoder(settings, description) -> Result<std::unique_ptr<Decoder>>
//   open(options, settings, ports) -> Result<Opened>   stores what the device says in `settings`
//   emulator(options, settings) -> Result<std::unique_ptr<Emulator>>
//   make_layout(bytes)                           only for a device with several bodies
//   traits()                                     only for a glove
//   kOftenEmpty                                  only where what comes may long hold no pose
//
// Everything here is cold.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/options.hpp"

namespace posed::drivers {

// An open connection to a device that has been started.
struct Opened {
  std::string identity;
  std::unique_ptr<Transport> transport;
  std::vector<std::string> warnings{};
  Poll poll{};
  double reopen_after_s = 0.0;
};

template <typename Type>
class DriverOf {
 public:
  [[nodiscard]] static const Driver& get() {
    static const Driver driver = make();
    return driver;
  }

  // The driver's completed options with what they say.
  struct Chosen {
    Options options;
    typename Type::Settings settings;
  };
  static Result<Chosen> choose(const Options& given) {
    auto options = TRY(complete_options(get(), given));
    auto settings = TRY(Type::settings(options));
    return Chosen{std::move(options), std::move(settings)};
  }

 private:
  static Result<Description> describe(const std::string& text, const std::string& identity) {
    const auto settings = TRY(Type::parse_device_info(text, identity));
    auto description = TRY(Type::describe(settings));
    description.driver = Type::kName;
    description.text = text;
    description.identity = identity;
    return description;
  }

  static Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
    auto settings = TRY(Type::parse_device_info(description.text, description.identity));
    return Type::decoder(std::move(settings), description);
  }

  static Result<Description> expect(const Options& given) {
    const auto chosen = TRY(choose(given));
    const auto identity = TRY(Type::check(chosen.options, chosen.settings));
    return describe(Type::device_info(chosen.settings), identity);
  }

  static Result<Device> open(const Options& given, TransportFactory& ports) {
    auto chosen = TRY(choose(given));
    auto opened = TRY(Type::open(chosen.options, chosen.settings, ports));
    auto device = TRY(make_device(get(), Type::device_info(chosen.settings), opened.identity));
    device.transport = std::move(opened.transport);
    device.warnings = std::move(opened.warnings);
    device.poll = std::move(opened.poll);
    device.reopen_after_s = opened.reopen_after_s;
    return device;
  }

  static Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
    auto chosen = TRY(choose(given));
    return Type::emulator(chosen.options, std::move(chosen.settings));
  }

  static Driver make() {
    Driver driver{.name = Type::kName,
                  .summary = Type::kSummary,
                  .options = Type::option_specs(),
                  .open = open,
                  .make_decoder = make_decoder,
                  .describe = describe,
                  .expect = expect,
                  .emulate = emulate};
    if constexpr (requires { Type::traits(); }) driver.glove = &Type::traits();
    if constexpr (requires { Type::kOftenEmpty; }) driver.often_empty = Type::kOftenEmpty;
    if constexpr (requires { &Type::make_layout; }) driver.make_layout = Type::make_layout;
    return driver;
  }
};

}  // namespace posed::drivers
