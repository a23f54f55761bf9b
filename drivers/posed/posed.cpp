#include "drivers/posed/posed.hpp"

#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/posed/decoder.hpp"
#include "drivers/posed/emulator.hpp"
#include "drivers/posed/layout.hpp"
#include "drivers/posed/protocol.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace chain {
namespace {

constexpr double kDefaultRate_hz = 60.0;

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto info = parse_device_info(text, identity);
  if (!info) return std::unexpected(info.error());
  return source_description("posed", text, identity, info->rate_hz);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto info = parse_device_info(description.text, description.identity);
  if (!info) return std::unexpected(info.error());
  return std::make_unique<UpstreamDecoder>(info->stream);
}

Result<UpstreamInfo> info_of(const Options& options) {
  UpstreamInfo info{.stream = option<std::string>(options, "stream"),
                    .rate_hz = option<double>(options, "rate_hz")};
  if (!is_upstream_stream(info.stream)) {
    return misuse(
        "stream should be the name of a stream of the other daemon: a-z, digits, '-'"
        " and '_'");
  }
  if (parse_device_info(device_info_text(info), "")) return info;
  return misuse("rate_hz should be more than 0 and at most 1000");
}

SubscriptionSettings settings_of(const Options& options) {
  const auto stream = option<std::string>(options, "stream");
  return {.endpoint = option<std::string>(options, "connect"),
          .key = option<std::string>(options, "key"),
          .server_key = option<std::string>(options, "server_key"),
          .topics = {"pose/" + stream, "skeleton/" + stream}};
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(posed_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto info = info_of(*options);
  if (!info) return std::unexpected(info.error());
  const SubscriptionSettings settings = settings_of(*options);
  if (const auto ok = check_subscription(settings); !ok) return std::unexpected(ok.error());
  return describe(device_info_text(*info), settings.endpoint);
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto expected = expect(given);
  if (!expected) return std::unexpected(expected.error());
  const auto options = complete_options(posed_driver(), given);
  auto transport = ports.subscribe(settings_of(*options));
  if (!transport) return std::unexpected(transport.error());
  return make_device(posed_driver(), *expected, std::move(*transport));
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(posed_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto info = info_of(*options);
  if (!info) return std::unexpected(info.error());
  return std::make_unique<UpstreamEmulator>(*info);
}

std::vector<OptionSpec> options() {
  return {
      {.name = "connect",
       .default_value = std::string("tcp://127.0.0.1:5570"),
       .help = "the other daemon's publish endpoint, or a relay's"},
      {.name = "stream", .default_value = std::string("walker"), .help = "which of its streams"},
      {.name = "key",
       .default_value = std::string(),
       .is_path = true,
       .help = "own secret key (NAME.key), if the other daemon uses keys"},
      {.name = "server_key",
       .default_value = std::string(),
       .is_path = true,
       .help = "the other daemon's public key (NAME.pub)"},
      {.name = "rate_hz",
       .default_value = kDefaultRate_hz,
       .help = "expected frames a second, until the stream says its rate"}};
}

}  // namespace
}  // namespace chain

const Driver& posed_driver() {
  static const Driver driver{.name = "posed",
                             .summary = "a stream of another posed, so that machines chain",
                             .options = chain::options(),
                             .open = chain::open,
                             .make_decoder = chain::make_decoder,
                             .describe = chain::describe,
                             .expect = chain::expect,
                             .make_layout = chain::make_layout,
                             .emulate = chain::emulate};
  return driver;
}

}  // namespace posed::drivers
